"""Machines for other processes: pickled as numbers, with their family by its name or by how it is made.

Functions and classes of a family are made while a program runs and cannot be pickled. Importing this module is enough.
"""

import copyreg
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

from kinetostat.machine.catalogue import family_named
from kinetostat.machine.machine import Family, Machine
from kinetostat.spec.errors import InputError


def _of_machine(machine: Machine) -> tuple[Any, ...]:
    content = {field.name: getattr(machine, field.name) for field in fields(machine)}
    return _machine, ({**content, "tables": {name: dict(vars(table)) for name, table in machine.tables.items()}},)


def _machine(content: Mapping[str, Any]) -> Machine:
    """Put a machine together again."""
    known = content["family"].every_table
    return Machine(**{**content, "tables": {name: known[name](**kept) for name, kept in content["tables"].items()}})


def _of_family(family: Family) -> tuple[Any, ...]:
    if family.recipe is not None:
        return _made, family.recipe
    if family_named(family.name) is not family:
        raise InputError(f'family "{family.name}" cannot be pickled before it is registered; call register(family).')
    return _named, (family.name,)


def _made(recipe: Callable[..., Family], given: tuple[Any, ...]) -> Family:
    """Make a family by its recipe."""
    return recipe(*given)


def _named(name: str) -> Family:
    """Return the family of a name."""
    family = family_named(name)
    if family is None:
        raise InputError(f'family "{name}" is not known in this program; register it before its machines are read.')
    return family


copyreg.pickle(Machine, _of_machine)
copyreg.pickle(Family, _of_family)
