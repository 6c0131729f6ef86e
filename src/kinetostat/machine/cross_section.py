"""Materials and cross-sections: from what an engineer orders to the rigidity of a link. Knows no machine.

Elastic constants are typical values for preliminary design; a file may give its own.
"""

import math
from dataclasses import dataclass
from typing import Any

from kinetostat.algebra.scalar import Scalar, reciprocal, smaller
from kinetostat.machine.leg import RIGID
from kinetostat.machine.link import Rigidity


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material.

    Attributes:
        name: as written in files.
        youngs_modulus, shear_modulus: E and G, Pa.
        density: kg/m³.
        expansion: relative growth per kelvin, 1/K.
        source: where the values come from.
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
            "steel",
            210e9,
            81e9,
            7850.0,
            12e-6,
            "EN 1993-1-1:2005, 3.2.6; EN 1991-1-1 Table A.4 (density)",
        ),
        Material("aluminium", 70e9, 27e9, 2700.0, 23e-6, "EN 1999-1-1:2007, 3.2.5"),
        Material(
            "cast-iron",
            110e9,
            43.7e9,
            7200.0,
            11.7e-6,
            "EN 1561:2011, annex A, EN-GJL-250: E 103 to 118 GPa, nu 0.26, expansion between 20 and 200 °C",
        ),
        Material(
            "cfrp",
            70e9,
            5e9,
            1600.0,
            2.1e-6,
            "woven standard-modulus carbon/epoxy 0/90, 50 % fibre: Performance Composites, mechanical properties of "
            "carbon fibre composite materials",
        ),
    )
}
"""Materials that files may name."""


@dataclass(frozen=True)
class CrossSection:
    """A cross-section; y and z are its principal axes.

    Attributes:
        area: m².
        second_moment_y, second_moment_z: of area about y and z, m⁴.
        torsion_constant: J, m⁴.
        shear_factor: kappa, the share of the area that shear sees; infinite where shear is not considered.
    """

    area: Scalar
    second_moment_y: Scalar
    second_moment_z: Scalar
    torsion_constant: Scalar
    shear_factor: Scalar = RIGID


def tube(outer: Scalar, inner: Scalar = 0.0, poisson: Scalar = 0.3) -> CrossSection:
    """A round tube, or a round bar where `inner` is 0; diameters in m.

    Source of the shear factor: Cowper 1966, J. Appl. Mech. 33, 335.
    """
    big, small = outer * outer, inner * inner
    area = (math.pi / 4.0) * (big - small)
    second = (math.pi / 64.0) * (big * big - small * small)
    ratio = small * reciprocal(big)
    thick = (1.0 + ratio) * (1.0 + ratio)
    below = (7.0 + 6.0 * poisson) * thick + (20.0 + 12.0 * poisson) * ratio
    return CrossSection(area, second, second, 2.0 * second, 6.0 * (1.0 + poisson) * thick / below)


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
    second = width * height * (1.0 / 12.0)
    return CrossSection(width * height, second * height * height, second * width * width, torsion, 5.0 / 6.0)


def rigidity(young: Scalar, slide: Scalar, profile: CrossSection, shear: bool = False) -> Rigidity:
    """EA, GJ, EI of a bar, and kappa GA where `shear` is asked for (Timoshenko).

    Args:
        young, slide: elastic moduli E and G, Pa.
        profile: its cross-section.
        shear: whether it deflects in shear as well.
    """
    sheared = profile.shear_factor * slide * profile.area if shear else RIGID
    return Rigidity(
        axial=young * profile.area,
        torsion=slide * profile.torsion_constant,
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
    return CrossSection(data.area, data.second_moment_y, data.second_moment_z, data.torsion_constant, 5.0 / 6.0)
