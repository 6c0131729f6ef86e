"""The section about a study: what was asked, what was found, and what holds it there. Nothing is computed here."""

from collections.abc import Iterator

from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.optimisation.result_data import message
from kinetostat.views.display import spoken
from kinetostat.views.optimisation_figures import pictures
from kinetostat.views.optimisation_tables import (
    direction_table,
    failing,
    front_table,
    remarks,
    scatter_table,
    variable_table,
    worth_table,
)
from kinetostat.views.report.content import Block, Paragraph, Points, Section
from kinetostat.views.report.pictures import drawn
from kinetostat.views.report.typesetting import printed, typeset
from kinetostat.views.study_tables import aims, bounds_table, not_searched
from kinetostat.views.tables import number

METHODS = {
    "genetic": "a genetic algorithm",
    "gradient": "descents with exact derivatives from several starts",
    "hybrid": "a genetic algorithm, then descents with exact derivatives",
    "nsga2": "NSGA-II, a genetic algorithm for several objectives",
}
CAPTIONS = {
    "comparison": "Left: how many times stiffer each direction is. Right: each variable between its bounds.",
    "convergence": "Best and mean of the designs that each step kept, and their distance from the last best.",
    "front": "Designs over the objectives; on the front none beats another in everything.",
    "tolerances": "Scatter of the objectives over the machines that manufacture makes of the best design.",
}


def study_section(found: Result) -> Section:
    """Question, history and answer of a study."""
    return Section(
        "Design study",
        (
            Section("The question", _question(found.problem)),
            Section("The search", _search(found)),
            Section("The answer", _answer(found)),
        ),
    )


def gains(found: Result) -> Iterator[str]:
    """What each objective was and has become, a sentence each."""
    for k, objective in enumerate(found.problem.objectives):
        before, after = found.initial.objectives[0, k], found.outcome.objectives[0, k]
        unit = "" if objective.term.unit in ("1", "SI") else f" {objective.term.unit}"
        label = spoken(objective.term.label)
        worth = f"{number(before)}{unit} before, {number(after)}{unit} now."
        yield f"{label[0].upper()}{label[1:]} ({objective.goal}): {worth}"


def _question(problem: Problem) -> tuple[Block, ...]:
    fixed = not_searched(problem)
    return (
        Paragraph(typeset(f"{problem.machine.name}, judged at {problem.poses.told}.")),
        Points(tuple((typeset(text), "") for text in aims(problem))),
        printed(bounds_table(problem), "Variables and their bounds."),
        *([Paragraph(f"{fixed}.", "Not searched:")] if fixed else []),
    )


def _search(found: Result) -> tuple[Block, ...]:
    problem, figures = found.problem, pictures(found)
    settings = problem.study.optimizer
    about = f"Method {problem.method}: {METHODS[problem.method]}; seed {settings.seed}. {message(found)}"
    kept = (name for name in ("convergence", "front") if name in figures)
    return (Paragraph(typeset(about)), *(drawn(figures[name], CAPTIONS[name]) for name in kept))


def _answer(found: Result) -> tuple[Block, ...]:
    figures, several = pictures(found), len(found.problem.objectives) > 1
    best = "the knee of the front" if several else "the best design"
    blocks: list[Block] = [
        printed(worth_table(found), f"What it is worth: the machine as it was, and {best}."),
        printed(
            variable_table(found),
            f"Variables of {best}; what one percent of each does to the objectives, of an angle 0.01 rad.",
        ),
        printed(direction_table(found), "Compliance before and after, the worst of all poses."),
        drawn(figures["comparison"], CAPTIONS["comparison"]),
    ]
    if several:
        blocks.append(printed(front_table(found), "Designs of the front."))
    if found.robustness:
        blocks.append(printed(scatter_table(found.robustness), "Objectives under the tolerances."))
        blocks.append(drawn(figures["tolerances"], CAPTIONS["tolerances"]))
        if found.robustness.failing:
            blocks.append(Paragraph(failing(found.robustness)))
    told = tuple((typeset(line), "") for line in remarks(found))
    return (*blocks, Points(told)) if told else tuple(blocks)
