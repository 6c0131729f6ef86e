"""Links that grow where they are warmer, and struts that bend away: against forward kinematics and Euler's load."""

import math

import numpy as np
import pytest

from kinetostat import evaluate_grid
from kinetostat.machine.loading import build, load
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import analyze
from kinetostat.studies.assembly_modes import forward
from kinetostat.studies.commanding import command
from kinetostat.studies.under_load import Rest, under_load
from kinetostat.views.loaded import stability_of
from machines import load_without_limits, written

GROWTH = 12e-6 * 40.0
"""Of steel that is 40 K warmer."""
TUBE = '{ shape = "tube", outer_diameter = "6 mm", inner_diameter = "4 mm", material = "steel" }'
SECOND_MOMENT = math.pi / 64.0 * (0.006**4 - 0.004**4)
"""Of that tube, m^4."""


def warmed(kind):
    """Settings that warm one kind of links of a family."""
    return [f"expansion.{kind}=12 um/(m*K)", f"temperature_rise.{kind}=40 K"]


def reached(machine, coordinates):
    """Where P comes to without loads if the actuators stand at these coordinates, base frame, m."""
    return np.array(next(pose for pose in forward(machine, coordinates, starts=1).poses if pose.present).position)


def at_home(machine):
    return np.array([float(c) for c in machine.configure().platform.translation.components()])


def moved(machine):
    """How far warm links move P, base axes, m."""
    state = under_load(machine)
    assert state.rest == Rest.OK
    assert state.residual < 1e-9
    shown = dict(zip(state.components, state.displacement, strict=True))
    return np.array([shown.get(axis, 0.0) for axis in "xyz"])


def test_legs_that_are_warmer_are_legs_that_are_driven_further_out():
    machine = load_without_limits("hexapod", ["pose.x=20 mm", "pose.roll=8 deg", *warmed("legs")])
    longer = {each.name: each.coordinate * (1.0 + GROWTH) for each in analyze(machine).actuators}
    expected = reached(machine, longer) - at_home(machine)
    assert np.abs(expected).max() > 1e-5
    assert moved(machine) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "kind", "field"),
    [
        ("delta", "arms", "geometry.arm_length"),
        ("delta", "bars", "geometry.bar_length"),
        ("orthoglide", "bars", "geometry.bar_length"),
        ("planar-3rrr", "proximal_links", "geometry.proximal_link"),
        ("planar-3rrr", "distal_links", "geometry.distal_link"),
    ],
)
def test_links_that_are_warmer_are_links_that_are_longer(name, kind, field):
    machine = load_without_limits(name)
    length = getattr(machine.tables["geometry"], field.partition(".")[2])
    grown = machine.with_values({field: (1.0 + GROWTH) * length})
    expected = reached(grown, {each.name: each.coordinate for each in analyze(machine).actuators}) - at_home(machine)
    assert np.abs(expected).max() > 1e-6
    assert moved(load_without_limits(name, warmed(kind))) == pytest.approx(expected, abs=1e-11)


LEGS = """
[sections.rod]
shape            = "round"
diameter         = "20 mm"
material         = "aluminium"
temperature_rise = "10 K"
[sections.link]
shape            = "round"
diameter         = "20 mm"
material         = "steel"
temperature_rise = "25 K"
[[legs]]
name = "left"
joints = [
  { name = "foot", type = "revolute", joins = ["base", "tube"], point = ["-200 mm", 0, 0], axis = [0, 0, 1] },
  { name = "drive", type = "prismatic", joins = ["tube", "rod"], point = ["-200 mm", 0, 0], axis = "head", actuated = true, stiffness = "50 N/um", section = "rod" },
  { name = "head", type = "revolute", joins = ["rod", "platform"], point = ["-200 mm", "600 mm", 0], axis = [0, 0, 1] },
]
[[legs]]
name = "right"
joints = [
  { name = "foot", type = "revolute", joins = ["base", "link"], point = ["200 mm", 0, 0], axis = [0, 0, 1] },
  { name = "head", type = "revolute", joins = ["link", "platform"], point = ["200 mm", "600 mm", 0], axis = [0, 0, 1] },
]
links.link = { model = "rigid", section = "link" }
[[legs]]
name = "across"
joints = [
  { name = "foot", type = "revolute", joins = ["base", "tube"], point = ["-200 mm", 0, 0], axis = [0, 0, 1] },
  { name = "drive", type = "prismatic", joins = ["tube", "rod"], point = ["-200 mm", 0, 0], axis = "head", actuated = true, stiffness = "50 N/um" },
  { name = "head", type = "revolute", joins = ["rod", "platform"], point = ["200 mm", "600 mm", 0], axis = [0, 0, 1] },
]
"""  # noqa: E501


def test_sections_of_machines_leg_by_leg_say_how_their_links_grow():
    """A machine of three legs between known points: where circles about the feet meet, to first order by hand."""
    state = under_load(build(written("three legs in a plane", (0, 0.6, 0), {"x": 0, "y": 0.6, "yaw": 0}) + LEGS))
    left, right, across = 23e-6 * 10.0 * 0.6, 12e-6 * 25.0 * 0.6, 0.0
    # The heads rise by the growth of the upright legs; the diagonal keeps its length, which fixes the motion along x.
    right_x = (across * math.hypot(0.4, 0.6) - 0.6 * right) / 0.4
    expected = [(right - left) / 0.4, right_x, 0.5 * (left + right)]
    assert state.displacement == pytest.approx(expected, rel=2e-3)
    assert state.linear == pytest.approx(expected, rel=1e-9)


