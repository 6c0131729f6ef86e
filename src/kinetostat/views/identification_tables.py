"""What has been identified of a machine, as tables and sentences on a terminal. Nothing is computed here."""

import numpy as np
from rich.console import Console

from kinetostat.display import Scale, number, number_and_uncertainty
from kinetostat.machine.machine import Machine
from kinetostat.studies.identification.identification import Identification
from kinetostat.studies.identification.next_poses import unit_of
from kinetostat.views.tables import numeric_table, text_table

RATIO, SHARE = Scale(1e6, "ppm"), Scale(1e2, "%")
MOST_OUTLIERS = 12
MOST_POSES = 40
NOT_EXPLAINED = 1.5
"""Residuals over their standard deviations from which something else must be said to move the tool."""
NOT_SEEN = "not seen"
SI = {"length": "m", "angle": "rad"}


def print_identification(console: Console, answer: Identification) -> None:
    """Print how well the measurements are explained, by which numbers, what is not seen, and what to measure next."""
    fit, seen = answer.fit, answer.observed
    console.print(_verdict(answer), highlight=False)
    display = answer.machine.display
    table = numeric_table("Residuals, root mean square", "", ["as drawn", "as identified", "of poses left out"])
    columns = [answer.scatter(residuals) for residuals in (fit.before, fit.after, fit.predicted)]
    for kind, name in (("length", "positions and distances"), ("angle", "angles")):
        if kind in columns[0]:
            table.add_row(name, *(display.show_deflection(column[kind], SI[kind]) for column in columns))
    console.print(table)
    table = text_table("Identified numbers (± half of the 95 % interval)", "error", "value", "±", "unit", "meaning")
    for column in table.columns[1:3]:
        column.justify = "right"
    for unknown, value, half in zip(answer.unknowns, fit.values, fit.sure, strict=True):
        scale = scale_of(answer.machine, SI.get(unknown.kind, "1"), unknown.group)
        table.add_row(unknown.path, *value_and_half(value, half, scale), scale.unit, unknown.words)
    console.print(table)
    _print_unseen(console, answer)
    _print_outliers(console, answer)
    _print_next(console, answer)
    if not seen.data.known:
        text = "No standard deviations were given: intervals follow from the residuals themselves."
        console.print(text, highlight=False)


def value_and_half(value: float, half: float, scale: Scale) -> tuple[str, str]:
    """An identified number and half of its 95 % interval in a unit, to the digits that are known."""
    if not np.isfinite(half):
        return number(value * scale.factor), NOT_SEEN
    return number_and_uncertainty(value * scale.factor, half * scale.factor)


def scale_of(machine: Machine, unit: str, group: str) -> Scale:
    """The unit in which an error is read: that of small motions, ppm for gains, percent for compliances."""
    if unit in SI.values():
        return machine.display.deflection(unit)
    return SHARE if group == "compliances" else RATIO


def _verdict(answer: Identification) -> str:
    fit, data = answer.fit, answer.observed.data
    aside = int((~fit.kept).sum())
    text = (
        f"{answer.machine.name}: {len(answer.unknowns)} unknowns from {len(answer.observed.value)} values at "
        f"{len(data)} poses; {fit.rank} combinations are seen"
    )
    text += f", {len(answer.unknowns) - fit.rank} are not" if fit.rank < len(answer.unknowns) else ""
    text += f"; {aside} values are set aside as outliers." if aside else "."
    if data.known and fit.scatter > NOT_EXPLAINED:
        text += (
            f" The residuals are {number(fit.scatter, digits=2)} times as large as the standard deviations say: the "
            "measurements are less sure, or something that moves the tool is not fitted (gains, compliances)."
        )
    return text


def _print_unseen(console: Console, answer: Identification) -> None:
    if not answer.unseen:
        return
    display = answer.machine.display
    table = text_table("What no pose sees", "combination", "moves the tool by", "of that, inside the machine")
    for each in answer.unseen:
        table.add_row(each.words, *(display.show_deflection(moved, "m") for moved in (each.tool, each.inside)))
    console.print(table)
    text = (
        "Such a combination is left as near to zero as it can be. It moves the tool in the base frame; what lies "
        "inside the machine is what another place of the base and of the target cannot undo."
    )
    console.print(text, highlight=False)


def _print_outliers(console: Console, answer: Identification) -> None:
    if not answer.outliers:
        return
    table = numeric_table("Outliers, set aside", "line", ["value", "standard deviations"])
    for line, name, off in sorted(answer.outliers, key=lambda entry: -abs(entry[2]))[:MOST_OUTLIERS]:
        table.add_row(str(line), name, number(off, digits=3))
    console.print(table)
    if len(answer.outliers) > MOST_OUTLIERS:
        console.print(f"... and {len(answer.outliers) - MOST_OUTLIERS} more.", highlight=False)


def _print_next(console: Console, answer: Identification) -> None:
    proposed = answer.next
    if proposed is None:
        return
    display = answer.machine.display
    kinds = {path: unit_of(path) for path in proposed.poses}
    heads = [display.scale(unit).label(path.removeprefix("pose.")) for path, unit in kinds.items()]
    table = numeric_table("Poses to measure next", "pose", heads)
    for row, values in enumerate(np.column_stack(list(proposed.poses.values()))[:MOST_POSES], 1):
        pairs = zip(values, kinds.values(), strict=True)
        table.add_row(str(row), *(number(float(v) * display.scale(unit).factor) for v, unit in pairs))
    console.print(table)
    text = (
        f"They make the intervals shorter by a factor of {number(proposed.sharper, digits=3)} on average; as many "
        f"poses at random by {number(proposed.random, digits=3)}. {proposed.within} Candidates: {_ranges(answer)}."
    )
    console.print(text, highlight=False)


def _ranges(answer: Identification) -> str:
    """From where to where candidates went, coordinate by coordinate."""
    parts = []
    for path, ends in answer.next.ranges.items() if answer.next else ():
        scale = answer.machine.display.scale(unit_of(path))
        low, high = (number(end * scale.factor, digits=3) for end in ends)
        parts.append(f"{path.removeprefix('pose.')} {low} to {high} {scale.unit}")
    return ", ".join(parts)
