"""Tables of what parameters do to the stiffness: sensitivities and design guidelines.

Only rounding is computed here.
"""

import math
from collections.abc import Iterator

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from kinetostat.machine.parameters import with_leg
from kinetostat.studies.guidelines.guidelines import Guidelines
from kinetostat.studies.guidelines.moves import Move
from kinetostat.studies.guidelines.roles import Roles
from kinetostat.studies.guidelines.sentences import LEAST, MATTERS, statements
from kinetostat.studies.sensitivity import PER, Sensitivity, notes
from kinetostat.units import KINDS, show
from kinetostat.views.display import family_of_names, spoken
from kinetostat.views.tables import number, numeric_table, omitted

MOST_INFLUENCES = 40
"""Parameters that are printed; `--json` has all."""
NEGLIGIBLE = 0.0005
"""Percent per percent below which a 0 is printed."""


def print_sensitivity(console: Console, answer: Sensitivity) -> None:
    """The parameters that matter most, and what the numbers mean."""
    console.print(influence_table(answer, MOST_INFLUENCES))
    hidden = len(answer.parameters) - MOST_INFLUENCES
    if hidden > 0:
        console.print(f"{omitted(hidden)} (--json has all).")
    for note in notes(answer):
        console.print(note, highlight=False)


def influence_table(answer: Sensitivity, count: int) -> Table:
    """The first parameters by rank, with their values and what they do to each index."""
    group = family_of_names(answer.quantities)
    heads = [spoken(name.removeprefix(f"{group}_")) for name in answer.quantities]
    title = f"{answer.machine.name}: {spoken(group)}, {PER}" if group else f"{answer.machine.name}: {PER}"
    table = numeric_table(title, "parameter", ["value", *heads])
    for one in answer.parameters[:count]:
        name = with_leg(answer.machine, one.path)
        table.add_row(name, show(one.value, KINDS[one.kind].unit, 6), *(_percent(percent) for percent in one.percents))
    return table


def _percent(value: float | None) -> str:
    """Three digits after the point, a dash where there is none."""
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
"""Share from which on an element is printed in bold."""
MOST_ROWS = 16
"""Parameters that are printed; all of them on demand."""
MOST_NAMED = 8
LEGEND = "· any stiffness suffices; never: nothing else is compliant in that direction."
"""Of the table of limits."""
ALIKE = "poses: share of the poses at which all arrows of the row point the same way as here."
"""Of the table of parameters."""


def print_guidelines(console: Console, found: Guidelines, full: bool = False) -> None:
    """Sentences and tables; every parameter, and a sentence for those that matter most, if `full`."""
    console.print(Text.assemble((found.machine.name, "bold"), "  design guidelines"))
    answered, poses = found.poses
    about = f"Directions {' '.join(found.components)} (base axes): deflection under a load in the same direction."
    if poses:
        about += f" Over {', '.join(found.ranges)}: {answered:,} of {poses:,} poses have a result."
    console.print(about, style="dim", highlight=False)
    if found.here is None:
        return
    _print_sentences(console, found, full)
    _print_equations(console, found)
    console.print(element_table(found, found.here))
    console.print(limit_table(found, found.here))
    console.print(f"{LEGEND}\n", style="dim")
    _print_moves(console, found, full)


def _print_sentences(console: Console, found: Guidelines, full: bool) -> None:
    said = statements(found)
    for topic, title in TOPICS.items():
        own = [one for one in said if one.topic == topic]
        if own and (full or topic != "design"):
            console.print(Text(f"\n{title}", "bold"))
            for one in own:
                aside = "" if one.holds is None else f" [{over_poses(one.holds)}]"
                console.print(Padding(Text.assemble(f"- {one.text}", (aside, "dim")), (0, 0, 0, 1)))
    console.print()


def over_poses(share: float) -> str:
    """At how many poses something holds."""
    return "everywhere" if share == 1.0 else f"at {100 * share:.3g} % of the poses"


