"""What a machine file may say about tolerances: plus-minus, standard deviations, classes of ISO 286 and ISO 2768."""

import math
import pickle

import pytest

from kinetostat import InputError, build, load
from kinetostat.machine.file_schema import machine_schema
from kinetostat.machine.loading import as_toml
from kinetostat.machine.saving import as_file
from kinetostat.spec.tolerance_table import (
    GRADES,
    SIGMAS,
    SIZES,
    joined_tolerances,
    read_tolerances,
    within_class,
)


def read(value):
    """A single value, read."""
    return read_tolerances({"joints": value})["joints"].deviations[0]


@pytest.mark.parametrize(
    ("text", "kind", "limit", "spread"),
    [
        ("0.05 mm", "length", 5e-5, "uniform"),
        ("±0.05 mm", "length", 5e-5, "uniform"),
        ("+-0.05 mm", "length", 5e-5, "uniform"),
        ("+/- 50 um uniform", "length", 5e-5, "uniform"),
        ("0.05 mm normal", "length", 5e-5, "normal"),
        ("sigma 0.02 mm", "length", 6e-5, "normal"),
        ("1 deg", "angle", math.pi / 180, "uniform"),
        ("sigma 0.1 mrad", "angle", 3e-4, "normal"),
        ("20 um/m", "share", 2e-5, "uniform"),
        ("0.01 %", "share", 1e-4, "uniform"),
        ("5 ppm", "share", 5e-6, "uniform"),
        ("0 mm", "length", 0.0, "uniform"),
    ],
)
def test_a_value_is_read_with_its_unit(text, kind, limit, spread):
    deviation = read(text)
    assert (deviation.kind, deviation.spread) == (kind, spread)
    assert deviation.limit == pytest.approx(limit, rel=1e-12)
    assert deviation.within(kind, 0.0) == deviation.limit
    assert deviation.fits(kind)
    assert not any(deviation.fits(other) for other in {"length", "angle", "share"} - {kind})


@pytest.mark.parametrize(
    ("text", "size", "zone"),
    [("IT7", 0.3, 52e-6), ("IT7 at 300 mm", 9.0, 52e-6), ("ISO 286 IT6", 0.05, 16e-6), ("IT11", 0.0503, 190e-6)],
)
def test_a_grade_is_half_of_its_zone_either_way(text, size, zone):
    assert read(text).within("length", size) == pytest.approx(zone / 2)
    assert not read(text).fits("angle")


def test_grades_follow_the_formula_of_the_standard():
    """Up to 500 mm: so many times 0.45 D^(1/3) + 0.001 D, D the geometric mean of the range; rounded, up to a tenth."""
    factors = {5: 7, 6: 10, 7: 16, 8: 25, 9: 40, 10: 64, 11: 100, 12: 160, 13: 250, 14: 400}
    lows = [1, *SIZES[:-1]]
    for grade, factor in factors.items():
        for low, high, zone in zip(lows, SIZES, GRADES[grade], strict=True):
            mean = math.sqrt(low * high)
            unit = 0.45 * mean ** (1 / 3) + 0.001 * mean if high <= 500 else 0.004 * mean + 2.1
            assert zone == pytest.approx(factor * unit, rel=0.16), (grade, high)
    widths = [GRADES[grade] for grade in sorted(GRADES)]
    assert all(len(row) == len(SIZES) for row in widths)
    assert all(finer < coarser for i in range(13) for finer, coarser in zip(widths[i], widths[i + 1], strict=True))


def test_a_general_tolerance_has_lengths_and_angles():
    medium = read("ISO 2768-mK")
    assert medium.within("length", 0.3) == pytest.approx(0.5e-3)
    assert medium.within("length", 0.4) == pytest.approx(0.5e-3)  # the end belongs to its range
    assert medium.within("length", 0.401) == pytest.approx(0.8e-3)
    assert medium.within("angle", 0.3) == pytest.approx(math.radians(10 / 60))
    assert within_class("v", 9.0, "angle") == pytest.approx(math.radians(20 / 60))
    assert within_class("m", math.nextafter(0.4, 1.0), "angle") == medium.within("angle", 0.4), "round-off is no range"
    with pytest.raises(InputError, match=r"sizes above 0, not for 0 mm"):
        within_class("m", 0.0, "angle")
    with pytest.raises(InputError, match=r"no value for 3000 mm"):
        within_class("f", 3.0, "length")
    with pytest.raises(InputError, match=r"up to 3150 mm"):
        within_class(7, 3.2, "length")