def test_commands_take_growth_back():
    machine = load("hexapod", warmed("legs"))
    answer = command(machine)
    assert answer.distance_uncorrected[0] > 1e-5
    assert answer.distance_corrected[0] < 1e-12
    assert answer.coordinates[0] == pytest.approx(answer.unloaded[0] / (1.0 + GROWTH), rel=3e-7)


def test_a_link_that_is_warm_without_an_expansion_is_refused():
    with pytest.raises(InputError, match="temperature_rise of legs is given, but nothing says how its material grows"):
        under_load(load("hexapod", ["temperature_rise.legs=3 K"]))
    with pytest.raises(InputError, match="nothing says how its material grows"):
        evaluate_grid(load("hexapod"), ["temperature_rise.legs=0 K:3 K:3"], ["displacement_z"])
    assert evaluate_grid(load("hexapod"), ["temperature_rise.legs=0 K:3 K:3"], ["stiffness_z"]).stiffness_z.size == 3


def test_a_column_between_two_hinges_bends_away_at_the_load_of_euler():
    settings = [f"stiffness.leg_axial={TUBE}", "load.force=[0, 0, -20000]"]
    machine = load_without_limits("hexapod", settings)
    state = under_load(machine)
    by_hand = math.pi**2 * 210e9 * SECOND_MOMENT
    loads = {spring.leg: spring.load for spring in state.springs}
    assert len(state.struts) == 6
    for strut, actuator in zip(state.struts, analyze(machine).actuators, strict=True):
        assert strut.length == pytest.approx(actuator.coordinate, rel=1e-12)
        assert strut.compression == pytest.approx(-loads[strut.leg], rel=1e-3)
        assert strut.euler_load == pytest.approx(by_hand / actuator.coordinate**2, rel=1e-12)
    worst = min(strut.factor for strut in state.struts)
    heavier = under_load(load("hexapod", [*settings[:1], f"load.force=[0, 0, {-20e3 * worst * 1.01}]"]))
    assert heavier.rest is Rest.UNSTABLE
    assert heavier.message.startswith("Strut leg ")
    assert "bends away (and 5 more): it is pressed with" in heavier.message
    assert "bends away at about 0.98" in stability_of(heavier)
    assert state.rest is Rest.OK
    assert state.message.startswith("At rest and stable.")
    assert f"bends away at about {worst:.3g} times this load" in stability_of(state)
    assert heavier.factor > 1.0, "the springs alone would stand"
    assert all(
        strut.factor == math.inf for strut in under_load(load("hexapod", [settings[0], "load.force=[0,0,1e4]"])).struts
    )


def test_bars_of_a_parallelogram_share_the_load_of_their_leg():
    machine = load_without_limits("delta", [f"stiffness.bar_axial={TUBE}", "load.force=[0, 0, 500]"])
    state = under_load(machine)
    assert len(state.struts) == 6
    slopes = [leg.lines[0].direction.z for leg in machine.configure().legs for _ in range(2)]
    carried = sum(-strut.compression * slope for strut, slope in zip(state.struts, slopes, strict=True))
    assert carried == pytest.approx(500.0, rel=1e-3)


def chained(count, force):
    """A column of so many beams in a row between two hinges, and a guide along it."""
    row = ['{ name = "foot", type = "revolute", joins = ["base", "part 1"], point = [0, 0, 0], axis = [0, 0, 1] }']
    for i in range(1, count):
        joins = f'joins = ["part {i}", "part {i + 1}"], point = [0, {i / count}, 0]'
        row.append(f'{{ name = "weld {i}", type = "fixed", {joins} }}')
    head = f'joins = ["part {count}", "platform"], point = [0, 1, 0], axis = [0, 0, 1]'
    row.append(f'{{ name = "head", type = "revolute", {head} }}')
    links = "\n".join(f'"part {i}" = {{ model = "beam", section = "bar" }}' for i in range(1, count + 1))
    return build(
        written("row of beams", (0, 1, 0), {"x": 0, "y": 1, "yaw": 0})
        + f"""
[sections.bar]
shape = "round"
diameter = "10 mm"
material = "steel"
[[legs]]
name = "column"
joints = [{", ".join(row)}]
[legs.links]
{links}
[[legs]]
name = "guide"
joints = [{{ name = "slide", type = "prismatic", joins = ["base", "platform"], point = [0, 1, 0], axis = [0, 1, 0] }}]
[load]
force = [0, {-force!r}, 0]
"""
    )


def test_a_row_of_beams_bends_away_at_the_load_of_euler():
    """Beams with springs at their middle come to it with the square of their length; the limit is Euler's load."""
    euler = math.pi**2 * 210e9 * math.pi * 0.01**4 / 64.0
    eight, sixteen = (under_load(chained(count, 100.0)).factor * 100.0 / euler for count in (8, 16))
    assert (1.0 - eight) / (1.0 - sixteen) == pytest.approx(4.0, rel=0.05)
    assert sixteen + (sixteen - eight) / 3.0 == pytest.approx(1.0, abs=1e-3)
