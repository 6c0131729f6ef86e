"""The machine as built by measurements: the question, and the descriptions of its answer and of the record of a fit.

Sentences and tables show the record of a fit, so that an answer and a file that is read again look alike. Nothing is
computed here.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from kinetostat.display import DASH, Display, Scale, number, number_and_uncertainty
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studies.identification.fit import Tell
from kinetostat.studies.identification.fitted_values import (
    NOMINAL_ANGLES,
    FirmwareNumbers,
    firmware_numbers,
    klipper_text,
    marlin_text,
    reprap_text,
    with_home,
)
from kinetostat.studies.identification.identification import USUALLY_FITTED, Identification, identify
from kinetostat.studies.identification.next_poses import NextPoses, as_csv, unit_of
from kinetostat.studies.identification.record import FitRecord, record_of
from kinetostat.units import KINDS
from kinetostat.views.data_forms import json_of
from kinetostat.views.question import Description, Field, Lines, Option, Question
from kinetostat.views.tables import FittedTable, numeric_table, text_table

RATIO, SHARE = Scale(1e6, "ppm"), Scale(1e2, "%")
"""Units in which gains and errors of compliances are read."""
MOST_LISTED_OUTLIERS = MOST_LISTED_POSES = 40
"""Greatest number of rows of the table of outliers, and of that of poses to measure next: those of a screen."""
NOT_EXPLAINED = 1.5
"""Residuals over their standard deviations beyond which something that is not fitted must move the tool: by chance they
are half more than expected in a few small fits only."""
NOT_SEEN = "not seen"
"""Word in the place of an interval that has no end."""
MEASURED_KINDS = {"length": ("positions and distances", "m"), "angle": ("angles", "rad")}
"""Kinds of measured values, each with its words and its SI unit."""


def _record(answer: Identification) -> FitRecord:
    return record_of(answer.observed.data.path, json_of(IDENTIFICATION, answer), {})


def _fit_lines(record: FitRecord) -> Lines:
    unseen_count = len(record.unknowns) - record.rank
    text = f"{len(record.unknowns)} unknowns from {record.values} values at {record.poses} poses; "
    text += f"{record.rank} combinations are seen"
    if unseen_count:
        text += f", {unseen_count} are not"
    if record.outliers:
        text += f"; {len(record.outliers)} values are set aside as outliers"
    text += "."
    if record.known and record.scatter > NOT_EXPLAINED:
        text += (
            f" The residuals are {number(record.scatter, digits=2)} times as large as the standard deviations say: the "
            "measurements are less sure, or something that moves the tool is not fitted (gains, compliances)."
        )
    yield "As measured", text
    if not record.known:
        yield "Intervals", "No standard deviations were given: intervals follow from the residuals themselves."
    if record.unseen:
        yield (
            "Not seen",
            "Combinations that no pose sees are left as near to zero as they can be. They move the tool in the base "
            "frame; what lies inside the machine is what another place of the base and of the target cannot undo.",
        )


def _lines(answer: Identification) -> Lines:
    yield from _fit_lines(_record(answer))
    if answer.next is not None:
        gain, gain_at_random = (number(factor, digits=3) for factor in (answer.next.gain, answer.next.gain_at_random))
        yield (
            "Next poses",
            f"They make the intervals shorter by a factor of {gain} on average; as many poses at random by "
            f"{gain_at_random}. {answer.next.area} Candidates: {_ranges(answer.next, answer.machine)}.",
        )


def _proposal(proposed: NextPoses) -> dict[str, Any]:
    """Return proposed poses as plain data."""
    return {
        "poses": proposed.poses,
        "sharper": proposed.gain,
        "random": proposed.gain_at_random,
        "ranges": proposed.ranges,
        "within": proposed.area,
    }


def _ranges(proposed: NextPoses, machine: Machine) -> str:
    """Return the range of each coordinate among the candidates."""
    parts = []
    for path, ends in proposed.ranges.items():
        scale = machine.display.scale(unit_of(machine, path))
        low, high = (number(end * scale.factor, digits=3) for end in ends)
        parts.append(f"{path.removeprefix('pose.')} {low} to {high} {scale.unit}")
    return ", ".join(parts)


def _fit_tables(record: FitRecord, display: Display) -> Iterator[FittedTable]:
    yield _residual_table(record, display)
    yield _number_table(record, display)
    if record.unseen:
        table = text_table("What no pose sees", "combination", "moves the tool by", "of that, inside the machine")
        for words, *motions in record.unseen:
            table.add_row(words, *(display.show_deflection(motion, "m") for motion in motions))
        yield table
    if record.outliers:
        yield _outlier_table(record)


def _tables(answer: Identification, _full: bool) -> Iterator[FittedTable]:
    yield from _fit_tables(_record(answer), answer.machine.display)
    numbers = firmware_numbers(answer)
    if numbers is not None:
        yield _firmware_table(numbers)
    if answer.next is not None:
        yield _pose_table(answer.next, answer.machine)


def _residual_table(record: FitRecord, display: Display) -> FittedTable:
    table = numeric_table("Residuals, root mean square", "", ["as drawn", "as identified", "of poses left out"])
    for kind, (name, unit) in MEASURED_KINDS.items():
        sizes = [residuals.get(kind) for residuals in record.residuals]
        if any(size is not None for size in sizes):
            table.add_row(name, *(DASH if size is None else display.show_deflection(size, unit) for size in sizes))
    return table


def _number_table(record: FitRecord, display: Display) -> FittedTable:
    title, heads = "Identified numbers (± half of the 95 % interval)", ("error", "value", "±", "unit", "meaning")
    table = text_table(title, *heads, numeric=("value", "±"))
    for unknown in record.unknowns:
        scale = _scale_of(display, unknown.unit, unknown.group)
        table.add_row(unknown.path, *_value_and_half(unknown.value, unknown.half, scale), scale.unit, unknown.words)
    return table


def _value_and_half(value: float, half: float, scale: Scale) -> tuple[str, str]:
    """Return an identified number and half of its 95 % interval in a unit, to the digits that are known."""
    if not np.isfinite(half):
        return number(value * scale.factor), NOT_SEEN
    return number_and_uncertainty(value * scale.factor, half * scale.factor)


def _scale_of(display: Display, unit: str, group: str) -> Scale:
    """Return the unit in which an error is read: that of small motions, ppm for gains, percent for compliances."""
    if unit in ("m", "rad"):
        return display.deflection(unit)
    return SHARE if group == "compliances" else RATIO


def _outlier_table(record: FitRecord) -> FittedTable:
    table = numeric_table("Outliers, set aside", "line", ["value", "standard deviations"])
    ordered = sorted(record.outliers, key=lambda outlier: -abs(outlier[2]))
    for line, name, deviations in ordered[:MOST_LISTED_OUTLIERS]:
        table.add_row(str(line), name, number(deviations, digits=3))
    if len(ordered) > MOST_LISTED_OUTLIERS:
        table.add_row("...", f"{len(ordered) - MOST_LISTED_OUTLIERS} more", "")
    return table


def _pose_table(proposed: NextPoses, machine: Machine) -> FittedTable:
    scales = [machine.display.scale(unit_of(machine, path)) for path in proposed.poses]
    names = (path.removeprefix("pose.") for path in proposed.poses)
    heads = [scale.label(name) for scale, name in zip(scales, names, strict=True)]
    table = numeric_table("Poses to measure next", "pose", heads)
    for row, values in enumerate(np.column_stack(list(proposed.poses.values()))[:MOST_LISTED_POSES], 1):
        table.add_row(str(row), *(number(float(v) * s.factor) for v, s in zip(values, scales, strict=True)))
    return table


def _firmware_table(numbers: FirmwareNumbers) -> FittedTable:
    """Return the numbers of a printer's controller: words of Klipper, letters of M665 and M666, and values."""
    heads = ("Klipper", "Marlin", "RepRapFirmware", "value", "±")
    table = text_table("In the words of firmware (mm, deg)", *heads, numeric=("value", "±"))
    halves = numbers.halves
    (marlin, marlin_height), (reprap, reprap_height) = numbers.marlin_endstops, numbers.reprap_endstops

    def add(klipper: str, marlin_word: str, reprap_word: str, value: float, half: float) -> None:
        table.add_row(klipper, marlin_word, reprap_word, *number_and_uncertainty(value, half))

    add("delta_radius", "M665 R", "M665 R", numbers.radius, halves["radius"][0])
    for tower, rod, half in zip("abc", numbers.rods, halves["rods"], strict=True):
        add(f"arm_length {tower}", "M665 L", "M665 L", rod, half)
    columns = "abc", "XYZ", NOMINAL_ANGLES, numbers.angles, halves["angles"]
    for tower, letter, nominal, angle, half in zip(*columns, strict=True):
        add(f"angle {tower} - {nominal:g}", f"M665 {letter}", f"M665 {letter}", angle, half)
    for place, (tower, letter) in enumerate(zip("abc", "XYZ", strict=True)):
        marlin_change, reprap_change = (f"M666 {letter} {endstops[place]:+.4f}" for endstops in (marlin, reprap))
        raised, half = numbers.raised[place], halves["raised"][place]
        add(f"position_endstop {tower}, change", marlin_change, reprap_change, raised, half)
    table.add_row("", f"M665 H {marlin_height:+.4f}", f"M665 H {reprap_height:+.4f}", "", "")
    if any(halves["scale"]):
        add("rotation_distance, factor", "1 / M92", "1 / M92", numbers.scale, halves["scale"][0])
    return table


