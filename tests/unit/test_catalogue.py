"""Closed-form kinematics and statics of every family in the catalogue, against moving the pose a little."""

import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from elastic import leg_compliance
from kinetostat.kinematics.closing import why_out_of_reach
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.actuators import actuators_of
from kinetostat.machine.loading import build, bundled
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.spec.fields import optional
from machines import load_without_limits as load

STEP = 1e-6
DIFFERENCED = 1e-7
"""Central differences: truncation STEP^2 times third derivatives of up to 1e4, and the rounding unit over STEP."""
ROUNDED = 1e-9
INFINITE = float("inf")
NAMES = [name for name in bundled() if load(name).family.chains is None]
CRANKS = [name for name in NAMES if "geometry.crank_length" in values(load(name))]
DRIVEN = [name for name in NAMES if name.endswith("driven")]

every_machine = pytest.mark.parametrize("name", NAMES)


def components(screw_or_vector):
    return np.array(screw_or_vector.components(), dtype=float)


def somewhere(name, seed=0):
    """The bundled machine at a pose some centimetres and degrees away, where nothing is special."""
    machine, random = load(name), np.random.default_rng(seed)
    pose = {p: v for p, v in values(machine).items() if p.startswith("pose.")}
    return with_values(machine, {p: v + float(random.uniform(-0.04, 0.04)) for p, v in pose.items()})


def coordinates(machine):
    return [path for path in values(machine) if path.startswith("pose.")]


def neighbours(machine, path):
    at = values(machine)[path]
    return [with_values(machine, {path: at + step}).configure() for step in (-STEP, STEP)]


def platform_twist(machine, path):
    """At P, per unit of one pose coordinate, by moving it."""
    before, after = (configuration.platform for configuration in neighbours(machine, path))
    here = machine.configure().platform.rotation
    axes = [[components(getattr(q.rotation, axis)) for axis in "xyz"] for q in (before, after)]
    spin = (np.array(axes[1]) - np.array(axes[0])).T @ np.array([components(getattr(here, axis)) for axis in "xyz"])
    spin /= 2 * STEP
    velocity = components(after.translation - before.translation) / (2 * STEP)
    return np.array([spin[2, 1], spin[0, 2], spin[1, 0], *velocity])


def moving(leg):
    """Joints that move while links stay rigid, passive ones and actuators: each with its element."""
    found = []
    for element in leg.chain:
        found += [(element, joint) for joint in element.freedoms]
        found += [(element, spring.joint) for spring in element.springs if spring.actuated]
    return found


def joint_rates(leg, reference, twist):
    """Rates of `moving` joints (least squares) that give the platform that twist, and what they leave of it."""
    screws = np.array([components(joint.twist(reference)) for _, joint in moving(leg)]).T
    rates = np.linalg.lstsq(screws, twist, rcond=1e-10)[0]
    return rates, screws @ rates - twist


def actuator_rates(machine, path):
    """Of every actuator, leg by leg, per unit of a pose coordinate."""
    configuration, twist = machine.configure(), platform_twist(machine, path)
    found = []
    for leg in configuration.legs:
        rates, _ = joint_rates(leg, configuration.platform.translation, twist)
        actuated = [element in leg.springs for element, _ in moving(leg)]
        found += [rate for rate, own in zip(rates, actuated, strict=True) if own]
    return found


@every_machine
def test_the_bundled_pose_is_regular(name):
    response = respond(load(name))
    assert response.status == Status.OK
    assert response.singularity_margin > 0.05


@every_machine
def test_a_leg_carries_all_that_does_no_work_on_its_passive_joints(name):
    machine = somewhere(name)
    configuration = machine.configure()
    absent = configuration.plane.missing_freedoms if configuration.plane else ()
    for leg in configuration.legs:
        screws = leg.screws(configuration.platform.translation, configuration.length, absent)
        twists, wrenches = (np.array([components(s) for s in found]) for found in (screws.passive, screws.wrenches))
        assert np.abs(twists @ wrenches.T).max() <= 1e-12
        assert np.linalg.matrix_rank(twists, 1e-9) + np.linalg.matrix_rank(wrenches, 1e-9) == 6


@every_machine
@pytest.mark.parametrize("seed", range(3))
def test_joints_move_as_their_twists_say(name, seed):
    """The platform's motion is one the joints allow, and carries every joint along as the joints before it do."""
    machine = somewhere(name, seed)
    configuration = machine.configure()
    reference = configuration.platform.translation
    for path in coordinates(machine):
        twist = platform_twist(machine, path)
        around = neighbours(machine, path)
        for leg, before, after in zip(configuration.legs, *(c.legs for c in around), strict=True):
            rates, left = joint_rates(leg, reference, twist)
            assert np.abs(left).max() <= DIFFERENCED * (1 + np.abs(twist).max())
            places = [element.path for element in leg.chain]
            moved = [[element.path for element in other.chain] for other in (before, after)]
            for i, here in enumerate(places):
                for j, point in enumerate(here):
                    velocity = components(moved[1][i][j] - moved[0][i][j]) / (2 * STEP)
                    assert velocity == pytest.approx(carried(leg, rates, i, j, point), abs=DIFFERENCED * 10)


