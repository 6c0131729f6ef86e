"""Rigidities written as a cross-section and a material: E A, G J or E I from what an engineer orders.

In any field of such a kind a table may stand: { shape = "tube", outer_diameter = "40 mm", inner_diameter = "30 mm",
material = "steel" }. Machines written leg by leg have tables of sections instead.
"""

from collections.abc import Mapping
from types import SimpleNamespace

from kinetostat.machine.machine import Family
from kinetostat.machine.section import MATERIALS
from kinetostat.machine.written.plan import SHAPES
from kinetostat.machine.written.sections import SHAPE_KINDS, rigidity_of
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.fields import quantities
from kinetostat.units import UnitError, parse

WHICH = {"axial rigidity": "axial", "torsional rigidity": "torsion", "bending rigidity": "bending_y"}
"""Kinds of rigidity, and which of a section's they are."""
MODULI = ("youngs_modulus", "shear_modulus")


def resolve(document: Document, family: Family, origin: str) -> Document:
    """A copy of a document in which each rigidity written as a cross-section is a number, SI.

    Raises:
        InputError: an unknown shape, size or material; names the field.
    """
    result = dict(document)
    for table, section in family.sections.items():
        written = result.get(table)
        if not isinstance(written, dict):
            continue
        result[table] = written = dict(written)
        for name, quantity in quantities(section).items():
            if quantity.kind in WHICH and name in written:
                written[name] = _number(written[name], WHICH[quantity.kind], f'"{origin}": {table}.{name}')
    return result


def _number(value: object, which: str, where: str) -> object:
    if isinstance(value, list):
        return [_number(entry, which, f"{where}, entry {i}") for i, entry in enumerate(value)]
    return _rigidity(value, which, where) if isinstance(value, dict) else value


def _rigidity(table: Mapping[str, object], which: str, where: str) -> float:
    rest = dict(table)
    shape = choice(rest.pop("shape", None), SHAPES, f"{where}: shape")
    numbers = {size: _size(rest.pop(size, None), SHAPE_KINDS[size], f"{where}: {size}") for size in SHAPES[shape]}
    if "material" in rest or not rest.keys() & set(MODULI):
        material = MATERIALS[choice(rest.pop("material", None), MATERIALS, f"{where}: material")]
        numbers |= {"youngs_modulus": material.youngs_modulus, "shear_modulus": material.shear_modulus}
    else:
        numbers |= {name: _size(rest.pop(name, None), "elastic modulus", f"{where}: {name}") for name in MODULI}
    for key in rest:
        raise InputError(f"{where}: {key} is not known; a {shape} section has {', '.join(SHAPES[shape])} and material.")
    if shape == "tube" and not numbers["inner_diameter"] < numbers["outer_diameter"]:
        raise InputError(f"{where}: inner_diameter must be less than outer_diameter.")
    return float(getattr(rigidity_of(shape, SimpleNamespace(**numbers), shear=False), which))


def _size(value: object, kind: str, where: str) -> float:
    try:
        number = parse(value, kind)
    except UnitError as error:
        said = "missing" if value is None else shorten(value)
        raise InputError(f"{where} is {said}: {error}.") from None
    if number < 0.0 or (number == 0.0 and not where.endswith("inner_diameter")):
        raise InputError(f"{where} is {shorten(value)}; it must be greater than 0.")
    return number
