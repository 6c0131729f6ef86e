"""A tilting machine over its elevation: the question, the description of its answer, and its picture.

Nothing is computed here.
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.display import DASH, number
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.late import LateModule
from kinetostat.machine.machine import pose_of, setting_of
from kinetostat.studies.elevation import USUAL_RANGE, Elevation, elevation
from kinetostat.units import component_units, load_unit
from kinetostat.views.command import correction_lines, correction_tables, law_fields
from kinetostat.views.data_forms import NumberColumn, column_head, columns_csv, status_words, with_heads
from kinetostat.views.loaded import KINDS_OF_LOADS, use_of_limit
from kinetostat.views.question import (
    FIRST_FIELDS,
    LAW_TOLERANCE,
    REQUIREMENTS,
    Axis,
    Description,
    Drawing,
    Field,
    Lines,
    Option,
    Question,
    Records,
    requirements_met,
)
from kinetostat.views.tables import FittedTable, numeric_table, text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinetostat.views import figures
else:
    figures = LateModule("kinetostat.views.figures")

ROOM_ABOVE_CURVE = 1.15
"""Upper end of a panel with a single curve over the greatest value of the curve. The axis begins at zero, so that
heights can be compared."""
PANEL_HEIGHT, ROOM_FOR_TITLE = 2.0, 0.7
"""Height of a row of panels, and of title and notes, inches."""


def _lines(answer: Elevation) -> Lines:
    display = answer.machine.display
    show = display.show
    ends = [show(float(answer.elevations[i]), "rad") for i in (0, -1)]
    yield "Pose", f"{pose_of(answer.machine)}, at {len(answer.elevations)} elevations from {ends[0]} to {ends[1]}."
    if answer.message:
        yield "Elevation", answer.message
    if not np.isfinite(answer.sag).any():
        return
    sag, rotation = _greatest_text(answer, answer.sag, "m"), _greatest_text(answer, answer.rotation, "rad")
    yield "Sag", f"The loads move the tool point by at most {sag} and turn the platform by at most {rotation}."
    if np.isfinite(answer.frequency).any():
        place = int(np.nanargmin(answer.frequency))
        least = f"{show(float(answer.frequency[place]), 'Hz')} {_elevation_text(answer, place)}"
        yield "Frequency", f"The first natural frequency is at least {least}."
    yield "Actuators", _forces_sentence(answer)
    yield "Reversals", _reversals_sentence(answer)
    if answer.budget is not None:
        place = int(np.nanargmax(answer.error))
        size = f"{display.show_deflection(float(answer.error[place]), 'm')} {_elevation_text(answer, place)}"
        yield "As built", f"95 % of all machines are off by at most {size}; kinetostat budget says by what."
    yield from correction_lines(answer.corrections)
    if answer.corrections.error_uncorrected:
        yield "Angle", "gravity_angle is 90 deg - elevation."


def _elevation_text(answer: Elevation, place: int) -> str:
    return f"at {answer.machine.display.show(float(answer.elevations[place]), 'rad')}"


def _greatest_text(answer: Elevation, sizes: Array, unit: str) -> str:
    """Return the greatest of some deflections over the elevation, and where it is."""
    place = int(np.nanargmax(sizes))
    return f"{answer.machine.display.show_deflection(float(sizes[place]), unit)} ({_elevation_text(answer, place)})"


def _forces_sentence(answer: Elevation) -> str:
    """Return the greatest load of each kind, and how much of the limits is used."""
    parts = []
    for turning, kind in KINDS_OF_LOADS:
        unit, columns = load_unit(turning), [i for i, turns in enumerate(answer.turning) if turns is turning]
        if columns:
            sizes = np.nan_to_num(np.abs(answer.loads[:, columns]))
            place, column = np.unravel_index(int(sizes.argmax()), sizes.shape)
            size = answer.machine.display.show(float(sizes[place, column]), unit)
            name = answer.actuators[columns[int(column)]]
            parts.append(f"the greatest {kind} is {size}, of {name} {_elevation_text(answer, int(place))}")
    text = f"{'; '.join(parts)}."
    text = f"{text[0].upper()}{text[1:]}"
    if not np.isfinite(answer.limit_use).any():
        return f"{text} The file limits no load of actuators."
    use = float(np.nanmax(answer.limit_use))
    return f"{text} An actuator uses {use_of_limit(use)}{'' if use > 1.0 else ' at most'}."


def _reversals_sentence(answer: Elevation) -> str:
    if not answer.reversals:
        return "No load of a drive or a joint reverses, so that no clearance is crossed."
    display = answer.machine.display
    legs = (f"{reversal.leg} at {display.show(reversal.elevation, 'rad', digits=3)}" for reversal in answer.reversals)
    jumps = [reversal.jump for reversal in answer.reversals if reversal.jump is not None]
    text = f"Loads reverse in {', '.join(legs)}."
    if jumps:
        jump = display.show_deflection(max(jumps), "m")
        return f"{text} The tool point jumps by up to {jump} as clearances are crossed."
    return f"{text} Clearances in [tolerances], or backlash in [drives], say how far the tool point jumps there."


def _tables(answer: Elevation, full: bool) -> Iterator[FittedTable]:
    if not np.isfinite(answer.sag).any():
        return
    yield _elevation_table(answer, full)
    yield _loads_table(answer)
    if answer.reversals:
        yield _reversals_table(answer)
    yield from correction_tables(answer.corrections, full)


def _columns(answer: Elevation, full: bool = False) -> dict[str, NumberColumn]:
    """Return the columns of the main table by their heads; with `full` also the components of the displacement."""
    columns = {"sag": NumberColumn("m", answer.sag), "rotation": NumberColumn("rad", answer.rotation)}
    if full:
        units = component_units(answer.components)
        columns |= dict(zip(answer.components, map(NumberColumn, units, answer.displacement.T), strict=True))
    columns["first frequency"] = NumberColumn("Hz", answer.frequency)
    for turning, kind in KINDS_OF_LOADS:
        chosen = [turns is turning for turns in answer.turning]
        if any(chosen):
            greatest = np.abs(answer.loads[:, chosen]).max(axis=1)
            columns[f"greatest {kind}"] = NumberColumn(load_unit(turning), greatest)
    if answer.budget is not None:
        columns["error, 95 %"] = NumberColumn("m", answer.error)
    return columns


def _elevation_table(answer: Elevation, full: bool) -> FittedTable:
    display, columns = answer.machine.display, _columns(answer, full)
    values_by_unit: dict[str, list[Array]] = {}
    for unit, values in columns.values():
        values_by_unit.setdefault(unit, []).append(values)
    scales = {unit: display.fitting(unit, np.concatenate(arrays)) for unit, arrays in values_by_unit.items()}
    heads = [f"{name}\n{scales[column.unit].head}" for name, column in columns.items()]
    table = numeric_table("Over elevation", f"elevation\n{display.scale('rad').head}", heads)
    for i, height in enumerate(answer.elevations):
        cells = (float(values[i]) * scales[unit].factor for unit, values in columns.values())
        table.add_row(display.number(float(height), "rad"), *(DASH if math.isnan(c) else number(c) for c in cells))
    return table


def _loads_table(answer: Elevation) -> FittedTable:
    display = answer.machine.display
    units = [load_unit(turning) for turning in answer.turning]
    scales = [display.scale(unit) for unit in units]
    heads = [f"{name}\n{scale.head}" for name, scale in zip(answer.actuators, scales, strict=True)]
    title = "Loads of actuators, positive where they are pulled"
    table = numeric_table(title, f"elevation\n{display.scale('rad').head}", heads)
    for height, row in zip(answer.elevations, answer.loads, strict=True):
        loads = zip(row.tolist(), units, strict=True)
        cells = (display.number(load, unit) if math.isfinite(load) else DASH for load, unit in loads)
        table.add_row(display.number(float(height), "rad"), *cells)
    return table


def _reversals_table(answer: Elevation) -> FittedTable:
    display = answer.machine.display
    table = text_table("Loads that reverse", "elevation", "leg", "between the parts of")
    for head in ("tool point jumps", "platform turns"):
        table.add_column(head, justify="right", no_wrap=True)
    for reversal in answer.reversals:
        sizes = ((reversal.jump, "m"), (reversal.turn, "rad"))
        shown = (DASH if size is None else display.show_deflection(size, unit) for size, unit in sizes)
        place = display.show(reversal.elevation, "rad", digits=3)
        table.add_row(place, reversal.leg, ", ".join(reversal.parts), *shown)
    return table


def elevation_csv(answer: Elevation) -> str:
    """Write all numbers over the elevation as CSV in SI: a row for each, with loads and corrections of actuators."""
    columns: dict[str, Any] = {"elevation [rad]": answer.elevations}
    columns["status"] = status_words(answer.statuses)
    columns |= with_heads(_columns(answer, full=True))
    for name, turning, values in zip(answer.actuators, answer.turning, answer.loads.T, strict=True):
        columns[column_head(f"{name} load", load_unit(turning))] = values
    commands = answer.corrections.command
    for name, unit, values in zip(commands.actuators, commands.units, commands.corrections.T, strict=True):
        columns[column_head(f"{name} correction", unit)] = values
    return columns_csv(columns)


def elevation_figures(answer: Elevation) -> dict[str, Drawing]:
    """Return the drawing over the elevation; none where the machine comes to no rest."""
    if not np.isfinite(answer.sag).any():
        return {}
    caption = "Sag, first frequency, loads and corrections of the actuators over the elevation; dotted: loads reverse."
    return {"elevation": Drawing(caption, partial(elevation_figure, answer))}


def elevation_figure(answer: Elevation, title: str = "{}: over elevation") -> "Figure":
    """Draw displacement, rotation, frequency, loads, error and corrections over the elevation, a panel for each."""
    contents = _panel_contents(answer)
    rows, _ = figures.grid_shape(len(contents), most_columns=2)
    heights = answer.machine.display.scale("rad")
    notes = setting_of(answer.machine), "dotted lines: loads reverse" if answer.reversals else ""
    with figures.new_figure(
        (7.0, ROOM_FOR_TITLE + PANEL_HEIGHT * rows), title.format(answer.machine.name), *notes
    ) as figure:
        panels = figures.panel_grid(figure, len(contents), most_columns=2, sharex=True)
        for panel, content in zip(panels, contents, strict=True):
            _draw_panel(panel, answer, content, heights.factor)
        for panel in panels[-2:]:  # the last of both columns
            panel.set_xlabel(heights.label("elevation"))
            panel.tick_params(labelbottom=True)
    return figure


@dataclass(frozen=True)
class PanelContent:
    """The content of a panel over the elevation.

    Attributes:
        meaning: meaning of the values.
        unit: unit of the values, SI.
        curves: values over the elevation by name; the name is empty where there is one curve alone.
        fitting: whether the unit that is shown follows the values, as for deflections, which are small.
    """

    meaning: str
    unit: str
    curves: dict[str, Array]
    fitting: bool = False


def _panel_contents(answer: Elevation) -> list[PanelContent]:
    """List the panels in which something is known."""
    commands = answer.corrections.command
    motion_units, load_units = component_units(answer.components), [load_unit(turns) for turns in answer.turning]

    def motions(unit: str) -> dict[str, Array]:
        return _curves(unit, answer.components, motion_units, answer.displacement)

    def loads(unit: str) -> dict[str, Array]:
        return _curves(unit, answer.actuators, load_units, answer.loads)

    def corrections(unit: str) -> dict[str, Array]:
        return _curves(unit, commands.actuators, commands.units, commands.corrections)

    contents = [
        PanelContent("displacement", "m", motions("m"), fitting=True),
        PanelContent("rotation", "rad", motions("rad"), fitting=True),
        PanelContent("first frequency", "Hz", {"": answer.frequency}),
        PanelContent("force, pulling", "N", loads("N")),
        PanelContent("moment", "N·m", loads("N·m")),
        PanelContent("error, 95 %", "m", {} if answer.budget is None else {"": answer.error}, fitting=True),
        PanelContent("correction", "m", corrections("m"), fitting=True),
        PanelContent("correction", "rad", corrections("rad"), fitting=True),
    ]
    return [content for content in contents if any(np.isfinite(values).any() for values in content.curves.values())]


def _curves(unit: str, names: Sequence[str], units: Sequence[str], table: Array) -> dict[str, Array]:
    """Return the columns of a table [elevations x names] that have a unit, by name."""
    return {name: values for name, of_values, values in zip(names, units, table.T, strict=True) if of_values == unit}


def _draw_panel(panel: "Axes", answer: Elevation, content: PanelContent, angle_factor: float) -> None:
    """Draw the curves of a panel; elevations are multiplied by a factor that brings them from rad to what is shown."""
    display, curves = answer.machine.display, content.curves
    scale = display.scale(content.unit)
    if content.fitting:
        scale = display.fitting(content.unit, np.concatenate(list(curves.values())))
    for place, (name, values) in enumerate(curves.items()):
        panel.plot(answer.elevations * angle_factor, values * scale.factor, label=name, **figures.look_of(place))
    panel.set_ylabel(scale.label(content.meaning))
    panel.margins(x=0.0)
    if content.unit in ("N", "N·m"):
        panel.axhline(0.0, color=figures.GUIDE_COLOUR, linewidth=0.8)
        for reversal in answer.reversals:
            panel.axvline(reversal.elevation * angle_factor, color=figures.COLOURS[1], linewidth=0.8, linestyle=":")
    if "" in curves:
        panel.set_ylim(0.0, ROOM_ABOVE_CURVE * float(np.nanmax(curves[""])) * scale.factor)
    else:
        # Six drives are six curves all over the panel: a legend inside would cover some of them.
        panel.legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=figures.NOTE_SIZE, borderaxespad=0.2
        )


ELEVATION = Description(
    title="Over elevation",
    fields=(
        *FIRST_FIELDS,
        Field("components"),
        Field("elevation", "elevations", "rad", forms=("json",)),
        Field("statuses", lambda answer: status_words(answer.statuses), forms=("json",)),
        Field("displacement", unit="rad, m", long_name="rotation vector and displacement of the tool point",
              axes=("elevation", "component")),
        Field("sag", unit="m", long_name="displacement of the tool point by the loads", axes=("elevation",)),
        Field("rotation", unit="rad", long_name="rotation of the platform by the loads", axes=("elevation",)),
        Field("frequency", unit="Hz", long_name="first natural frequency", axes=("elevation",)),
        Field("actuators"),
        Field("load", "loads", "N, N·m", "load of each actuator, positive where it is pulled",
              axes=("elevation", "actuator")),
        Field("limit_use", unit="1", long_name="greatest share of a limit of the loads", axes=("elevation",)),
        Field("error", unit="m", long_name="error of the tool point that 95 % of all machines keep within",
              axes=("elevation",)),
        Records("reversals", "reversal", (
            Field("elevation", unit="rad", column="at_elevation"),
            Field("leg"),
            Field("parts", lambda reversal: ", ".join(reversal.parts)),
            Field("jump", unit="m"),
            Field("turn", unit="rad"),
        ), forms=("json",)),
        Field("correction", lambda answer: answer.corrections.command.corrections, "m, rad",
              "what is added to each actuator", axes=("elevation", "driven")),
        Field("law", lambda answer: law_fields(answer.corrections), forms=("json",)),
        REQUIREMENTS,
    ),
    lines=_lines,
    tables=_tables,
    figures=elevation_figures,
    axes=(
        Axis("elevation", "elevations", "rad", "elevation"),
        Axis("component", "components"),
        Axis("actuator", "actuators"),
        Axis("driven", "corrections.command.actuators"),
    ),
    makers={"csv": elevation_csv},
    state=lambda answer: f"over elevation: {answer.status.word}",
    answered=lambda answer: bool(np.isfinite(answer.sag).any()),
    kept=lambda answer: answer.status is Status.OK and requirements_met(answer),
    files={"elevation.json": "json", "elevation.csv": elevation_csv, "elevation.nc": "nc"},
)  # fmt: skip
ELEVATION_QUESTION = Question(
    example='kinetostat elevation telescope.toml --over "20 deg:90 deg:8" --about 1,0,0 -o elevation',
    answer=elevation,
    options=(
        Option(
            "over",
            "text",
            f"from, to and number of elevations; at 90 deg gravity acts as the file says (default: {USUAL_RANGE})",
            metavar="FROM:TO:COUNT",
            default=USUAL_RANGE,
        ),
        Option(
            "about",
            "direction",
            "axis of the base about which gravity turns in it as the elevation falls (default: load.gravity_axis)",
            default=(),
        ),
        LAW_TOLERANCE,
    ),
    output="elevation.json, elevation.csv, elevation.nc and the figure",
    reports_progress=True,
    full="also show the components of the displacement",
)
