"""The section on a design study: the question, the search and the answer.

Nothing is computed here.
"""

from collections.abc import Iterator

from kinetostat.kinetostatics.quantities import spoken
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.result_data import message
from kinetostat.views.optimisation_figures import pictures
from kinetostat.views.optimisation_tables import (
    aims,
    bounds_table,
    direction_table,
    failing,
    front_table,
    not_searched,
    remarks,
    scatter_table,
    variable_table,
    worth_table,
)
from kinetostat.views.report.content import Block, Paragraph, Points, Section
from kinetostat.views.report.pictures import drawn
from kinetostat.views.report.typesetting import printed, typeset

METHODS = {
    "genetic": "a genetic algorithm",
    "gradient": "descents with exact derivatives from several starts",
    "hybrid": "a genetic algorithm, then descents with exact derivatives",
    "nsga2": "NSGA-II, a genetic algorithm for several objectives",
}
CAPTIONS = {
    "comparison": "Left: how many times stiffer each direction is. Right: each variable between its bounds.",
    "convergence": "Best and mean of the designs that each step kept, and their distance from the final best.",
    "front": "Designs over the objectives; on the front no design is better than another in all objectives.",
    "tolerances": "Scatter of the objectives over machines made to the tolerances from the best design.",
}


def study_section(result: Result) -> Section:
    """Write the section on a study."""
    return Section(
        "Design study",
        (
            Section("The question", _question(result.problem)),
            Section("The search", _search(result)),
            Section("The answer", _answer(result)),
        ),
    )


def gains(result: Result) -> Iterator[str]:
    """Generate a sentence on each objective, with its value before and after."""
    for k, objective in enumerate(result.problem.objectives):
        before, after = result.initial.objectives[0, k], result.outcome.objectives[0, k]
        unit, show = objective.term.unit, result.problem.machine.display.show
        before, after = (show(value, "1" if unit == "SI" else unit) for value in (before, after))
        label = spoken(objective.term.label)
        yield f"{label[0].upper()}{label[1:]} ({objective.goal}): {before} before, {after} now."


def _question(problem: Problem) -> tuple[Block, ...]:
    fixed = not_searched(problem)
    return (
        Paragraph(typeset(f"{problem.machine.name}, judged at {problem.poses.description}.")),
        Points(tuple((typeset(text), "") for text in aims(problem))),
        printed(bounds_table(problem), "Variables and their bounds."),
        *([Paragraph(f"{fixed}.", "Not searched:")] if fixed else []),
    )


def _search(result: Result) -> tuple[Block, ...]:
    problem, figures = result.problem, pictures(result)
    settings = problem.study.optimizer
    about = f"Method {problem.method}: {METHODS[problem.method]}; seed {settings.seed}. {message(result)}"
    shown = (name for name in ("convergence", "front") if name in figures)
    return (Paragraph(typeset(about)), *(drawn(figures[name](), CAPTIONS[name]) for name in shown))


def _answer(result: Result) -> tuple[Block, ...]:
    figures, several = pictures(result), len(result.problem.objectives) > 1
    best = "the knee of the front" if several else "the best design"
    blocks: list[Block] = [
        printed(worth_table(result), f"Objectives: the original machine, and {best}."),
        printed(
            variable_table(result),
            f"Variables of {best}, and the effect of 1 % of each on the objectives, of an angle of 0.01 rad.",
        ),
        printed(direction_table(result), "Compliance before and after, at the worst of all poses."),
        drawn(figures["comparison"](), CAPTIONS["comparison"]),
    ]
    if several:
        blocks.append(printed(front_table(result), "Designs of the front."))
    if result.robustness:
        scatter = scatter_table(result.robustness, result.problem.machine.display)
        blocks.append(printed(scatter, "Objectives under the tolerances."))
        blocks.append(drawn(figures["tolerances"](), CAPTIONS["tolerances"]))
        if result.robustness.failing:
            blocks.append(Paragraph(failing(result.robustness)))
    items = tuple((typeset(line), "") for line in remarks(result))
    return (*blocks, Points(items)) if items else tuple(blocks)
