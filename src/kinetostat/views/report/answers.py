"""Sections of a report on the answers to its questions, most of them made from the description of the answer.

Sections on a state under load and on a design study say more and are written here. Nothing is computed here.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from kinetostat.algebra.scalar import reciprocal
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import plain_name
from kinetostat.machine.machine import Machine
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.identification.record import FitRecord, RecordedFit
from kinetostat.studies.optimisation.problem import Problem
from kinetostat.studies.optimisation.result import Result
from kinetostat.studies.report import REPORT_QUESTIONS, Answers
from kinetostat.studies.under_load import LoadedState
from kinetostat.validation.comparison import Validation
from kinetostat.views.answers import description_of
from kinetostat.views.grid_figures import grid_figure
from kinetostat.views.guidelines import GUIDELINES
from kinetostat.views.identification import RECORDED_FIT
from kinetostat.views.identification_figures import FIT_CAPTIONS
from kinetostat.views.loaded import (
    SIGNS,
    bars_figure,
    displacement_table,
    load_figure,
    shape_figure,
    springs_or_kinds_table,
    stability_of,
    strut_table,
    tangent_table,
)
from kinetostat.views.optimisation import (
    aims,
    bounds_table,
    direction_table,
    failing_sentence,
    front_table,
    objective_table,
    remarks,
    scatter_table,
    unsearched_variables,
    variable_table,
)
from kinetostat.views.optimisation_figures import pictures
from kinetostat.views.question import Description
from kinetostat.views.report.content import Block, Bullets, Figure, Paragraph, Section, as_figure, as_table, typeset
from kinetostat.views.sensitivity import SENSITIVITY
from kinetostat.views.validation import VALIDATION

ANSWERS_WITH_SECTIONS = [question.name for question in REPORT_QUESTIONS if question.section]
"""Answers with a section of their own, in the order of a report."""
LEFT_OUT_SENTENCES = {"guidelines": "Guidelines were left out.", "sensitivity": "Sensitivities were left out."}
"""Sentences in the place of sections that nobody wanted, by answer."""
LINE_OF_FIRST_PAGE = "Pose"
"""Head of the line that is on the first page of a report already."""


def answer_sections(answers: Answers) -> Iterator[Section]:
    """Write a section on each answer that was asked for, and on the record of a fit if there is one."""
    for name in ANSWERS_WITH_SECTIONS:
        answer = answers.of(name)
        if not answer:
            continue
        if name in WRITTEN_SECTIONS:
            yield WRITTEN_SECTIONS[name](answer, answers)
        else:
            further_blocks = _frequencies(answers) if name == "vibration" else ()
            yield described_section(description_of(answer), answer, further_blocks)
    if answers.fit:
        yield _fit_section(answers.machine, answers.fit)


def design_sections(answers: Answers) -> Iterator[Section]:
    """Write the sections for the designer: guidelines, and the parameters ranked by influence."""
    for name, description in (("guidelines", GUIDELINES), ("sensitivity", SENSITIVITY)):
        answer = answers.of(name)
        if answer is None:
            yield Section(description.title, (Paragraph(LEFT_OUT_SENTENCES[name]),))
        else:
            yield described_section(description, answer)


def described_section(description: Description, answer: Any, more: Iterable[Block] = ()) -> Section:
    """Write the section on an answer.

    Args:
        description: the description of answers of this kind.
        answer: the answer at the pose of the report.
        more: further blocks at the end of the section.
    """
    return Section(description.title, (*_description_blocks(description, answer), *more))


def _description_blocks(description: Description, answer: Any) -> Iterator[Block]:
    if not description.answered(answer):
        yield Paragraph(typeset(answer.message))
        return
    for head, sentence in description.sentences(answer):
        if head != LINE_OF_FIRST_PAGE:
            yield Paragraph(typeset(sentence), f"{head}:")
    for part in description.tables(answer, False):
        yield Paragraph(typeset(part)) if isinstance(part, str) else as_table(part, f"{part.title}.")
    for drawing in description.drawings(answer).values():
        if not drawing.minor:
            yield as_figure(drawing(title=""), drawing.caption)


def _frequencies(answers: Answers) -> Iterator[Block]:
    """Give a map of the first natural frequency over the poses of the maps, if there is one."""
    over = answers.of("frequencies")
    if over is not None and (over["status"] == int(Status.OK)).any():
        names = [str(name) for name in over.data_vars if "frequency" in str(name)]
        yield as_figure(grid_figure(over, names, ""), "The first natural frequency over the poses.")


def loaded_section(state: LoadedState, answers: Answers) -> Section:
    """Write the section on the state under load: verdict, shape, displacement, loads of legs, stiffness, and the curve.

    Args:
        state: the machine at rest under its loads.
        answers: the answers of the report, whose analysis is that of the machine without loads.
    """
    return Section("Under load", tuple(_loaded_blocks(state, answers.analysis)))


def verdict_of(state: LoadedState) -> Paragraph:
    """Say whether the machine is at rest, and what is special about that."""
    return Paragraph(typeset(state.message), f"Under load, {state.rest.word}:")


def _loaded_blocks(state: LoadedState, analysis: Analysis) -> Iterator[Block]:
    yield verdict_of(state)
    if not state.has_rest:
        return
    yield Paragraph(typeset(stability_of(state)), "Stability:")
    displacements = displacement_table(state)
    yield as_figure(shape_figure(state, ""), "The machine at rest under its loads over the machine without them.")
    yield as_table(displacements, f"{displacements.title}, with exact geometry and by linear equations; base axes.")
    yield as_figure(bars_figure(state), "What each leg carries.")
    yield as_table(springs_or_kinds_table(state), f"Loads and deformations of the springs. {SIGNS}")
    if state.struts:
        yield as_table(strut_table(state), "Struts, which bend away under Euler's load.")
    free = [reciprocal(compliance) for compliance in analysis.compliance_diagonal.tolist()]
    tangent = tangent_table(state, free, analysis.stiffness_diagonal.tolist())
    if tangent is not None:
        caption = (
            "Stiffness that further loads meet, beside that of the free state: 1/C with all other motions free, K with "
            "all others held. The part of K under load that is not of springs is what loads and weights do by turning."
        )
        yield as_table(tangent, caption)
    yield as_figure(load_figure(state, ""), "Displacement and loads while the loads grow, beside the linear answer.")


WRITTEN_SECTIONS: dict[str, Callable[[Any, Answers], Section]] = {"under_load": loaded_section}
"""Functions that write the sections which say more than the description of the answer."""


def _fit_section(machine: Machine, record: FitRecord) -> Section:
    """Return the machine as built, by the record of a fit and the pictures beside it."""
    pictures = (
        Figure(caption, record.pictures[name], 0.85)
        for name, caption in FIT_CAPTIONS.items()
        if name in record.pictures
    )
    return described_section(RECORDED_FIT, RecordedFit(machine, record), pictures)


def validation_section(validation: Validation | str) -> Section:
    """Write the section that compares both compliances, or gives the reason why none was made."""
    if isinstance(validation, str):
        return Section(VALIDATION.title, (Paragraph(validation),))
    return described_section(VALIDATION, validation)


METHOD_WORDS = {
    "genetic": "a genetic algorithm",
    "gradient": "descents with exact derivatives from several starts",
    "hybrid": "a genetic algorithm, then descents with exact derivatives",
    "nsga2": "NSGA-II, a genetic algorithm for several objectives",
}


def study_section(result: Result) -> Section:
    """Write the section on a study."""
    return Section(
        "Design study",
        (
            Section("The question", _study_question(result.problem)),
            Section("The search", _study_search(result)),
            Section("The answer", _study_answer(result)),
        ),
    )


def gains(result: Result) -> Iterator[str]:
    """Generate a sentence on each objective, with its value before and after."""
    for k, objective in enumerate(result.problem.objectives):
        before, after = result.initial.objectives[0, k], result.outcome.objectives[0, k]
        unit, show = objective.term.unit, result.problem.machine.display.show
        before, after = (show(value, "1" if unit == "SI" else unit) for value in (before, after))
        label = plain_name(objective.term.label)
        yield f"{label[0].upper()}{label[1:]} ({objective.goal}): {before} before, {after} now."


def _study_question(problem: Problem) -> tuple[Block, ...]:
    fixed = unsearched_variables(problem)
    return (
        Paragraph(typeset(f"{problem.machine.name}, judged at {problem.poses.description}.")),
        Bullets(tuple((typeset(text), "") for text in aims(problem))),
        as_table(bounds_table(problem), "Variables and their bounds."),
        *([Paragraph(f"{fixed}.", "Not searched:")] if fixed else []),
    )


def _study_search(result: Result) -> tuple[Block, ...]:
    problem, figures = result.problem, pictures(result)
    settings = problem.study.optimizer
    method = f"Method {problem.method}: {METHOD_WORDS[problem.method]}; seed {settings.seed}. {result.message}"
    names = (name for name in ("convergence", "front") if name in figures)
    return (Paragraph(typeset(method)), *(as_figure(figures[name](), figures[name].caption) for name in names))


def _study_answer(result: Result) -> tuple[Block, ...]:
    figures, several = pictures(result), len(result.problem.objectives) > 1
    best = "the knee of the front" if several else "the best design"
    blocks: list[Block] = [
        as_table(objective_table(result), f"Objectives: the original machine, and {best}."),
        as_table(
            variable_table(result),
            f"Variables of {best}, and the effect of 1 % of each on the objectives, of an angle of 0.01 rad.",
        ),
        as_table(direction_table(result), "Compliance before and after, at the worst of all poses."),
        as_figure(figures["comparison"](), figures["comparison"].caption),
    ]
    if several:
        blocks.append(as_table(front_table(result), "Designs of the front."))
    if result.robustness:
        scatter = scatter_table(result.robustness, result.problem.machine.display)
        blocks.append(as_table(scatter, "Objectives under the tolerances."))
        blocks.append(as_figure(figures["tolerances"](), figures["tolerances"].caption))
        if result.robustness.failing:
            blocks.append(Paragraph(failing_sentence(result.robustness)))
    items = tuple((typeset(line), "") for line in remarks(result))
    return (*blocks, Bullets(items)) if items else tuple(blocks)
