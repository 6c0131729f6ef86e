"""Base of answers and of their parts whose arrays are handed out so that any library takes them.

What answers mean is the business of the rooms that make them.
"""

from typing import Any

import numpy as np

from kinetostat.spec.immutable import FixedDict, Immutable

MOST_COPIED = 1000
"""Entries up to which an array is handed out as a copy: vectors and matrices of a pose, not tables of many poses."""


class ImmutableAnswer(Immutable):
    """An object that cannot be changed, and hands out small arrays as copies.

    Some libraries refuse arrays that are read-only (SciPy's `Rotation.from_rotvec`). What is written into a copy
    changes nothing here. A large array is not copied, and is read-only.
    """

    def __getattribute__(self, name: str) -> Any:
        return _own_copy(object.__getattribute__(self, name))


def _own_copy(value: Any) -> Any:
    """Return a copy of a small array, also where it stands in a dictionary or among others; else the value itself."""
    if isinstance(value, np.ndarray):
        return value.copy() if value.size <= MOST_COPIED else value
    if type(value) is tuple and value and isinstance(value[0], np.ndarray):
        return tuple(map(_own_copy, value))
    if isinstance(value, FixedDict) and any(isinstance(entry, np.ndarray) for entry in value.values()):
        return FixedDict({key: _own_copy(entry) for key, entry in value.items()})
    return value