def _firmware_file(text: Callable[[FirmwareNumbers], str], answer: Identification) -> str | None:
    numbers = firmware_numbers(answer)
    return None if numbers is None else text(numbers)


def _unknowns(answer: Identification) -> list[dict[str, Any]]:
    return [
        {
            "path": unknown.path,
            "words": unknown.words,
            "group": unknown.group,
            "unit": KINDS[unknown.kind].unit if unknown.kind != "share" else "1",
            "value": float(value),
            "half_interval_95": float(half),
            "seen": bool(np.isfinite(half)),
        }
        for unknown, value, half in zip(answer.unknowns, answer.fit.values, answer.fit.half_intervals, strict=True)
    ]


def _fit_file(answer: Identification) -> dict[str, Any]:
    """Return the record of the fit, with the home pose that commands of the machine as built need."""
    return with_home(answer, json_of(IDENTIFICATION, answer))


IDENTIFICATION = Description(
    title="Identification",
    fields=(
        Field("machine", "machine.name"),
        Field("family", "machine.family.name"),
        Field("data", "observed.data.path"),
        Field("poses", lambda answer: len(answer.observed.data)),
        Field("values", lambda answer: len(answer.observed.measured)),
        Field("unknowns", _unknowns),
        Field("covariance", "fit.covariance"),
        Field("rank", "fit.rank"),
        Field("freedom", "fit.freedom"),
        Field("scatter", "fit.scatter"),
        Field("sigma_known", "observed.data.known"),
        Field("before", lambda answer: answer.scatter(answer.fit.before)),
        Field("after", lambda answer: answer.scatter(answer.fit.after)),
        Field("left_out", lambda answer: answer.scatter(answer.fit.predicted)),
        Field(
            "outliers",
            lambda answer: [{"line": line, "value": name, "sigmas": off} for line, name, off in answer.outliers],
        ),
        Field("unseen", lambda answer: list(answer.unseen)),
        Field("next_poses", lambda answer: None if answer.next is None else _proposal(answer.next)),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.identification_figures.identification_figures",
    state=lambda answer: f"as built, by {answer.observed.data.path}",
    files={
        "machine.toml": "exchange.leg_by_leg.fitted_text",
        "fit.json": _fit_file,
        "next-poses.csv": lambda answer: None if answer.next is None else as_csv(answer.machine, answer.next),
        "klipper.cfg": partial(_firmware_file, klipper_text),
        "marlin.gcode": partial(_firmware_file, marlin_text),
        "reprapfirmware.g": partial(_firmware_file, reprap_text),
    },
)

RECORDED_FIT = Description(
    title="Identification",
    fields=(),
    lines=lambda fit: [*_fit_lines(fit.record), ("Measurements", f"{fit.record.data}.")],
    tables=lambda fit, _full: _fit_tables(fit.record, fit.machine.display),
)


def machine_by_measurements(
    machine: Machine,
    data: str,
    fit: Sequence[str] = (),
    priors: Sequence[str] = (),
    bounds: Sequence[str] = (),
    ties: Sequence[str] = (),
    no_outliers: bool = False,
    frame: bool = False,
    target: bool = False,
    sigma: str = "",
    sigma_angle: str = "",
    more: int = 0,
    progress: Tell = lambda *_: None,
) -> Identification:
    """Identify a machine with the options of the command, whose sizes by group or path are texts "what=size"."""
    return identify(
        machine,
        data,
        fit or (() if ties else USUALLY_FITTED),
        frame=frame,
        target=target,
        sigma=sigma,
        sigma_angle=sigma_angle,
        priors=_sizes(priors, "--prior"),
        bounds=_sizes(bounds, "--bound"),
        ties=_sizes(ties, "--tie", "NAME=PATTERN", "rod_length=geometry.rod_length.*"),
        robust=not no_outliers,
        more=more,
        tell=progress,
    )


def _sizes(
    texts: Sequence[str], option: str, form: str = "what=size", example: str = "zeros=0.1 mm"
) -> Mapping[str, str]:
    """Return texts by group or path, from texts "what=size"."""
    sizes = {}
    for text in texts:
        name, equals, size = (part.strip() for part in text.partition("="))
        if not (name and equals and size):
            raise InputError(f'{option} {shorten(text)} must be {form}, e.g. {option} "{example}".')
        sizes[name] = size
    return sizes


IDENTIFY_QUESTION = Question(
    example="kinetostat identify hexapod measured.csv --fit geometry --fit zeros --frame -o identified",
    answer=machine_by_measurements,
    options=(
        Option(
            "data",
            "file",
            "a CSV file: columns of the commanded pose (x [mm], roll [deg]) or actuators (actuator.leg 1 [mm]) and of "
            "what was measured (measured.x [mm], measured.rx [deg], measured.distance [mm], deflection.z [um]), with "
            "sigma.x [um], force.z [N] and from.x [mm] where they belong",
            metavar="DATA",
            first=True,
            required=True,
        ),
        Option(
            "fit",
            "text",
            "geometry, zeros, gains, compliances, shared, or paths with * (default: geometry and zeros); repeatable",
            metavar="WHAT",
            many=True,
        ),
        Option("frame", "flag", "the place of the measuring frame is unknown"),
        Option("target", "flag", "the place of the target on the platform is unknown"),
        Option("sigma", "quantity", 'of measured lengths, e.g. --sigma "5 um"', metavar="LENGTH", default=""),
        Option("sigma_angle", "quantity", 'of angles, e.g. --sigma-angle "20 urad"', metavar="ANGLE", default=""),
        Option(
            "priors",
            "text",
            'standard deviation about zero before measuring by group or path, e.g. --prior "zeros=0.1 mm"; repeatable',
            metavar="WHAT=SIZE",
            many=True,
            word="--prior",
        ),
        Option(
            "bounds",
            "text",
            'largest size by group or path, e.g. --bound "zeros=0.1 mm"; repeatable',
            metavar="WHAT=SIZE",
            many=True,
            word="--bound",
        ),
        Option(
            "ties",
            "text",
            "errors that are one unknown, by a name of your own: paths with *, or 0.5 * PATH + -0.5 * PATH; repeatable",
            metavar="NAME=PATTERN",
            many=True,
            word="--tie",
        ),
        Option("no_outliers", "flag", "keep all values: outliers are not set aside"),
        Option("more", "count", "propose N poses to measure next", default=0, word="--next"),
    ),
    output="the machine as built (TOML), the record of the fit (JSON), poses to measure next (CSV) and figures",
    slow="fitting",
    reports_progress=True,
)
