"""The tables [drives] and [servo] as each drive has them: what all drives share, and what a drive has of its own.

A file may have a table [drives.NAME] or [servo.NAME] for a leg or a drive, with the fields in which it differs. A
machine with such tables gets a family of its own, whose files have them. Loads and motions of drives are not here.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import compress
from typing import Any

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal
from kinetostat.machine.actuators import name_of
from kinetostat.machine.common_tables import COMMON
from kinetostat.machine.leg import Leg, PartName, Spring
from kinetostat.machine.machine import Family, Machine
from kinetostat.machine.parameters import KEPT_FAMILIES, AnyMachine, with_values
from kinetostat.spec.document import Document, toml_key
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.fields import quantities

TABLES_OF_DRIVES = ("drives", "servo")
"""Tables of which a drive may have its own."""
MOST_DRIVES = 64
"""Drives that may have tables of their own: more than any machine has, so that more are a mistake."""


def family_with_own_drives(family: Family, document: Document, origin: str) -> Family:
    """The family whose machine files have the tables of single drives that a document has; itself without any.

    Args:
        family: the family of the machine.
        document: the tables of its file.
        origin: names the file in messages.

    Raises:
        InputError: a field that drives do not have, or too many tables.
    """
    tables = []
    for table in TABLES_OF_DRIVES:
        known, written = quantities(COMMON[table]), document.get(table)
        entries = written.items() if isinstance(written, dict) else ()
        for name, fields in entries:
            if name in known or not isinstance(fields, dict):
                continue  # a field of the table itself, known or not
            for field in fields:
                choice(field, known, f'"{origin}": the field of {table}.{toml_key(name)}')
            tables.append((f"{table}.{name}", tuple(field for field in known if field in fields)))
    if len(tables) > len(TABLES_OF_DRIVES) * MOST_DRIVES:
        raise InputError(
            f'"{origin}" has {len(tables)} tables of single drives; at most {MOST_DRIVES} drives have any.'
        )
    return _with_own_drives(family, tuple(tables)) if tables else family


@lru_cache(KEPT_FAMILIES)
def _with_own_drives(family: Family, tables: tuple[tuple[str, tuple[str, ...]], ...]) -> Family:
    return replace(family, own_drives=tables, recipe=(_with_own_drives, (family, tables)))


def check_own_drives(family: Family, legs: Sequence[Leg], origin: str) -> None:
    """Refuse tables of drives that a machine does not have.

    Args:
        family: the family of the machine, whose files have these tables.
        legs: the legs of the machine.
        origin: names its file in messages.

    Raises:
        InputError: names the table, and the drives that there are.
    """
    if not family.own_drives:
        return
    names = dict.fromkeys(
        name for leg in legs for spring in leg.springs if spring.actuated for name in (leg.name, name_of(spring))
    )
    for path, _ in family.own_drives:
        table, _, name = path.partition(".")
        choice(name, names, f'"{origin}": the leg or drive of [{table}.{toml_key(name)}]')


def numbers_of_drive(machine: Machine, table: str, spring: Spring) -> Any:
    """A table of `TABLES_OF_DRIVES` as a drive has it: its own fields in the place of those of all drives.

    A table of the drive comes before that of its leg.

    Args:
        machine: the machine with its tables.
        table: "drives" or "servo".
        spring: the spring of the actuator.
    """
    numbers, part = machine.tables[table], spring.of
    tables = [path for path, _ in machine.family.own_drives if path.startswith(f"{table}.")]
    names = [path.removeprefix(f"{table}.") for path in tables]
    of_leg = [part.leg == name if isinstance(part, PartName) else part.startswith(f"{name} ") for name in names]
    of_drive = [name == name_of(spring) for name in names]
    for path in (*compress(tables, of_leg), *compress(tables, of_drive)):
        numbers = replace(numbers, **vars(machine.tables[path]))
    return numbers


def with_every_drive(machine: AnyMachine, changes: Mapping[str, float]) -> AnyMachine:
    """The machine with fields of [drives] or [servo] replaced for every drive, whether it has its own or not.

    Args:
        machine: a machine.
        changes: new values by path, such as "drives.lead", SI.
    """
    shared_paths = {f"{path}.{field}": f"{path.partition('.')[0]}.{field}" for path, field in _own_fields(machine)}
    single = {path: changes[shared] for path, shared in shared_paths.items() if shared in changes}
    return with_values(machine, {**changes, **single})


def values_of_drives(machine: Machine, path: str) -> list[Any]:
    """All values that a machine has of a field of [drives] or [servo], shared ones first.

    Args:
        machine: a machine.
        path: the path of the field, such as "drives.lead".
    """
    table, _, field = path.partition(".")
    single = [path for path, own_field in _own_fields(machine) if own_field == field and path.startswith(f"{table}.")]
    return [getattr(machine.tables[name], field) for name in (table, *single)]


def _own_fields(machine: AnyMachine) -> list[tuple[str, str]]:
    """Each field in a table of a single drive: the path of the table, and the name of the field."""
    return [(path, field) for path, fields in machine.family.own_drives for field in fields]


def rotor_turns(spring: Spring, drives: Any) -> Scalar:
    """Radians by which the rotor of an actuator turns per metre or radian of the actuator; 0.0 if nothing says it.

    Args:
        spring: the actuator's spring.
        drives: the table [drives] as this drive has it, see `numbers_of_drive`.

    Raises:
        InputError: rotors have an inertia or friction, but nothing says how far they turn.
    """
    slides = spring.joint.point is None
    transmission = drives.lead if slides else drives.ratio
    if is_zero(transmission):
        if all(is_zero(number) for number in (drives.rotor_inertia, drives.rotor_damping, drives.rotor_friction)):
            return 0.0
        field, example, kind = ("lead", '"10 mm"', "linear") if slides else ("ratio", "50", "rotary")
        raise InputError(
            f"drives.{field} is 0, but drives.rotor_inertia, drives.rotor_damping or drives.rotor_friction is given "
            f"and the actuators are {kind}: nothing says how far a rotor turns; write {field} = {example} in the "
            "table [drives]."
        )
    return reciprocal(transmission) * (2.0 * math.pi) if slides else transmission
