"""The reproduction of the paper as people see it: terminal, tables (CSV, JSON), figures and one HTML page."""

import csv
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console
from rich.text import Text

from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.studies.optimisation.result_data import as_dataset
from kinetostat.studies.paper.claims import Claim
from kinetostat.studies.paper.comparison import Comparison, Verdict
from kinetostat.studies.paper.derivation import Check
from kinetostat.studies.paper.reproduction import Reproduction
from kinetostat.studies.storage import write_dataset, write_json, write_text
from kinetostat.views.drawing import three_views
from kinetostat.views.figures import contour_maps, curves, save
from kinetostat.views.optimisation_figures import convergence
from kinetostat.views.paper_page import page
from kinetostat.views.tables import text_table

FIGURE_4 = "Fig. 4: stiffness against the stiffness of the passive links"
FIGURE_5 = "Fig. 5: compliance at z = 68 cm, theta5 = -60 deg, theta6 = 120 deg"
FIGURE_6 = "Fig. 6: the best design and the mean of the population"
MACHINE = "The machine at its reference pose"


def write_all(found: Reproduction, folder: Path) -> list[Path]:
    """Write tables, data, figures and the page into a folder.

    Returns:
        What was written, the page first.
    """
    drawn = figures(found)
    written = [folder / "index.html"]
    write_text(written[0], page(found, drawn))
    written.append(folder / "reproduction.json")
    write_json(written[-1], found.as_json())
    for name, rows in (
        ("numbers", found.comparisons),
        ("equations", found.checks),
        ("statements", found.claims),
        ("search", found.search_claims),
    ):
        written.append(folder / f"{name}.csv")
        write_text(written[-1], _csv(rows))
    written.append(folder / "figure-6.nc")
    write_dataset(written[-1], as_dataset(found.search))
    for name, dataset in (("figure-4", found.curves), ("figure-5", found.maps)):
        written.append(folder / f"{name}.nc")
        write_dataset(written[-1], dataset)
    for name, figure in drawn.items():
        written += save(figure, folder / name)
    return written


def figures(found: Reproduction) -> dict[str, Figure]:
    """The figures by file name."""
    section = found.maps.rename({"geometry.passive_leg_offset": "pose.y"})
    return {
        "machine": three_views(found.machine, MACHINE),
        "figure-4": curves(found.curves, GROUPS["stiffness"], FIGURE_4),
        "figure-5": contour_maps(section, GROUPS["compliance"], FIGURE_5),
        "figure-6": convergence(found.search.log, FIGURE_6),
    }


def print_summary(console: Console, found: Reproduction, written: Sequence[Path]) -> None:
    """Every number beside the printed one, then equations, statements and the verdict."""
    console.print(_numbers_table(found.comparisons))
    equations = text_table(
        "Equations 1-32: matrices of the paper against those of kinetostat", "eq.", "statement", "residual", ""
    )
    for check in found.checks:
        equations.add_row(
            check.equation, check.statement, f"{check.residual:.1e}", "holds" if check.holds else Text("FAILS", "red")
        )
    console.print(equations)
    for claim in (*found.claims, *found.search_claims):
        console.print(Text.assemble((claim.place, "bold"), f"  {claim.finding.value}"))
        console.print(f"  {claim.statement}", highlight=False)
        console.print(f"  {claim.measured} {claim.limits}", highlight=False, style="dim")
    console.print()
    console.print(verdict(found), style="bold green" if found.explained else "bold red", highlight=False)
    console.print(f"wrote {written[0]} and {len(written) - 1} more files beside it", highlight=False)


def verdict(found: Reproduction) -> str:
    """One sentence that counts."""
    numbers = Counter(one.verdict for one in found.comparisons)
    claims = (*found.claims, *found.search_claims)
    statements = Counter(claim.finding.value for claim in claims)
    holding = sum(check.holds for check in found.checks)
    findings = ", ".join(f"{count} {held(word, count)}" for word, count in statements.items())
    return (
        f"{len(found.comparisons)} numbers: {numbers[Verdict.EQUAL]} equal to print, {numbers[Verdict.MISPRINT]} known "
        f"misprints, {numbers[Verdict.DIFFERS]} differ. {len(found.checks)} groups of equations: {holding} hold. "
        f"{len(claims)} statements: {findings}."
    )


def held(finding: str, count: int) -> str:
    """What so many statements do, from what one does: it holds, they hold."""
    verb, space, rest = finding.partition(" ")
    return (verb if count == 1 else verb.removesuffix("s")) + space + rest


def _numbers_table(comparisons: Sequence[Comparison]) -> Any:
    table = text_table("Numbers", "place", "", "printed", "computed", "unit", "verdict")
    place = ""
    shown = {
        Verdict.EQUAL: Text("equal"),
        Verdict.MISPRINT: Text("misprint", "yellow"),
        Verdict.DIFFERS: Text("DIFFERS", "red"),
    }
    for one in comparisons:
        head = "" if one.place == place else one.place
        place = one.place
        table.add_row(head, one.component, one.printed, f"{one.computed:.7g}", one.unit, shown[one.verdict])
    return table


def _csv(rows: Sequence[Comparison | Check | Claim]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.name for field in fields(rows[0])])
    writer.writerows(astuple(row) for row in rows)
    return text.getvalue()
