"""An error budget on a terminal: the error, what it is made of, tolerances of least cost. Nothing is computed."""

import math
from collections.abc import Mapping

import numpy as np
from rich.console import Console

from kinetostat.accuracy.errors import MachineError
from kinetostat.display import Display, number
from kinetostat.kinematics.status import Status
from kinetostat.spec.tolerance_table import Tolerance
from kinetostat.studies.budget.allocation import Allocation
from kinetostat.studies.budget.budget import DRAWN_DIGITS, ROUND_OFF_SHARE, Budget
from kinetostat.studies.budget.data import STATISTICS
from kinetostat.studies.budget.tolerances import TolerancedPart, is_about
from kinetostat.views.fitted_table import FittedTable
from kinetostat.views.tables import numeric_table, text_table

MOST_PARTS = 12
"""Single tolerances that are listed; all of them with --full, and in JSON."""
PER_METRE = 1e-6
"""Ratios are read in µm/m."""


def print_budget(console: Console, budget: Budget, full: bool = False) -> None:
    """Print the answer in sentences, the sizes of the error, its contributions, and the allocation."""
    console.print(
        f"{budget.machine.name}: error of the tool by {len(budget.parts)} tolerances", style="bold", highlight=False
    )
    console.print(budget.message, highlight=False)
    _print_missing(console, budget)
    console.print(sizes_table(budget, full))
    console.print(drawn_sentence(budget), highlight=False)
    _print_exact(console, budget)
    if budget.shares.any():
        console.print(lines_table(budget))
        console.print(legs_table(budget))
        _print_parts(console, budget, full)
    if budget.allocation is not None:
        _print_allocation(console, budget.allocation, budget)


def _print_missing(console: Console, budget: Budget) -> None:
    for code in sorted({*budget.status.tolist()} - {int(Status.OK)}):
        count, status = int((budget.status == code).sum()), Status(code)
        text = f"{count:,} of {len(budget.status):,} poses: no result ({status.word.replace('_', ' ')})."
        console.print(f"{text} {status.sentence}", highlight=False)


def shown_measures(budget: Budget, full: bool = False) -> list[str]:
    """Names of the measures that are worth a row: parasitic parts where they are not simply a component.

    Args:
        budget: with its measures.
        full: whether parasitic components are shown one by one.
    """
    shown = []
    for name, unit in zip(budget.measures, budget.units, strict=True):
        of_unit = [m for m, u in zip(budget.measures, budget.units, strict=True) if u == unit]
        most = max(float(np.nanmax(budget.size("worst", m))) for m in of_unit)
        parasitic = name.startswith("parasitic ")
        single = parasitic and f"parasitic {'rotation' if unit == 'rad' else 'position'}" != name
        if parasitic and (
            (single and not full) or float(np.nanmax(budget.size("worst", name))) <= ROUND_OFF_SHARE * most
        ):
            continue
        shown.append(name)
    return shown


def sizes_table(budget: Budget, full: bool = False) -> FittedTable:
    """A row for each measure: at the pose, or the largest over all poses with the number of its pose.

    Args:
        budget: with its sizes.
        full: whether parasitic components are shown one by one.
    """
    display, many = budget.machine.display, len(budget.status) > 1
    statistics = [s for s in STATISTICS if s != "mean" or budget.pressed]
    title = f"Error of the tool at the {budget.machine.reference}, base axes"
    heads = ["unit", *(STATISTICS[s].replace(" ", "\n", 1) for s in statistics)]
    heads += ["95 %:\nat pose", "95 %\neverywhere"] if many else []
    table = numeric_table(title + (": largest over all poses" if many else ""), "error", heads)
    for name in shown_measures(budget, full):
        place = budget.measures.index(name)
        scale = display.deflection(budget.units[place])
        sizes = [float(np.nanmax(budget.size(s, name))) for s in statistics]
        cells = [
            number((size if size > ROUND_OFF_SHARE * sizes[-1] else 0.0) * scale.factor, digits=DRAWN_DIGITS)
            for size in sizes
        ]
        if many:
            everywhere = float(budget.spread.everywhere[place]) * scale.factor
            cells += [str(int(np.nanargmax(budget.size("usual", name))) + 1), number(everywhere, digits=DRAWN_DIGITS)]
        table.add_row(f"{name} (parasitic)" if name in budget.parasitic else name, scale.unit, *cells)
    return table


def drawn_sentence(budget: Budget) -> str:
    """Say what percentiles and the worst case are of."""
    return (
        f"Percentiles: {budget.samples:,} machines drawn, to first order; the worst case is at the limits of all "
        "tolerances."
    )


def _print_exact(console: Console, budget: Budget) -> None:
    exact, show = budget.exact, budget.machine.display.show_deflection
    if exact is None:
        return
    place = budget.measures.index(budget.leading)
    lost = f" {exact.failed:,} of them cannot be assembled." if exact.failed else ""
    console.print(
        f"{exact.machines:,} machines solved exactly: 95 % keep within {show(float(exact.usual[place]), 'm')}; the "
        f"first order is off by at most {show(float(exact.difference[place]), 'm')}.{lost} Single contributions "
        f"explain all of the variance but {number(100.0 * float(exact.unexplained[place]), digits=2)} %.",
        highlight=False,
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f}"


def ranked_by(budget: Budget) -> list[str]:
    """The measures whose shares are listed, the leading one first."""
    turned = "rotation" if "rotation" in budget.measures else "rz"
    return [name for name in ("along", "position", turned) if name in budget.measures]