def carried(leg, rates, index, end, point):
    """Velocity of the point by the joints up to its element; that element's own freedom moves only its far end."""
    before = leg.chain[: index + bool(end)]
    shares = zip(moving(leg), rates, strict=True)
    taken = [
        components(joint.twist(point)) * rate for (element, joint), rate in shares if any(element is b for b in before)
    ]
    return sum(taken, np.zeros(6))[3:]


@every_machine
def test_rigid_links_leave_the_compliance_of_the_actuators(name):
    """C = T (A^T k A)^-1 T^T, with T the platform twists and A the actuator rates per unit of the pose coordinates."""
    machine = somewhere(name)
    stiff = [leaf for p in parameters(machine.family) if p.quantity.stiff for leaf in p.leaves]
    links = {path: INFINITE for path in stiff if "actuator" not in path}
    machine = with_values(machine, links)
    found = np.array(respond(machine).compliance.rows(), dtype=float)
    twists = np.array([platform_twist(machine, path) for path in coordinates(machine)]).T
    rates = np.array([actuator_rates(machine, path) for path in coordinates(machine)]).T
    held = [s.stiffness for leg in machine.configure().legs for s in leg.springs if s.actuated]
    expected = twists @ np.linalg.inv(rates.T @ np.diag(held) @ rates) @ twists.T
    for part in (slice(0, 3), slice(3, 6)):
        block = expected[part, part]
        assert np.abs(found[part, part] - block).max() <= 1e-5 * np.abs(block).max() + 1e-18


@pytest.mark.parametrize("name", CRANKS)
def test_cranks_and_rods_have_their_lengths_and_cranks_point_outward(name):
    machine = somewhere(name)
    geometry = machine.tables["geometry"]
    for leg, turn in zip([leg for leg in machine.configure().legs if leg.lines], geometry.crank_turn, strict=True):
        base, elbow, tip = (components(point) for point in leg.path)
        assert np.linalg.norm(elbow - base) == pytest.approx(geometry.crank_length, rel=1e-12)
        assert np.linalg.norm(tip - elbow) == pytest.approx(geometry.rod_length, rel=1e-12)
        assert np.linalg.norm(base[:2]) == pytest.approx(geometry.base_radius, rel=1e-12)
        radial = base[:2] / geometry.base_radius
        c, s = math.cos(turn), math.sin(turn)
        side = np.array([c * radial[0] - s * radial[1], s * radial[0] + c * radial[1], 0.0])
        assert abs(np.cross(elbow - base, side)[2]) <= 1e-12, "the crank has left its plane"
        way = tip - base
        assert np.cross(np.cross([0.0, 0.0, 1.0], side), way) @ (elbow - base) > 0.0, "the elbow has changed sides"


@pytest.mark.parametrize("name", CRANKS)
def test_a_crank_leg_yields_as_a_cantilever_with_a_rod(name):
    """G = f_t^2 a^2 / k + (f_t^2 + f_n^2) a^3 / 3 EI + L / EA for a unit force along the rod."""
    machine = somewhere(name)
    geometry, stiffness = machine.tables["geometry"], machine.tables["stiffness"]
    a, configuration = geometry.crank_length, machine.configure()
    for leg, k in zip([leg for leg in configuration.legs if leg.lines], stiffness.actuator, strict=True):
        base, elbow, tip = (components(point) for point in leg.path)
        axis, crank, force = (
            components(leg.springs[0].joint.axis),
            (elbow - base) / a,
            (tip - elbow) / geometry.rod_length,
        )
        swing, across = force @ np.cross(axis, crank), force @ axis
        bent = (swing**2 + across**2) * a**3 / (3 * stiffness.crank_bending)
        expected = (swing * a) ** 2 / k + bent + geometry.rod_length / stiffness.leg_axial
        screws = leg.screws(configuration.platform.translation, configuration.length)
        assert leg_compliance(screws)[0][0] == pytest.approx(expected, rel=ROUNDED)


