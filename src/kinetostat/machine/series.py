"""Parts in a row that carry one load, "ball screw 200 N/um", "bearing 400 N/um": how files write them, their springs.

A list of such texts in the place of a stiffness becomes a table with a number for each part, so that each of them is a
parameter, and each has its own share in the attribution.
"""

import keyword
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

from kinetostat.algebra.scalar import Scalar
from kinetostat.machine.leg import Element, Leg, PartName, Spring
from kinetostat.machine.machine import Configuration, Family
from kinetostat.machine.parameters import KEPT_FAMILIES, LONGEST_NAME
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Field, made_table, optional, quantities
from kinetostat.units import KINDS

MOST_PARTS = 12
"""Parts that a series may have: a drive has some five between motor and platform, so that more is a mistake."""

SeriesKeys = tuple[tuple[str, tuple[str, ...]], ...]
"""Fields of [stiffness] that are series, each with the keys of its parts."""

# A name that begins with a letter, then its stiffness: a number with a unit, or "rigid".
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
    by_key: dict[str, object] = {}
    for name, stiffness in entries:
        key = re.sub(r"\W+", "_", name)
        if not key.isidentifier() or keyword.iskeyword(key) or key.startswith("_") or len(key) > LONGEST_NAME:
            raise InputError(f'{where}: {shorten(name)} cannot name a part; write a short name, e.g. "ball screw".')
        if key in by_key:
            raise InputError(f'{where}: two parts are called "{label(key)}"; give each a name of its own.')
        by_key[key] = stiffness
    return by_key


def label(key: str) -> str:
    """The name of a part for people: its key with spaces."""
    return key.replace("_", " ")


def springs_in_a_row(spring: Spring, row: Sequence[tuple[str, Scalar]], joint: str = "") -> tuple[Spring, ...]:
    """Springs on one freedom in the place of a spring on it; the first of them is the one that its servo drives.

    Args:
        spring: the spring whose place they take; its `part_name` knows the leg.
        row: key and stiffness of each part, N/m or N·m/rad.
        joint: name of the joint, which comes before that of the part; empty to leave it out.
    """
    springs: list[Spring] = []
    for key, stiffness in row:
        title, part = f"{joint} {label(key)}".strip(), spring.part_name
        name = PartName(part.leg, title) if isinstance(part, PartName) else f"{part} {label(key)}"
        is_first = not springs
        actuated, hinge = spring.actuated and is_first, spring.hinge and is_first
        springs.append(replace(spring, name=name, part=name, stiffness=stiffness, actuated=actuated, hinge=hinge))
    return tuple(springs)


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


def with_named_parts(document: Document, family: Family, origin: str) -> Document:
    """A copy of a document of a family in which the series of its actuators are tables by part.

    Raises:
        InputError: a series in a field that is not an actuator's, or a part that is not one; names the field.
    """
    stiffness = document.get("stiffness")
    if not isinstance(stiffness, dict):
        return document
    fields = {key: value for key, value in stiffness.items() if key in _stiffness_fields(family) and is_series(value)}
    for key in fields:
        if not key.endswith("actuator"):
            raise InputError(
                f'"{origin}": stiffness.{key} is {shorten(fields[key])}; only an actuator is a series of parts, '
                "because they must carry one load along one freedom."
            )
    tables = {key: parts(value, f'"{origin}": stiffness.{key}') for key, value in fields.items()}
    return {**document, "stiffness": {**stiffness, **tables}}


def family_with_parts(family: Family, document: Document) -> Family:
    """The family whose machine files have a number for each part of the series in a document; itself without any."""
    stiffness = document.get("stiffness")
    fields = stiffness.items() if isinstance(stiffness, dict) else ()
    known = _stiffness_fields(family)
    series = tuple((key, tuple(value)) for key, value in fields if key in known and is_series(value))
    return _family_with_parts(family, series) if series else family


def _stiffness_fields(family: Family) -> set[str]:
    """The fields of [stiffness] that are stiffnesses, and not rigidities of links."""
    known = quantities(family.tables["stiffness"])
    return {name for name, quantity in known.items() if KINDS[quantity.kind].name.endswith("stiffness")}


@lru_cache(KEPT_FAMILIES)
def _family_with_parts(family: Family, series: SeriesKeys) -> Family:
    stiffness_table = family.tables["stiffness"]
    known, in_parts = quantities(stiffness_table), dict(series)
    single = {
        name: Field(quantity, getattr(stiffness_table, name) if name in optional(stiffness_table) else None)
        for name, quantity in known.items()
        if name not in in_parts
    }
    rows = {
        f"stiffness.{field}": made_table(
            "Series",
            {key: Field(replace(known[field], meaning=f"{label(key)}, in a row with the others")) for key in keys},
        )
        for field, keys in series
    }
    tables = {**family.tables, "stiffness": made_table("Stiffness", single), **rows}
    return replace(
        family,
        tables=tables,
        configure=partial(_configuration, family, series),
        recipe=(_family_with_parts, (family, series)),
    )


class SeriesStiffness(tuple[tuple[str, Scalar], ...]):
    """Key and stiffness of the parts of a series, in the place of the stiffness of one actuator.

    A family passes the stiffness of an actuator on to its spring and computes nothing with it. So this goes through its
    `configure` as a number would, and the spring that has got it is then replaced by those of the parts.
    """


def _configuration(family: Family, series: SeriesKeys, **tables: Any) -> Configuration:
    """The machine at its pose, with the parts of each series as springs in the place of one."""
    stiffness_table = family.tables["stiffness"]
    known, stiffnesses = quantities(stiffness_table), dict(vars(tables["stiffness"]))
    for field, keys in series:
        numbers = tables.pop(f"stiffness.{field}")
        columns = [getattr(numbers, key) for key in keys]
        if known[field].count is None:
            stiffnesses[field] = SeriesStiffness(zip(keys, columns, strict=True))
        else:
            stiffnesses[field] = tuple(
                SeriesStiffness(zip(keys, entries, strict=True)) for entries in zip(*columns, strict=True)
            )
    configuration = family.configure(**{**tables, "stiffness": stiffness_table(**stiffnesses)})
    return replace(configuration, legs=tuple(_in_parts(leg) for leg in configuration.legs))


def _in_parts(leg: Leg) -> Leg:
    chain: list[Element] = []
    for element in leg.chain:
        row = element.stiffness if isinstance(element, Spring) else None
        chain += springs_in_a_row(element, row) if isinstance(row, SeriesStiffness) else (element,)  # type: ignore[arg-type]
    return replace(leg, chain=tuple(chain))
