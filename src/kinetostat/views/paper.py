"""The reproduction of the paper on the terminal and in files: tables (CSV, JSON), figures and an HTML page.

The page stands alone: no script, no request, pictures inside. Numbers and verdicts come from `studies.reproduction`.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, astuple, fields
from functools import partial
from html import escape
from importlib.metadata import version
from itertools import groupby
from operator import attrgetter
from pathlib import Path

from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.spec.installation import command, start_command
from kinetostat.studies import printed_numbers
from kinetostat.studies.printed_equations import EquationCheck
from kinetostat.studies.printed_numbers import PaperNumber, PrintVerdict
from kinetostat.studies.reproduction import Claim, Finding, Reproduction
from kinetostat.studies.storage import write_text
from kinetostat.views.answers import write_files
from kinetostat.views.data_forms import csv_text
from kinetostat.views.drawing import three_views
from kinetostat.views.figures import Tell, as_svg, save
from kinetostat.views.grid_figures import contour_maps, grid_curves
from kinetostat.views.optimisation import designs_dataset
from kinetostat.views.optimisation_figures import convergence
from kinetostat.views.page import Markup, figure, table, whole_page
from kinetostat.views.question import Description, Drawing, Field, Lines
from kinetostat.views.tables import print_answer, text_table

FIGURE_4 = "Fig. 4: stiffness against the stiffness of the passive links"
FIGURE_5 = "Fig. 5: compliance at z = 68 cm, theta5 = -60 deg, theta6 = 120 deg"
FIGURE_6 = "Fig. 6: the best design and the mean of the population"
MACHINE_TITLE = "The machine at its reference pose"

VERDICT_MARKS = {
    PrintVerdict.EQUAL: "good",
    PrintVerdict.MISPRINT: "note",
    PrintVerdict.DIFFERS: "bad",
    Finding.HOLDS: "good",
    Finding.PARTLY: "note",
    Finding.FAILS: "bad",
}
"""Classes of the style by verdict."""
COUNTS = ("no", "one", "two", "three", "four", "five", "six")
"""Words for the numbers of misprints; greater ones are written in digits."""
PAPER_STYLE = """
.tiles { display: flex; flex-wrap: wrap; gap: .8rem; margin: 1.4rem 0; }
.tile { border: 1px solid var(--line); border-radius: .5rem; padding: .6rem .9rem; }
.tile b { display: block; font-size: 1.6rem; line-height: 1.2; }
.mark { border-radius: .3rem; padding: .05rem .45rem; font-size: .85rem; white-space: nowrap; }
.good { background: #dff3e4; color: #14532d; } .note { background: #fdf0cf; color: #6b4400; }
.bad { background: #fde0df; color: #7f1d1d; }
dl dt { font-weight: 600; margin-top: 1rem; } dl dd { margin: .15rem 0 0 0; max-width: 46rem; }
"""

CAPTIONS = {
    "machine": "Four U-P-S legs (blue, thick: cylinder) and the passive leg (orange) that leaves four freedoms. The "
    "text from which this program was made has no figures; the geometry is a reconstruction that the printed numbers "
    "determine completely.",
    "figure-4": "K_rz and K_y grow with the passive links; the other four do not depend on them at this pose.",
    "figure-5": "The paper's cut through the workspace. The machine itself cannot move along y: there, y shifts the "
    "plane of its passive leg, and the platform with it.",
    "figure-6": "The paper's search again, with other random numbers. The right panel shows how far "
    "best and mean still are from the last best.",
}


def write_all(
    reproduction: Reproduction, folder: Path, formats: Sequence[str] = ("png",), tell: Tell | None = None
) -> list[Path]:
    """Write tables, data, figures and the page into a folder.

    Args:
        reproduction: the recomputed paper.
        folder: the folder of the files.
        formats: the formats of the figures, some of `views.figures.FORMATS`.
        tell: called before each figure with how many are done, how many there are, and which one comes next.

    Returns:
        What was written, the page first.
    """
    drawn = {name: drawing() for name, drawing in figures(reproduction).items()}
    written = [folder / "index.html"]
    write_text(written[0], page(reproduction, drawn))
    written += write_files(REPRODUCTION, reproduction, folder)
    return written + save({name: partial(drawn.__getitem__, name) for name in drawn}, folder, formats, tell)


def figures(reproduction: Reproduction) -> dict[str, Drawing]:
    """Return the figures by file name."""
    # The offset of the passive leg is the coordinate y of the paper's figure.
    maps = reproduction.maps.rename({"geometry_passive_leg_offset": "y"})
    maps = maps.assign_coords(y=maps["y"].assign_attrs(field="pose.y"))
    draw = {
        "machine": partial(three_views, reproduction.machine, title=MACHINE_TITLE),
        "figure-4": partial(grid_curves, reproduction.curves, GROUPS["stiffness"], title=FIGURE_4),
        "figure-5": partial(contour_maps, maps, GROUPS["compliance"], title=FIGURE_5),
        "figure-6": partial(convergence, reproduction.search.log, title=FIGURE_6),
    }
    return {name: Drawing(CAPTIONS[name], function) for name, function in draw.items()}


def print_summary(console: Console, reproduction: Reproduction, written: Sequence[Path], full: bool = False) -> None:
    """Print the reproduction, where its files are, and what to try next; every number and statement if `full`."""
    print_answer(console, REPRODUCTION, reproduction, full)
    hint = "" if full else "; --full prints every number, equation and statement"
    console.print(f"wrote {written[0]} and {len(written) - 1} more files beside it{hint}", highlight=False)
    console.print("next:", highlight=False)
    for line in (f"{command()} analyze tripteron", start_command("studio", "studio")):
        console.print(f"  {line}", highlight=False, soft_wrap=True)


def _lines(reproduction: Reproduction) -> Lines:
    yield "Verdict", verdict(reproduction)
    for line in misprints(reproduction):
        yield "Misprint", line


def _tables(reproduction: Reproduction, full: bool) -> Iterator[Table | str]:
    """Give the numbers that differ; if `full`, every number next to the printed one, then equations and statements."""
    if not full:
        differing = [number for number in reproduction.comparisons if number.verdict is PrintVerdict.DIFFERS]
        if differing:
            yield _numbers_table(differing)
        return
    yield _numbers_table(reproduction.comparisons)
    equations = text_table(
        "Equations 1-32: matrices of the paper against those of kinetostat", "eq.", "statement", "residual", ""
    )
    for check in reproduction.checks:
        equations.add_row(
            check.equation, check.statement, f"{check.residual:.1e}", "holds" if check.holds else Text("FAILS", "red")
        )
    yield equations
    for claim in reproduction.all_claims:
        yield f"{claim.place}  {claim.finding.value}\n  {claim.statement}\n  {claim.measured} {claim.limits}"


def verdict(reproduction: Reproduction) -> str:
    """Return a sentence with the counts of numbers, equations and statements."""
    numbers = reproduction.verdicts
    holding = sum(check.holds for check in reproduction.checks)
    findings = ", ".join(
        f"{count} {in_number(finding.value, count)}" for finding, count in reproduction.findings.items()
    )
    return (
        f"{len(reproduction.comparisons)} numbers: {numbers[PrintVerdict.EQUAL]} equal to print, "
        f"{numbers[PrintVerdict.MISPRINT]} known misprints, {numbers[PrintVerdict.DIFFERS]} differ. "
        f"{len(reproduction.checks)} groups of equations: {holding} hold. "
        f"{len(reproduction.all_claims)} statements: {findings}."
    )


def in_number(finding: str, count: int) -> str:
    """Put a finding such as "holds in part" into the plural where it is about several statements."""
    verb, space, rest = finding.partition(" ")
    return (verb if count == 1 else verb.removesuffix("s")) + space + rest


def _numbers_table(comparisons: Sequence[PaperNumber]) -> Table:
    rows = text_table("Numbers", "place", "", "printed", "computed", "unit", "verdict")
    place = ""
    shown = {
        PrintVerdict.EQUAL: Text("equal"),
        PrintVerdict.MISPRINT: Text("misprint", "yellow"),
        PrintVerdict.DIFFERS: Text("DIFFERS", "red"),
    }
    for each in comparisons:
        head, place = "" if each.place == place else each.place, each.place
        rows.add_row(head, each.component, each.printed, f"{each.computed:.7g}", each.unit, shown[each.verdict])
    return rows


def _csv(rows: Sequence[PaperNumber | EquationCheck | Claim]) -> str:
    return csv_text([field.name for field in fields(rows[0])], map(astuple, rows))


REPRODUCTION = Description(
    title="The paper",
    fields=(
        Field("paper", lambda _reproduction: printed_numbers.CITATION),
        Field("explained"),
        Field("comparisons"),
        Field("equations", lambda answer: [asdict(check) | {"holds": check.holds} for check in answer.checks]),
        Field("statements", "claims"),
        Field("optimisation", "search_claims"),
        Field("typography", lambda _reproduction: list(printed_numbers.TYPOGRAPHY)),
    ),
    lines=_lines,
    tables=_tables,
    figures=figures,
    state=lambda answer: "explained" if answer.explained else "NOT explained",
    files={
        "reproduction.json": "json",
        "numbers.csv": lambda answer: _csv(answer.comparisons),
        "equations.csv": lambda answer: _csv(answer.checks),
        "statements.csv": lambda answer: _csv(answer.claims),
        "search.csv": lambda answer: _csv(answer.search_claims),
        "figure-6.nc": lambda answer: designs_dataset(answer.search),
        "figure-4.nc": attrgetter("curves"),
        "figure-5.nc": attrgetter("maps"),
    },
)


def page(reproduction: Reproduction, drawn: Mapping[str, Figure]) -> str:
    """Return the page.

    Args:
        reproduction: the recomputed paper.
        drawn: the figures by name; each name has a caption in `CAPTIONS`.
    """
    pictures = {name: figure(as_svg(picture), CAPTIONS[name]) for name, picture in drawn.items()}
    body = [
        "<h1>Zhang and Gosselin's machine, reproduced</h1>",
        '<p class="soft">' + escape(printed_numbers.CITATION) + ", "
        f"compared with the results of kinetostat {escape(version('kinetostat'))}. "
        "Order of components: rx ry rz x y z; SI units, base axes, at the platform point P.</p>",
        _tiles(reproduction),
        "<h2>The machine</h2>",
        pictures["machine"],
        "<h2>Numbers</h2>",
        "<p>A number is equal to print if it rounds to the digits that are printed. A misprint is listed only where "
        "the corrected digits are reached, with the reason.</p>",
        *(f"<p>{escape(line)}</p>" for line in misprints(reproduction)),
        *_numbers(reproduction.comparisons),
        "<h2>Equations 1 to 32</h2>",
        _equations(reproduction),
        "<h2>Stiffness against link stiffness</h2>",
        pictures["figure-4"],
        "<h2>Compliance over the workspace</h2>",
        pictures["figure-5"],
        "<h2>Design guidelines and further facts, tested</h2>",
        _statements(reproduction.claims),
        "<h2>Optimisation</h2>",
        _statements(reproduction.search_claims),
        pictures["figure-6"],
        "<h2>Slips of typography</h2>",
        f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in printed_numbers.TYPOGRAPHY)}</ul>",
    ]
    return whole_page("Zhang and Gosselin's machine, reproduced by kinetostat", PAPER_STYLE, body)


def misprints(reproduction: Reproduction) -> Iterator[str]:
    """Write a sentence on the misprints of each place of the paper: what is printed, what it should say, and why."""
    wrong_numbers = [number for number in reproduction.comparisons if number.verdict is PrintVerdict.MISPRINT]
    for place, group in groupby(wrong_numbers, key=attrgetter("place")):
        failures = list(group)
        pairs = [
            f"{_symbol(place, each.component)} {each.printed} should read "
            f"{printed_numbers.ERRATA[place, each.component].corrected}"
            for each in failures
        ]
        count = COUNTS[len(failures)] if len(failures) < len(COUNTS) else str(len(failures))
        are = "number is a misprint" if len(failures) == 1 else "numbers are misprints"
        reason = printed_numbers.ERRATA[place, failures[0].component].reason
        yield f"{place}: {count} {are} of the paper. {'; '.join(pairs)}. Reason: {reason}."


def _symbol(place: str, component: str) -> str:
    """Return the symbol of a number of the paper's tables: C_rx in Table III, K_rx in Table IV."""
    letter = {"Table III": "C_", "Table IV": "K_"}.get(place.partition(",")[0], "")
    return component if "/" in component else f"{letter}{component}"


def _tiles(reproduction: Reproduction) -> str:
    numbers, findings = reproduction.verdicts, reproduction.findings
    holding = sum(check.holds for check in reproduction.checks)
    tiles = [
        (numbers[PrintVerdict.EQUAL], "numbers equal to print"),
        (numbers[PrintVerdict.MISPRINT], "known misprints"),
        (numbers[PrintVerdict.DIFFERS], "numbers differ"),
        (f"{holding} of {len(reproduction.checks)}", "groups of equations hold"),
        (f"{findings[Finding.HOLDS]} + {findings[Finding.PARTLY]}", "statements hold + in part"),
    ]
    cells = "".join(f'<div class="tile"><b>{count}</b>{escape(text)}</div>' for count, text in tiles)
    return f'<div class="tiles">{cells}</div>'


def _numbers(comparisons: Sequence[PaperNumber]) -> Iterable[str]:
    titles = {"Table": "Tables III and IV", "Eq.": "Equations 33 to 38", "Section": "Designs of section 4.3"}
    heads = ("place", "quantity", "printed", "computed", "unit", "verdict")
    for head, group in groupby(comparisons, key=lambda comparison: comparison.place.split(" ")[0]):
        rows = []
        for place, members in groupby(group, key=attrgetter("place")):
            rows += [_number_row(member, "" if i else place) for i, member in enumerate(members)]
        yield table(titles[head], heads, rows, (False, False, True, True, False, False))


def _number_row(comparison: PaperNumber, place: str) -> tuple[str, ...]:
    mark = Markup(_mark(comparison.verdict) + (f" {escape(comparison.reason)}" if comparison.reason else ""))
    return place, comparison.component, comparison.printed, f"{comparison.computed:.9g}", comparison.unit, mark


def _equations(reproduction: Reproduction) -> str:
    rows = [
        (
            check.equation,
            check.statement,
            f"{check.residual:.1e}",
            f"{check.tolerance:.0e}",
            _mark(Finding.HOLDS if check.holds else Finding.FAILS),
        )
        for check in reproduction.checks
    ]
    heads = ("equation", "statement", "residual", "tolerance", "verdict")
    return table(
        "The paper's matrices A, B, J and J' against legs as (W, G)", heads, rows, (False, False, True, True, False)
    )


def _statements(claims: Sequence[Claim]) -> str:
    entries = [
        f"<dt>{escape(claim.place)} {_mark(claim.finding)}</dt><dd>{escape(claim.statement)}</dd>"
        f'<dd class="soft">{escape(claim.measured)} {escape(claim.limits)}</dd>'
        for claim in claims
    ]
    return f"<dl>{''.join(entries)}</dl>"


def _mark(finding: PrintVerdict | Finding) -> Markup:
    return Markup(f'<span class="mark {VERDICT_MARKS[finding]}">{escape(finding.value)}</span>')
