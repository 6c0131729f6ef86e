"""Cross-sections against closed forms, exact series and thin limits; materials and what they make of a bar."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.machine.cross_section import MATERIALS, CrossSection, rectangle, rigidity, tube

SIZES = st.floats(1e-3, 1.0)
POISSON = st.floats(0.0, 0.5)


@given(SIZES, POISSON)
def test_a_round_bar(diameter, poisson):
    """Shear factor: Cowper 1966, 6 (1 + nu) / (7 + 6 nu)."""
    found = tube(diameter, 0.0, poisson)
    second = math.pi * diameter**4 / 64
    expected = CrossSection(
        math.pi * diameter**2 / 4, second, second, 2 * second, 6 * (1 + poisson) / (7 + 6 * poisson)
    )
    assert vars(found) == pytest.approx(vars(expected), rel=1e-12)


def test_a_bore_that_vanishes_leaves_the_bar():
    assert vars(tube(0.05, 1e-9)) == pytest.approx(vars(tube(0.05)), rel=1e-12)


@given(SIZES, st.floats(0.05, 0.95), POISSON)
def test_a_tube_is_a_bar_less_a_bar(outer, ratio, poisson):
    """Area and second moments are differences; the shear factor lies between those of a bar and of a thin tube."""
    found = tube(outer, ratio * outer, poisson)
    whole, bore = (tube(diameter, 0.0, poisson) for diameter in (outer, ratio * outer))
    for name in ("area", "second_moment_y", "second_moment_z", "torsion_constant"):
        assert getattr(found, name) == pytest.approx(getattr(whole, name) - getattr(bore, name), rel=1e-9)
    assert 2 * (1 + poisson) / (4 + 3 * poisson) < found.shear_factor < whole.shear_factor


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_a_thin_tube(poisson):
    """2 pi r t, pi r^3 t, 2 pi r^3 t; Cowper: 2 (1 + nu) / (4 + 3 nu)."""
    radius, wall = 0.03, 1e-6
    found = tube(2 * radius + wall, 2 * radius - wall, poisson)
    assert found.area == pytest.approx(2 * math.pi * radius * wall, rel=1e-6)
    assert found.second_moment_y == found.second_moment_z == pytest.approx(math.pi * radius**3 * wall, rel=1e-6)
    assert found.torsion_constant == pytest.approx(2 * math.pi * radius**3 * wall, rel=1e-6)
    assert found.shear_factor == pytest.approx(2 * (1 + poisson) / (4 + 3 * poisson), rel=1e-6)


def torsion_by_series(long, short):
    """Saint-Venant's exact solution of a rectangle."""
    terms = [math.tanh(n * math.pi * long / (2 * short)) / n**5 for n in range(1, 200, 2)]
    return long * short**3 * (1 / 3 - 64 / math.pi**5 * short / long * sum(terms))


@given(SIZES, SIZES)
def test_a_rectangle(width, height):
    """Width along y, height along z: a bar that stands high is stiff about y; torsion is the same lying or standing."""
    found = rectangle(width, height)
    assert found.area == pytest.approx(width * height, rel=1e-12)
    assert found.second_moment_y == pytest.approx(width * height**3 / 12, rel=1e-12)
    assert found.second_moment_z == pytest.approx(height * width**3 / 12, rel=1e-12)
    assert found.shear_factor == pytest.approx(5 / 6)
    assert found.torsion_constant == pytest.approx(rectangle(height, width).torsion_constant, rel=1e-12)
    exact = torsion_by_series(max(width, height), min(width, height))
    assert found.torsion_constant == pytest.approx(exact, rel=0.005)


def test_a_square_and_a_strip_in_torsion():
    """0.1406 a^4 (Roark), and b t^3 / 3."""
    assert rectangle(2.0, 2.0).torsion_constant == pytest.approx(0.1406 * 16, rel=2e-3)
    assert rectangle(1.0, 1e-6).torsion_constant == pytest.approx(1e-18 / 3, rel=1e-5)


def test_rigidities_of_a_bar():
    section = CrossSection(2.0, 3.0, 5.0, 7.0, 0.5)
    stiff = rigidity(11.0, 13.0, section)
    assert (stiff.axial, stiff.torsion, stiff.bending_y, stiff.bending_z) == (22.0, 91.0, 33.0, 55.0)
    assert stiff.shear_y == stiff.shear_z == math.inf
    sheared = rigidity(11.0, 13.0, section, shear=True)
    assert sheared.shear_y == sheared.shear_z == 13.0


@pytest.mark.parametrize("name", MATERIALS)
def test_a_material_is_plausible_and_says_where_from(name):
    """Metals are isotropic: nu = E / 2G - 1 lies between 0.2 and 0.35; a woven laminate is soft in shear."""
    material = MATERIALS[name]
    assert (material.name, bool(material.source)) == (name, True)
    poisson = 0.5 * material.youngs_modulus / material.shear_modulus - 1
    assert 0.2 < poisson < 0.35 or (name == "cfrp" and poisson > 1)
    assert 1000.0 < material.density < 10000.0


@pytest.mark.parametrize(("name", "young", "shear"), [("steel", 210e9, 81e9), ("aluminium", 70e9, 27e9)])
def test_moduli_of_the_eurocodes(name, young, shear):
    """EN 1993-1-1, 3.2.6 and EN 1999-1-1, 3.2.5."""
    assert (MATERIALS[name].youngs_modulus, MATERIALS[name].shear_modulus) == (young, shear)


@pytest.mark.parametrize("shape", [tube, rectangle])
def test_many_sections_at_once(shape):
    """Sections may be swept: arrays give what floats give."""
    sizes = np.array([0.03, 0.05, 0.08]), np.array([0.02, 0.045, 0.01])
    together = vars(shape(*sizes))
    for n, pair in enumerate(zip(*sizes, strict=True)):
        alone = vars(shape(*map(float, pair)))
        assert {key: np.broadcast_to(v, 3)[n] for key, v in together.items()} == pytest.approx(alone, rel=1e-14)
