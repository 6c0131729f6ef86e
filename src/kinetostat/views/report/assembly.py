"""From answers to a report: title block and sections in order. Nothing is computed and no format is known here."""

from collections.abc import Mapping
from importlib.metadata import version

from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.studies.report.answers import Answers
from kinetostat.validation.comparison import Validation
from kinetostat.views.report.content import Report
from kinetostat.views.report.design import guideline_section, sensitivity_section
from kinetostat.views.report.machine import data_section, machine_section
from kinetostat.views.report.pictures import shown
from kinetostat.views.report.record import Origin, method_section, record_section
from kinetostat.views.report.stiffness import load_section, stiffness_section
from kinetostat.views.report.study import study_section
from kinetostat.views.report.summary import summary_section
from kinetostat.views.report.typesetting import typeset
from kinetostat.views.report.validation import validation_section
from kinetostat.views.report.workspace import workspace_section
from kinetostat.views.tables import readable


def report_of(
    answers: Answers, validation: Validation | str, origin: Origin, about: Mapping[str, str], live: bool
) -> Report:
    """The report about a machine, or about a study and its best design.

    Args:
        answers: of a pose whose status is OK.
        validation: by an independent engine, or why there is none.
        origin: what the report is made of.
        about: further lines of the title block, by name.
        live: whether the report will be a page, which may show the machine in three dimensions.

    Raises:
        ValueError: the pose has no answer.
    """
    found, result = answers.analysis, answers.result
    if found.status is not Status.OK:
        raise ValueError("a pose without an answer has no report")
    pictures = shown(found)
    engine = () if isinstance(validation, str) else (validation.engine, validation.version)
    sections = [
        summary_section(answers, validation),
        *([study_section(result)] if result else []),
        machine_section(found, pictures, live),
        data_section(found),
        stiffness_section(found),
        load_section(found, pictures),
        workspace_section(answers),
        guideline_section(answers),
        sensitivity_section(answers.sensitivity),
        validation_section(validation),
        method_section(),
        record_section(origin, engine),
    ]
    return Report(
        "Stiffness report" if result is None else "Design study report",
        found.machine.name if result is None else result.problem.study.name,
        (*_title_block(answers), *about.items()),
        tuple(sections),
        {"machine.toml": origin.machine_file, "results.json": origin.results},
    )


def _title_block(answers: Answers) -> list[tuple[str, str]]:
    found, machine = answers.analysis, answers.machine
    rows = [("Machine", machine.name), ("Family", machine.family.name), ("Pose", _pose(machine))]
    return [
        *rows,
        ("Reference", f"{machine.reference}, {found.axes} axes, SI units"),
        ("Program", f"kinetostat {version('kinetostat')}"),
    ]


def _pose(machine: Machine) -> str:
    held = values(machine)
    fields = [p for p in parameters(machine.family) if p.path.startswith("pose.") and len(p.leaves) == 1]
    shown = [f"{p.path.removeprefix('pose.')} {readable([held[p.path]], p.quantity)}" for p in fields]
    return typeset(", ".join(shown))
