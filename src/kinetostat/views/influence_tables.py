"""Tables of what parameters do to the stiffness: sensitivities and design guidelines.

Only rounding is computed here.
"""

import math
from collections.abc import Iterator

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from kinetostat.display import number
from kinetostat.kinetostatics.quantities import group_of, spoken
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.guideline_sentences import LEAST, MATTERS, statements
from kinetostat.studies.guidelines import Guidelines, Move, Roles
from kinetostat.studies.sensitivity import PER, Sensitivity, notes
from kinetostat.units import KINDS, RIGID
from kinetostat.views.tables import numeric_table, omitted

MOST_INFLUENCES = 40
"""Parameters that are printed; `--json` has all."""
DIGITS = 6
"""Digits of the value of a parameter, and of the coefficients of K, which are compared with those of papers."""
NEGLIGIBLE = 0.0005
"""Percent per percent below which a 0 is printed."""


def print_sensitivity(console: Console, sensitivity: Sensitivity) -> None:
    """Print the parameters with the largest effect, and what the numbers mean."""
    console.print(influence_table(sensitivity, MOST_INFLUENCES))
    hidden = len(sensitivity.parameters) - MOST_INFLUENCES
    if hidden > 0:
        console.print(f"{omitted(hidden)} (--json has all).")
    for note in notes(sensitivity):
        console.print(note, highlight=False)


def influence_table(sensitivity: Sensitivity, count: int) -> Table:
    """Return the first parameters by rank, with their values and their effect on each index."""
    group = group_of(sensitivity.quantities)
    heads = [spoken(name.removeprefix(f"{group}_")) for name in sensitivity.quantities]
    title = f"{sensitivity.machine.name}: {spoken(group)}, {PER}" if group else f"{sensitivity.machine.name}: {PER}"
    table = numeric_table(title, "parameter", ["value", *heads])
    for influence in sensitivity.parameters[:count]:
        name = with_leg(sensitivity.machine, influence.path)
        table.add_row(
            name,
            sensitivity.machine.display.show(influence.value, KINDS[influence.kind].unit, RIGID, DIGITS),
            *(_percent(percent) for percent in influence.percents),
        )
    return table


def _percent(value: float | None) -> str:
    """Return a number with three decimals, or a dash where there is none."""
    if value is None:
        return "–"
    return "0" if abs(value) < NEGLIGIBLE else f"{value:.3f}"


TOPICS = {
    "compliance": "What each direction depends on",
    "weakest": "Where more stiffness helps most",
    "rigid": "What counts as rigid, within 1 %",
    "design": "What each parameter does",
}
MOST = 0.5
"""Share from which an element is printed in bold."""
MOST_ROWS = 16
"""Parameters that are printed; all of them on demand."""
MOST_NAMED = 8
LEGEND = "· any stiffness suffices; never: nothing else is compliant in that direction."
"""Legend of the table of limits."""
ALIKE = "poses: share of the poses at which all arrows of the row point the same way as here."
"""Legend of the table of parameters."""


def print_guidelines(console: Console, guidelines: Guidelines, full: bool = False) -> None:
    """Print sentences and tables; if `full`, every parameter and sentences on the most important ones."""
    console.print(Text.assemble((guidelines.machine.name, "bold"), "  design guidelines"))
    answered, poses = guidelines.poses
    about = f"Directions {' '.join(guidelines.components)} (base axes): deflection under a load in the same direction."
    if poses:
        about += f" Over {', '.join(guidelines.ranges)}: {answered:,} of {poses:,} poses have a result."
    console.print(about, style="dim", highlight=False)
    if guidelines.here is None:
        return
    _print_sentences(console, guidelines, full)
    _print_equations(console, guidelines)
    if guidelines.elements:
        console.print(element_table(guidelines, guidelines.here))
        console.print(limit_table(guidelines, guidelines.here))
        console.print(f"{LEGEND}\n", style="dim")
    _print_moves(console, guidelines, full)


def _print_sentences(console: Console, guidelines: Guidelines, full: bool) -> None:
    sentences = statements(guidelines)
    for topic, title in TOPICS.items():
        selected = [statement for statement in sentences if statement.topic == topic]
        if selected and (full or topic != "design"):
            console.print(Text(f"\n{title}", "bold"))
            for statement in selected:
                aside = "" if statement.holds is None else f" [{over_poses(statement.holds)}]"
                console.print(Padding(Text.assemble(f"- {statement.text}", (aside, "dim")), (0, 0, 0, 1)))
    console.print()


def over_poses(share: float) -> str:
    """Say at how many poses a statement is true."""
    return "everywhere" if share == 1.0 else f"at {100 * share:.3g} % of the poses"


def _print_equations(console: Console, guidelines: Guidelines) -> None:
    """Print K as sums over elements, in the form of the paper's equations 33-38."""
    if guidelines.stiffness_equations is None:
        return
    console.print(
        Text.assemble(
            ("K at this pose", "bold"), " as a sum over elements; k is the stiffness of one part of the element (SI)"
        )
    )
    for line in equations(guidelines):
        console.print(f"  {line}", highlight=False)
    console.print()


