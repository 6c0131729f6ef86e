"""Public words of earlier versions and what they are called now, with the warning that an old word causes.

An old word keeps working for one version. Names of quantities and keys of JSON data are renamed in `RENAMED`, an
attribute at its class, by `former_names` or `renamed_property`.
"""

import sys
import warnings
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Literal, TypeVar

AnyClass = TypeVar("AnyClass")
WordKind = Literal["quantity", "JSON key"]
"""Kinds of public words that `RENAMED` lists: names of quantities, keys of JSON data."""

PACKAGE = __name__.partition(".")[0]
"""The name with which all modules of kinetostat begin."""

RENAMED: Mapping[WordKind, Mapping[str, str]] = MappingProxyType(
    {
        "quantity": {"regularity": "singularity_margin", "side": "aspect"},
        "JSON key": {
            "order": "components",
            "ridges_told": "ridges_text",
            "regularity": "singularity_margin",
            "side": "aspect",
            "compliance": "tangent_compliance",
            "leg_distance": "leg_least_singular_value",
            "platform_distance": "platform_least_singular_value",
            "energy": "net_energy",
            "energy_over_time": "net_energy_over_time",
        },
    }
)
"""The new word for each old one, by kind of word."""

DEPRECATED_KEYS = "deprecated_keys"
"""The key of JSON data under which the old keys are listed, each with the key that replaces it."""


def current_name(name: str, kind: WordKind) -> str:
    """Return the present word for one that may be from an earlier version, and warn if it is.

    Args:
        name: a word as the user wrote it.
        kind: its kind; words that `RENAMED` does not list are returned as they are.
    """
    current = RENAMED[kind].get(name)
    if current is None:
        return name
    _warn(f'The {kind} "{name}" is now called "{current}".')
    return current


def renamed_property(current: str) -> Any:
    """Make a property that keeps the old name of an attribute alive: it warns and returns the attribute `current`."""

    class Former:
        """The old name of an attribute; it learns that name when the class with it is made."""

        def __set_name__(self, owner: type, name: str) -> None:
            self.name = name

        def __get__(self, instance: Any, owner: type | None = None) -> Any:
            if instance is None:
                return self
            _warn(f"{type(instance).__name__}.{self.name} is now called {type(instance).__name__}.{current}.")
            return getattr(instance, current)

    return Former()


def former_names(**current: str) -> Callable[[type[AnyClass]], type[AnyClass]]:
    """Keep old names of a class's attributes alive as `renamed_property` does; a class decorator.

    Args:
        current: the present name for each old one.
    """

    def add(cls: type[AnyClass]) -> type[AnyClass]:
        for former, name in current.items():
            alias = renamed_property(name)
            alias.__set_name__(cls, former)
            setattr(cls, former, alias)
        return cls

    return add


def with_former_keys(data: dict[str, Any], table: Mapping[str, str]) -> dict[str, Any]:
    """Return JSON data in which values stand under their old keys as well as under the present ones.

    Tables and lists inside the data are treated in the same way. The old keys that were added are listed under
    "deprecated_keys" at the top level, so that a program that reads them can tell.

    Args:
        data: the data with the present keys; it is not changed.
        table: the present key for each old one, e.g. `RENAMED["JSON key"]`.
    """
    used: dict[str, str] = {}
    result = _with_old(data, {current: former for former, current in table.items()}, used)
    return {**result, DEPRECATED_KEYS: {**data.get(DEPRECATED_KEYS, {}), **used}} if used else dict(result)


def _with_old(value: Any, former: Mapping[str, str], used: dict[str, str]) -> Any:
    """Return data with old keys beside the present ones; each key that is added is noted in `used`, old to present."""
    if isinstance(value, list | tuple):
        return [_with_old(entry, former, used) for entry in value]
    if not isinstance(value, dict):
        return value
    result = {}
    for key, entry in value.items():
        result[key] = entry if key == DEPRECATED_KEYS else _with_old(entry, former, used)
        old = former.get(key)
        if old is not None and old not in value:
            result[old] = result[key]
            used[old] = key
    return result


def _warn(fact: str) -> None:
    # Python shows such a warning only to the program whose own line it names, so every frame of kinetostat is passed.
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == PACKAGE:
        frame, level = frame.f_back, level + 1
    warnings.warn(f"{fact} The old name will go in the next version.", DeprecationWarning, stacklevel=level)
