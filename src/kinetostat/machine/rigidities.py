"""Rigidities written as a cross-section and a material: E A, G J or E I from what an engineer orders.

In any field of such a kind a table may stand: { shape = "tube", outer_diameter = "40 mm", inner_diameter = "30 mm",
material = "steel" }. Machines written leg by leg have tables of cross-sections instead.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import TypeAlias

import numpy as np

from kinetostat.machine.cross_section import MATERIALS, SHAPE_KINDS, SHAPES, linear_density_of, rigidity_of
from kinetostat.machine.machine import Family
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.fields import quantities
from kinetostat.units import UnitError, parse

WHICH = {"axial rigidity": "axial", "torsional rigidity": "torsion", "bending rigidity": "bending_y"}
"""Kinds of rigidity, and which of a cross-section's rigidities they are."""
MODULI = ("youngs_modulus", "shear_modulus")
SAME = 1e-9
"""Relative difference up to which two linear densities are one."""

Densities: TypeAlias = float | list[float]
"""Mass per length, kg/m, of a field or of each of its entries; 0 where it is not known."""


def resolve(document: Document, family: Family, origin: str) -> Document:
    """A copy of a document in which each rigidity written as a cross-section is a number, SI.

    What such a link weighs per length goes into [linear_density], unless the document says it there.

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
    heavy = _densities(family, {name: density for name, (_, density) in resolved.items()}, origin)
    written = document.get("linear_density", {})
    return {**result, "linear_density": {**heavy, **written}} if heavy and isinstance(written, dict) else result


def _densities(family: Family, resolved: Mapping[str, Densities], origin: str) -> dict[str, Densities]:
    """Mass per length of each kind of links whose cross-section is known, kg/m."""
    heavy: dict[str, Densities] = {}
    for kind in family.links:
        known = {name: resolved[name] for name in kind.rigidities if np.any(resolved.get(name, 0.0))}
        for density in known.values():
            if not np.allclose(density, heavy.setdefault(kind.name, density), rtol=SAME, atol=0.0):
                raise InputError(
                    f'"{origin}": stiffness.{" and stiffness.".join(known)} describe the same {kind.name}, but '
                    "their cross-sections differ in mass; give both the same cross-section, or one of them as a number."
                )
    return heavy


def _resolved(value: object, which: str, where: str) -> tuple[object, Densities]:
    """A field as numbers, and the linear densities of what stood there as cross-sections."""
    if not isinstance(value, list):
        return _rigidity(value, which, where) if isinstance(value, dict) else (value, 0.0)
    entries = [_resolved(entry, which, f"{where}, entry {i}") for i, entry in enumerate(value)]
    return [number for number, _ in entries], [float(np.max(density, initial=0.0)) for _, density in entries]


def _rigidity(table: Mapping[str, object], which: str, where: str) -> tuple[float, float]:
    rest = dict(table)
    shape = choice(rest.pop("shape", None), SHAPES, f"{where}: shape")
    numbers = {
        size: _size(rest.pop(size, None), SHAPE_KINDS[size], f"{where}: {size}", size == "inner_diameter")
        for size in SHAPES[shape]
    }
    if "material" in rest or not rest.keys() & set(MODULI):
        material = MATERIALS[choice(rest.pop("material", None), MATERIALS, f"{where}: material")]
        numbers |= {name: getattr(material, name) for name in (*MODULI, "density")}
    else:
        numbers |= {name: _size(rest.pop(name, None), "elastic modulus", f"{where}: {name}") for name in MODULI}
        numbers["density"] = 0.0
    if "density" in rest:
        numbers["density"] = _size(rest.pop("density"), "density", f"{where}: density")
    for key in rest:
        raise InputError(
            f"{where}: {key} is not known; a {shape} cross-section has "
            f"{', '.join(SHAPES[shape])}, material and density."
        )
    if shape == "tube" and not numbers["inner_diameter"] < numbers["outer_diameter"]:
        inner, outer = numbers["inner_diameter"], numbers["outer_diameter"]
        raise InputError(f"{where}: inner_diameter is {inner:g} m; it must be less than outer_diameter, {outer:g} m.")
    data = SimpleNamespace(**numbers)
    return float(getattr(rigidity_of(shape, data, shear=False), which)), float(linear_density_of(shape, data))


def _size(value: object, kind: str, where: str, may_be_zero: bool = False) -> float:
    try:
        number = parse(value, kind)
    except UnitError as error:
        given = "missing" if value is None else shorten(value)
        raise InputError(f"{where} is {given}: {error}.") from None
    if number < 0.0 or (number == 0.0 and not may_be_zero):
        raise InputError(f"{where} is {shorten(value)}; it must be greater than 0.")
    return number
