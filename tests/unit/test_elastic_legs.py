"""Legs read as rows of screw motions: which of them are rods, and legs at some of their poses."""

import dataclasses

import numpy as np
import pytest

from kinetostat import build, state_of
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.equilibrium.elastic_legs import ElasticLeg, FreeSpin, Masses, RodEnds
from kinetostat.equilibrium.leg_reader import GivenMotions, Units, elastic_leg
from kinetostat.kinematics.chain import Chain
from kinetostat.machine.leg import Joint, Leg, Spring, revolutes

X, Y, Z = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)
START, END = Vector(0.1, 0.2, 0.0), Vector(0.1, 0.2, 0.7)
STRUT = Spring("strut", Joint(Z), 1e6, actuated=True)
BALL, UNIVERSAL = revolutes(END, (X, Y, Z)), revolutes(START, (X, Y))


def read(*chain):
    units = Units(ZERO, np.array([0.5]), np.array([2.0]), 1)
    return elastic_leg(Leg("leg", chain), units, GivenMotions(1), ())


def test_a_strut_between_two_joints_is_a_rod():
    rod = read(*UNIVERSAL, STRUT, *BALL).rod
    np.testing.assert_array_equal(rod.near, [[0.2, 0.4, 0.0]])
    np.testing.assert_array_equal(rod.far, [[0.2, 0.4, 1.4]])


@pytest.mark.parametrize(
    "chain",
    [
        (Joint(X), STRUT, *BALL),
        (*BALL, STRUT, Joint(X)),
        (*UNIVERSAL, STRUT, *revolutes(END, (X, Y))),
        (*UNIVERSAL, Spring("strut", Joint(X), 1e6), *BALL),
        (*UNIVERSAL, Spring("strut", Joint(Z, START), 1e6), *BALL),
        (*UNIVERSAL, STRUT, Joint(Z), Spring("tip", Joint(Z), 1e6), *BALL),
        (STRUT, *BALL),
    ],
)
def test_other_legs_are_no_rods(chain):
    """A slide at one end, too few turns, springs across or about the line, a joint between two springs, no joint."""
    assert read(*chain).rod is None


def test_some_poses_of_a_leg_are_those_of_all_its_parts():
    """Every array that has a row for each pose, in the leg and in what it holds; two sizes are alike nowhere else."""
    poses, size, masses = 11, 3, 2
    random = np.random.default_rng(0)
    leg = ElasticLeg(
        name="leg",
        chain=Chain(random.normal(size=(poses, size, 6)), (0, 1, 2), (-1, -1, -1), size),
        springs=(None,) * size,
        sign=np.zeros(size),
        masses=Masses(
            names=("a", "b"),
            carried=(1, 2),
            pairs=(),
            point=random.normal(size=(poses, masses, 3)),
            mass=random.normal(size=(poses, masses)),
            uncoupled=random.normal(size=(poses, masses)),
            inertia=random.normal(size=(poses, masses, 6)),
        ),
        idle=random.normal(size=(poses, size, size)),
        **{name: random.normal(size=(poses, size)) for name in ("stiffness", "preload", "rotors", "dampers")},
        rod=RodEnds(*random.normal(size=(2, poses, 3))),
        spin=FreeSpin(0, random.normal(size=(poses, 3))),
    )
    rows = np.array([7, 2])

    def compare(whole, part):
        for field in dataclasses.fields(whole):
            value, taken = getattr(whole, field.name), getattr(part, field.name)
            if dataclasses.is_dataclass(value):
                compare(value, taken)
            elif isinstance(value, np.ndarray):
                np.testing.assert_array_equal(taken, value[rows] if len(value) == poses else value)

    compare(leg, leg.at(rows))


def test_a_platform_on_three_lifts_that_slide_outwards_sinks_by_its_weight():
    """A machine 3-PPS: each leg begins with a slide that nothing drives, and its ball carries a third of the weight."""
    angles = (0.0, 2.0, 4.0)
    legs = []
    for name, angle in zip("abc", np.array(angles) * np.pi / 3.0, strict=True):
        x, y = 0.2 * np.cos(angle), 0.2 * np.sin(angle)
        slide = {"name": "slide", "type": "prismatic", "joins": ["base", "cart"], "point": [x, y, 0], "axis": [x, y, 0]}
        lift = {"name": "lift", "type": "prismatic", "joins": ["cart", "post"], "point": [x, y, 0.1], "axis": [0, 0, 1]}
        ball = {"name": "ball", "type": "spherical", "joins": ["post", "platform"], "point": [x, y, 0.4]}
        legs.append({"name": name, "joints": [slide, {**lift, "actuated": True, "stiffness": 5e7}, ball]})
    machine = build(
        {
            "schema": 1,
            "name": "3-PPS",
            "family": "legs",
            "platform": {"point": [0, 0, 0.4]},
            "pose": {"z": 0.4, "roll": 0.0, "pitch": 0.0},
            "load": {"force": [0, 0, -150.0]},
            "legs": legs,
        }
    )
    state = state_of(machine)
    assert state.stands
    assert [load for _, load in state.actuator_loads] == pytest.approx([50.0] * 3, rel=1e-12)
    shift = state.at_rest.state.platform.translation[0] * state.mechanism.length[0]
    assert shift == pytest.approx([0.0, 0.0, -1e-6], abs=1e-15)
