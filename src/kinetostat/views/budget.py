"""The error of the tool that tolerances allow: the question, and the description of its answer.

Nothing is computed here.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from kinetostat.accuracy.errors import MachineError
from kinetostat.accuracy.toleranced_parts import PossibleErrors, is_about, possible_errors
from kinetostat.accuracy.tool_error import ExactSample
from kinetostat.arrays import Array
from kinetostat.display import Display, number
from kinetostat.engine.batch import Progress, silent
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.studies.allocation import ALLOCATION_RULES, Allocation
from kinetostat.studies.budget import (
    DRAWN_DIGITS,
    ROUND_OFF_SHARE,
    STATISTICS,
    Budget,
    budget,
)
from kinetostat.tolerances import LEAST_DIVISOR
from kinetostat.units import KINDS
from kinetostat.views.budget_forms import (
    budget_dataset,
    budget_figures,
    contributions_csv,
    poses_csv,
    ranked_by,
    varied_fields,
)
from kinetostat.views.data_forms import status_words
from kinetostat.views.question import MESSAGE, NAME, Description, Field, Lines, Option, Question, Records
from kinetostat.views.tables import FittedTable, numeric_table, text_table

MOST_LISTED_PARTS = 12
"""Single tolerances that are listed, which fill a screen; all of them with --full, and in JSON."""
MICROMETRE_PER_METRE = 1e-6
"""Unit in which tolerances that are ratios are shown: that of the lengths of scales and screws."""
SAME_TOLERANCE = 0.01
"""Change of a tolerance, as a share of it, up to which it is kept: nobody writes it on a drawing."""


def _lines(answer: Budget) -> Lines:
    yield "As built", answer.message
    for code in sorted({*answer.status.tolist()} - {int(Status.OK)}):
        count, status = int((answer.status == code).sum()), Status(code)
        text = f"{count:,} of {len(answer.status):,} poses: no result ({status.phrase})."
        yield "Poses", f"{text} {status.sentence}"
    drawn = f"{answer.samples:,} machines drawn, to first order; the worst case is at the limits of all tolerances."
    yield "Percentiles", drawn
    if answer.exact is not None:
        yield "Exact", _exact_sentence(answer, answer.exact)
    if answer.allocation is not None:
        yield "Allocation", _allocation_sentence(answer, answer.allocation)


def _exact_sentence(answer: Budget, exact: ExactSample) -> str:
    show, place = answer.machine.display.show_deflection, answer.measures.index(answer.leading)
    failures = f" {exact.failed:,} of them cannot be assembled." if exact.failed else ""
    return (
        f"{exact.machines:,} machines solved exactly: 95 % keep within {show(float(exact.usual[place]), 'm')}; the "
        f"first order is off by at most {show(float(exact.difference[place]), 'm')}.{failures} Single contributions "
        f"explain all of the variance but {number(100.0 * float(exact.unexplained[place]), digits=2)} %."
    )


def _allocation_sentence(answer: Budget, allocation: Allocation) -> str:
    times, evenly = (number(cost / allocation.before, digits=3) for cost in (allocation.cost, allocation.evenly))
    return (
        f"The present tolerances give {answer.machine.display.show_deflection(allocation.present, 'm')}. The new ones "
        f"cost {times} times as much; if all were changed by one factor, {evenly} times as much. Half of a tolerance "
        "counts as twice the cost."
    )


def _tables(answer: Budget, full: bool) -> Iterator[FittedTable]:
    yield _sizes_table(answer, full)
    if answer.shares.any():
        texts = _text_by_line(answer)
        counts = {line: str(sum(part.line == line for part in answer.parts)) for line in texts}
        yield _sums_table(answer, "line", "lines of [tolerances]", {"tolerance": texts, "numbers": counts})
        yield _sums_table(answer, "leg", "legs", {})
        yield _parts_table(answer, full)
    if answer.allocation is not None:
        yield _allocation_table(answer, answer.allocation)


def _text_by_line(answer: Budget) -> dict[str, str]:
    """Return the text of each line of [tolerances], such as "0.05 mm", by what the line is about."""
    return {line.about: line.text for line in answer.tolerances}


def _shown_measures(answer: Budget, full: bool) -> list[str]:
    """Return the names of the measures that have a row: of parasitic ones their sizes, and if `full` each component.

    Parasitic measures that are round-off beside the others have none.
    """
    units = dict(zip(answer.measures, answer.units, strict=True))
    greatest = {name: float(np.nanmax(answer.size("worst", name))) for name in units}
    shown = []
    for name, unit in units.items():
        is_component = name not in ("parasitic rotation", "parasitic position")
        largest = max(greatest[other] for other in units if units[other] == unit)
        is_round_off = greatest[name] <= ROUND_OFF_SHARE * largest
        is_hidden = name.startswith("parasitic ") and (is_round_off or (is_component and not full))
        if not is_hidden:
            shown.append(name)
    return shown


def _sizes_table(answer: Budget, full: bool) -> FittedTable:
    """Return a row for each measure: at the pose, or the largest over all poses with the number of its pose."""
    display, many = answer.machine.display, len(answer.status) > 1
    statistics = [s for s in STATISTICS if s != "mean" or answer.pressed]
    title = f"Error of the tool at the {answer.machine.reference}, base axes"
    heads = ["unit", *(STATISTICS[s].replace(" ", "\n", 1) for s in statistics)]
    heads += ["95 %:\nat pose", "95 %\neverywhere"] if many else []
    table = numeric_table(title + (": largest over all poses" if many else ""), "error", heads)
    for name in _shown_measures(answer, full):
        place = answer.measures.index(name)
        scale = display.deflection(answer.units[place])
        sizes = {s: float(np.nanmax(answer.size(s, name))) for s in statistics}
        clean = [size if size > ROUND_OFF_SHARE * sizes["worst"] else 0.0 for size in sizes.values()]
        cells = [number(size * scale.factor, digits=DRAWN_DIGITS) for size in clean]
        if many:
            everywhere = float(answer.spread.everywhere[place]) * scale.factor
            cells += [str(int(np.nanargmax(answer.size("usual", name))) + 1), number(everywhere, digits=DRAWN_DIGITS)]
        table.add_row(f"{name} (parasitic)" if name in answer.parasitic else name, scale.unit, *cells)
    return table


def _shares_table(answer: Budget, subject: str, *heads: str) -> FittedTable:
    """Return a table of contributions without rows yet."""
    table = text_table(f"Contributions to the variance: {subject}", *heads)
    for name in ranked_by(answer):
        table.add_column(f"{name}\n%", justify="right", no_wrap=True)
    return table


def _sums_table(answer: Budget, key: str, subject: str, notes: dict[str, dict[str, str]]) -> FittedTable:
    """Return the shares of lines or legs, the largest first; notes by name stand in columns between."""
    table = _shares_table(answer, subject, key, *notes)
    by_measure = [answer.shares_by(key, name) for name in ranked_by(answer)]
    for name in answer.shares_by(key):
        table.add_row(name, *(note[name] for note in notes.values()), *(_percent(each[name]) for each in by_measure))
    return table


def _parts_table(answer: Budget, full: bool) -> FittedTable:
    """Return the shares of single tolerances, the largest first."""
    rows = answer.shares[[answer.measures.index(name) for name in ranked_by(answer)]]
    order = answer.ranking
    shown = order if full else order[:MOST_LISTED_PARTS]
    table = _shares_table(answer, "the largest single tolerances", "number of the machine", "±")
    for place in shown:
        part = answer.parts[place]
        table.add_row(
            part.words, _tolerance_text(part.kind, part.limit, answer.machine.display), *map(_percent, rows[:, place])
        )
    if len(shown) < len(order):
        remainders = rows[:, order[len(shown) :]].sum(axis=1)
        table.add_row(f"{len(order) - len(shown)} further ones (--full)", "", *map(_percent, remainders))
    return table


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f}"


def _tolerance_text(kind: str, limit: float, display: Display) -> str:
    """Return a tolerance with its unit, "0.05 mm"."""
    if kind == "share":
        return f"{number(limit / MICROMETRE_PER_METRE, digits=display.digits)} µm/m"
    return display.show(limit, "m" if kind == "length" else "rad")


def _allocation_table(answer: Budget, allocation: Allocation) -> FittedTable:
    rule = "root of the sum of squares" if allocation.by == "rss" else "worst case"
    where = "along the direction" if allocation.measure == "along" else "at the tool point"
    wanted = answer.machine.display.show_deflection(allocation.wanted, "m")
    table = text_table(f"Tolerances of least cost for {wanted} {where} ({rule})", "line", "now", "least cost", "advice")
    table.add_column("factor", justify="right", no_wrap=True)
    table.add_column("cost\n%", justify="right", no_wrap=True)
    texts = _text_by_line(answer)
    for place in np.argsort(allocation.factors, kind="stable"):
        line, factor = allocation.lines[place], float(allocation.factors[place])
        cost = 100.0 * float(allocation.costs[place]) / factor / max(allocation.cost, LEAST_DIVISOR)
        new = _new_tolerance(answer, line, factor)
        table.add_row(line, texts[line], new, _advice(factor), number(factor, digits=3), f"{cost:.1f}")
    return table


def _advice(factor: float) -> str:
    if math.isinf(factor):
        return "no effect"
    return "tighten" if factor < 1.0 - SAME_TOLERANCE else "loosen" if factor > 1.0 + SAME_TOLERANCE else "keep"


def _new_tolerance(answer: Budget, line: str, factor: float) -> str:
    """Return the new tolerances of a line by kind, from the least to the largest where sizes differ."""
    if math.isinf(factor):
        return "any"
    texts = []
    for kind in ("length", "angle", "share"):
        limits = [part.limit * factor for part in answer.parts if part.line == line and part.kind == kind]
        if limits:
            ends = (_tolerance_text(kind, end, answer.machine.display) for end in (min(limits), max(limits)))
            texts.append("±" + " to ".join(dict.fromkeys(ends)))
    return ", ".join(texts)


def _by_measure(answer: Budget, statistic: Array) -> dict[str, Any]:
    """Return a statistic [poses x measures] by measure: a number at a single pose, else a list."""
    columns = dict(zip(answer.measures, statistic.T, strict=True))
    return {name: float(column[0]) if len(column) == 1 else column for name, column in columns.items()}


def _exact_of(answer: Budget) -> dict[str, Any] | None:
    exact = answer.exact
    if exact is None:
        return None
    sizes = {"rms": exact.rms, "usual": exact.usual, "difference": exact.difference, "unexplained": exact.unexplained}
    by_measure = {name: dict(zip(answer.measures, row.tolist(), strict=True)) for name, row in sizes.items()}
    return {"machines": exact.machines, "failed": exact.failed, **by_measure}


PART = (
    Field("path"),
    Field("meaning", "words"),
    Field("leg"),
    Field("group"),
    Field("line"),
    Field("tolerance", "limit"),
    Field("unit", lambda part: KINDS[part["kind"]].unit),
    Field("distribution", lambda part: "normal" if part["normal"] else "uniform"),
    Field("shares"),
)


def _contributions(answer: Budget) -> list[dict[str, Any]]:
    """Return the parts with their shares by measure."""
    rows = zip(answer.parts, answer.shares.T.tolist(), strict=True)
    return [vars(part) | {"shares": dict(zip(answer.measures, row, strict=True))} for part, row in rows]


BUDGET = Description(
    title="Error by tolerances",
    fields=(
        NAME,
        MESSAGE,
        Field("tolerances", _text_by_line),
        Field("measures", lambda answer: dict(zip(answer.measures, answer.units, strict=True))),
        Field("leading_measure", "leading"),
        Field("status", lambda answer: status_words(answer.status)),
        Field("poses", lambda answer: {path: column.values for path, column in varied_fields(answer).items()}),
        Field("errors", lambda answer: {s: _by_measure(answer, getattr(answer.spread, s)) for s in STATISTICS}),
        Field("usual_everywhere", lambda a: dict(zip(a.measures, a.spread.everywhere.tolist(), strict=True))),
        Field("machines", "samples"),
        Records("contributions", "tolerance", PART, _contributions, forms=("json",)),
        Field("shares_by_line", lambda answer: answer.shares_by("line")),
        Field("shares_by_leg", lambda answer: answer.shares_by("leg")),
        Field("pressed_joints", "pressed"),
        Field("sometimes_pressed_joints", "sometimes_pressed"),
        Field("freedoms"),
        Field("parasitic"),
        Field("exact", _exact_of),
        Field("allocation"),
    ),
    lines=_lines,
    tables=_tables,
    figures=budget_figures,
    makers={"csv": contributions_csv, "nc": budget_dataset},
    state=lambda answer: f"error of the tool by {len(answer.parts)} tolerances",
    files={
        "budget.json": "json",
        "contributions.csv": "csv",
        "poses.csv": poses_csv,
        "budget.nc": lambda answer: budget_dataset(answer) if len(answer.status) > 1 else None,
    },
    figure_prefix="budget-",
)


def _errors_table(answer: PossibleErrors, _full: bool) -> Iterator[FittedTable]:
    """Give every number of a machine that may be off, with the line of [tolerances] that is about it."""
    table = text_table("Numbers that may be off", "path", "meaning", "kind", "line of [tolerances]")
    for error in answer.errors:
        table.add_row(error.path, error.words, error.kind, _line_about(answer, error) or "exact")
    yield table


def _line_about(answer: PossibleErrors, error: MachineError) -> str | None:
    """Return the last line of [tolerances] about a number, which replaces those before it; None if none is."""
    lines = [line for line in answer.machine.tolerances.values() if is_about(line.about, error) and line.of(error.kind)]
    return f"{lines[-1].about}: {lines[-1].text}" if lines else None


POSSIBLE_ERRORS = Description(
    title="Numbers that may be off",
    fields=(
        NAME,
        Field(
            "errors",
            lambda answer: [
                {"path": e.path, "meaning": e.words, "kind": e.kind, "line": _line_about(answer, e)}
                for e in answer.errors
            ],
        ),
    ),
    tables=_errors_table,
    state=lambda answer: f"{len(answer.errors)} numbers may be off",
)


def budget_or_possible_errors(
    machine: Machine,
    poses: Any = None,
    ranges: Sequence[str] = (),
    along: Sequence[float] = (),
    samples: int = 0,
    exact: int = 0,
    allocate: float | str | None = None,
    by: str = "rss",
    seed: int = 0,
    list_errors: bool = False,
    progress: Progress = silent,
) -> Budget | PossibleErrors:
    """Compute the budget, or only list the numbers that may be off; tolerances of the command are in the machine."""
    if list_errors:
        return possible_errors(machine)
    return budget(
        machine,
        poses,
        ranges,
        along=along,
        samples=samples,
        exact=exact,
        allocate=allocate,
        by=by,
        seed=seed,
        progress=progress,
    )


BUDGET_QUESTION = Question(
    example='kinetostat budget hexapod --tolerance "joints=0.05 mm" --tolerance "zeros=0.02 mm" -o out',
    answer=budget_or_possible_errors,
    options=(
        Option(
            "poses",
            "file",
            "a CSV file of poses, as `path` takes it (default: the pose of the machine)",
            metavar="POSES",
            first=True,
        ),
        Option(
            "tolerances",
            "setting",
            "a line as in the table [tolerances] of the machine file, after those of the file: joints, zeros, gains, "
            "clearances, compliances, or a path in which * stands for anything; VALUE is plus and minus (0.05 mm), a "
            "standard deviation (sigma 0.02 mm), or a class (IT7 at 300 mm, ISO 2768-m at 300 mm); repeatable",
            metavar="WHAT=VALUE",
            many=True,
            word="--tolerance",
        ),
        Option(
            "ranges",
            "text",
            "a coordinate of the pose and its range: the error over a sweep or a map; repeatable",
            metavar="FIELD=from:to:count",
            many=True,
            word="--over",
        ),
        Option(
            "along",
            "direction",
            "also the error of the tool point along this direction, by which contributions are then ranked",
            default=(),
        ),
        Option(
            "samples",
            "count",
            "machines that are drawn to first order (default: 131072, or 4096 if there are several poses)",
            default=0,
        ),
        Option("exact", "count", "machines that are solved exactly, to compare with", default=0),
        Option(
            "allocate",
            "quantity",
            'also the tolerances of least cost for this error, e.g. "0.05 mm"',
            metavar="LENGTH",
        ),
        Option(
            "by",
            "choice",
            "what must keep it: the root of the sum of squares (default), or the worst case",
            default="rss",
            choices=tuple(ALLOCATION_RULES),
        ),
        Option("seed", "count", "seed of the random machines (default: 0)", metavar="SEED", default=0),
        Option("list_errors", "flag", "only list every number that may be off, with its path", word="--list"),
    ),
    output="the figures, JSON, CSV and NetCDF",
    reports_progress=True,
    full="list all contributions and parasitic components",
)
