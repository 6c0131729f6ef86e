"""The whole derivation over any scalar: floats, NumPy arrays, more digits, JAX under vmap; one pose or many."""

import math

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.kinematics.closing import Joints
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import springs
from kinetostat.machine.parameters import values, with_values
from machines import (
    CASES,
    elastic_machine,
    few,
    is_regular,
    one_of_each,
    regular_machines,
    stiffness_paths,
)
from numeric import U, array, assert_blocks_close, columns, lost, trace_product

SAME = 1e-11
"""Norm-wise per block: some hundred roundings, times the condition of W."""


REORDERED = 10.0
"""Factor within which the singularity margin of a pose is known; see `test_invariance`."""


def joints_of(machine):
    """Where its joints are, if they have to be sought: that is done in float64, for arrays as for one machine."""
    return solve_joints(machine) if machine.family.chains else None


def answers(machine, joints=None):
    """K, C, singularity margin and status as one list of scalars."""
    response = respond(machine, joints)
    return [*response.stiffness.upper, *response.compliance.upper, response.singularity_margin, response.status]


def stacked(chosen):
    """Every leaf as an array over the machines, but for limits that are not set: those are infinite by form."""
    leaves = {path: np.array([values(machine)[path] for machine in chosen]) for path in values(chosen[0])}
    return {path: column for path, column in leaves.items() if np.isfinite(column).all()}


@elastic_machine
@few
@given(data=st.data())
def test_arrays_give_the_same_numbers_pose_by_pose(case, data):
    """Leaves that are exactly 0.0 in the floats are structural zeros there and numbers in the arrays."""
    chosen = data.draw(st.lists(regular_machines(case), min_size=2, max_size=4))
    together = answers(with_values(case.machine, stacked(chosen)))
    for n, machine in enumerate(chosen):
        mine = np.array([np.broadcast_to(result, len(chosen))[n] for result in together], dtype=float)
        assert_same_answer(mine, machine)


def assert_same_answer(found, machine):
    expected, relative = np.array(answers(machine), dtype=float), SAME + lost(respond(machine))
    for part in (slice(0, 21), slice(21, 42)):
        assert_blocks_close(unpacked(found[part]), unpacked(expected[part]), relative)
    assert 1.0 / REORDERED < found[42] / expected[42] < REORDERED
    assert found[43] == expected[43]


def unpacked(upper):
    full = np.zeros((6, 6))
    full[np.triu_indices(6)] = upper
    return full + np.triu(full, 1).T


EAGER = [case for case in CASES if case.name in ("zhang-gosselin-4dof", "passive-leg-5dof-driven", "planar-3rrr")]
"""JAX runs each operation on its own here, which takes a second for a thousand."""


@pytest.mark.parametrize("case", EAGER, ids=repr)
def test_jax_under_vmap_gives_the_same_answers(case):
    chosen = [machine for machine in some_machines(case) if is_regular(machine)]
    leaves = stacked(chosen)
    joints = joints_of(with_values(case.machine, leaves))

    def one(leaf, coordinates, status):
        return answers(with_values(case.machine, leaf), Joints(coordinates, status) if coordinates else None)

    found = (tuple(map(np.asarray, joints.coordinates)), joints.status) if joints else ((), np.zeros(len(chosen)))
    with jax.enable_x64(True):
        batch = [np.broadcast_to(np.asarray(r), len(chosen)) for r in jax.vmap(one)(leaves, *found)]
    for n, machine in enumerate(chosen):
        assert_same_answer(np.array([r[n] for r in batch]), machine)


def some_machines(case, count=40):
    """Random designs, the same ones on every run."""
    random = np.random.default_rng(2)
    for _ in range(count):
        drawn = {path: random.uniform(low, high) for path, (low, high) in case.ranges.items()}
        drawn |= {path: 10 ** random.uniform(3, 6) for path in stiffness_paths(case.machine)}
        yield with_values(case.machine, {path: float(value) for path, value in drawn.items()})


@elastic_machine
@few
@given(data=st.data())
def test_float64_is_right_to_its_condition(case, data):
    """The same formulas with 11 more bits: what float64 loses is some rounding units of tr K tr C."""
    machine = data.draw(regular_machines(case))
    joints = joints_of(machine)
    finite = {path: value for path, value in values(machine).items() if math.isfinite(value)}
    longer = with_values(machine, {path: np.longdouble(value) for path, value in finite.items()})
    response, more = respond(machine, joints), respond(longer, joints)
    relative = 30 * U * trace_product(response)
    assert any(np.asarray(entry).dtype == np.longdouble for entry in more.stiffness.upper)
    assert_blocks_close(array(response.stiffness), array(more.stiffness), relative)
    assert_blocks_close(array(response.compliance), array(more.compliance), relative)


@one_of_each
def test_derivatives_are_those_of_the_attribution(case):
    """Forward and reverse: d diag(C) / dk by JAX is the sum of -s_e^2 xi_e^2 dk_e/dk, at the reference machine."""
    machine = case.machine
    now, joints = values(machine), joints_of(machine)
    stiff = [path for path in stiffness_paths(machine) if 0.0 < now[path] < math.inf]

    def softness(numbers):
        return respond(with_values(machine, dict(zip(stiff, numbers, strict=True))), joints).compliance.diagonal()

    def stiffnesses(numbers):
        placed = respond(with_values(machine, dict(zip(stiff, numbers, strict=True))), joints).configuration
        return [spring.stiffness for spring in springs(placed)]

    with jax.enable_x64(True), np.errstate(invalid="ignore"):
        numbers = [now[path] for path in stiff]
        forward, reverse = (np.array(slope(softness)(numbers), dtype=float) for slope in (jax.jacfwd, jax.jacrev))
        changes = np.array(jax.jacfwd(stiffnesses)(numbers), dtype=float)
    assert forward == pytest.approx(reverse, rel=SAME, abs=1e-18)
    statics = respond(machine, joints).statics
    yielding = np.array([s if s < math.inf else 0.0 for s in statics.compliance])
    expected = -(columns(statics.flexibility) ** 2) * yielding**2 @ changes
    assert forward == pytest.approx(expected, rel=1e-9, abs=1e-15)