def _print_equations(console: Console, found: Guidelines) -> None:
    """K as sums over elements, as the paper's equations 33-38."""
    if found.stiffness_equations is None:
        return
    console.print(
        Text.assemble(
            ("K at this pose", "bold"), " as a sum over elements; k is the stiffness of one part of the element (SI)"
        )
    )
    for line in equations(found):
        console.print(f"  {line}", highlight=False)
    console.print()


def equations(found: Guidelines) -> list[str]:
    """The diagonal of K as sums over elements, a line each; none where K is no such sum."""
    rows = (found.stiffness_equations or {}).items()
    sums = [
        " + ".join(f"{number(row[i])} k({element})" for element, row in rows if row[i] != 0.0)
        for i in range(len(found.components))
    ]
    return [f"K_{name} = {terms or '0'}" for name, terms in zip(found.components, sums, strict=True)] if rows else []


def element_table(found: Guidelines, here: Roles) -> Table:
    """What each element contributes to each direction."""
    table = numeric_table("Attribution: share of each element in the diagonal of C", "element", found.components)
    for element, row in zip(found.elements, here.shares[:, :, 0].tolist(), strict=True):
        table.add_row(element.name, *(_share(part) for part in row))
    return table


def _share(part: float) -> Text:
    if math.isnan(part) or part == 0.0:
        return Text("–" if part else "·")
    return Text(f"{100 * part:.1f} %", "bold" if part >= MOST else "" if part >= MATTERS else "dim")


def limit_table(found: Guidelines, here: Roles) -> Table:
    """From which stiffness on each element counts as rigid: absolute where it has one stiffness, else relative."""
    table = numeric_table(
        "Stiffness from which an element counts as rigid (within 1 %)", "element", ["now", *found.components]
    )
    for k, element in enumerate(found.elements):
        row = here.rigid[k, :, 0].tolist()
        if element.stiffness is None:
            table.add_row(element.name, "1 × now", *(_limit(factor) for factor in row))
        else:
            rigid = element.stiffness == math.inf
            own = 1.0 if rigid else element.stiffness
            now = "rigid" if rigid else f"{_limit(element.stiffness)} {element.unit}"
            table.add_row(element.name, now, *(_limit(factor * own) for factor in row))
    return table


def _limit(value: float) -> str:
    """A limit in at most five characters."""
    if math.isnan(value):
        return "–"
    if value == 0.0 or math.isinf(value):
        return "·" if value == 0.0 else "never"
    text = f"{value:.2g}" if value >= 1000.0 else f"{value:.3g}"
    return text.replace("e+0", "e").replace("e+", "e").replace("e-0", "e-")


def _print_moves(console: Console, found: Guidelines, full: bool) -> None:
    shown = found.parameters if full else found.parameters[:MOST_ROWS]
    console.print(move_table(found, len(shown)))
    if found.poses[0]:
        console.print(ALIKE, style="dim")
    console.print(found.meaning, highlight=False, style="dim")
    for line in left_out(found, len(shown)):
        console.print(line, highlight=False)


def move_table(found: Guidelines, count: int) -> Table:
    """What each of the first parameters does to each direction."""
    grid = bool(found.poses[0])
    heads = ["parameter", *found.components, *(["poses"] if grid else [])]
    title = "Effect of 1 % more (of an angle: 0.01 rad more), percent stiffer ▲ or softer ▼"
    table = numeric_table(title, heads[0], heads[1:])
    for move in found.parameters[:count]:
        table.add_row(
            with_leg(found.machine, move.path), *(_arrow(p) for p in move.percents), *([_alike(move)] if grid else [])
        )
    return table


def left_out(found: Guidelines, count: int) -> Iterator[str]:
    """What the table of the first parameters does not show, in sentences."""
    hidden = len(found.parameters) - count
    if hidden:
        yield f"{omitted(hidden)} (--full shows them)."
    if found.without_influence:
        yield f"No direction depends on {_few(found.without_influence)}."
    for reason in dict.fromkeys(why for _, why in found.left_out):
        paths = [path for path, why in found.left_out if why == reason]
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
