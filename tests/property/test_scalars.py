"""The whole derivation over any scalar: floats, NumPy arrays, more digits, JAX under vmap; one pose or many."""

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import values, with_values
from machines import every_machine, is_regular, machines, regular_machines
from numeric import U, array, assert_blocks_close, columns, trace_product

SAME = 1e-11
"""Norm-wise per block; XLA contracts a * b + c and reorders sums, which costs rounding times the condition of W."""


def answers(machine):
    """K, C, regularity and status as one list of scalars."""
    response = respond(machine)
    return [*response.stiffness.upper, *response.compliance.upper, response.regularity, response.status]


def stacked(chosen):
    """Every leaf as an array over the machines."""
    return {path: np.array([values(machine)[path] for machine in chosen]) for path in values(chosen[0])}


@every_machine
@given(data=st.data())
def test_arrays_give_the_same_bits_pose_by_pose(case, data):
    """Leaves that are exactly 0.0 in the floats are structural zeros there and numbers in the arrays."""
    chosen = data.draw(st.lists(regular_machines(case), min_size=2, max_size=4))
    together = answers(with_values(load(case.name), stacked(chosen)))
    for n, machine in enumerate(chosen):
        alone = np.array(answers(machine), dtype=float)
        mine = np.array([np.broadcast_to(result, len(chosen))[n] for result in together], dtype=float)
        assert_same_answer(mine, alone, SAME)


def assert_same_answer(found, expected, relative):
    for part in (slice(0, 21), slice(21, 42)):
        assert_blocks_close(unpacked(found[part]), unpacked(expected[part]), relative)
    assert found[42] == pytest.approx(expected[42], rel=1e-9)
    assert found[43] == expected[43]


def unpacked(upper):
    full = np.zeros((6, 6))
    full[np.triu_indices(6)] = upper
    return full + np.triu(full, 1).T


@every_machine
def test_jax_under_vmap_gives_the_same_answers(case):
    chosen = [machine for machine in some_machines(case) if is_regular(machine)]
    leaves = stacked(chosen)

    def one(leaf):
        return answers(with_values(load(case.name), leaf))

    with jax.enable_x64(True):
        batch = [np.broadcast_to(np.asarray(r), len(chosen)) for r in jax.jit(jax.vmap(one))(leaves)]
    for n, machine in enumerate(chosen):
        assert_same_answer(np.array([r[n] for r in batch]), np.array(answers(machine), dtype=float), SAME)


def some_machines(case, count=200):
    """Random designs, the same ones on every run."""
    random = np.random.default_rng(2)
    stiff = [path for path in values(load(case.name)) if path.startswith("stiffness.")]
    for _ in range(count):
        drawn = {path: random.uniform(low, high) for path, (low, high) in case.ranges.items()}
        drawn |= {path: 10 ** random.uniform(3, 6) for path in stiff}
        yield with_values(load(case.name), {path: float(value) for path, value in drawn.items()})


@every_machine
@given(data=st.data())
def test_float64_is_right_to_its_condition(case, data):
    """The same formulas with 11 more bits: what float64 loses is some rounding units of tr K tr C."""
    machine = data.draw(machines(case).filter(is_regular))
    more = respond(with_values(machine, {path: np.longdouble(value) for path, value in values(machine).items()}))
    response = respond(machine)
    length = float(response.configuration.length)
    relative = 30 * U * trace_product(response.stiffness, response.compliance, length)
    assert more.stiffness.upper[0].dtype == np.longdouble
    assert_blocks_close(array(response.stiffness), array(more.stiffness), relative)
    assert_blocks_close(array(response.compliance), array(more.compliance), relative)


@every_machine
def test_derivatives_are_those_of_the_attribution(case):
    """Forward and reverse: d diag(C) / dk_e by JAX is -s_e^2 xi_e^2, at the reference machine."""
    machine = load(case.name)
    stiff = [path for path in values(machine) if path.startswith("stiffness.")]

    def softness(numbers):
        return respond(with_values(machine, dict(zip(stiff, numbers, strict=True)))).compliance.diagonal()

    with jax.enable_x64(True):
        numbers = [values(machine)[path] for path in stiff]
        forward, reverse = (np.array(slope(softness)(numbers)) for slope in (jax.jacfwd, jax.jacrev))
    assert forward == pytest.approx(reverse, rel=SAME, abs=1e-18)
    statics = respond(machine).statics
    expected = -(columns(statics.flexibility) ** 2) * np.array(statics.compliance) ** 2
    columns_of_paths = [list(column) for column in forward.T]
    for column in expected.T:
        assert any(column == pytest.approx(found, rel=1e-9, abs=1e-15) for found in columns_of_paths)
