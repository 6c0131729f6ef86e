"""Loads in single machines against free bodies cut by hand and solved by NumPy."""

import math

import numpy as np
import pytest

from kinetostat.algebra.screw import NO_WRENCH, Wrench
from kinetostat.algebra.vector import AXES, IDENTITY, X_AXIS, Y_AXIS, Z_AXIS, ZERO, Displacement, Vector
from kinetostat.kinetostatics.loading import (
    deflection,
    joint_points,
    joint_reactions,
    leg_wrenches,
    spring_loads,
)
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.leg import Joint, Leg, Spring, revolutes
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Configuration, springs
from kinetostat.machine.parts import two_force_leg
from numeric import answer, screw, vector

LOAD = Wrench(Vector(3.0, -7.0, 5.0), Vector(40.0, 25.0, -90.0))


def line_wrench(direction, point, about):
    """Moment and force of a unit force [6]."""
    return np.concatenate([np.cross(point - about, direction), direction])


@pytest.mark.parametrize("tool", [(0.0, 0.0, 0.0), (0.02, -0.05, 0.1)])
def test_the_legs_of_a_hexapod(tool):
    """The platform cut free: six forces along the legs hold the load at the tool point."""
    response = respond(load("hexapod", [f"tool.offset={list(tool)}", "pose.roll=12 deg", "pose.x=10 mm"]))
    about = vector(response.reference)
    assert about == pytest.approx(vector(response.configuration.platform.apply(Vector(*tool))), abs=1e-15)
    lines, ends = [], []
    for leg in response.configuration.legs:
        base, top = (vector(p) for p in (leg.path[0], leg.path[-1]))
        ends.append(top)
        lines.append(line_wrench((top - base) / np.linalg.norm(top - base), top, about))
    forces = np.linalg.solve(np.array(lines).T, screw(LOAD))
    assert spring_loads(response, LOAD) == pytest.approx(forces)
    for wrench, line, force in zip(leg_wrenches(response, LOAD), lines, forces, strict=True):
        assert screw(wrench) == pytest.approx(force * line)
    reactions = joint_reactions(response, LOAD)
    assert len(reactions) == 18
    for reaction in reactions:
        assert vector(reaction.wrench.rotational) == pytest.approx(np.zeros(3), abs=1e-9)
    heads = [reaction for reaction in reactions if reaction.joint.endswith("platform joint")]
    for head, top, line, force in zip(heads, ends, lines, forces, strict=True):
        assert vector(head.point) == pytest.approx(top)
        assert vector(head.wrench.translational) == pytest.approx(force * line[3:])


def test_the_passive_leg_of_the_papers_machine():
    """Ten unknowns: four leg forces and the wrench on the passive leg; six balances, and its four joints' axes."""
    response = respond(load("zhang-gosselin-4dof"))
    passive, *actuated = response.configuration.legs
    about = vector(response.reference)
    matrix, right = np.zeros((10, 10)), np.concatenate([screw(LOAD), np.zeros(4)])
    for n, leg in enumerate(actuated):
        base, top = (vector(p) for p in (leg.path[0], leg.path[-1]))
        matrix[:6, n] = line_wrench((top - base) / np.linalg.norm(top - base), top, about)
    matrix[:6, 4:] = np.eye(6)
    for n, joint in enumerate(passive.passive):
        arm = vector(joint.point) - about
        matrix[6 + n, 4:7] = vector(joint.axis)
        matrix[6 + n, 7:] = -np.cross(vector(joint.axis), arm)
    found = np.linalg.solve(matrix, right)
    carried = leg_wrenches(response, LOAD)
    assert screw(carried[0]) == pytest.approx(found[4:], rel=1e-9, abs=1e-9)
    assert spring_loads(response, LOAD)[2:] == pytest.approx(found[:4])
    for spring, carries in zip(passive.springs, spring_loads(response, LOAD)[:2], strict=True):
        arm = vector(spring.joint.point) - about
        moment = found[4:7] - np.cross(arm, found[7:])
        assert carries == pytest.approx(moment @ vector(spring.joint.axis))
    assert {r.joint for r in joint_reactions(response, LOAD) if r.leg == "passive leg"} == {
        "passive leg foot",
        "passive leg elbow",
        "passive leg Hooke joint",
    }


