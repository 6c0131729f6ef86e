"""Base of answers and of their parts whose arrays are handed out so that any library takes them.

What answers mean is the business of the rooms that make them.
"""

from typing import Any

import numpy as np

from kinetostat.arrays import AnyArray
from kinetostat.spec.immutable import FixedDict, Immutable

MOST_COPIED = 1000
"""Entries up to which an array is handed out as a copy: vectors and matrices of a pose, not tables of many poses."""


class FixedArray(np.ndarray):
    """A copy of a small array of an answer, whose entries cannot be assigned; `np.array(...)` makes one that can.

    Its memory is not read-only, because some libraries refuse that (SciPy's `Rotation.from_rotvec`). Views are fixed as
    well, while copies and what is computed are their holder's own.
    """

    def __array_finalize__(self, source: Any) -> None:
        self.fixed = self.base is not None and getattr(source, "fixed", True)

    def __array_wrap__(self, array: AnyArray, _context: Any = None, return_scalar: bool = False) -> Any:
        return array[()] if return_scalar else np.asarray(array)

    def __setitem__(self, place: Any, value: Any) -> None:
        if self.fixed:
            raise TypeError("this array belongs to an answer and cannot be changed; copy it with np.array(...)")
        super().__setitem__(place, value)

    def __repr__(self) -> str:
        return repr(np.asarray(self))


class ImmutableAnswer(Immutable):
    """An object that cannot be changed, and hands out small arrays as copies.

    Nothing can be assigned into a copy either, because it would be lost: the next one is what the answer says. A large
    array is not copied, and is read-only.
    """

    def __getattribute__(self, name: str) -> Any:
        return _own_copy(object.__getattribute__(self, name))


def _own_copy(value: Any) -> Any:
    """Return a copy of a small array, also where it stands in a dictionary or among others; else the value itself."""
    if isinstance(value, np.ndarray):
        return np.array(value).view(FixedArray) if value.size <= MOST_COPIED else value
    if type(value) is tuple and value and isinstance(value[0], np.ndarray):
        return tuple(map(_own_copy, value))
    if isinstance(value, FixedDict) and any(isinstance(entry, np.ndarray) for entry in value.values()):
        return FixedDict({key: _own_copy(entry) for key, entry in value.items()})
    return value
