"""Bundled study files, and how to get at them by name. Nothing is evaluated here."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.late import LateModule
from kinetostat.machine.loading import bundled
from kinetostat.spec import document as documents
from kinetostat.spec.immutable import FixedDict

if TYPE_CHECKING:
    from kinetostat.spec import study
    from kinetostat.spec.study import StudyFile
else:
    study = LateModule("kinetostat.spec.study")

SUFFIX = ".toml"
SIMPLEST = "zhang-gosselin-2002"


@cache
def bundled_studies() -> dict[str, str]:
    """The text of every bundled study file by name, in alphabetical order."""
    files = sorted(Path(__file__).parent.glob(f"*{SUFFIX}"), key=lambda file: file.name)
    return FixedDict({file.stem: file.read_text(encoding="utf-8") for file in files})


def is_study(name: str) -> bool:
    """Whether a name or path means a study: a bundled one, or a file that says so.

    Raises:
        InputError: the file cannot be read.
    """
    if name in bundled_studies() or name in bundled() or not documents.exists(Path(name)):
        return name in bundled_studies()
    return documents.is_study(documents.read(Path(name)))


def study_of(name: str, settings: Sequence[str] = ()) -> "StudyFile":
    """A bundled study with overrides "path=value".

    Raises:
        InputError: a mistake in an override.
    """
    return study.read_study(documents.parse(bundled_studies()[name], name), name, settings)


def study_template() -> str:
    """The text of a commented study file to start from."""
    return bundled_studies()[SIMPLEST]
