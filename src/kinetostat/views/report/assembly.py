"""Assembly of a report: the title block and all sections in order.

Nothing is computed here, and no format is known.
"""

from collections.abc import Iterator, Mapping
from importlib.metadata import version

from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.studies.identification.record import FitRecord, RecordedFit
from kinetostat.studies.report.answers import Answers
from kinetostat.studies.setting import pose_of
from kinetostat.validation.comparison import Validation
from kinetostat.views.budget import BUDGET
from kinetostat.views.figures import contour_maps, curves
from kinetostat.views.identification import RECORDED_FIT
from kinetostat.views.identification_figures import CAPTIONS
from kinetostat.views.report.content import Block, Figure, Report, Section
from kinetostat.views.report.described import described_section
from kinetostat.views.report.design import guideline_section, sensitivity_section
from kinetostat.views.report.machine import data_section, machine_section, portrait
from kinetostat.views.report.pictures import drawn, shown
from kinetostat.views.report.provenance import Origin, method_section, record_section, validation_section
from kinetostat.views.report.stiffness import load_section, stiffness_section, workspace_section
from kinetostat.views.report.study import study_section
from kinetostat.views.report.summary import summary_section
from kinetostat.views.report.typesetting import typeset
from kinetostat.views.report.under_load import loaded_section
from kinetostat.views.vibration import VIBRATION


def report_of(
    answers: Answers, validation: Validation | str, origin: Origin, about: Mapping[str, str], live: bool
) -> Report:
    """Assemble the report on a machine, or on a study and its best design.

    Args:
        answers: for a pose whose status is OK.
        validation: by an independent engine, or why there is none.
        origin: what the report is made from.
        about: further lines of the title block, by name.
        live: whether the report will be a page, which may show the machine in three dimensions.

    Raises:
        ValueError: the status of the pose is not OK.
    """
    analysis, result = answers.analysis, answers.result
    if analysis.status is not Status.OK:
        raise ValueError("a report needs a pose whose status is OK")
    pictures = shown(analysis, answers.vibration if live else None)
    engine = () if isinstance(validation, str) else (validation.engine, validation.version)
    sections = [
        summary_section(answers, validation, portrait(analysis, pictures, live)),
        *([study_section(result)] if result else []),
        machine_section(analysis),
        data_section(analysis),
        stiffness_section(analysis),
        load_section(analysis, pictures),
        *([loaded_section(answers.loaded, analysis)] if answers.loaded else []),
        *([described_section(VIBRATION, answers.vibration, _frequencies(answers))] if answers.vibration else []),
        *([described_section(BUDGET, answers.budget)] if answers.budget else []),
        *([_fit_section(answers.machine, answers.fit)] if answers.fit else []),
        workspace_section(answers),
        guideline_section(answers),
        sensitivity_section(answers.sensitivity),
        validation_section(validation),
        method_section(),
        record_section(origin, engine),
    ]
    return Report(
        "Stiffness report" if result is None else "Design study report",
        analysis.machine.name if result is None else result.problem.study.name,
        (*_title_block(answers), *about.items()),
        tuple(sections),
        {"machine.toml": origin.machine_file, "results.json": origin.results},
    )


def _frequencies(answers: Answers) -> Iterator[Block]:
    """The first natural frequency over the poses of the maps, where there are any."""
    over = answers.frequencies
    if over is not None and (over["status"] == int(Status.OK)).any():
        draw = contour_maps if over["status"].ndim == 2 else curves
        names = [str(name) for name in over.data_vars if "frequency" in str(name)]
        yield drawn(draw(over, names, ""), "The first natural frequency over the poses.")


def _fit_section(machine: Machine, record: FitRecord) -> Section:
    """The machine as built, by the record of a fit and the pictures beside it."""
    pictures = (
        Figure(caption, record.pictures[name], 0.85) for name, caption in CAPTIONS.items() if name in record.pictures
    )
    return described_section(RECORDED_FIT, RecordedFit(machine, record), pictures)


def _title_block(answers: Answers) -> list[tuple[str, str]]:
    analysis, machine = answers.analysis, answers.machine
    rows = [("Machine", machine.name), ("Family", machine.family.name), ("Pose", typeset(pose_of(machine)))]
    return [
        *rows,
        ("Reference", f"{machine.reference}, {analysis.axes} axes"),
        ("Program", f"kinetostat {version('kinetostat')}"),
    ]
