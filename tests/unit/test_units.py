"""Quantities as people write them: what is read, what is refused and with which words."""

import math

import pint
import pytest

from kinetostat.units import KINDS, UNITS, USUAL, UnitError, parse, write

GOOD = [
    ("12 cm", "length", 0.12),
    ("12cm", "length", 0.12),
    ("  12   cm  ", "length", 0.12),
    ("+12. cm", "length", 0.12),
    (".5 m", "length", 0.5),
    ("-3e-2 m", "length", -0.03),
    ("1E2 mm", "length", 0.1),
    ("0.68", "length", 0.68),
    (0.68, "length", 0.68),
    (2, "length", 2.0),
    (0, "length", 0.0),
    ("5 um", "length", 5e-6),
    ("5 µm", "length", 5e-6),
    ("5 μm", "length", 5e-6),
    ("10 in", "length", 0.254),
    ("1 m^2/m", "length", 1.0),
    ("1 m**2/m", "length", 1.0),
    ("1 m²/m", "length", 1.0),
    ("30 deg", "angle", math.pi / 6),
    ("-60 degree", "angle", -math.pi / 3),
    ("100 mrad", "angle", 0.1),
    ("0.5 turn", "angle", math.pi),
    ("1000 N/m", "linear stiffness", 1000.0),
    ("20 N/um", "linear stiffness", 2e7),
    ("20 N / um", "linear stiffness", 2e7),
    ("1 kN/mm", "linear stiffness", 1e6),
    ("1e7 N*m/rad", "torsional stiffness", 1e7),
    ("1e7 N·m/rad", "torsional stiffness", 1e7),
    ("1 N*m/deg", "torsional stiffness", 180 / math.pi),
    ("1 lbf/in", "linear stiffness", 4.4482216152605 / 0.0254),
    ("1 arcsec", "angle", math.pi / 648000),
    ("rigid", "linear stiffness", math.inf),
    (" Rigid ", "torsional stiffness", math.inf),
    ("0 N/m", "linear stiffness", 0.0),
    ("10 N*m", "torsional stiffness", 10.0),
    ("2 1/s", "rate", 2.0),
    ("2 deg/s", "rate", math.pi / 90),
    ("2 1/s", "frequency", 2.0),
    ("3 kHz", "frequency", 3000.0),
    ("12e-6 1/K", "thermal expansion", 12e-6),
]


@pytest.mark.parametrize(("written", "kind", "value"), GOOD)
def test_good_quantities(written, kind, value):
    assert parse(written, kind) == pytest.approx(value, rel=1e-15)


FIX = {"length": "12 cm", "angle": "30 deg", "linear stiffness": "20 N/um", "torsional stiffness": "1e7 N*m/rad"}
FIX |= {"rate": "3 rad/s", "frequency": "120 Hz", "ratio": "0.02", "share": "20 um/m", "moment": "20 N*m"}
"""The example that a message about each kind must show."""

BAD = [
    ("12 kg", "length", '"kg" is not a unit of length'),
    ("12 cm2", "length", '"cm2" is not a unit'),
    ("12 parsnips", "length", '"parsnips" is unknown'),
    ("cm", "length", "it must be a length"),
    ("", "length", "it must be a length"),
    ("   ", "length", "it must be a length"),
    ("twelve cm", "length", "it must be a length"),
    ("1,5 m", "length", "is not a unit"),
    ("1_000 m", "length", "is not a unit"),
    ("0x10 m", "length", "is not a unit"),
    ("1 m 2 cm", "length", "is not a unit"),
    ("- 3 m", "length", "it must be a length"),
    ("rigid", "length", "it must be a length"),
    ("rigid", "angle", "it must be an angle"),
    ("nan", "length", "it must be a length"),
    ("inf m", "length", "it must be a length"),
    (math.nan, "length", "not a finite number"),
    (math.inf, "linear stiffness", "not a finite number"),
    (-math.inf, "length", "not a finite number"),
    ("1e999 m", "length", "not a finite number"),
    ("1e308 km", "length", "not a finite number"),
    (10**400, "length", "too large"),
    (True, "length", "it must be a length"),
    (False, "linear stiffness", '"rigid"'),
    (None, "length", "it must be a length"),
    ([1.0], "length", "it must be a length"),
    ({"m": 1}, "length", "it must be a length"),
    (b"1 m", "length", "it must be a length"),
    (1 + 0j, "length", "it must be a length"),
    ("30 parsec", "angle", "is unknown"),
    ("30 %", "angle", "is not a unit"),
    ("2 radian**2", "angle", "is not a unit of angle"),
    ("2 m/m", "angle", "is not a unit of angle"),
    ("2 pi", "angle", "is unknown"),
    ("30 m", "angle", "is not a unit of angle"),
    ("20 N*m/rad", "linear stiffness", "is not a unit of linear stiffness"),
    ("20 N/m", "torsional stiffness", "is not a unit of torsional stiffness"),
    ("20 degC", "length", "is unknown"),
    ("20 degC/m", "length", '"degC/m"'),
    ("20 degC**2", "length", '"degC**2"'),
    ("3 m/3", "length", '"m/3"'),
    ("3 nan", "length", '"nan"'),
    ("3 inf", "length", '"inf"'),
    ("3 Hz", "rate", "is not a unit of rate"),
    ("3 rad/s", "frequency", "is not a unit of frequency"),
    ("10 mm/turn", "length", "is not a unit of length"),
    ("3 deg", "ratio", "is not a unit of ratio"),
    ("3 deg", "share", "is not a unit of share"),
    ("3 N*m/deg", "moment", "is not a unit of moment"),
    ("3 /s", "rate", '"/s" is not a unit'),
]


