"""Is this installation sound? All findings, one after the other; whatever is broken, the others are still made."""

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

from kinetostat.studies.diagnosis.check import Check, State, reinstall

PARTS = {"software": "software", "machine": "hardware", "self-test": "self_test"}
"""Modules of this package by what they look at: imported when their turn comes, so that none hides another."""


def diagnose() -> Iterator[Check]:
    """Findings as they are made: packages and extras, what there is to run on, known numbers computed again."""
    for group, part in PARTS.items():
        try:
            yield from import_module(f"{__package__}.{part}").checks()
        except Exception as trouble:
            said = f"cannot be looked at, {type(trouble).__name__}: {str(trouble).partition(chr(10))[0]}"
            yield Check(group, group, State.FAILED, said, reinstall("kinetostat"))


def healthy(checks: Sequence[Check]) -> bool:
    """Whether none of the findings is a failure."""
    return all(check.state is not State.FAILED for check in checks)


def as_json(checks: Sequence[Check]) -> dict[str, Any]:
    """As plain data: the verdict, then by group and name what was found."""
    groups: dict[str, Any] = {}
    for check in checks:
        found = {"state": check.state.value, "said": check.said} | ({"fix": check.fix} if check.fix else {})
        groups.setdefault(check.group, {})[check.name] = found
    return {"healthy": healthy(checks), **groups}