def equations(guidelines: Guidelines) -> list[str]:
    """Return the diagonal of K as sums over elements, a line each; no lines where K is not such a sum."""
    rows = (guidelines.stiffness_equations or {}).items()
    sums = [
        " + ".join(f"{number(row[i], digits=DIGITS)} k({element})" for element, row in rows if row[i] != 0.0)
        for i in range(len(guidelines.components))
    ]
    return (
        [f"K_{name} = {terms or '0'}" for name, terms in zip(guidelines.components, sums, strict=True)] if rows else []
    )


def element_table(guidelines: Guidelines, here: Roles) -> Table:
    """Return the share of each element in the compliance of each direction."""
    table = numeric_table("Attribution: share of each element in the diagonal of C", "element", guidelines.components)
    for element, row in zip(guidelines.elements, here.shares[:, :, 0].tolist(), strict=True):
        table.add_row(element.name, *(_share(part) for part in row))
    return table


def _share(part: float) -> Text:
    if math.isnan(part) or part == 0.0:
        return Text("–" if part else "·")
    return Text(f"{100 * part:.1f} %", "bold" if part >= MOST else "" if part >= MATTERS else "dim")


def limit_table(guidelines: Guidelines, here: Roles) -> Table:
    """Return the stiffness from which each element counts as rigid.

    An element with several stiffnesses has no single value: its limits are multiples of the present stiffness.
    """
    table = numeric_table(
        "Stiffness from which an element counts as rigid (within 1 %)", "element", ["now", *guidelines.components]
    )
    for k, element in enumerate(guidelines.elements):
        row = here.rigid[k, :, 0].tolist()
        scale = guidelines.machine.display.scale(element.unit)
        if element.stiffness is None:
            table.add_row(element.name, "1 × now", *(_limit(factor) for factor in row))
        else:
            rigid = element.stiffness == math.inf
            present = 1.0 if rigid else element.stiffness
            now = f"rigid ({scale.unit})" if rigid else f"{_limit(element.stiffness * scale.factor)} {scale.unit}"
            table.add_row(element.name, now, *(_limit(factor * present * scale.factor) for factor in row))
    return table


def _limit(value: float) -> str:
    """Return a limit in at most five characters."""
    if math.isnan(value):
        return "–"
    if value == 0.0 or math.isinf(value):
        return "·" if value == 0.0 else "never"
    text = f"{value:.2g}" if value >= 1000.0 else f"{value:.3g}"
    return text.replace("e+0", "e").replace("e+", "e").replace("e-0", "e-")


def _print_moves(console: Console, guidelines: Guidelines, full: bool) -> None:
    shown = guidelines.parameters if full else guidelines.parameters[:MOST_ROWS]
    console.print(move_table(guidelines, len(shown)))
    if guidelines.poses[0]:
        console.print(ALIKE, style="dim")
    console.print(guidelines.meaning, highlight=False, style="dim")
    for line in left_out(guidelines, len(shown)):
        console.print(line, highlight=False)


def move_table(guidelines: Guidelines, count: int) -> Table:
    """Return the effect of the first parameters on each direction."""
    grid = bool(guidelines.poses[0])
    heads = ["parameter", *guidelines.components, *(["poses"] if grid else [])]
    title = "Effect of 1 % more (of an angle: 0.01 rad more), percent stiffer ▲ or softer ▼"
    table = numeric_table(title, heads[0], heads[1:])
    for move in guidelines.parameters[:count]:
        table.add_row(
            with_leg(guidelines.machine, move.path),
            *(_arrow(p) for p in move.percents),
            *([_alike(move)] if grid else []),
        )
    return table


def left_out(guidelines: Guidelines, count: int) -> Iterator[str]:
    """Write sentences on the parameters that the table omits, and why."""
    hidden = len(guidelines.parameters) - count
    if hidden:
        yield f"{omitted(hidden)} (--full shows them)."
    if guidelines.without_influence:
        yield f"No direction depends on {_few(guidelines.without_influence)}."
    for reason in dict.fromkeys(why for _, why in guidelines.left_out):
        paths = [path for path, why in guidelines.left_out if why == reason]
        yield f"Omitted {reason}: {_few(paths)}."


def _few(paths: tuple[str, ...] | list[str]) -> str:
    more = f" and {len(paths) - MOST_NAMED} more" if len(paths) > MOST_NAMED else ""
    return ", ".join(paths[:MOST_NAMED]) + more


def _arrow(percent: float | None) -> Text:
    if percent is None or abs(percent) < LEAST:
        return Text("–" if percent is None else "·")
    size = f"{abs(percent):.2f}" if abs(percent) < 1.0 else f"{abs(percent):.2g}"
    return Text(f"▲{size}", "blue") if percent > 0.0 else Text(f"▼{size}", "red")


def _alike(move: Move) -> str:
    felt = [
        move.stiffer[i] if p > 0.0 else move.softer[i]
        for i, p in enumerate(move.percents)
        if p is not None and abs(p) >= LEAST
    ]
    least = min(felt, default=1.0)
    return "all" if least == 1.0 else f"{100 * least:.0f} %"