@pytest.mark.parametrize(("written", "kind", "words"), BAD)
def test_bad_quantities_say_what_is_allowed(written, kind, words):
    with pytest.raises(UnitError) as caught:
        parse(written, kind)
    assert words in str(caught.value)
    assert FIX[kind] in str(caught.value)


ATTACKS = [
    "3 9**9**9",
    "3 m**9**9**9",
    "3 m^99999999",
    "3 m^3^3",
    "3 m^3^3^3^3",
    "3 m**3**3**3**3**3",
    "3 m**2**3**3**3*m",
    "3 (m)",
    "3 m)",
    "3 __import__('os')",
    "3 m;m",
    "3 m.real",
    "3 [m]",
    "3 m\n[m]",
    "3 \x00",
    "9" * 10_000 + " m",
    "3 " + "m*" * 100_000 + "m",
    "3 " + "m" * 1_000_000,
    " " * 1_000_000 + "x",
    "1" * 63 + "x" * 1_000_000,
]


@pytest.mark.parametrize("written", ATTACKS, ids=lambda text: text[:12])
def test_attacks_are_refused_before_they_are_evaluated(written, monkeypatch):
    """Towers of powers, code and endless text: pint would compute 3**3**3**3 for hours, so it must never see one."""
    monkeypatch.setattr("kinetostat.units._registry", lambda: pytest.fail("the unit was evaluated"))
    with pytest.raises(UnitError):
        parse(written, "length")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", [0.0, 0.22, 1.0, 1e-7, 1e10, 1 / 3])
def test_what_is_written_is_read_back_exactly(kind, value):
    assert parse(write(value, kind), kind) == value


def test_what_is_written_has_its_unit():
    assert write(0.22, "length") == "0.22 m"
    assert write(0.03, "ratio") == "0.03"  # of damping, not of lengths
    assert write(math.inf, "linear stiffness") == "rigid"


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_every_example_is_a_quantity_of_its_kind(kind):
    assert parse(kind.example, kind.name) > 0.0


def test_our_units_are_what_pint_knows_under_these_names():
    ours, known = pint.UnitRegistry(str(UNITS)), pint.UnitRegistry()
    names = {*ours, "mm", "µm", "kN", "GPa", "mrad"}
    assert {"deg", "°", "lbf", "psi", "tonne"} <= names
    for name in names:
        mine, theirs = (one.Quantity(1.0, name).to_root_units() for one in (ours, known))
        assert mine.magnitude == pytest.approx(theirs.magnitude, rel=1e-14), name
        assert str(mine.units) == str(theirs.units), name


@pytest.mark.parametrize(("si", "unit", "value"), [(si, *row) for si, rows in USUAL.items() for row in rows.items()])
def test_usual_units_are_those_of_pint_to_the_last_bit(si, unit, value):
    known = pint.UnitRegistry(str(UNITS))
    one, whole = (known.Quantity(1.0, text).to_root_units() for text in (unit, si))
    assert one.units == whole.units
    assert one.magnitude / whole.magnitude == value