def test_a_crank_turns_against_its_motor():
    """Planar 3-RRR: the motor's moment is the force along the distal link times its arm about the motor."""
    response = respond(load("planar-3rrr"))
    planar = Wrench(Vector(0.0, 0.0, 4.0), Vector(30.0, -20.0, 0.0))
    moments = dict(zip((s.name for s in springs(response.configuration)), spring_loads(response, planar), strict=True))
    lines = []
    for leg in response.configuration.legs:
        _, elbow, top = (vector(p) for p in leg.path)
        along = (top - elbow) / np.linalg.norm(top - elbow)
        lines.append((along, elbow, np.cross(top - vector(response.reference), along)[2]))
    balance = np.array([[arm, along[0], along[1]] for along, _, arm in lines]).T
    forces = np.linalg.solve(balance, [4.0, 30.0, -20.0])
    for leg, (along, elbow, _), force in zip(response.configuration.legs, lines, forces, strict=True):
        base = vector(leg.path[0])
        assert moments[f"{leg.name} distal link"] == pytest.approx(force)
        assert moments[f"{leg.name} actuator"] == pytest.approx(force * np.cross(elbow - base, along)[2])


def stacked(stiffness):
    """A platform on parallel vertical struts that share its weight, with five other freedoms held."""
    struts = [two_force_leg(f"strut {i}", Vector(0.0, 0.0, -1.0), ZERO, k) for i, k in enumerate(stiffness)]
    others = [Leg(f"hold {i}", (Spring(f"hold {i}", joint, 1e6), *rest)) for i, (joint, rest) in enumerate(HELD)]
    return answer(Configuration(Displacement(IDENTITY, ZERO), (*struts, *others), (), 1.0))


FREEDOMS = [*(Joint(axis, ZERO) for axis in AXES), *(Joint(axis) for axis in AXES)]
HELD = [(joint, [other for other in FREEDOMS if other is not joint]) for joint in FREEDOMS[:5]]
"""One freedom each that a leg holds, and the five that it leaves."""


@pytest.mark.parametrize("stiffness", [(1e5, 3e5), (1e5, 3e5, 6e5), (2e5, math.inf), (0.0, 4e5), (0.0, 4e5, 4e5)])
def test_parallel_springs_share_by_stiffness(stiffness):
    """Redundant: F_i = F k_i / sum k, and the platform sinks by F / sum k."""
    response = stacked(stiffness)
    down = Wrench(ZERO, Z_AXIS * -100.0)
    ends = [k / sum(stiffness) if math.isfinite(sum(stiffness)) else float(k == math.inf) for k in stiffness]
    shares = spring_loads(response, down)[: len(stiffness)]
    assert shares == pytest.approx([-100.0 * share for share in ends], rel=1e-9, abs=1e-9)
    carried = leg_wrenches(response, down)
    assert [wrench.translational.z for wrench in carried[: len(stiffness)]] == pytest.approx(shares, abs=1e-9)
    assert screw(sum(carried, NO_WRENCH)) == pytest.approx(screw(down), abs=1e-9)
    assert deflection(response.statics, down).translational.z == pytest.approx(-100.0 / sum(stiffness), rel=1e-9)


def test_joints_by_name_with_a_point_of_each():
    """A Hooke joint is one; a slide without a carriage is where the chain has come to; links are no joints."""
    leg = Leg(
        "leg",
        (
            *revolutes(X_AXIS, (Y_AXIS, Z_AXIS), "foot"),
            Spring("actuator", Joint(X_AXIS), 1e3, actuated=True),
            Spring("rod", Joint(X_AXIS), 1e6),
            Joint(Z_AXIS, None, "slide"),
            Spring("ball hinge", Joint(Z_AXIS, Z_AXIS, "ball"), 1e3, hinge=True),
            Joint(Z_AXIS, Y_AXIS, "head"),
            Joint(Z_AXIS, None, "rail", carriage=Z_AXIS),
        ),
    )
    assert joint_points(leg) == [
        ("foot", X_AXIS), ("actuator", X_AXIS), ("slide", X_AXIS), ("ball", Z_AXIS), ("head", Y_AXIS), ("rail", Z_AXIS),
    ]  # fmt: skip


