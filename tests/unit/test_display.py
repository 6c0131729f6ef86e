"""Results in the units that people read: one scale a dimension, chosen once, and numbers that lose nothing."""

import math
from io import StringIO

import pytest
from rich.console import Console

from kinetostat.display import (
    DASH,
    ENGINEERING,
    UNIT_OF,
    Display,
    number,
    number_and_uncertainty,
    read_display,
    without_round_off,
)
from kinetostat.machine.loading import as_toml, build, load
from kinetostat.studies.analysis import analyze
from kinetostat.studio import wording
from kinetostat.units import UnitError, multiple_of_unit, parse
from kinetostat.views.answers import plain_of
from kinetostat.views.report.content import as_table, typeset
from kinetostat.views.tables import numeric_table
from refusals import refused


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (20.0, "20"),
        (0.31244, "0.3124"),
        (0.0012345, "0.001234"),
        (-2.944e-4, "-2.944e-4"),
        (26195.3, "26195"),
        (999449.4, "999449"),
        (999999.6, "1e6"),
        (0.99996, "1"),
        (1.9223676e10, "1.922e10"),
        (math.inf, "∞"),
        (math.nan, DASH),
        (None, DASH),
    ],
)
def test_a_number_has_four_digits_and_no_empty_zeros(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "uncertainty", "texts"),
    [
        (0.9528, 0.93, ("0.95", "0.93")),
        (20.1, 0.4, ("20.10", "0.40")),
        (-56.63, 113.2, ("-57", "113")),
        (-0.3, 86.0, ("0", "86")),
        (21.03112, 0.0039, ("21.0311", "0.0039")),
        (21.05, 0.0, ("21.05", "0")),
        (3.4, math.inf, ("3.4", "∞")),
    ],
)
def test_a_number_has_no_more_decimals_than_its_uncertainty_lets_it(value, uncertainty, texts):
    assert number_and_uncertainty(value, uncertainty) == texts


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.31244, "m", "312.4 mm"),
        (math.radians(10), "rad", "10 deg"),
        (2e7, "N/m", "20 N/µm"),
        (331359.0, "N·m/rad", "0.3314 N·m/µrad"),
        (-3.209330e-7, "rad/N", "-0.3209 µrad/N"),
        (4.749957e-8, "m/N", "0.0475 µm/N"),
        (70e9, "Pa", "70 GPa"),
        (0.26, "1", "0.26"),
        (0.26, "", "0.26"),
        (1.5, "m**3", "1.5 m³"),
    ],
)
def test_a_result_is_shown_in_engineering_units(value, unit, text):
    assert ENGINEERING.show(value, unit) == text


def test_words_stand_for_infinity_and_have_no_unit():
    assert ENGINEERING.show(math.inf, "N/m", "rigid") == "rigid"


def test_small_motions_are_in_the_unit_of_the_compliance():
    assert ENGINEERING.show_deflection(1.234e-5, "m") == "12.34 µm"
    assert ENGINEERING.show_deflection(2e-6, "rad") == "2 µrad"
    assert Display("mm/N").show_deflection(2e-3, "m") == "2 mm"
    assert Display("si, mm").show_deflection(2e-3, "m") == "0.002 m"


@pytest.mark.parametrize(
    ("units", "unit", "values", "shown"),
    [
        ("", "m", [-9e-6, 2e-6, math.nan], "µm"),
        ("", "m", [-9e-6, 2e-3], "mm"),
        ("", "rad", [3e-4], "µrad"),
        ("", "rad", [0.1], "deg"),
        ("mm", "m", [9e-6], "mm"),
        ("si", "m", [9e-6], "m"),
        ("", "N/m", [9e-6], "N/µm"),
    ],
)
def test_motions_that_are_all_small_are_read_in_small_units_unless_chosen(units, unit, values, shown):
    scale = read_display({"units": units}).fitting(unit, values)
    assert scale.unit == shown
    assert multiple_of_unit(scale.unit, [unit], "mm")[1] * scale.factor == pytest.approx(1.0)


