"""Rigidities written as a cross-section and a material: E A, G J or E I from what an engineer orders.

In any field of such a kind a table may stand: { shape = "tube", outer_diameter = "40 mm", inner_diameter = "30 mm",
material = "steel" }. Machines written leg by leg have tables of cross-sections instead.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import TypeAlias

import numpy as np

from kinetostat.machine.cross_section import (
    MATERIALS,
    SHAPE_KINDS,
    SHAPES,
    least_bending_of,
    linear_density_of,
    rigidity_of,
)
from kinetostat.machine.links import OF_CROSS_SECTIONS
from kinetostat.machine.machine import Family
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.fields import quantities
from kinetostat.units import UnitError, parse

WHICH = {"axial rigidity": "axial", "torsional rigidity": "torsion", "bending rigidity": "bending_y"}
"""Kinds of rigidity, and which of a cross-section's rigidities they are."""
MODULI = ("youngs_modulus", "shear_modulus")
OF_MATTER = {"density": "density", "expansion": "thermal expansion"}
"""What else a material says, and its kind of quantity."""
SAME = 1e-9
"""Relative difference up to which two linear densities are one."""

Known: TypeAlias = Mapping[str, float | list[float]]
"""What cross-sections say about links beside their rigidity: a number of each of `OF_CROSS_SECTIONS`, SI, or a list of
them for a field with several entries; 0 where it is not known. Empty where no cross-section is written."""


def resolve(document: Document, family: Family, origin: str) -> Document:
    """A copy of a document in which each rigidity written as a cross-section is a number, SI.

    What such a link weighs per length, its least E I and its expansion go into the tables of the links, unless the
    document says them there.

    Raises:
        InputError: an unknown shape, size or material, or two cross-sections for one link; names the field.
    """
    stiffness = document.get("stiffness")
    if not isinstance(stiffness, dict):
        return document
    resolved = {
        name: _resolved(stiffness[name], WHICH[quantity.kind], f'"{origin}": stiffness.{name}')
        for name, quantity in quantities(family.tables["stiffness"]).items()
        if quantity.kind in WHICH and name in stiffness
    }
    result = {**document, "stiffness": {**stiffness, **{name: numbers for name, (numbers, _) in resolved.items()}}}
    for table in OF_CROSS_SECTIONS:
        known = _of_links(family, table, {name: numbers for name, (_, numbers) in resolved.items()}, origin)
        written = document.get(table, {})
        if known and isinstance(written, dict):
            result[table] = {**known, **written}
    return result


def _of_links(family: Family, table: str, resolved: Mapping[str, Known], origin: str) -> dict[str, float | list[float]]:
    """The numbers of one table of each kind of links whose cross-section is known, SI."""
    numbers: dict[str, float | list[float]] = {}
    for kind in family.links:
        given = {name: resolved.get(name, {}).get(table, 0.0) for name in kind.rigidities}
        known = {name: number for name, number in given.items() if np.any(number)}
        for number in known.values():
            if not np.allclose(number, numbers.setdefault(kind.name, number), rtol=SAME, atol=0.0):
                raise InputError(
                    f'"{origin}": stiffness.{" and stiffness.".join(known)} describe the same {kind.name}, but '
                    "their cross-sections differ in mass; give both the same cross-section, or one of them as a number."
                )
    return numbers


def _resolved(value: object, which: str, where: str) -> tuple[object, Known]:
    """A field as numbers, and what else the cross-sections say that stood there."""
    if not isinstance(value, list):
        return _rigidity(value, which, where) if isinstance(value, dict) else (value, {})
    entries = [_resolved(entry, which, f"{where}, entry {i}") for i, entry in enumerate(value)]
    known = {t: [float(np.max(each.get(t, 0.0))) for _, each in entries] for t in OF_CROSS_SECTIONS}
    return [number for number, _ in entries], known


def _rigidity(table: Mapping[str, object], which: str, where: str) -> tuple[float, Known]:
    rest = dict(table)
    shape = choice(rest.pop("shape", None), SHAPES, f"{where}: shape")
    numbers = {
        size: _size(rest.pop(size, None), SHAPE_KINDS[size], f"{where}: {size}", size == "inner_diameter")
        for size in SHAPES[shape]
    }
    if "material" in rest or not rest.keys() & set(MODULI):
        material = MATERIALS[choice(rest.pop("material", None), MATERIALS, f"{where}: material")]
        numbers |= {name: getattr(material, name) for name in (*MODULI, *OF_MATTER)}
    else:
        numbers |= {name: _size(rest.pop(name, None), "elastic modulus", f"{where}: {name}") for name in MODULI}
        numbers |= dict.fromkeys(OF_MATTER, 0.0)
    for name, kind in OF_MATTER.items():
        if name in rest:
            numbers[name] = _size(rest.pop(name), kind, f"{where}: {name}")
    for key in rest:
        raise InputError(
            f"{where}: {key} is not known; a {shape} cross-section has "
            f"{', '.join(SHAPES[shape])}, material, density and expansion."
        )
    if shape == "tube" and not numbers["inner_diameter"] < numbers["outer_diameter"]:
        inner, outer = numbers["inner_diameter"], numbers["outer_diameter"]
        raise InputError(f"{where}: inner_diameter is {inner:g} m; it must be less than outer_diameter, {outer:g} m.")
    data = SimpleNamespace(**numbers)
    known = map(float, (linear_density_of(shape, data), least_bending_of(shape, data), data.expansion))
    rigid = rigidity_of(shape, data, shear=False)
    return float(getattr(rigid, which)), dict(zip(OF_CROSS_SECTIONS, known, strict=True))


def _size(value: object, kind: str, where: str, may_be_zero: bool = False) -> float:
    try:
        number = parse(value, kind)
    except UnitError as error:
        given = "missing" if value is None else shorten(value)
        raise InputError(f"{where} is {given}: {error}.") from None
    if number < 0.0 or (number == 0.0 and not may_be_zero):
        raise InputError(f"{where} is {shorten(value)}; it must be greater than 0.")
    return number
