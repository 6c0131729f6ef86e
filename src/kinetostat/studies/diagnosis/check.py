"""One finding about an installation, and how a check that may fail becomes one. Knows nothing that is checked."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class State(StrEnum):
    """What became of a check."""

    SOUND = "sound"
    ABSENT = "absent"
    """Not there, and nothing that is needed."""
    FAILED = "failed"


@dataclass(frozen=True)
class Check:
    """A finding.

    Attributes:
        group: what it belongs to, a heading.
        name: what was looked at.
        state: what became of it.
        said: one sentence or number for people.
        fix: what to do about it, where there is something to do.
    """

    group: str
    name: str
    state: State
    said: str
    fix: str = ""


class UnsoundError(Exception):
    """A check that found something wrong; says what."""


def tried(group: str, name: str, question: Callable[[], str], fix: str) -> Check:
    """The answer to a question as a finding; whatever it raises is a failure, because anything may be broken here."""
    try:
        return Check(group, name, State.SOUND, question())
    except UnsoundError as wrong:
        return Check(group, name, State.FAILED, str(wrong), fix)
    except Exception as trouble:
        reason = str(trouble).partition("\n")[0]
        return Check(group, name, State.FAILED, f"{type(trouble).__name__}: {reason}", fix)


def reinstall(packages: str) -> str:
    """The command that mends packages."""
    return f"pip install --force-reinstall {packages}"
