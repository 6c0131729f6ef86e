"""The families of machines in closed form: those whose modules are here, and those that other packages register.

A module has its family as `FAMILY`, or several in a row as `FAMILIES`. A machine is pickled for other processes as
numbers, with its family by name or by how it is made: functions and classes of a family are made while a program runs
and cannot be pickled.
"""

import copyreg
import importlib
import pkgutil
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from typing import Any

from kinetostat.machine.machine import Family, Machine
from kinetostat.machine.written.plan import NAME
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError

PACKAGE = __name__.partition(".")[0]
ENTRY_POINTS = "kinetostat.families"
"""The group in which an installed package names its families, so that the command line knows them as well."""

OTHER_MODULES = {"orthoglide": "delta", "tricept": "passive_leg"}
"""Modules by the beginnings of family names that are not theirs, so that to look such a name up imports one module."""

_REGISTERED: dict[str, Family] = {}


def families() -> dict[str, Family]:
    """Return every family by name, in alphabetical order."""
    return dict(sorted({**_families_of_package(), **_REGISTERED}.items()))


def family_named(name: str) -> Family | None:
    """Return the family of a name, or None if there is none; of this package, only its own module is imported.

    A module's name begins the names of its families, with few exceptions (`OTHER_MODULES`). If no module's does, all
    are looked through, and then those that installed packages register.
    """
    other = next((module for beginning, module in OTHER_MODULES.items() if name.startswith(beginning)), "")
    wanted = other or name.replace("-", "_")
    for module in sorted(_modules(), key=lambda module: not wanted.startswith(module)):
        if name in _families_in(module):
            return _families_in(module)[name]
    if name not in _REGISTERED:
        register_installed()
    return _REGISTERED.get(name)


def _families_of_package() -> dict[str, Family]:
    return {name: family for module in _modules() for name, family in _families_in(module).items()}


def _modules() -> list[str]:
    return [module.name for module in pkgutil.iter_modules(__path__)]


@cache
def _families_in(module: str) -> dict[str, Family]:
    content = vars(importlib.import_module(f"{__name__}.{module}"))
    listed = (*content.get("FAMILIES", ()), *content.values())
    return {value.name: value for value in listed if isinstance(value, Family)}


@checked
def register(family: Family) -> Family:
    """Add a family of machines to those that files may name, until the program ends.

    Machines of it are loaded, analysed, mapped, optimised and saved as those of any other family. A family of the same
    name that was registered before is replaced, as when a notebook's cell runs again.

    Args:
        family: the family with its tables and its kinematics in closed form (see docs/extending.md).

    Returns:
        The family.

    Raises:
        InputError: it is not a family, or kinetostat itself has one of that name.
    """
    if family.name in {*_families_of_package(), NAME}:
        raise InputError(f'family "{family.name}" belongs to kinetostat; choose another name.')
    _REGISTERED[family.name] = family
    return family


@cache
def register_installed() -> None:
    """Register the families that installed packages name as entry points; asked only where a name is not known."""
    from importlib.metadata import entry_points  # takes a quarter of the time of importing NumPy

    for entry in entry_points(group=ENTRY_POINTS):
        register(entry.load())


def family_text(family: Family) -> str | None:
    """Say which family of kinetostat this is, the same in every process; None of any other, whose code may change."""
    if family.recipe is None:
        return family.name if family_named(family.name) is family and family.name not in _REGISTERED else None
    recipe, arguments = family.recipe
    parts = [family_text(part) if isinstance(part, Family) else repr(part) for part in arguments]
    if not recipe.__module__.startswith(f"{PACKAGE}.") or None in parts:
        return None
    return f"{recipe.__module__}.{recipe.__qualname__}({parts})"


def _pickled_machine(machine: Machine) -> tuple[Any, ...]:
    """A function that makes a machine again, and its arguments, as pickle takes them."""
    content = {field.name: getattr(machine, field.name) for field in fields(machine)}
    return _unpickled_machine, (
        {**content, "tables": {name: dict(vars(table)) for name, table in machine.tables.items()}},
    )


def _unpickled_machine(content: Mapping[str, Any]) -> Machine:
    """Put a machine together again."""
    classes = content["family"].every_table
    tables = {name: classes[name](**numbers) for name, numbers in content["tables"].items()}
    return Machine(**{**content, "tables": tables})


def _pickled_family(family: Family) -> tuple[Any, ...]:
    """The recipe by which a family is made again, or the look-up of its name, as pickle takes them."""
    if family.recipe is not None:
        return family.recipe
    if family_named(family.name) is not family:
        raise InputError(f'family "{family.name}" cannot be pickled before it is registered; call register(family).')
    return _family_by_name, (family.name,)


def _family_by_name(name: str) -> Family:
    """Return the family of a name."""
    family = family_named(name)
    if family is None:
        raise InputError(f'family "{name}" is not known in this program; register it before its machines are read.')
    return family


copyreg.pickle(Machine, _pickled_machine)
copyreg.pickle(Family, _pickled_family)
