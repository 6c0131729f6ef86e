"""Natural frequencies and modes: the question, and the description of its answer. Nothing is computed here."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Complex
from kinetostat.display import DASH, Display, number
from kinetostat.machine.loads import platform_is_loaded
from kinetostat.machine.machine import pose_of
from kinetostat.studies.attribution import ranking_of
from kinetostat.studies.vibration import Mode, Vibration, frequency_range, modes
from kinetostat.vibration.receptance import FreeTool
from kinetostat.views.analysis_tables import first_names
from kinetostat.views.question import FIRST_FIELDS, Axis, Description, Field, Lines, Option, Question, Records
from kinetostat.views.tables import FittedTable, numeric_table

AXES: Mapping[str, Sequence[float]] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
"""Axes of the base, along which the tool is looked at where no direction was asked for."""
LEAST_SHARE = 0.005
"""Share of the energy of every mode below which a part has no line of its own."""
MOST_PARTS = 12
"""Parts that have a line; where more springs deform, their kinds have one, so that the table stays on a screen."""
LEAST_PERCENT = 0.0005
"""Share below which a dash is shown: it would read 0.0 %."""


def mass_sentence(answer: Vibration) -> str:
    """Say how much mass moves, and of which parts no mass is known."""
    text = f"{answer.machine.display.show(answer.moving_mass, 'kg')} move."
    if not answer.uncounted:
        return text
    return f"{text} Nothing says the mass of {first_names(answer.uncounted)}: they count as massless."


def _loads_sentence(answer: Vibration) -> str:
    """Say that the loads of the file do not count where the machine vibrates about its free state; empty if they do."""
    loaded = platform_is_loaded(answer.machine) or answer.state.left_out
    if answer.loaded or not loaded:
        return ""
    return "These are vibrations about the free state: loads of the file do not count, but in modes --loaded."


def damping_sentence(answer: Vibration) -> str:
    """Say how the modes are damped."""
    if answer.assumed:
        return f"{number(100.0 * answer.modes[0].ratio)} % of critical in every mode, assumed; give a table [damping]."
    ratios = [100.0 * mode.ratio for mode in answer.modes]
    ends = dict.fromkeys(number(ratio, digits=3) for ratio in (min(ratios), max(ratios)))
    return f"{' to '.join(ends)} % of critical, by the table [damping]."


def _loops_sentence(answer: Vibration) -> str:
    """Say that servo loops are closed, and whether they hold; empty where they are not closed."""
    if answer.loops is None:
        return ""
    text = "The response of the tool is that with the servo loops closed; modes are those of motors that stand still."
    return text if answer.loops.stable else f"{text} The loops are unstable: kinetostat servo says what grows."


def tool_sentence(tool: FreeTool | None, display: Display) -> str:
    """Say over which frequencies and in which components a tool is coupled to the machine; empty without one."""
    if tool is None:
        return ""
    first, last = (display.show(float(end), "Hz") for end in tool.frequencies[[0, -1]])
    tip, flange = (", ".join(COMPONENTS[part] for part in parts) for parts in (tool.tip, tool.flange))
    text = f"Responses are those of the tip of the tool in {tip}, coupled at its flange in {flange}"
    return f"{text}, from {first} to {last}; modes are those of the machine alone."


def cut_sentence(answer: Vibration) -> str:
    """Say where the real part of the receptance across the cut is least, and the width of cut that follows.

    Nothing is said where neither a direction nor a pressure is known.
    """
    if not answer.direction:
        unknown = "Nothing says the direction across the cut: write direction = [1, 0, 0] under [cutting]."
        return unknown if answer.cutting_pressure else ""
    softest, display = answer.softest(answer.direction), answer.machine.display
    text = f"Along {axis_of(answer.direction)} the real part of the receptance is least at "
    text += f"{display.show(softest.frequency, 'Hz')}: {display.show(softest.real, 'm/N')}."
    if answer.cutting_pressure is None:
        return text
    width = display.show(softest.depth(answer.cutting_pressure), "m", endless="any width")
    return f"{text} Cuts up to {width} wide are stable at every spindle speed."


def axis_of(direction: Sequence[float]) -> str:
    """Name a direction by its axis, "x", or by its three numbers, "1,0,2"."""
    axes = [name for name, part in zip("xyz", direction, strict=True) if part]
    return axes[0] if len(axes) == 1 else ",".join(f"{part:g}" for part in direction)


def drawn_directions(direction: Sequence[float], components: Collection[str]) -> dict[str, Sequence[float]]:
    """Return the directions of which a figure has curves, by name: the one that was asked for, or else the base axes.

    Args:
        direction: the direction that was asked for; empty if there was none.
        components: names of the components of a motion that there are, such as "rx" and "z"; other axes are left out.
    """
    directions = {axis_of(direction): direction} if direction else AXES
    return {name: axis for name, axis in directions.items() if name not in AXES or name in components}


def _strain_shares(modes: Sequence[Mode]) -> list[Mapping[str, float]]:
    """Return the strain energy of each mode by spring, or by kind of spring where there are too many for a table."""
    springs = {name for mode in modes for name, share in mode.strain.items() if abs(share) >= LEAST_SHARE}
    return [mode.kinds if len(springs) > MOST_PARTS else mode.strain for mode in modes]


def mode_table(modes: Sequence[Mode], display: Display, components: Sequence[str]) -> FittedTable:
    """Return a line for each mode: frequency, damping, how the tool moves, mass and spring with the same response.

    Args:
        modes: the modes from the lowest on.
        display: the units of the machine's display.
        components: the components that the machine has: a planar one does not answer along z.
    """
    axes = [axis for axis in "xyz" if axis != "z" or "rx" in components or "z" in components]
    heads = ["Hz", "damping %", "tool", "modal mass", "modal stiffness", *(f"{axis} %" for axis in axes)]
    named = f"{', '.join(axes)}: share of the moving mass that answers a shaking base"
    table = numeric_table(f"Modes; {named}", "", heads)
    for place, mode in enumerate(modes, 1):
        turning = len(mode.direction) == 2
        table.add_row(
            str(place),
            number(mode.frequency, digits=display.digits),
            number(100.0 * mode.ratio, digits=3),
            mode.direction,
            display.show(mode.modal_mass, "kg·m**2" if turning else "kg"),
            display.show(mode.modal_stiffness, stiffness_unit(turning)),
            *(percent(share) for _, share in zip(axes, mode.effective_mass, strict=False)),
        )
    return table


def share_table(title: str, shares: Sequence[Mapping[str, float]]) -> FittedTable:
    """Return the shares of an energy by part in each mode, the greatest parts first, in percent."""
    names = dict.fromkeys(name for mode in shares for name in mode)
    largest = {name: max(abs(mode.get(name, 0.0)) for mode in shares) for name in names}
    order = [name for name, _ in ranking_of(largest)]
    shown = [name for name in order if largest[name] >= LEAST_SHARE][:MOST_PARTS]
    table = numeric_table(title, "", [str(place) for place in range(1, len(shares) + 1)])
    for name in shown:
        table.add_row(name, *(percent(mode.get(name, 0.0)) for mode in shares))
    omitted = order[len(shown) :]
    remainders = [sum(mode.get(name, 0.0) for name in omitted) for mode in shares]
    if any(abs(share) >= LEAST_PERCENT for share in remainders):
        table.add_row(omitted[0] if len(omitted) == 1 else f"{len(omitted)} others", *map(percent, remainders))
    return table


def percent(share: float) -> str:
    """Return a share as a number of percent, a dash where it is nothing."""
    return f"{100.0 * share:.1f}" if abs(share) >= LEAST_PERCENT else DASH


def _lines(answer: Vibration) -> Lines:
    if not answer.modes:
        return [("Pose", f"{pose_of(answer.machine)}. {answer.message}")]
    return [
        ("Pose", f"{pose_of(answer.machine)}."),
        ("Modes", answer.message),
        ("Masses", mass_sentence(answer)),
        ("Damping", damping_sentence(answer)),
        ("Loads", _loads_sentence(answer)),
        ("Loops", _loops_sentence(answer)),
        ("Tool", tool_sentence(answer.tool, answer.machine.display)),
        ("Cutting", cut_sentence(answer)),
    ]  # those that are empty are not shown


def _tables(answer: Vibration, _full: bool) -> Iterator[FittedTable]:
    if answer.modes:
        yield mode_table(answer.modes, answer.machine.display, answer.components)
        yield share_table("Strain energy (%)", _strain_shares(answer.modes))
        yield share_table("Kinetic energy (%)", [mode.kinetic for mode in answer.modes])


def stiffness_unit(turning: bool) -> str:
    """Return the unit of the stiffness of a rotation, or of a displacement."""
    return "N·m/rad" if turning else "N/m"


def _named_modes(answer: Vibration) -> list[dict[str, Any]]:
    """Return the modes with the names of their components."""
    names, axes = answer.components, "xyz"
    return [
        vars(mode)
        | {
            "tool": dict(zip(names, mode.tool, strict=True)),
            "effective_mass": dict(zip(axes, mode.effective_mass, strict=True)),
        }
        for mode in answer.modes
    ]


def _receptance(answer: Vibration) -> Complex:
    """Return the receptance over the frequencies of the response, of the components that the machine has."""
    parts = [COMPONENTS.index(name) for name in answer.components]
    return answer.receptance(frequency_range(answer).tolist())[:, parts][:, :, parts]


MODE = (
    Field("frequency", unit="Hz", long_name="natural frequency", column="frequency_hz"),
    Field("damping_ratio", "ratio", long_name="damping ratio"),
    Field(
        "tool",
        long_name="motion of the tool in a motion of mass 1 kg, rad and m per root of a kg·m²",
        axes=("component",),
        column="*",
    ),
    Field("direction", long_name="component in which the tool moves most"),
    Field("modal_mass", long_name="mass that would vibrate alone in the direction of the mode, kg or kg·m²"),
    Field("modal_stiffness", long_name="stiffness on which the modal mass would vibrate, N/m or N·m/rad"),
    Field("effective_mass", long_name="share of all mass that answers a shaking base", axes=("shaken",)),
    Field("strain_energy", "strain", long_name="share of strain energy", axes=("spring",), forms=("json", "nc")),
    Field("strain_energy_by_kind", "kinds", forms=("json",)),
    Field("kinetic_energy", "kinetic", long_name="share of kinetic energy", axes=("part",), forms=("json", "nc")),
)
RESPONSE = ("frequency", "moved", "loaded")
"""Axes of a receptance: its frequency, the component that moves and the one that is loaded."""

VIBRATION = Description(
    title="Vibration",
    fields=(
        *FIRST_FIELDS,
        Field("loaded"),
        Field("components", lambda answer: list(answer.components)),
        Field("moving_mass"),
        Field("without_known_mass", lambda answer: list(answer.uncounted)),
        Field("damping_assumed", "assumed"),
        Field("closed_loops", lambda answer: answer.loops is not None),
        Records("modes", "mode", MODE, _named_modes),
        Field(
            "receptance_real",
            lambda answer: _receptance(answer).real,
            long_name="real part, rad and m per N·m and N",
            axes=RESPONSE,
            forms=("nc",),
        ),
        Field(
            "receptance_imaginary",
            lambda answer: _receptance(answer).imag,
            long_name="imaginary part, the same units",
            axes=RESPONSE,
            forms=("nc",),
        ),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.vibration_figures.vibration_figures",
    axes=(Axis("frequency", frequency_range, "Hz"), Axis("moved", "components"), Axis("loaded", "components")),
    state=lambda answer: "about its state under load" if answer.loaded else answer.status.word,
    answered=lambda answer: bool(answer.modes),
    files={"modes.csv": "csv", "response.nc": "nc"},
)
TOOL_RECEPTANCE = Option(
    "tool_receptance",
    "file",
    "a CSV file with the receptance of a free tool and holder, which are coupled to the tool point",
)
VIBRATING_LOADED = "vibrations about the state of rest under the loads, with tensions and weights"
"""Help on `--loaded` of questions about vibrations."""
MODES_QUESTION = Question(
    example='kinetostat modes hexapod --set tool.mass="12 kg" -o modes',
    answer=modes,
    options=(
        Option(
            "along",
            "direction",
            "direction in which the tool is pushed, for the response (default: that of [cutting], else x, y and z)",
            default=(),
        ),
        Option(
            "cutting_pressure",
            "quantity",
            'cutting force per area of the chip, e.g. "2000 N/mm**2": tells the width of cut that stays stable in the '
            "direction of --along",
            metavar="PRESSURE",
        ),
        Option(
            "lowest",
            "quantity",
            'lowest frequency of the response, e.g. "10 Hz" (default: a fifth of the first mode)',
            metavar="FREQUENCY",
            former=("--from",),
        ),
        Option(
            "highest",
            "quantity",
            'highest frequency of the response, e.g. "500 Hz" (default: above the sixth mode)',
            metavar="FREQUENCY",
            former=("--to",),
        ),
        TOOL_RECEPTANCE,
        Option("closed_loops", "flag", "the response of the tool with the servo loops of the table [servo] closed"),
    ),
    loaded=VIBRATING_LOADED,
    output="modes.csv, response.nc and the figures",
)
