"""The reproduction of the paper on the terminal and in files: tables (CSV, JSON), figures and an HTML page.

Numbers and verdicts come from `studies.paper`; the page itself is written in `paper_page`.
"""

import csv
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import astuple, fields
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console
from rich.text import Text

from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.spec.installation import command, starting
from kinetostat.studies.optimisation.result_data import as_dataset
from kinetostat.studies.paper.claims import Claim
from kinetostat.studies.paper.comparison import Comparison, Verdict
from kinetostat.studies.paper.derivation import Check
from kinetostat.studies.paper.reproduction import Reproduction
from kinetostat.studies.storage import write_dataset, write_json, write_text
from kinetostat.views.drawing import three_views
from kinetostat.views.figures import Tell, contour_maps, curves, save
from kinetostat.views.optimisation_figures import convergence
from kinetostat.views.paper_page import misprints, page
from kinetostat.views.tables import text_table

FIGURE_4 = "Fig. 4: stiffness against the stiffness of the passive links"
FIGURE_5 = "Fig. 5: compliance at z = 68 cm, theta5 = -60 deg, theta6 = 120 deg"
FIGURE_6 = "Fig. 6: the best design and the mean of the population"
MACHINE = "The machine at its reference pose"


def write_all(
    reproduction: Reproduction, folder: Path, formats: Sequence[str] = ("png",), tell: Tell | None = None
) -> list[Path]:
    """Write tables, data, figures and the page into a folder.

    Args:
        reproduction: what was recomputed.
        folder: for the files.
        formats: of the figures, of `views.figures.FORMATS`.
        tell: called before each figure with how many are done, how many there are, and which one comes next.

    Returns:
        What was written, the page first.
    """
    drawn = figures(reproduction)
    written = [folder / "index.html"]
    write_text(written[0], page(reproduction, drawn))
    written.append(folder / "reproduction.json")
    write_json(written[-1], reproduction.as_json())
    for name, rows in (
        ("numbers", reproduction.comparisons),
        ("equations", reproduction.checks),
        ("statements", reproduction.claims),
        ("search", reproduction.search_claims),
    ):
        written.append(folder / f"{name}.csv")
        write_text(written[-1], _csv(rows))
    written.append(folder / "figure-6.nc")
    write_dataset(written[-1], as_dataset(reproduction.search))
    for name, dataset in (("figure-4", reproduction.curves), ("figure-5", reproduction.maps)):
        written.append(folder / f"{name}.nc")
        write_dataset(written[-1], dataset)
    return written + save({name: partial(drawn.__getitem__, name) for name in drawn}, folder, formats, tell)


def figures(reproduction: Reproduction) -> dict[str, Figure]:
    """The figures by file name."""
    # The paper calls this offset of the passive leg y, the coordinate of its figure.
    section = reproduction.maps.rename({"geometry_passive_leg_offset": "y"})
    section = section.assign_coords(y=section["y"].assign_attrs(field="pose.y"))
    return {
        "machine": three_views(reproduction.machine, MACHINE),
        "figure-4": curves(reproduction.curves, GROUPS["stiffness"], FIGURE_4),
        "figure-5": contour_maps(section, GROUPS["compliance"], FIGURE_5),
        "figure-6": convergence(reproduction.search.log, FIGURE_6),
    }


def print_summary(console: Console, reproduction: Reproduction, written: Sequence[Path], full: bool = False) -> None:
    """Print the verdict and the misprints of the paper; every number, equation and statement if `full`."""
    console.print(verdict(reproduction), style="bold green" if reproduction.explained else "bold red", highlight=False)
    for line in misprints(reproduction):
        console.print(line, highlight=False)
    if full:
        _print_everything(console, reproduction)
    else:
        differing = [comparison for comparison in reproduction.comparisons if comparison.verdict is Verdict.DIFFERS]
        if differing:
            console.print(_numbers_table(differing))
    more = "" if full else "; --full prints every number, equation and statement"
    console.print(f"wrote {written[0]} and {len(written) - 1} more files beside it{more}", highlight=False)
    console.print("next:", highlight=False)
    for line in (f"{command()} analyze tripteron", starting("studio", "studio")):
        console.print(f"  {line}", highlight=False, soft_wrap=True)


def _print_everything(console: Console, reproduction: Reproduction) -> None:
    """Print every number next to the printed one, then equations and statements."""
    console.print(_numbers_table(reproduction.comparisons))
    equations = text_table(
        "Equations 1-32: matrices of the paper against those of kinetostat", "eq.", "statement", "residual", ""
    )
    for check in reproduction.checks:
        equations.add_row(
            check.equation, check.statement, f"{check.residual:.1e}", "holds" if check.holds else Text("FAILS", "red")
        )
    console.print(equations)
    for claim in (*reproduction.claims, *reproduction.search_claims):
        console.print(Text.assemble((claim.place, "bold"), f"  {claim.finding.value}"))
        console.print(f"  {claim.statement}", highlight=False)
        console.print(f"  {claim.measured} {claim.limits}", highlight=False, style="dim")


def verdict(reproduction: Reproduction) -> str:
    """Return a sentence with the counts of numbers, equations and statements."""
    numbers = Counter(comparison.verdict for comparison in reproduction.comparisons)
    claims = (*reproduction.claims, *reproduction.search_claims)
    statements = Counter(claim.finding.value for claim in claims)
    holding = sum(check.holds for check in reproduction.checks)
    findings = ", ".join(f"{count} {in_number(word, count)}" for word, count in statements.items())
    return (
        f"{len(reproduction.comparisons)} numbers: {numbers[Verdict.EQUAL]} equal to print, "
        f"{numbers[Verdict.MISPRINT]} known misprints, {numbers[Verdict.DIFFERS]} differ. "
        f"{len(reproduction.checks)} groups of equations: {holding} hold. "
        f"{len(claims)} statements: {findings}."
    )


def in_number(finding: str, count: int) -> str:
    """Put a finding such as "holds in part" into the plural where it is about several statements."""
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
    for comparison in comparisons:
        head = "" if comparison.place == place else comparison.place
        place = comparison.place
        table.add_row(
            head,
            comparison.component,
            comparison.printed,
            f"{comparison.computed:.7g}",
            comparison.unit,
            shown[comparison.verdict],
        )
    return table


def _csv(rows: Sequence[Comparison | Check | Claim]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.name for field in fields(rows[0])])
    writer.writerows(astuple(row) for row in rows)
    return text.getvalue()
