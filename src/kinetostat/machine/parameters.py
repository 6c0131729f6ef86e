"""The scalars of a machine by path ("geometry.base_radius", "stiffness.passive_links.0"): list, find, replace.

Numbers that are hardly what was meant are pointed out here too (`doubts`); what is refused is up to `spec`.
"""

import difflib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from kinetostat.algebra.scalar import Scalar
from kinetostat.machine.column import column
from kinetostat.machine.machine import Family, Machine
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Quantity, leaves, quantities
from kinetostat.units import KINDS

FULL_TURN = 2.0 * math.pi
BEYOND = 100.0
"""How many times the longest of all other lengths a length may be."""
SOFTEST = 100.0
"""N/m: a part that gives 10 mm under 1 N can be neither a drive nor a link of a machine."""


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

    @property
    def shown(self) -> str:
        """Its name for people; see `shown`."""
        return shown(self.path)

    @property
    def unit(self) -> str:
        """The SI unit of its values, as people read it."""
        return KINDS[self.quantity.kind].unit

    @property
    def dimension(self) -> str:
        """Its name in datasets, without dots, so that it can be written as an attribute: x, geometry_base_angles_1."""
        return self.shown.replace(".", "_")


POSE = "pose."


def shown(path: str) -> str:
    """Return a path as people read it: coordinates of the pose by their names alone (x), all others in full."""
    return path.removeprefix(POSE)


def parameters(family: Family) -> Iterator[Parameter]:
    """All parameters of a family: every field, and every entry of fields that hold several."""
    for table, fields in family.every_table.items():
        for name, quantity in quantities(fields).items():
            paths = tuple(leaves(f"{table}.{name}", quantity))
            yield Parameter(f"{table}.{name}", quantity, paths)
            if quantity.count is not None:
                yield from (Parameter(path, quantity, (path,)) for path in paths)


def find(family: Family, text: str) -> Parameter:
    """The parameter people mean: its path, its name in tables or datasets, or the end of its path if no other ends so.

    Args:
        family: of the machine.
        text: "x", "pose.x", "geometry.base_angles.1", "geometry_base_angles_1" or "base_angles.1".

    Raises:
        InputError: none, several, or several numbers that are never alike; the message lists what is near.
    """
    matches = _find(family, text)
    if matches.quantity.apart and len(matches.leaves) > 1:
        raise InputError(
            f"{matches.path} holds {len(matches.leaves)} numbers; name one of them: {', '.join(matches.leaves)}."
        )
    return matches


def _find(family: Family, text: str) -> Parameter:
    known = {parameter.path: parameter for parameter in parameters(family)}
    for exact in (text, f"{POSE}{text}"):
        if exact in known:
            return known[exact]
    ends = [path for path in known if path.endswith(f".{text}") or known[path].dimension == text]
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
    scalars: dict[str, Scalar] = {}
    for table, fields in machine.family.every_table.items():
        for name, quantity in quantities(fields).items():
            given = getattr(machine.tables[table], name)
            entries = (given,) if quantity.count is None else given
            scalars.update(zip(leaves(f"{table}.{name}", quantity), entries, strict=True))
    return scalars


def with_values(machine: Machine, changes: Mapping[str, Any]) -> Machine:
    """The machine with some scalars replaced, by leaf path: by floats, traced scalars or arrays (as columns)."""
    new = {**values(machine), **{path: column(value) for path, value in changes.items()}}
    tables = {}
    for table, fields in machine.family.every_table.items():
        made = {}
        for name, quantity in quantities(fields).items():
            entries = tuple(new[path] for path in leaves(f"{table}.{name}", quantity))
            made[name] = entries[0] if quantity.count is None else entries
        tables[table] = fields(**made)
    return replace(machine, tables=tables)


def with_leg(machine: Machine, path: str) -> str:
    """Return a path for people: "geometry.base_angles.5 (leg 6)", as entries count from 0 and legs have names."""
    field, _, entry = path.rpartition(".")
    whole = next((p for p in parameters(machine.family) if p.path == field and p.quantity.per_leg), None)
    if whole is None:
        return path
    names = {leg.number: leg.name for leg in machine.configure().legs}
    return f"{path} ({names.get(int(entry) + 1, f'leg {int(entry) + 1}')})"


def doubts(machine: Machine) -> Iterator[str]:
    """A sentence for each implausible number: an angle beyond a turn, one length beyond all, no stiffness."""
    numbers = list(_numbers(machine))
    for path, field, kind, value in numbers:
        if kind == "angle" and abs(value) > FULL_TURN * (1.0 + 1e-9):
            yield f'{path} is {value:g} rad, more than a turn; if degrees are meant, write "{value:g} deg".'
        others = [abs(v) for _, other, k, v in numbers if k == kind == "length" and other != field]
        if 0.0 < BEYOND * max(others, default=0.0) < abs(value):
            yield f'{path} is {value:g} m, over {BEYOND:g} times all others; if mm are meant, write "{value:g} mm".'
        if kind == "linear stiffness" and 0.0 < value < SOFTEST:
            yield f'{path} is {value:g} N/m, next to nothing; if N/um are meant, write "{value:g} N/um".'


def _numbers(machine: Machine) -> Iterator[tuple[str, str, str, float]]:
    """Path, field, kind and value of every finite number; once for all entries of a field that are alike."""
    given = values(machine)
    fields = {p.path: p for p in parameters(machine.family)}
    entries = {leaf for p in fields.values() if p.quantity.count for leaf in p.leaves}
    for field in (p for p in fields.values() if p.path not in entries):
        finite = {leaf: float(given[leaf]) for leaf in field.leaves if math.isfinite(given[leaf])}
        alike = {field.path: next(iter(finite.values()))} if len(set(finite.values())) == 1 else finite
        yield from ((path, field.path, field.quantity.kind, value) for path, value in alike.items())
