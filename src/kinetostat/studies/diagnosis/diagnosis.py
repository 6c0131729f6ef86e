"""Checks of an installation, one after the other; where one breaks, the others are still made."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from typing import Any

from kinetostat.spec.installation import installing
from kinetostat.spec.renamed import with_former_keys


class State(StrEnum):
    """Result of a check."""

    SOUND = "sound"
    ABSENT = "absent"
    """Not installed, and not needed."""
    FAILED = "failed"


@dataclass(frozen=True)
class Check:
    """A finding.

    Attributes:
        group: heading under which it is listed.
        name: of the part that was checked.
        state: the result.
        detail: one sentence or number.
        fix: the remedy, where there is one.
    """

    group: str
    name: str
    state: State
    detail: str
    fix: str = ""


class UnsoundError(Exception):
    """A check has found a fault, which the message names."""


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
    return installing(packages.split(), again=True)


PARTS = {"software": "software", "machine": "hardware", "self-test": "self_test"}
"""Modules of this package by what they look at: imported when their turn comes, so that none hides another."""


def diagnose() -> Iterator[Check]:
    """Findings as they are made: packages and extras, what there is to run on, known numbers computed again."""
    for group, part in PARTS.items():
        try:
            yield from import_module(f"{__package__}.{part}").checks()
        except Exception as trouble:
            text = f"cannot be looked at, {type(trouble).__name__}: {str(trouble).partition(chr(10))[0]}"
            yield Check(group, group, State.FAILED, text, reinstall("kinetostat"))


def healthy(checks: Sequence[Check]) -> bool:
    """Whether none of the findings is a failure."""
    return all(check.state is not State.FAILED for check in checks)


def as_json(checks: Sequence[Check]) -> dict[str, Any]:
    """Write the verdict, then the finding of each check by group and name, as plain data."""
    groups: dict[str, Any] = {}
    for check in checks:
        entry = {"state": check.state.value, "detail": check.detail} | ({"fix": check.fix} if check.fix else {})
        groups.setdefault(check.group, {})[check.name] = entry
    return with_former_keys({"healthy": healthy(checks), **groups}, {"said": "detail"})
