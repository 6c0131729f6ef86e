"""Answers that nobody can change from outside: fixed dictionaries, lists and arrays; their equality and hash.

What the answers mean is the business of the rooms that make them.
"""

from dataclasses import fields, is_dataclass
from types import MappingProxyType
from typing import Any, NoReturn, TypeVar

import numpy as np

from kinetostat.arrays import AnyArray

K = TypeVar("K")
V = TypeVar("V")
MOST_COPIED = 1000
"""Entries up to which an array is handed out as a copy: vectors and matrices of a pose, not tables of many poses."""


class _Fixed:
    """The common part of fixed lists and dictionaries: they refuse every change, and can be pickled and hashed."""

    _plain: type

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        kind = self._plain.__name__
        raise TypeError(
            f"this {kind} belongs to a machine or an answer and cannot be changed; copy it with {kind}(...)"
        )

    __setitem__ = __delitem__ = __ior__ = __iadd__ = __imul__ = clear = pop = popitem = setdefault = update = _refuse
    append = extend = insert = remove = reverse = sort = _refuse

    def __hash__(self) -> int:
        return _hash_of(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._plain(self),)


class FixedDict(_Fixed, dict[K, V]):  # type: ignore[misc]
    """A dictionary that cannot be changed; `dict(...)` makes a copy that can."""

    _plain = dict


class FixedList(_Fixed, list[V]):  # type: ignore[misc]
    """A list that cannot be changed; `list(...)` makes a copy that can."""

    _plain = list


class Immutable:
    """Base of frozen dataclasses with `eq=False`: what they hold is fixed, and they are compared by it and hashed.

    NaN equals NaN. Arrays become read-only, lists and dictionaries fixed. Objects that cannot be hashed, as
    datasets, are compared but do not enter the hash.
    """

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            object.__setattr__(self, name, immutable_data(value))

    def __eq__(self, other: object) -> bool:
        return same(self, other) if type(self) is type(other) else NotImplemented

    def __hash__(self) -> int:
        return _hash_of(self)


class FixedArray(np.ndarray):
    """A copy of a small array of an answer, whose entries cannot be assigned; `np.array(...)` makes one that can.

    Its memory is not read-only, because some libraries refuse that (SciPy's `Rotation.from_rotvec`). Views are fixed as
    well, while copies and what is computed are their holder's own.
    """

    def __array_finalize__(self, source: Any) -> None:
        # NumPy calls this for every new array of this class. A view has a base and stays fixed; a copy has none.
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


def immutable_data(value: Any) -> Any:
    """Return data with fixed lists and dictionaries in place of those that could be changed, and read-only arrays."""
    if isinstance(value, _Fixed):
        return value
    if isinstance(value, dict | MappingProxyType):
        return FixedDict({key: immutable_data(entry) for key, entry in value.items()})
    if type(value) in (list, tuple):
        return (FixedList if type(value) is list else tuple)(immutable_data(entry) for entry in value)
    arrays = [variable.values for variable in value.data_vars.values()] if hasattr(value, "data_vars") else [value]
    for array in arrays:
        if hasattr(array, "setflags"):
            array.setflags(write=False)
    return value


def same(a: Any, b: Any) -> bool:
    """Return whether two pieces of data hold the same: entry by entry, NaN equal to NaN, datasets with all labels."""
    if a is b:
        return True
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(entry, b[key]) for key, entry in a.items())
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if hasattr(a, "setflags") and hasattr(b, "setflags"):
        return a.shape == b.shape and bool(((a == b) | ((a != a) & (b != b))).all())
    if hasattr(a, "identical"):
        return bool(a.identical(b))
    if _by_fields(a) and type(a) is type(b):
        return all(same(getattr(a, name), getattr(b, name)) for name in _fields_compared(a))
    return bool(a == b or (a != a and b != b))


def _by_fields(value: Any) -> bool:
    """Return whether the fields decide what equals it: not of a class with a rule of its own."""
    return isinstance(value, Immutable) or (is_dataclass(value) and value.__dataclass_params__.eq)  # type: ignore[union-attr]


def _fields_compared(value: Any) -> list[str]:
    return [field.name for field in fields(value) if field.compare]


def _hash_of(value: Any) -> int:
    """Return a hash that is equal where `same` says so; 0 of what cannot be hashed."""
    if isinstance(value, dict):
        return hash(frozenset((key, _hash_of(entry)) for key, entry in value.items()))
    if isinstance(value, list | tuple):
        return hash(tuple(_hash_of(entry) for entry in value))
    if _by_fields(value):
        return hash((type(value), *(_hash_of(getattr(value, name)) for name in _fields_compared(value))))
    try:
        return hash(value) if value == value else 0  # NaN has a hash of its own
    except (TypeError, ValueError):  # arrays can be neither hashed nor asked as a whole
        return 0
