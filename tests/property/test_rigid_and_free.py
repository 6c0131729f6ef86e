"""The two ends of the stiffness scale, rigid and free, are exact: no large number stands in for infinity."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.machine.machine import springs
from kinetostat.machine.parameters import values, with_values
from machines import CASES, every_machine, regular_machines, stiffness_paths
from numeric import array, assert_blocks_close, assert_psd, dimensionless, reached, screw

STIFF = 1e14
"""N/m or N·m/rad: 1e8 times and more the other springs here."""


def some_springs(machine):
    """Some of its springs, at least one."""
    return st.lists(st.sampled_from(stiffness_paths(machine)), min_size=1, unique=True)


def with_springs(machine, paths, stiffness):
    return with_values(machine, dict.fromkeys(paths, stiffness))


def chosen(response, stiffness):
    """Indices of the springs of this stiffness."""
    return [e for e, spring in enumerate(springs(response.configuration)) if spring.stiffness == stiffness]


@every_machine
@given(data=st.data())
def test_rigid_is_the_exact_limit(case, data):
    """C(1e14) - C(rigid) is the compliance of the stiff springs and nothing else, to the rounding of C."""
    machine = data.draw(regular_machines(case))
    paths = data.draw(some_springs(machine))
    rigid = respond(with_springs(machine, paths, math.inf))
    stiff = respond(with_springs(machine, paths, STIFF))
    twists = np.array([screw(stiff.statics.flexibility[e]) for e in chosen(stiff, STIFF)])
    remainder = twists.T @ twists / STIFF
    assert_blocks_close(array(rigid.compliance) + remainder, array(stiff.compliance), 1e-12)


ONE_SPRING = [(case, path) for case in CASES for path in stiffness_paths(load(case.name))]


@pytest.mark.parametrize(("case", "path"), ONE_SPRING)
def test_at_the_reference_design_very_stiff_is_rigid_to_nine_digits(case, path):
    """STIFF beside the 1000 N/m of the paper's actuators; as much beside the springs of other machines."""
    machine = load(case.name)
    softest = min(values(machine)[other] for other in stiffness_paths(machine))
    rigid, stiff = (respond(with_springs(machine, [path], k)) for k in (math.inf, STIFF * softest / 1e3))
    assert_blocks_close(array(stiff.compliance), array(rigid.compliance), 1e-9)


@every_machine
@given(data=st.data())
def test_a_rigid_spring_adds_nothing_to_c_and_is_never_nan(case, data):
    machine = data.draw(regular_machines(case))
    paths = data.draw(some_springs(machine))
    response = respond(with_springs(machine, paths, math.inf))
    length = float(response.configuration.length)
    assert_psd(response.compliance, length, Twist)
    assert np.linalg.matrix_rank(dimensionless(response.compliance, length, Twist), 1e-12, hermitian=True) <= 6 - len(
        paths
    )
    stiffness = array(response.stiffness)
    assert not np.any(np.isnan(stiffness))
    held = reached(response.statics.resistance, chosen(response, math.inf), 1.0 / length)
    assert np.array_equal(np.isinf(stiffness), held)


@every_machine
@given(data=st.data())
def test_a_free_spring_leaves_k_finite_and_frees_just_what_it_moves(case, data):
    machine = data.draw(regular_machines(case))
    paths = data.draw(some_springs(machine))
    response = respond(with_springs(machine, paths, 0.0))
    length = float(response.configuration.length)
    assert_psd(response.stiffness, length, Wrench)
    compliance = array(response.compliance)
    assert not np.any(np.isnan(compliance))
    freed = reached(response.statics.flexibility, chosen(response, 0.0), length)
    assert np.array_equal(np.isinf(compliance), freed)


@every_machine
@given(data=st.data())
def test_free_springs_resist_nothing(case, data):
    """K of the machine without the spring: the twist that it leaves free meets no resistance."""
    machine = data.draw(regular_machines(case))
    response = respond(with_springs(machine, data.draw(some_springs(machine)), 0.0))
    scale = np.repeat([float(response.configuration.length), 1.0], 3)
    stiffness = dimensionless(response.stiffness, scale[0], Wrench)
    for e in chosen(response, 0.0):
        motion = screw(response.statics.flexibility[e]) * scale
        assert np.linalg.norm(stiffness @ motion) <= 1e-9 * np.linalg.norm(stiffness) * np.linalg.norm(motion)


@every_machine
def test_all_rigid_does_not_move_and_all_free_does_not_resist(case):
    machine = load(case.name)
    rigid = respond(with_springs(machine, stiffness_paths(machine), math.inf))
    free = respond(with_springs(machine, stiffness_paths(machine), 0.0))
    assert np.array_equal(array(rigid.compliance), np.zeros((6, 6)))
    assert np.array_equal(array(free.stiffness), np.zeros((6, 6)))
    assert min(rigid.stiffness.diagonal()) == math.inf
    assert min(free.compliance.diagonal()) == math.inf


@every_machine
@given(data=st.data())
def test_a_rigid_machine_with_free_actuators_keeps_its_freedoms(case, data):
    """Free springs are as many as the freedoms: K of the rest has the rank of the constraints."""
    machine = data.draw(regular_machines(case))
    actuators = [path for path in stiffness_paths(machine) if "actuator" in path]
    response = respond(with_springs(machine, actuators, 0.0))
    stiffness = dimensionless(response.stiffness, float(response.configuration.length), Wrench)
    eigenvalues = np.linalg.eigvalsh(stiffness)
    assert len(actuators) == case.freedoms
    assert np.all(abs(eigenvalues[: case.freedoms]) <= 1e-12 * eigenvalues[-1])
    assert np.all(eigenvalues[case.freedoms :] > 0.0)
