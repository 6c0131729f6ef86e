"""The aspect: changes where a machine passes one, and nowhere else."""

import math

import numpy as np
import pytest

from kinetostat.algebra.solve import complement, handedness
from kinetostat.kinetostatics.extremes import aspect
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import parameters, values, with_values
from machines import every_machine

STEPS = 400
"""Poses along a way."""
NEAR = 0.05
"""Singularity margin that is small enough where a way crosses a singularity in a step."""


def test_handedness_is_the_sign_of_the_determinant():
    rng = np.random.default_rng(0)
    for _ in range(500):
        size = int(rng.integers(2, 7))
        some = int(rng.integers(1, size + 1))
        vectors = (rng.standard_normal((some, size)) * (rng.random((some, size)) < 0.7)).tolist()
        rest = complement(vectors)[0] if some < size else []
        determinant = np.linalg.det(np.array([*vectors, *rest], dtype=float))
        if abs(determinant) > 1e-9:
            assert handedness(vectors) == np.sign(determinant)


@every_machine
def test_it_changes_only_at_singularities(case):
    """Along random straight ways through pose space: wherever the aspect changes, the machine is all but singular."""
    machine, rng = case.machine, np.random.default_rng(5)
    kinds = {p.path: p.quantity.kind for p in parameters(machine.family) if p.path.startswith("pose.")}
    reach = {"length": 0.6 * float(respond(machine).configuration.length), "angle": 0.5}
    held, changes = values(machine), 0
    for _ in range(4):
        ends = {path: reach[kind] * rng.uniform(-1, 1, 2) for path, kind in kinds.items()}
        way = {path: held[path] + np.linspace(*pair, STEPS) for path, pair in ends.items()}
        with np.errstate(all="ignore"):
            response = respond(with_values(machine, way))
        ok = np.broadcast_to(response.status, STEPS) == 0
        aspects = np.broadcast_to(aspect(response), STEPS)
        assert set(np.unique(aspects[ok])) <= {-1.0, 0.0, 1.0}
        changed = (aspects[1:] * aspects[:-1] < 0) & ok[1:] & ok[:-1]
        least = np.minimum(response.singularity_margin[1:], response.singularity_margin[:-1])[changed]
        assert (least < NEAR).all()
        changes += int(changed.sum())
    assert changes < STEPS / 10


def test_a_hexapod_passes_a_singularity_when_it_yaws_by_a_right_angle():
    found = [aspect(respond(load("hexapod", [f"pose.yaw={yaw} deg"]))) for yaw in (-100, -80, 0, 80, 100)]
    assert found[1:4] == [found[2]] * 3
    assert found[0] == found[4] == -found[2]


def test_the_singular_circle_of_a_planar_machine():
    """Similar triangles, turned by t against each other: singular on a circle about O (see the workspace tests)."""
    machine = load("planar-3rpr")
    radius = math.sqrt(0.25**2 + 0.08**2 - 2 * 0.25 * 0.08 * math.cos(math.radians(30)))
    angles = np.linspace(0, 2 * math.pi, 50)
    for factor, sign in ((0.999, 1.0), (1.001, -1.0)):
        circle = {"pose.x": factor * radius * np.cos(angles), "pose.y": factor * radius * np.sin(angles)}
        assert (aspect(respond(with_values(machine, circle))) == sign).all()


@pytest.mark.parametrize("name", ["tripteron", "passive-leg-4dof-driven"])
def test_redundant_legs_are_not_divided(name):
    assert aspect(respond(load(name))) == 0.0