def test_the_motor_shafts_of_a_delta():
    """The platform cut free: two forces along the bars of each leg; the shaft bears them and their moment about it."""
    response = respond(load("delta", ["pose.x=60 mm", "pose.y=-40 mm"]))
    about, pulls = vector(response.reference), []
    for leg in response.configuration.legs:
        (bars,) = [part for part in leg.chain if isinstance(part, Parallelogram)]
        for near, far in ([vector(end) for end in bar] for bar in bars.bars):
            pulls.append((leg, near, (far - near) / np.linalg.norm(far - near)))
    lines = np.array([line_wrench(along, near, about) for _, near, along in pulls])
    pulls = list(zip(pulls, np.linalg.solve(lines.T, screw(LOAD)), strict=True))
    loads = dict(zip((s.name for s in springs(response.configuration)), spring_loads(response, LOAD), strict=True))
    shafts = {r.leg: r for r in joint_reactions(response, LOAD) if r.joint == f"{r.leg} actuator"}
    assert len(shafts) == 3
    for leg in response.configuration.legs:
        motor = leg.springs[0].joint
        cut = sum(f * line_wrench(u, near, vector(motor.point)) for (own, near, u), f in pulls if own is leg)
        shaft = shafts[leg.name]
        assert vector(shaft.point) == pytest.approx(vector(motor.point))
        assert screw(shaft.wrench) == pytest.approx(cut, abs=1e-9)
        assert cut[:3] @ vector(motor.axis) == pytest.approx(loads[f"{leg.name} actuator"])
        assert np.linalg.norm(np.cross(cut[:3], vector(motor.axis))) > 1.0


def test_the_slides_of_a_tripteron():
    """Every leg takes the force along its own slide; forces and moments at the three slides hold the platform."""
    response = respond(load("tripteron", ["pose.x=0.55 m", "pose.z=0.4 m"]))
    slides = {r.leg: r for r in joint_reactions(response, LOAD) if r.joint.endswith("slide")}
    forces = {"x": [40.0, 0.0, 0.0], "y": [0.0, 25.0, 0.0], "z": [0.0, 0.0, -90.0]}
    points = {"x": [0.55, 1.0, 0.0], "y": [0.0, 0.5, 1.0], "z": [0.0, 0.0, 0.4]}
    moment = -vector(LOAD.rotational)
    for leg, slide in slides.items():
        assert vector(slide.wrench.translational) == pytest.approx(forces[leg], abs=1e-9)
        assert vector(slide.point) == pytest.approx(points[leg])
        assert vector(slide.wrench.rotational)["xyz".index(leg)] == pytest.approx(0.0, abs=1e-9)
        moment += vector(slide.wrench.rotational) + np.cross(np.array(points[leg]) - [0.55, 0.5, 0.4], forces[leg])
    assert moment == pytest.approx(np.zeros(3), abs=1e-9)
    assert len(slides) == 3


def test_a_guide_is_loaded_at_its_carriage():
    """10 cm beside the shoulder the force along the slide has an arm of 10 cm; the carriage goes where the leg goes."""
    response = respond(load("tripteron", ["legs.z.slide.point=[0, -0.1, 0.5]", "pose.z=0.6 m"]))
    slide, shoulder = (r for r in joint_reactions(response, LOAD) if r.joint in ("z slide", "z shoulder"))
    assert vector(slide.point) == pytest.approx([0.0, -0.1, 0.6])
    assert vector(shoulder.point) == pytest.approx([0.0, 0.0, 0.6])
    more = vector(slide.wrench.rotational) - vector(shoulder.wrench.rotational)
    assert more == pytest.approx([0.1 * -90.0, 0.0, 0.0])
