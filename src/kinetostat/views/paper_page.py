"""The reproduction of the paper as one self-contained HTML page: no script, no request, pictures inside."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.metadata import version
from itertools import groupby

from matplotlib.figure import Figure

from kinetostat.studies.paper import printed
from kinetostat.studies.paper.claims import Claim, Finding
from kinetostat.studies.paper.comparison import Comparison, Verdict
from kinetostat.studies.paper.reproduction import Reproduction
from kinetostat.views.figures import as_svg
from kinetostat.views.page import Markup, figure, table, whole_page

MARKS = {
    Verdict.EQUAL: "good",
    Verdict.MISPRINT: "note",
    Verdict.DIFFERS: "bad",
    Finding.HOLDS: "good",
    Finding.PARTLY: "note",
    Finding.FAILS: "bad",
}

COUNTS = ("no", "one", "two", "three", "four", "five", "six")
NUMERIC = (False, False, True, True, False, False)
"""Columns of the table of numbers."""

STYLE = """
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


def page(reproduction: Reproduction, figures: Mapping[str, Figure]) -> str:
    """The page.

    Args:
        reproduction: what to show.
        figures: by name, drawn; each name has a caption here.
    """
    pictures = {name: figure(as_svg(drawn), CAPTIONS[name]) for name, drawn in figures.items()}
    body = [
        "<h1>Zhang and Gosselin's machine, reproduced</h1>",
        '<p class="soft">' + escape(printed.CITATION) + ", "
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
        f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in printed.TYPOGRAPHY)}</ul>",
    ]
    return whole_page("Zhang and Gosselin's machine, reproduced by kinetostat", STYLE, body)


def misprints(reproduction: Reproduction) -> Iterator[str]:
    """Write a sentence on the misprints of each place of the paper: what is printed, what it should say, and why."""
    known = [comparison for comparison in reproduction.comparisons if comparison.verdict is Verdict.MISPRINT]
    for place, group in groupby(known, key=lambda comparison: comparison.place):
        wrong = list(group)
        pairs = [
            f"{_symbol(place, each.component)} {each.printed} should read "
            f"{printed.ERRATA[place, each.component].corrected}"
            for each in wrong
        ]
        count = COUNTS[len(wrong)] if len(wrong) < len(COUNTS) else str(len(wrong))
        are = "number is a misprint" if len(wrong) == 1 else "numbers are misprints"
        reason = printed.ERRATA[place, wrong[0].component].reason
        yield f"{place}: {count} {are} of the paper. {'; '.join(pairs)}. Reason: {reason}."


def _symbol(place: str, component: str) -> str:
    """Return the symbol of a number of the paper's tables: C_rx in Table III, K_rx in Table IV."""
    letter = {"Table III": "C_", "Table IV": "K_"}.get(place.partition(",")[0], "")
    return component if "/" in component else f"{letter}{component}"


def _tiles(reproduction: Reproduction) -> str:
    equal = sum(comparison.verdict is Verdict.EQUAL for comparison in reproduction.comparisons)
    misprints = sum(comparison.verdict is Verdict.MISPRINT for comparison in reproduction.comparisons)
    differing = len(reproduction.comparisons) - equal - misprints
    equations = f"{sum(check.holds for check in reproduction.checks)} of {len(reproduction.checks)}"
    claims = (*reproduction.claims, *reproduction.search_claims)
    holding = sum(claim.finding is Finding.HOLDS for claim in claims)
    limited = sum(claim.finding is Finding.PARTLY for claim in claims)
    tiles = [
        (equal, "numbers equal to print"),
        (misprints, "known misprints"),
        (differing, "numbers differ"),
        (equations, "groups of equations hold"),
        (f"{holding} + {limited}", "statements hold + in part"),
    ]
    cells = "".join(f'<div class="tile"><b>{figure}</b>{escape(text)}</div>' for figure, text in tiles)
    return f'<div class="tiles">{cells}</div>'


def _numbers(comparisons: Sequence[Comparison]) -> Iterable[str]:
    titles = {"Table": "Tables III and IV", "Eq.": "Equations 33 to 38", "Section": "Designs of section 4.3"}
    heads = ("place", "quantity", "printed", "computed", "unit", "verdict")
    for head, group in groupby(comparisons, key=lambda comparison: comparison.place.split(" ")[0]):
        rows = []
        for place, members in groupby(group, key=lambda comparison: comparison.place):
            rows += [_number_row(comparison, place if first else "") for comparison, first in _marking_first(members)]
        yield table(titles[head], heads, rows, NUMERIC)


def _marking_first(members: Iterable[Comparison]) -> Iterable[tuple[Comparison, bool]]:
    return ((member, i == 0) for i, member in enumerate(members))


def _number_row(comparison: Comparison, place: str) -> tuple[str, ...]:
    verdict = Markup(_mark(comparison.verdict) + (f" {escape(comparison.reason)}" if comparison.reason else ""))
    return place, comparison.component, comparison.printed, f"{comparison.computed:.9g}", comparison.unit, verdict


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
    return table("The paper's matrices A, B, J and J' against legs as (W, G)", heads, rows, NUMERIC[-5:])


def _statements(claims: Sequence[Claim]) -> str:
    entries = [
        f"<dt>{escape(claim.place)} {_mark(claim.finding)}</dt><dd>{escape(claim.statement)}</dd>"
        f'<dd class="soft">{escape(claim.measured)} {escape(claim.limits)}</dd>'
        for claim in claims
    ]
    return f"<dl>{''.join(entries)}</dl>"


def _mark(verdict: Verdict | Finding) -> Markup:
    return Markup(f'<span class="mark {MARKS[verdict]}">{escape(verdict.value)}</span>')