def test_a_class_without_a_nominal_size_says_what_to_write():
    with pytest.raises(InputError, match='write it, for example "IT7 at 300 mm"'):
        read("IT7").within("length", 0.0)


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (5, "a text with a unit"),
        ("5", "with its unit"),
        ("5 kg", "with its unit"),
        ("-1 mm", "not a tolerance from 0"),
        ("2 m", "not a tolerance from 0 to 1 m"),
        ("IT25", "grades IT1 to IT14"),
        ("IT7 at 3 kg", "the nominal size"),
        ("IT7 at 0 mm", "the nominal size"),
        ("", "with its unit"),
        ([], "has 0 values"),
        (["1 mm", "2 mm"], "two tolerances of the kind length"),
        (["IT7", "2 mm"], "two tolerances of the kind length"),
        ({"tolerance": "1 mm", "price": 2}, 'no field "price"'),
        ({"tolerance": "1 mm", "cost": 0}, "joints.cost is 0"),
        ({"tolerance": "1 mm", "cost": True}, "joints.cost is True"),
        ({"cost": 1}, "a text with a unit"),
    ],
)
def test_what_is_not_a_tolerance_is_refused_with_an_example(value, reason):
    with pytest.raises(InputError, match=reason) as refused:
        read_tolerances({"joints": value}, '"mine.toml": ')
    assert str(refused.value).startswith('"mine.toml": tolerances.joints')


def test_too_many_lines_are_refused():
    with pytest.raises(InputError, match="at most 200"):
        read_tolerances({f"legs.{i}": "1 mm" for i in range(201)})


def test_paths_need_no_quotes_and_later_lines_come_last():
    lines = read_tolerances({"joints": "1 mm", "geometry": {"base_radius": "2 mm"}})
    assert list(lines) == ["joints", "geometry.base_radius"]
    assert list(joined_tolerances(lines, read_tolerances({"joints": "3 mm"}))) == ["geometry.base_radius", "joints"]


TEXT = """
[tolerances]
joints = ["0.05 mm", "0.02 deg"]   # as milled
geometry.base_radius = "IT7"
"legs.leg 1.*" = { tolerance = "sigma 0.02 mm", cost = 3.0 }
"""


def machine(settings=()):
    """A machine whose file has tolerances."""
    return build(as_toml(load("hexapod")) + TEXT, "mine.toml", settings)


def test_a_machine_keeps_its_tolerances_wherever_it_goes():
    written = machine(["tolerances.gains=20 um/m", "tolerances.legs.leg 2.*=0.1 mm", "tolerances.joints=1 mm"])
    about = ["geometry.base_radius", "legs.leg 1.*", "gains", "legs.leg 2.*", "joints"]
    assert list(written.tolerances) == about
    assert written.tolerances["legs.leg 1.*"].cost == 3.0
    assert written.tolerances["legs.leg 1.*"].deviations[0].limit == pytest.approx(SIGMAS * 2e-5)
    for again in (build(as_toml(written)), build(as_file(written)), pickle.loads(pickle.dumps(written))):
        assert list(again.tolerances.items()) == list(written.tolerances.items())
    assert written != machine()
    assert "# as milled" in as_file(machine())


def test_the_whole_table_can_be_set():
    assert list(load("hexapod", ['tolerances={joints="1 mm"}']).tolerances) == ["joints"]
    with pytest.raises(InputError, match="it must be a table"):
        load("hexapod", ["tolerances=5"])


def test_the_schema_knows_the_table():
    schema = machine_schema()
    kinds = [kind for kind in (*schema["$defs"].values(), *schema["anyOf"]) if "family" in kind.get("properties", {})]
    assert kinds
    assert all("tolerances" in kind["properties"] for kind in kinds)