def test_units_are_chosen_one_by_one_and_the_dual_unit_follows():
    display = Display("kN m/rad, inch, arcsec")
    assert display.scale("N·m/rad").unit == "kN·m/rad"
    assert display.scale("rad/(N·m)").unit == "rad/(kN·m)"
    assert display.scale("m").factor == pytest.approx(1.0 / 0.0254)
    assert display.scale("rad").factor == pytest.approx(3600.0 * 180.0 / math.pi)
    assert display.scale("N/m").unit == "N/µm", "what is not named stays"
    assert Display("um/N").scale("N/m") == Display("N/um").scale("N/m")


@pytest.mark.parametrize("unit", UNIT_OF)
def test_a_scale_and_its_unit_say_the_same(unit):
    for display in (ENGINEERING, Display("si"), Display("N/mm, N*m/mrad, m, arcmin, kN, t, MPa")):
        scale = display.scale(unit)
        assert multiple_of_unit(scale.unit, [unit], "")[1] * scale.factor == pytest.approx(1.0, rel=1e-14)


def test_stiffness_and_compliance_have_one_factor_so_that_k_c_is_1_as_printed():
    stiff = {ENGINEERING.scale(unit).factor for unit in ("N/m", "N·m/rad", "N/rad")}
    soft = {ENGINEERING.scale(unit).factor for unit in ("m/N", "rad/(N·m)", "rad/N")}
    assert len(stiff) == len(soft) == 1
    assert stiff.pop() * soft.pop() == pytest.approx(1.0)


def test_what_a_field_shows_is_read_back():
    for unit, kind in (("m", "length"), ("N/m", "linear stiffness"), ("N·m/rad", "torsional stiffness")):
        assert parse(ENGINEERING.show(1234.5, unit, digits=10), kind) == pytest.approx(1234.5, rel=1e-14)


@pytest.mark.parametrize("given", [{"units": "furlong"}, {"units": 3}, {"digits": 1}, {"colour": "red"}, "si"])
def test_a_table_display_with_a_mistake_is_refused(given):
    with pytest.raises(UnitError):
        read_display(given)
    with refused("display"):
        build({"family": "hexapod", "name": "x", "display": given})


@pytest.mark.parametrize("name", ["hexapod", "tripteron"])
def test_a_machine_carries_its_display_through_files_and_answers_stay_si(name):
    machine = load(name, ["display.units=si, mm", "display.digits=6"])
    assert machine.display == Display("si, mm", 6)
    assert build(as_toml(machine)).display == machine.display
    assert plain_of(analyze(machine)) == plain_of(analyze(load(name)))
    assert load(name).in_units("N/mm").display.units == "N/mm"
    with refused("furlong"):
        machine.in_units("furlong")


def test_round_off_beside_a_large_value_is_zero_in_every_table():
    """Of the same unit only: a small moment beside a large force may be what is asked for; ratios have no unit."""
    loads = ["8822 N", "-2.382e-8 N", "1.5e-5 N", "2.4e-8 N·m", "–", "rigid"]
    shown = ["8822 N", "0 N", "1.5e-5 N", "2.4e-8 N·m", "–", "rigid"]
    assert without_round_off(loads) == shown
    assert without_round_off(["1", "3e-13"]) == ["1", "3e-13"]
    table = numeric_table("Springs", "spring", ["load"])
    for name, load_text in zip("abcdef", loads, strict=True):
        table.add_row(name, load_text)
    assert [row[1] for row in as_table(table, "").rows] == [typeset(cell) for cell in shown]
    told = StringIO()
    Console(file=told, width=80).print(table)
    assert "e-8 N " not in told.getvalue()
    page = wording.table("springs", ["", "load"], [*map(list, zip("abcdef", loads, strict=True))])
    assert "<td>0 N</td>" in page
    assert "e-8 N<" not in page