def test_planar_cranks_yield_likewise():
    machine = somewhere("planar-3rrr")
    geometry, stiffness, configuration = (
        machine.tables["geometry"],
        machine.tables["stiffness"],
        machine.configure(),
    )
    a, rod = geometry.proximal_link, geometry.distal_link
    for leg, k in zip(configuration.legs, stiffness.actuator, strict=True):
        base, elbow, tip = (components(point) for point in leg.path)
        assert (np.linalg.norm(elbow - base), np.linalg.norm(tip - elbow)) == pytest.approx((a, rod), rel=1e-12)
        assert np.cross(tip - base, elbow - base)[2] > 0.0, "the elbow is on the left"
        swing = np.cross(elbow - base, (tip - elbow) / rod)[2]
        expected = swing**2 / k + swing**2 * a / (3 * stiffness.proximal_bending) + rod / stiffness.distal_axial
        screws = leg.screws(configuration.platform.translation, configuration.length)
        assert leg_compliance(screws)[0][0] == pytest.approx(expected, rel=ROUNDED)


def cantilever(length, along, bending, torsion):
    """Compliance [6 x 6] of a beam's end, moment and force there to rotation and displacement."""
    x = along[:, None] @ along[None, :]
    cross = np.array([[0, -along[2], along[1]], [along[2], 0, -along[0]], [-along[1], along[0], 0]])
    turn = x * length / torsion + (np.eye(3) - x) * length / bending
    couple = cross * length**2 / (2 * bending)
    return np.block([[turn, couple], [couple.T, (np.eye(3) - x) * length**3 / (3 * bending)]])


@pytest.mark.parametrize("name", ["delta", "orthoglide"])
def test_a_leg_with_bars_yields_as_beam_theory_says(name):
    """Drive, then a cantilever loaded at its end by both bars, then L / EA for each bar."""
    machine = somewhere(name)
    geometry, stiffness, configuration = (
        machine.tables["geometry"],
        machine.tables["stiffness"],
        machine.configure(),
    )
    is_delta = name == "delta"
    bending, torsion = (
        (stiffness.arm_bending, stiffness.arm_torsion) if is_delta else (stiffness.foot_bending, stiffness.foot_torsion)
    )
    for leg, k in zip(configuration.legs, stiffness.actuator, strict=True):
        base, elbow, tip = (components(point) for point in leg.path)
        bar = (tip - elbow) / geometry.bar_length
        assert np.linalg.norm(bar) == pytest.approx(1.0, rel=1e-12)
        ends = [components(line.point) + elbow - tip for line in leg.lines]
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(geometry.bar_spacing, rel=1e-12)
        forces = np.array([[*np.cross(end - elbow, bar), *bar] for end in ends]).T
        length = np.linalg.norm(elbow - base)
        yielding = cantilever(length, (elbow - base) / length, bending, torsion)
        axis = components(leg.springs[0].joint.axis)
        drive = np.array([*axis, *np.cross(axis, elbow - base)]) if is_delta else np.array([0.0, 0.0, 0.0, *axis])
        yielding += drive[:, None] @ drive[None, :] / k
        expected = forces.T @ yielding @ forces + np.eye(2) * geometry.bar_length / stiffness.bar_axial
        found = leg_compliance(leg.screws(configuration.platform.translation, configuration.length))
        assert np.abs(np.array(found) - expected).max() <= ROUNDED * np.abs(expected).max()


def test_the_orthoglide_is_isotropic_at_the_origin():
    machine = load(
        "orthoglide", ["stiffness.bar_axial=rigid", "stiffness.foot_bending=rigid", "stiffness.foot_torsion=rigid"]
    )
    found = np.array(respond(machine).compliance.rows(), dtype=float)[3:, 3:]
    assert found == pytest.approx(np.eye(3) / 50e6, abs=1e-20)


def test_the_slides_of_the_orthoglide_push_and_their_feet_stand_square():
    machine = somewhere("orthoglide")
    for leg, forward in zip(machine.configure().legs, np.eye(3), strict=True):
        rail, slide, joint = (components(point) for point in leg.path)
        side = components(leg.lines[0].point - leg.lines[1].point)
        assert np.abs(np.cross(slide, forward)).max() <= 1e-15, "the slide is not on its axis"
        assert (joint - slide) @ forward > 0.0, "the slide is ahead of the platform"
        assert (slide - rail) @ np.array([forward, side]).T == pytest.approx([0.0, 0.0], abs=1e-15)
        assert np.linalg.norm(slide - rail) == pytest.approx(machine.tables["geometry"].foot_length)


def test_the_cranks_of_the_delta_point_outward():
    for leg in load("delta").configure().legs:
        base, elbow, _ = (components(point) for point in leg.path)
        assert elbow @ base > base @ base
        assert abs(np.cross(base, elbow)[2]) <= 1e-15


@pytest.mark.parametrize("name", [n for n in NAMES if "stiffness.leg_axial" in values(load(n)) and n not in CRANKS])
def test_flexible_legs_are_springs_in_a_row_with_their_actuators(name):
    machine, rigidity = somewhere(name), 3e4
    machine = with_values(machine, {"stiffness.leg_axial": INFINITE})
    legs = [leg for leg in machine.configure().legs if leg.lines]
    lengths = [(leg.path[-1] - leg.path[0]).norm() for leg in legs]
    held = machine.tables["stiffness"].actuator
    softer = {
        f"stiffness.actuator.{i}": 1.0 / (1.0 / k + size / rigidity) if k else 0.0
        for i, (k, size) in enumerate(zip(held, lengths, strict=True))
    }
    expected = respond(with_values(machine, softer)).compliance.upper
    found = respond(with_values(machine, {"stiffness.leg_axial": rigidity})).compliance.upper
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-9 * max(expected))


