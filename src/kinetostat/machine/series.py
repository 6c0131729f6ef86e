"""Parts in a row that carry one load, "ball screw 200 N/um", "bearing 400 N/um": how files write them, their springs.

A list of such texts in the place of a stiffness becomes a table with a number for each part, so that each of them is a
parameter, and each has its own share in the attribution.
"""

import keyword
import re
from collections.abc import Sequence
from dataclasses import replace

from kinetostat.algebra.scalar import Scalar
from kinetostat.machine.leg import PartName, Spring
from kinetostat.spec.errors import InputError, shorten

MOST_PARTS = 12
"""Parts of a series: more is a mistake."""

_PART = re.compile(r"\s*([^\W\d_][^.]*?)[\s:]+([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?:\s*[^\d\s].*)?|rigid)\s*")


def is_series(value: object) -> bool:
    """Tell whether a stiffness is written as parts: a table, or a list whose first entry starts with a name."""
    first = value[0] if isinstance(value, list) and value else None
    return isinstance(value, dict) or (isinstance(first, str) and _PART.fullmatch(first) is not None)


def parts(value: object, where: str) -> dict[str, object]:
    """The parts of a series by key ("ball_screw"), each with its stiffness as it is written.

    Args:
        value: a list such as ["ball screw 200 N/um", "bearing 400 N/um"], or a table by name.
        where: names the field in messages.

    Raises:
        InputError: an entry without name or stiffness, one name twice, or too many parts.
    """
    entries = list(value.items()) if isinstance(value, dict) else [_entry(e, where) for e in _list(value, where)]
    if not 1 <= len(entries) <= MOST_PARTS:
        raise InputError(f"{where} has {len(entries)} parts; a series has 1 to {MOST_PARTS}.")
    named: dict[str, object] = {}
    for name, stiffness in entries:
        key = re.sub(r"\W+", "_", name)
        if not key.isidentifier() or keyword.iskeyword(key) or key.startswith("_") or len(key) > 40:
            raise InputError(f'{where}: {shorten(name)} cannot name a part; write a short name, e.g. "ball screw".')
        if key in named:
            raise InputError(f'{where}: two parts are called "{label(key)}"; give each a name of its own.')
        named[key] = stiffness
    return named


def label(key: str) -> str:
    """What people call a part: its key with spaces."""
    return key.replace("_", " ")


def springs_in_a_row(spring: Spring, named: Sequence[tuple[str, Scalar]], joint: str = "") -> tuple[Spring, ...]:
    """Springs on one freedom in the place of a spring on it; the first of them is the one that its servo drives.

    Args:
        spring: whose place they take; its `of` knows the leg.
        named: key and stiffness of each part, N/m or N·m/rad.
        joint: name of the joint, which comes before that of the part; empty to leave it out.
    """
    row = []
    for number, (key, stiffness) in enumerate(named):
        title = f"{joint} {label(key)}".strip()
        name = PartName(spring.of.leg, title) if isinstance(spring.of, PartName) else label(key)
        first = number == 0
        row.append(
            replace(
                spring,
                name=name,
                part=name,
                stiffness=stiffness,
                actuated=spring.actuated and first,
                hinge=spring.hinge and first,
            )
        )
    return tuple(row)


def _list(value: object, where: str) -> list[object]:
    if not isinstance(value, list):
        raise InputError(
            f'{where} is {shorten(value)}; write a list, e.g. ["ball screw 200 N/um", "bearing 400 N/um"].'
        )
    return value


def _entry(entry: object, where: str) -> tuple[str, str]:
    match = _PART.fullmatch(entry) if isinstance(entry, str) else None
    if match is None:
        raise InputError(
            f"{where}: {shorten(entry)} is not a part of a series; write its name and then its stiffness, "
            'e.g. "ball screw 200 N/um".'
        )
    return match[1], match[2]
