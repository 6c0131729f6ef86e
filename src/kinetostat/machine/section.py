"""Materials and cross-sections: from what an engineer orders to the rigidity of a link. Knows no machine.

Elastic constants are typical values for preliminary design; a file may give its own.
"""

import math
from dataclasses import dataclass

from kinetostat.machine.link import Rigidity


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material.

    Attributes:
        name: as written in files.
        youngs_modulus, shear_modulus: E and G, Pa.
        density: kg/m³.
        source: where the values come from.
    """

    name: str
    youngs_modulus: float
    shear_modulus: float
    density: float
    source: str


MATERIALS = {
    material.name: material
    for material in (
        Material("steel", 210e9, 81e9, 7850.0, "EN 1993-1-1:2005, 3.2.6 (E, G), EN 1991-1-1 Table A.4 (density)"),
        Material("aluminium", 70e9, 27e9, 2700.0, "EN 1999-1-1:2007, 3.2.5"),
        Material("cast-iron", 110e9, 44e9, 7200.0, "EN 1561, EN-GJL-250: E0 103 to 118 GPa, nu 0.26, 7.20 g/cm3"),
        Material(
            "cfrp",
            70e9,
            5e9,
            1600.0,
            "woven standard-modulus carbon/epoxy 0/90, 50 % fibre: Performance Composites, mechanical properties of "
            "carbon fibre composite materials",
        ),
    )
}
"""Materials that files may name."""


@dataclass(frozen=True)
class Section:
    """A cross-section; y and z are its principal axes.

    Attributes:
        area: m².
        second_moment_y, second_moment_z: of area about y and z, m⁴.
        torsion_constant: J, m⁴.
        shear_factor_y, shear_factor_z: kappa, the share of the area that shear along y and z sees.
    """

    area: float
    second_moment_y: float
    second_moment_z: float
    torsion_constant: float
    shear_factor_y: float = math.inf
    shear_factor_z: float = math.inf


def round_section(diameter: float, poisson: float = 0.3) -> Section:
    """A solid round bar; shear factor after Cowper 1966, J. Appl. Mech. 33, 335."""
    return tube_section(diameter, 0.0, poisson)


def tube_section(outer: float, inner: float, poisson: float = 0.3) -> Section:
    """A round tube, diameters in m; shear factor after Cowper 1966, J. Appl. Mech. 33, 335."""
    area = math.pi * (outer**2 - inner**2) / 4.0
    second = math.pi * (outer**4 - inner**4) / 64.0
    ratio = (1.0 + (inner / outer) ** 2) ** 2
    hollow = (20.0 + 12.0 * poisson) * (inner / outer) ** 2
    factor = 6.0 * (1.0 + poisson) * ratio / ((7.0 + 6.0 * poisson) * ratio + hollow)
    return Section(area, second, second, 2.0 * second, factor, factor)


def rectangular_section(width: float, height: float) -> Section:
    """A solid rectangle, `width` along y and `height` along z, m; torsion after Roark (error below 4 percent)."""
    long, short = max(width, height), min(width, height)
    slender = short / long
    torsion = long * short**3 * (1.0 / 3.0 - 0.21 * slender * (1.0 - slender**4 / 12.0))
    factor = 5.0 / 6.0
    return Section(width * height, width * height**3 / 12.0, height * width**3 / 12.0, torsion, factor, factor)


def rigidity(material: Material, section: Section, shear: bool = False) -> Rigidity:
    """EA, GJ, EI of a bar, and kappa GA where `shear` is asked for (Timoshenko)."""
    young, slide = material.youngs_modulus, material.shear_modulus
    return Rigidity(
        axial=young * section.area,
        torsion=slide * section.torsion_constant,
        bending_y=young * section.second_moment_y,
        bending_z=young * section.second_moment_z,
        shear_y=section.shear_factor_y * slide * section.area if shear else math.inf,
        shear_z=section.shear_factor_z * slide * section.area if shear else math.inf,
    )
