"""Materials and cross-sections: from what an engineer orders to the rigidity of a link, also in the files of families.

Elastic constants are typical values for preliminary design; a file may give its own. In any field of a family for E A,
G J or E I a table may stand: { shape = "tube", outer_diameter = "40 mm", inner_diameter = "30 mm", material =
"steel" }. Machines written leg by leg have tables of cross-sections instead.
"""

import math
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from kinetostat.algebra.scalar import Scalar, reciprocal, smaller
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import RIGID
from kinetostat.machine.link import Rigidity
from kinetostat.machine.links import OF_CROSS_SECTIONS
from kinetostat.machine.machine import Family
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.fields import quantities
from kinetostat.tolerances import SAME_MATTER
from kinetostat.units import UnitError, parse


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material.

    Attributes:
        name: the name as written in files.
        youngs_modulus, shear_modulus: E and G, Pa.
        density: kg/m³.
        expansion: relative growth per kelvin, 1/K.
        source: the origin of the values.
    """

    name: str
    youngs_modulus: float
    shear_modulus: float
    density: float
    expansion: float
    source: str


MATERIALS = {
    material.name: material
    for material in (
        Material(
            name="steel",
            youngs_modulus=210e9,
            shear_modulus=81e9,
            density=7850.0,
            expansion=12e-6,
            source="EN 1993-1-1:2005, 3.2.6; EN 1991-1-1 Table A.4 (density)",
        ),
        Material(
            name="aluminium",
            youngs_modulus=70e9,
            shear_modulus=27e9,
            density=2700.0,
            expansion=23e-6,
            source="EN 1999-1-1:2007, 3.2.5",
        ),
        Material(
            name="cast-iron",
            youngs_modulus=110e9,
            shear_modulus=43.7e9,
            density=7200.0,
            expansion=11.7e-6,
            source="EN 1561:2011, annex A, EN-GJL-250: E 103 to 118 GPa, nu 0.26, expansion between 20 and 200 °C",
        ),
        Material(
            name="cfrp",
            youngs_modulus=70e9,
            shear_modulus=5e9,
            density=1600.0,
            expansion=2.1e-6,
            source="woven standard-modulus carbon/epoxy 0/90, 50 % fibre: Performance Composites, mechanical "
            "properties of carbon fibre composite materials",
        ),
    )
}
"""Materials that files may name."""


@dataclass(frozen=True)
class CrossSection:
    """A cross-section; y and z are its principal axes.

    Attributes:
        area: m².
        second_moment_y, second_moment_z: the second moments of area about y and z, m⁴.
        torsion_constant: J, m⁴.
        shear_factor: kappa, the share of the area that shear sees; infinite where shear is not considered.
    """

    area: Scalar
    second_moment_y: Scalar
    second_moment_z: Scalar
    torsion_constant: Scalar
    shear_factor: Scalar = RIGID


SHEAR_FACTOR = 5.0 / 6.0
"""Shear factor of a solid rectangle, by the energy of the parabola of shear stress across it; taken as well for
cross-sections of which a file gives moments and no shape."""


def tube(outer: Scalar, inner: Scalar = 0.0, poisson: Scalar = 0.3) -> CrossSection:
    """A round tube, or a round bar where `inner` is 0; diameters in m. A Poisson's ratio of 0.3 is that of most metals.

    Source of the shear factor: Cowper 1966, J. Appl. Mech. 33, 335.
    """
    outer_square, inner_square = outer * outer, inner * inner
    area = (math.pi / 4.0) * (outer_square - inner_square)
    second_moment = (math.pi / 64.0) * (outer_square * outer_square - inner_square * inner_square)
    ratio = inner_square * reciprocal(outer_square)
    ring = (1.0 + ratio) * (1.0 + ratio)
    shear_factor = 6.0 * (1.0 + poisson) * ring / ((7.0 + 6.0 * poisson) * ring + (20.0 + 12.0 * poisson) * ratio)
    return CrossSection(area, second_moment, second_moment, 2.0 * second_moment, shear_factor)


def rectangle(width: Scalar, height: Scalar) -> CrossSection:
    """A solid rectangle, `width` along y and `height` along z, m; shear factor 5/6.

    Source of the torsion constant: Roark's Formulas for Stress and Strain, solid rectangle (error below 0.5 percent).
    """
    short = smaller(width, height)
    long = width + height - short
    slender = short / long
    torsion = (
        long
        * short
        * short
        * short
        * (1.0 / 3.0 - 0.21 * slender * (1.0 - slender * slender * slender * slender / 12.0))
    )
    twelfth = width * height * (1.0 / 12.0)
    return CrossSection(width * height, twelfth * height * height, twelfth * width * width, torsion, SHEAR_FACTOR)


def rigidity(young: Scalar, shear_modulus: Scalar, profile: CrossSection, shear: bool = False) -> Rigidity:
    """EA, GJ, EI of a bar, and kappa GA where `shear` is asked for (Timoshenko).

    Args:
        young, shear_modulus: elastic moduli E and G, Pa.
        profile: the cross-section of the bar.
        shear: whether it deflects in shear as well.
    """
    sheared = profile.shear_factor * shear_modulus * profile.area if shear else RIGID
    return Rigidity(
        axial=young * profile.area,
        torsion=shear_modulus * profile.torsion_constant,
        bending_y=young * profile.second_moment_y,
        bending_z=young * profile.second_moment_z,
        shear_y=sheared,
        shear_z=sheared,
    )


SHAPES = {
    "round": ("diameter",),
    "tube": ("outer_diameter", "inner_diameter"),
    "rectangle": ("width", "height"),
    "own": ("area", "second_moment_y", "second_moment_z", "torsion_constant"),
}
"""The shapes of cross-sections that files may name, and the numbers that give them."""

SHAPE_KINDS = {
    "diameter": "length",
    "outer_diameter": "length",
    "inner_diameter": "length",
    "width": "length",
    "height": "length",
    "area": "area",
    "second_moment_y": "second moment of area",
    "second_moment_z": "second moment of area",
    "torsion_constant": "second moment of area",
}
"""Kind of quantity of each of these numbers."""


def rigidity_of(shape: str, data: Any, shear: bool) -> Rigidity:
    """The rigidity of a bar with a cross-section of the file.

    Args:
        shape: a key of `SHAPES`.
        data: an instance of its table.
        shear: whether it deflects in shear as well (Timoshenko).
    """
    return rigidity(data.youngs_modulus, data.shear_modulus, _profile(shape, data), shear)


def linear_density_of(shape: str, data: Any) -> Scalar:
    """Mass per length of such a bar, kg/m; arguments as for `rigidity_of`."""
    return data.density * _profile(shape, data).area


def least_bending_of(shape: str, data: Any) -> Scalar:
    """E I of such a bar about its weaker axis, N·m²; arguments as for `rigidity_of`."""
    profile = _profile(shape, data)
    return data.youngs_modulus * smaller(profile.second_moment_y, profile.second_moment_z)


def _profile(shape: str, data: Any) -> CrossSection:
    poisson = 0.5 * data.youngs_modulus / data.shear_modulus - 1.0
    if shape == "round":
        return tube(data.diameter, 0.0, poisson)
    if shape == "tube":
        return tube(data.outer_diameter, data.inner_diameter, poisson)
    if shape == "rectangle":
        return rectangle(data.width, data.height)
    return CrossSection(data.area, data.second_moment_y, data.second_moment_z, data.torsion_constant, SHEAR_FACTOR)


RIGIDITIES = {"axial rigidity": "axial", "torsional rigidity": "torsion", "bending rigidity": "bending_y"}
"""Fields of `Rigidity` by the kind of quantity that they are."""
MODULI = ("youngs_modulus", "shear_modulus")
"""Fields of a cross-section that may stand in the place of a material."""
OTHER_PROPERTIES = {"density": "density", "expansion": "thermal expansion"}
"""Other properties of a material, and their kind of quantity."""

LinkProperties: TypeAlias = Mapping[str, float | list[float]]
"""Properties of links from cross-sections, beside rigidity: a number of each of `OF_CROSS_SECTIONS`, SI, or a list of
them for a field with several entries; 0 where it is not known. Empty where no cross-section is written."""


class _ReadField(NamedTuple):
    """A field of [stiffness] with numbers in the place of cross-sections, and what these say of the links besides."""

    rigidity: object
    properties: LinkProperties


def with_rigidities(document: Document, family: Family, origin: str) -> Document:
    """A copy of a document in which each rigidity written as a cross-section is a number, SI.

    What such a link weighs per length, its least E I and its expansion go into the tables of the links, unless the
    document says them there.

    Raises:
        InputError: an unknown shape, size or material, or two cross-sections for one link; names the field.
    """
    stiffness = document.get("stiffness")
    if not isinstance(stiffness, dict):
        return document
    read_fields = {
        name: _read_field(stiffness[name], RIGIDITIES[quantity.kind], f'"{origin}": stiffness.{name}')
        for name, quantity in quantities(family.tables["stiffness"]).items()
        if quantity.kind in RIGIDITIES and name in stiffness
    }
    rigidities = {name: field.rigidity for name, field in read_fields.items()}
    properties = {name: field.properties for name, field in read_fields.items()}
    result = {**document, "stiffness": {**stiffness, **rigidities}}
    for table in OF_CROSS_SECTIONS:
        numbers = _of_links(family, table, properties, origin)
        written = document.get(table, {})
        if numbers and isinstance(written, dict):
            result[table] = {**numbers, **written}
    return result


def _of_links(
    family: Family, table: str, properties: Mapping[str, LinkProperties], origin: str
) -> dict[str, float | list[float]]:
    """The numbers of one table, by kind of links, that the cross-sections in the fields of [stiffness] say, SI."""
    numbers: dict[str, float | list[float]] = {}
    for kind in family.links:
        numbers_of_fields = {name: properties.get(name, {}).get(table, 0.0) for name in kind.rigidities}
        known = {name: number for name, number in numbers_of_fields.items() if np.any(number)}
        for number in known.values():
            if not np.allclose(number, numbers.setdefault(kind.name, number), rtol=SAME_MATTER, atol=0.0):
                raise InputError(
                    f'"{origin}": stiffness.{" and stiffness.".join(known)} describe the same {kind.name}, but '
                    "their cross-sections differ in mass; give both the same cross-section, or one of them as a number."
                )
    return numbers


def _read_field(value: object, rigidity_name: str, where: str) -> _ReadField:
    """Read a field of [stiffness]: a number, a cross-section, or a list of these."""
    if isinstance(value, dict):
        return _rigidity(value, rigidity_name, where)
    if not isinstance(value, list):
        return _ReadField(value, {})
    entries = [_read_field(entry, rigidity_name, f"{where}, entry {i}") for i, entry in enumerate(value)]
    properties = {
        table: [float(np.max(entry.properties.get(table, 0.0))) for entry in entries] for table in OF_CROSS_SECTIONS
    }
    return _ReadField([entry.rigidity for entry in entries], properties)


def _rigidity(table: Mapping[str, object], rigidity_name: str, where: str) -> _ReadField:
    """One of the rigidities of the cross-section that a table describes, and what else it says of the link."""
    shape, numbers = _shape_and_numbers(table, where)
    data = SimpleNamespace(**numbers)
    properties = {
        "linear_density": float(linear_density_of(shape, data)),
        "bending_rigidity": float(least_bending_of(shape, data)),
        "expansion": float(data.expansion),
    }
    return _ReadField(float(getattr(rigidity_of(shape, data, shear=False), rigidity_name)), properties)


def _shape_and_numbers(table: Mapping[str, object], where: str) -> tuple[str, dict[str, float]]:
    """The shape of a cross-section, and its sizes and its material as numbers, SI.

    Raises:
        InputError: a field is missing, unknown or out of bounds.
    """
    rest = dict(table)
    shape = choice(rest.pop("shape", None), SHAPES, f"{where}: shape")
    numbers = {
        size: _size(rest.pop(size, None), SHAPE_KINDS[size], f"{where}: {size}", size == "inner_diameter")
        for size in SHAPES[shape]
    }
    if "material" in rest or not rest.keys() & set(MODULI):
        material = MATERIALS[choice(rest.pop("material", None), MATERIALS, f"{where}: material")]
        numbers |= {name: getattr(material, name) for name in (*MODULI, *OTHER_PROPERTIES)}
    else:
        numbers |= {name: _size(rest.pop(name, None), "elastic modulus", f"{where}: {name}") for name in MODULI}
        numbers |= dict.fromkeys(OTHER_PROPERTIES, 0.0)
    for name, kind in OTHER_PROPERTIES.items():
        if name in rest:
            numbers[name] = _size(rest.pop(name), kind, f"{where}: {name}")
    if rest:
        raise InputError(
            f"{where}: {next(iter(rest))} is not known; a {shape} cross-section has "
            f"{', '.join(SHAPES[shape])}, material, density and expansion."
        )
    if shape == "tube" and not numbers["inner_diameter"] < numbers["outer_diameter"]:
        inner, outer = numbers["inner_diameter"], numbers["outer_diameter"]
        raise InputError(f"{where}: inner_diameter is {inner:g} m; it must be less than outer_diameter, {outer:g} m.")
    return shape, numbers


def _size(value: object, kind: str, where: str, may_be_zero: bool = False) -> float:
    try:
        number = parse(value, kind)
    except UnitError as error:
        given = "missing" if value is None else shorten(value)
        raise InputError(f"{where} is {given}: {error}.") from None
    if number < 0.0 or (number == 0.0 and not may_be_zero):
        raise InputError(f"{where} is {shorten(value)}; it must be greater than 0.")
    return number