SECTIONS = {
    "passive-leg-4dof": ("passive_links", [("passive_link_bending", 3.0), ("passive_link_bending", 3.0)]),
    "passive-leg-5dof": ("passive_links", [("passive_link_bending", 3.0), ("passive_link_bending", 3.0)]),
    "passive-leg-3dof-pu": ("ram", [("ram_bending", 3.0), ("ram_bending", 3.0), ("ram_torsion", 1.0)]),
    "tricept": ("tube", [("tube_bending", 3.0), ("tube_bending", 3.0), ("tube_torsion", 1.0)]),
}


@pytest.mark.parametrize("name", [n for n in NAMES if load(n).family.name.removesuffix("-rus") in SECTIONS])
def test_passive_links_from_a_section_are_in_a_row_with_their_joints(name):
    machine = somewhere(name)
    field, own = SECTIONS[machine.family.name.removesuffix("-rus")]
    geometry, pose = machine.tables["geometry"], machine.tables["pose"]
    lengths = getattr(geometry, "passive_links", None) or [getattr(pose, "length", None) or pose.z] * 3
    given = replace(machine.tables["stiffness"], **{
        section: (2e3, 2e3) if section.startswith("passive") else 2e3 for section, _ in own
    })  # fmt: skip
    rows = zip(getattr(given, field), own, lengths, strict=True)
    by_hand = tuple(1.0 / (1.0 / k + size / (factor * 2e3)) for k, (_, factor), size in rows)
    expected = replace(machine.tables["stiffness"], **{field: by_hand})
    answers = [
        respond(replace(machine, tables={**machine.tables, "stiffness": s})).compliance.upper for s in (given, expected)
    ]
    assert answers[0] == pytest.approx(answers[1], rel=1e-12)


@pytest.mark.parametrize("name", DRIVEN)
def test_a_driven_passive_leg_has_an_actuator_and_else_is_passive(name):
    machine = load(name)
    (path,) = [p for p in values(machine) if p.endswith("_actuator")]
    passive, driven = (with_values(machine, {path: k}).configure().legs[0] for k in (0.0, 1e3))
    assert (passive.actuated, driven.actuated) == (False, True)
    assert len(passive.passive) == len(driven.passive) + 1
    free = respond(with_values(machine, {path: 0.0})).compliance.upper
    assert max(free) == INFINITE, "with a leg removed the platform is free"
    assert max(respond(machine).compliance.upper) < INFINITE


@pytest.mark.parametrize("name", NAMES)
def test_the_coordinate_and_the_load_of_a_drive_have_one_name(name):
    configuration = load(name).configure()
    driven = [spring for leg in configuration.legs for spring in leg.springs if spring.actuated]
    assert [actuator.name for actuator in actuators_of(configuration)] == [spring.name for spring in driven]


FAR = {
    "delta": {"pose.z": -2.0},
    "orthoglide": {"pose.y": 0.5},
    "planar-3rrr": {"pose.x": 1.0},
    **{name: {"geometry.rod_length": 0.1} for name in CRANKS},
}
NEAR = {
    "delta": {"geometry.bar_length": 5.0},
    "planar-3rrr": {"geometry.distal_link": 5.0},
    **{name: {"geometry.rod_length": 5.0} for name in CRANKS},
}


@pytest.mark.parametrize(("name", "change"), [*FAR.items(), *NEAR.items()])
def test_out_of_reach_is_said_with_figures(name, change):
    machine = with_values(load(name), change)
    response = respond(machine)
    assert response.status == Status.OUT_OF_REACH
    said = why_out_of_reach(response.configuration, machine.display)
    assert said
    assert "nan" not in said
    assert "inf" not in said


@pytest.mark.parametrize("name", NAMES)
def test_optional_fields_stand_in_the_file(name):
    """As comments, where the machine does not use them, that may be put to use as they are."""
    text, machine = bundled()[name], load(name)
    for section, fields in machine.family.tables.items():
        table = text[text.index(f"[{section}]") :].partition("\n[")[0]
        for field in optional(fields):
            assert re.search(rf"^(# )?{field}\s*=", table, re.MULTILINE), f"{section}.{field} is not in {name}.toml"
    used = re.sub(r"^# (\w+\s*= )", r"\1", text, flags=re.MULTILINE)
    assert respond(build(tomllib.loads(used), name)).status == Status.OK