def lines_table(budget: Budget) -> FittedTable:
    """The shares of the lines of [tolerances], the largest first."""
    names = ranked_by(budget)
    table = text_table("Contributions to the variance: lines of [tolerances]", "line", "tolerance", "numbers")
    for name in names:
        table.add_column(f"{name}\n%", justify="right", no_wrap=True)
    by_name = {name: budget.shares_by("line", name) for name in names}
    texts = {line.about: line.text for line in budget.tolerances}
    for line in budget.shares_by("line"):
        count = sum(part.line == line for part in budget.parts)
        table.add_row(line, texts[line], str(count), *(_percent(by_name[name][line]) for name in names))
    return table


def legs_table(budget: Budget) -> FittedTable:
    """The shares of the legs, the largest first."""
    names = ranked_by(budget)
    table = numeric_table("Contributions to the variance: legs", "leg", [f"{name}\n%" for name in names])
    by_name = {name: budget.shares_by("leg", name) for name in names}
    for leg in budget.shares_by("leg"):
        table.add_row(leg, *(_percent(by_name[name][leg]) for name in names))
    return table


def _print_parts(console: Console, budget: Budget, full: bool) -> None:
    names = ranked_by(budget)
    order = budget.ranking
    shown = order if full else order[:MOST_PARTS]
    table = text_table("Contributions to the variance: the largest single tolerances", "number of the machine", "±")
    for name in names:
        table.add_column(f"{name}\n%", justify="right", no_wrap=True)
    for place in shown:
        part = budget.parts[place]
        cells = (_percent(float(budget.shares[budget.measures.index(name), place])) for name in names)
        table.add_row(part.words, limit_of(part, budget.machine.display), *cells)
    console.print(table)
    if len(shown) < len(order):
        left = float(budget.shares[budget.measures.index(budget.leading), order[len(shown) :]].sum())
        console.print(
            f"{len(order) - len(shown)} further tolerances bring {_percent(left)} % together; --full lists them.",
            highlight=False,
        )


def limit_of(part: TolerancedPart, display: Display) -> str:
    """A tolerance with its unit, "0.05 mm"."""
    if part.kind == "ratio":
        return f"{number(part.limit / PER_METRE, digits=display.digits)} µm/m"
    return display.show(part.limit, "m" if part.kind == "length" else "rad")


def _print_allocation(console: Console, allocation: Allocation, budget: Budget) -> None:
    show = budget.machine.display.show_deflection
    how = "root of the sum of squares" if allocation.by == "rss" else "worst case"
    where = "along the direction" if allocation.measure == "along" else "at the tool point"
    title = f"Tolerances of least cost for {show(allocation.wanted, 'm')} {where} ({how})"
    table = text_table(title, "line", "now", "least cost", "so")
    table.add_column("factor", justify="right", no_wrap=True)
    table.add_column("cost\n%", justify="right", no_wrap=True)
    tolerances = {line.about: line for line in budget.tolerances}
    order = np.argsort(allocation.factors, kind="stable")
    for place in order:
        line, factor = allocation.lines[place], float(allocation.factors[place])
        cost = 100.0 * float(allocation.costs[place]) / factor / max(allocation.cost, 1e-300)
        new = _new_tolerance(budget, line, factor)
        table.add_row(line, tolerances[line].text, new, _advice(factor), number(factor, digits=3), f"{cost:.1f}")
    console.print(table)
    times, evenly = (number(c / allocation.before, digits=3) for c in (allocation.cost, allocation.evenly))
    console.print(
        f"The present tolerances give {show(allocation.present, 'm')}. The new ones cost {times} times as much; "
        f"if all were changed by one factor, {evenly} times as much. Half of a tolerance counts as twice the cost.",
        highlight=False,
    )


def _advice(factor: float) -> str:
    if math.isinf(factor):
        return "no effect"
    return "tighten" if factor < 0.99 else "loosen" if factor > 1.01 else "keep"


def _new_tolerance(budget: Budget, line: str, factor: float) -> str:
    """The new tolerances of a line by kind, from the least to the largest where sizes differ."""
    if math.isinf(factor):
        return "any"
    texts = []
    for kind in ("length", "angle", "ratio"):
        limits = [part for part in budget.parts if part.line == line and part.kind == kind]
        ends = dict.fromkeys(
            limit_of(_scaled(part, factor), budget.machine.display) for part in sorted(limits, key=lambda p: p.limit)
        )
        if ends:
            texts.append("±" + " to ".join([*ends][:: max(1, len(ends) - 1)]))
    return ", ".join(texts)


def _scaled(part: TolerancedPart, factor: float) -> TolerancedPart:
    return TolerancedPart(**{**vars(part), "limit": part.limit * factor})


def print_errors(console: Console, errors: tuple[MachineError, ...], tolerances: Mapping[str, Tolerance]) -> None:
    """Print every number of a machine that may be off, with the line of [tolerances] that is about it."""
    table = text_table("Numbers that may be off", "path", "meaning", "kind", "line of [tolerances]")
    for error in errors:
        lines = [line for line in tolerances.values() if is_about(line.about, error) and line.of(error.kind)]
        holding = f"{lines[-1].about}: {lines[-1].text}" if lines else "exact"
        table.add_row(error.path, error.words, error.kind, holding)
    console.print(table)
