"""The scalars of a machine by path ("geometry.base_radius", "stiffness.passive_links.0"): list, find, replace."""

import difflib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from kinetostat.algebra.scalar import Scalar
from kinetostat.machine.machine import Family, Machine
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Quantity, leaves, quantities

LEG_BY_LEG = ("_angles", "crank_turn", "stiffness.actuator")
"""Ends of the fields of families that have an entry for each leg."""


@dataclass(frozen=True)
class Parameter:
    """A field of a machine file, or one entry of a field that holds several.

    Attributes:
        path: as people write it.
        quantity: kind, meaning and bounds of its values.
        leaves: paths of the scalars it stands for: one, or every entry of the field together.
    """

    path: str
    quantity: Quantity
    leaves: tuple[str, ...]


def parameters(family: Family) -> Iterator[Parameter]:
    """All parameters of a family: every field, and every entry of fields that hold several."""
    for table, fields in family.every_table.items():
        for name, quantity in quantities(fields).items():
            paths = tuple(leaves(f"{table}.{name}", quantity))
            yield Parameter(f"{table}.{name}", quantity, paths)
            if quantity.count is not None:
                yield from (Parameter(path, quantity, (path,)) for path in paths)


def find(family: Family, text: str) -> Parameter:
    """The parameter people mean: its path, or the end of its path where only one parameter ends so.

    Raises:
        InputError: none, several, or several numbers that are never alike; the message lists what is near.
    """
    found = _find(family, text)
    if found.quantity.apart and len(found.leaves) > 1:
        raise InputError(
            f"{found.path} holds {len(found.leaves)} numbers; name one of them: {', '.join(found.leaves)}."
        )
    return found


def _find(family: Family, text: str) -> Parameter:
    known = {parameter.path: parameter for parameter in parameters(family)}
    if text in known:
        return known[text]
    ends = [path for path in known if path.endswith(f".{text}")]
    if len(ends) == 1:
        return known[ends[0]]
    if ends:
        raise InputError(f'"{text}" may be {" or ".join(ends)}; write one of them.')
    near = difflib.get_close_matches(text, [*known, *(path.split(".", 1)[1] for path in known)], 1)
    pose = ", ".join(path for path in known if path.startswith("pose."))
    rest = f"coordinates of its pose are {pose}, and `kinetostat check` shows every field."
    hint = f"did you mean {near[0]}?" if near else rest
    raise InputError(f'"{text}" is not a field of family {family.name}; {hint}')


def values(machine: Machine) -> dict[str, Scalar]:
    """Every scalar of a machine by path, SI."""
    found: dict[str, Scalar] = {}
    for table, fields in machine.family.every_table.items():
        for name, quantity in quantities(fields).items():
            held = getattr(machine.tables[table], name)
            entries = (held,) if quantity.count is None else held
            found.update(zip(leaves(f"{table}.{name}", quantity), entries, strict=True))
    return found


def with_values(machine: Machine, changes: Mapping[str, Any]) -> Machine:
    """The machine with some scalars replaced, by leaf path; the values may be floats or traced scalars."""
    new = {**values(machine), **changes}
    tables = {}
    for table, fields in machine.family.every_table.items():
        made = {}
        for name, quantity in quantities(fields).items():
            entries = tuple(new[path] for path in leaves(f"{table}.{name}", quantity))
            made[name] = entries[0] if quantity.count is None else entries
        tables[table] = fields(**made)
    return replace(machine, tables=tables)


def with_leg(machine: Machine, path: str) -> str:
    """A path for people: "geometry.base_angles.5 (leg 6)", as entries count from 0 and legs have names."""
    field, _, entry = path.rpartition(".")
    if not entry.isdigit() or not field.endswith(LEG_BY_LEG):
        return path
    legs = [leg.name for leg in machine.configure().legs if leg.name.startswith("leg ")]
    count = next(len(p.leaves) for p in parameters(machine.family) if p.path == field)
    return f"{path} ({legs[int(entry)] if len(legs) == count else f'leg {int(entry) + 1}'})"
