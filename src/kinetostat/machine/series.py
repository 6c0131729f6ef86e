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
    named: dict[str, object] = {}
    for name, stiffness in entries:
        key = re.sub(r"\W+", "_", name)
        if not key.isidentifier() or keyword.iskeyword(key) or key.startswith("_") or len(key) > LONGEST_NAME:
            raise InputError(f'{where}: {shorten(name)} cannot name a part; write a short name, e.g. "ball screw".')
        if key in named:
            raise InputError(f'{where}: two parts are called "{label(key)}"; give each a name of its own.')
        named[key] = stiffness
    return named


def label(key: str) -> str:
    """The name of a part for people: its key with spaces."""
    return key.replace("_", " ")


def springs_in_a_row(spring: Spring, named: Sequence[tuple[str, Scalar]], joint: str = "") -> tuple[Spring, ...]:
    """Springs on one freedom in the place of a spring on it; the first of them is the one that its servo drives.

    Args:
        spring: the spring whose place they take; its `part_name` knows the leg.
        named: key and stiffness of each part, N/m or N·m/rad.
        joint: name of the joint, which comes before that of the part; empty to leave it out.
    """
    row = []
    for number, (key, stiffness) in enumerate(named):
        title = f"{joint} {label(key)}".strip()
        part = spring.part_name
        name = PartName(part.leg, title) if isinstance(part, PartName) else f"{part} {label(key)}"
        is_first = number == 0
        row.append(
            replace(
                spring,
                name=name,
                part=name,
                stiffness=stiffness,
                actuated=spring.actuated and is_first,
                hinge=spring.hinge and is_first,
            )
        )
    return tuple(row)


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
    fields = {key: value for key, value in stiffness.items() if key in _stiffnesses(family) and is_series(value)}
    for key in fields:
        if not key.endswith("actuator"):
            raise InputError(
                f'"{origin}": stiffness.{key} is {shorten(fields[key])}; only an actuator is a series of parts, '
                "because they must carry one load along one freedom."
            )
    named = {key: parts(value, f'"{origin}": stiffness.{key}') for key, value in fields.items()}
    return {**document, "stiffness": {**stiffness, **named}}


def family_with_parts(family: Family, document: Document) -> Family:
    """The family whose machine files have a number for each part of the series in a document; itself without any."""
    stiffness = document.get("stiffness")
    fields = stiffness.items() if isinstance(stiffness, dict) else ()
    series = tuple((key, tuple(value)) for key, value in fields if key in _stiffnesses(family) and is_series(value))
    return _family_with_parts(family, series) if series else family


def _stiffnesses(family: Family) -> set[str]:
    known = quantities(family.tables["stiffness"])
    return {name for name, quantity in known.items() if KINDS[quantity.kind].name.endswith("stiffness")}


@lru_cache(KEPT_FAMILIES)
def _family_with_parts(family: Family, series: tuple[tuple[str, tuple[str, ...]], ...]) -> Family:
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
    """Key and stiffness of the parts of a series, where a family has the stiffness of one actuator."""


def _configuration(family: Family, series: tuple[tuple[str, tuple[str, ...]], ...], **tables: Any) -> Configuration:
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
