"""What a report is about: a machine or a study, as people name it, with the texts that it was read from."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kinetostat.machine.loading import bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.saving import as_file
from kinetostat.spec import document as documents
from kinetostat.spec.errors import InputError
from kinetostat.spec.study import study_toml
from kinetostat.studies.bundled import bundled_studies, is_study
from kinetostat.studies.optimisation.problem import Problem, load_problem
from kinetostat.studies.optimisation.search import stored_problem
from kinetostat.studies.study_folder import holds_study

Texts = tuple[tuple[str, str], ...]
"""Name and text of each input."""


@dataclass(frozen=True)
class Subject:
    """What a report is about.

    Attributes:
        machine: with its overrides; of a study as it is before.
        inputs: name and text of each file that it was read from.
        problem: of a study; None for a machine alone.
        folder: that holds the search of the study, if there is one.
    """

    machine: Machine
    inputs: Texts
    problem: Problem | None = None
    folder: Path | None = None


def subject_of(name: str, settings: Sequence[str] = ()) -> Subject:
    """The subject that a name or path means: a machine, a study, or the folder of a study.

    Args:
        name: a file, a folder, or the name of a bundled machine or study.
        settings: overrides "path=value" of the machine's or the study's fields.

    Raises:
        InputError: nothing of that name, or a mistake in it or in an override.
    """
    path = Path(name)
    shipped = name in bundled() or name in bundled_studies()
    if not shipped and documents.exists(path) and holds_study(path):
        return _stored(path, settings)
    if is_study(name):
        return _study(name, path, settings)
    machine = load(name, settings)
    return Subject(machine, (_read(name, path),))


def _stored(folder: Path, settings: Sequence[str]) -> Subject:
    if settings:
        raise InputError(f'"{folder}" holds a study with settings of its own; leave out --set.')
    problem = stored_problem(folder)
    return Subject(problem.machine, texts_of(problem), problem, folder)


def texts_of(problem: Problem) -> Texts:
    """Texts from which a problem can be read again, the study first."""
    return ("study.toml", study_toml(problem.study)), ("machine.toml", as_file(problem.machine))


def _study(name: str, path: Path, settings: Sequence[str]) -> Subject:
    problem = load_problem(name, settings)
    machine = problem.study.machine
    study = (f"{name}.toml", bundled_studies()[name]) if name in bundled_studies() else _read(name, path)
    return Subject(problem.machine, (study, _read(machine, path.parent / machine)), problem)


def _read(name: str, path: Path) -> tuple[str, str]:
    """The text of a machine or study file, or of a bundled machine of that name."""
    shipped = bundled()
    return (f"{name}.toml", shipped[name]) if name in shipped else (path.name, path.read_text("utf-8"))
