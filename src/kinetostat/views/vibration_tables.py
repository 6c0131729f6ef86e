"""Natural vibrations as tables on a terminal: the answer first, then modes, and which parts make them."""

from collections.abc import Mapping, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.display import Display, number
from kinetostat.studies.attribution import ranked
from kinetostat.studies.setting import pose_of
from kinetostat.studies.vibration import Mode, Vibration
from kinetostat.views.tables import numeric_table, print_doubts

LEAST_SHARE = 0.005
"""Share of the energy of every mode below which a part has no line of its own."""
MOST_PARTS = 12
"""Parts that have a line; where more springs deform, their kinds have one."""
LEAST_PERCENT = 0.0005
"""Share that is shown as nothing."""


def print_vibration(
    console: Console, answer: Vibration, direction: Sequence[float] = (), pressure: float | None = None
) -> None:
    """Print the vibrations of a machine.

    Args:
        console: where they go.
        answer: of the machine.
        direction: in which the tool is pushed, base axes; no limit of a cut is told without one.
        pressure: cutting force per area of the chip, N/m²; None to tell the softest real part only.
    """
    machine, display = answer.machine, answer.machine.display
    state = "about its state under load" if answer.loaded else answer.status.word
    console.print(Text.assemble((machine.name, "bold"), f"  {state}"))
    lines = Table.grid(padding=(0, 2, 0, 0))
    if not answer.modes:
        lines.add_row(Text("Pose", "bold"), f"{pose_of(machine)}. {answer.message}")
    else:
        lines.add_row(Text("Pose", "bold"), f"{pose_of(machine)}.")
        lines.add_row(Text("Modes", "bold"), answer.message)
        lines.add_row(Text("Masses", "bold"), masses_of(answer))
        lines.add_row(Text("Damping", "bold"), damping_of(answer))
    if answer.modes and (direction or pressure):
        lines.add_row(Text("Cutting", "bold"), cut_of(answer, direction, pressure))
    console.print(lines)
    print_doubts(console, machine)
    if answer.modes:
        console.print(mode_table(answer.modes, display, answer.components))
        console.print(share_table("Strain energy (%)", strain_of(answer.modes)))
        console.print(share_table("Kinetic energy (%)", [mode.kinetic for mode in answer.modes]))


def masses_of(answer: Vibration) -> str:
    """Say what moves, and of which parts no mass is known."""
    text = f"{answer.machine.display.show(answer.moving_mass, 'kg')} move."
    if not answer.uncounted:
        return text
    return f"{text} Nothing says the mass of {', '.join(answer.uncounted)}: they count as massless."


def damping_of(answer: Vibration) -> str:
    """Say how the modes are damped."""
    if answer.assumed:
        return f"{number(100.0 * answer.modes[0].ratio)} % of critical in every mode, assumed; give a table [damping]."
    ratios = [100.0 * mode.ratio for mode in answer.modes]
    ends = dict.fromkeys(number(ratio, digits=3) for ratio in (min(ratios), max(ratios)))
    return f"{' to '.join(ends)} % of critical, by the table [damping]."


def cut_of(answer: Vibration, direction: Sequence[float], pressure: float | None) -> str:
    """Say where the real part of the receptance along a direction is least, and the width of cut that follows."""
    if not any(direction):
        return "Nothing says the direction across the cut: write direction = [1, 0, 0] under [cutting]."
    softest, display = answer.softest(direction), answer.machine.display
    text = f"Along {axis_of(direction)} the real part of the receptance is least at "
    text += f"{display.show(softest.frequency, 'Hz')}: {display.show(softest.real, 'm/N')}."
    if pressure is None:
        return text
    width = display.show(softest.depth(pressure), "m", endless="any width")
    return f"{text} Cuts up to {width} wide are stable at every spindle speed."


def cut_by_table(answer: Vibration) -> str:
    """The same for direction and pressure of the table [cutting]; nothing where the file has no such table."""
    table = answer.machine.tables["cutting"]
    if not (any(table.direction) or table.pressure):
        return ""
    return cut_of(answer, table.direction, table.pressure or None)


def axis_of(direction: Sequence[float]) -> str:
    """A direction by the name of its axis, "x", or by its three numbers, "1,0,2"."""
    axes = [name for name, part in zip("xyz", direction, strict=True) if part]
    return axes[0] if len(axes) == 1 else ",".join(f"{part:g}" for part in direction)


def strain_of(modes: Sequence[Mode]) -> list[Mapping[str, float]]:
    """Shares of the strain energy of each mode by spring, or by kind of spring where there are too many for a table."""
    springs = {name for mode in modes for name, share in mode.strain.items() if abs(share) >= LEAST_SHARE}
    return [mode.kinds if len(springs) > MOST_PARTS else mode.strain for mode in modes]


def mode_table(modes: Sequence[Mode], display: Display, components: Sequence[str]) -> Table:
    """A line for each mode: frequency, damping, how the tool moves, what would ring there alone.

    Args:
        modes: from the lowest.
        display: of the machine.
        components: that the machine has: a planar one does not answer along z.
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
            display.show(mode.modal_stiffness, "N·m/rad" if turning else "N/m"),
            *(percent(share) for _, share in zip(axes, mode.effective_mass, strict=False)),
        )
    return table


def share_table(title: str, shares: Sequence[Mapping[str, float]]) -> Table:
    """Shares of an energy by part in each mode, the greatest parts first, in percent."""
    names = dict.fromkeys(name for mode in shares for name in mode)
    largest = {name: max(abs(mode.get(name, 0.0)) for mode in shares) for name in names}
    order = [name for name, _ in ranked(largest)]
    shown = [name for name in order if largest[name] >= LEAST_SHARE][:MOST_PARTS]
    table = numeric_table(title, "", [str(place) for place in range(1, len(shares) + 1)])
    for name in shown:
        table.add_row(name, *(percent(mode.get(name, 0.0)) for mode in shares))
    rest = order[len(shown) :]
    left = [sum(mode.get(name, 0.0) for name in rest) for mode in shares]
    if any(abs(share) >= LEAST_PERCENT for share in left):
        table.add_row(rest[0] if len(rest) == 1 else f"{len(rest)} others", *map(percent, left))
    return table


def percent(share: float) -> str:
    """A share as a number of percent, a dash where it is nothing."""
    return f"{100.0 * share:.1f}" if abs(share) >= LEAST_PERCENT else "–"
