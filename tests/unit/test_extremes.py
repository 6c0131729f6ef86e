"""Numbers to design by, against NumPy on K and C and against the machine's own geometry."""

import math

import numpy as np
import pytest

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.exchange.results import as_dataset
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.extremes import ROTATIONS, TRANSLATIONS
from kinetostat.kinetostatics.indices import PLANAR, SPATIAL
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.studies.analysis import analyze
from kinetostat.views.answers import plain_of
from machines import every_machine

CONDITION = 1e-8
"""K and C of the bundled machines have conditions up to 1e6."""


def value(name, response):
    return float(QUANTITIES[name].value(response))


def block(matrix, there, rows):
    kept = [i for i in there if i in rows]
    return np.array(matrix.rows(), dtype=float)[np.ix_(kept, kept)]


@every_machine
def test_extremes_are_eigenvalues(case):
    response = respond(case.machine)
    there = SPATIAL if response.configuration.plane is None else PLANAR
    assert response.status == Status.OK
    for word, rows in (("translational", TRANSLATIONS), ("rotational", ROTATIONS)):
        soft, stiff = block(response.compliance, there, rows), block(response.stiffness, there, rows)
        if np.isfinite(soft).all():
            assert value(f"least_{word}_stiffness", response) == pytest.approx(1.0 / np.linalg.eigvalsh(soft)[-1])
        if np.isfinite(stiff).all():
            assert value(f"greatest_{word}_stiffness", response) == pytest.approx(np.linalg.eigvalsh(stiff)[-1])


@every_machine
def test_free_stiffness_is_what_is_left_of_k_when_all_else_follows(case):
    """1 / C_ii by a second route: K_ii - K_io K_oo^-1 K_oi; at most K_ii, with which all else is held."""
    response = respond(case.machine)
    there = SPATIAL if response.configuration.plane is None else PLANAR
    stiff = block(response.stiffness, there, range(6))
    if not np.isfinite(stiff).all():  # a rigid machine has no second route
        return
    scale = 1.0 / np.sqrt(np.diag(stiff))
    unit = stiff * np.outer(scale, scale)
    for k, i in enumerate(there):
        others = [j for j in range(len(there)) if j != k]
        left = 1.0 - unit[k, others] @ np.linalg.solve(unit[np.ix_(others, others)], unit[others, k])
        found = value(f"free_stiffness_{COMPONENTS[i]}", response)
        assert found == pytest.approx(left * stiff[k, k], rel=1e-6, abs=1e-12 * stiff[k, k])
        assert found <= stiff[k, k] * (1.0 + CONDITION)


def test_free_stiffness_where_nothing_gives_is_infinite_for_one_pose_and_for_many():
    """With rigid links the paper's machine gives neither about z nor along y, C_ii = 0; the others are 1 / C_ii."""
    machine = load("zhang-gosselin-4dof", ["stiffness.passive_links=rigid"])
    alone, compliance = respond(machine), analyze(machine).compliance_diagonal
    many = evaluate(machine, PointTable({"pose.z": np.array([0.68, 0.68])}), GROUPS["free_stiffness"])
    for i, name in enumerate(COMPONENTS):
        expected = 1.0 / compliance[i] if name not in ("rz", "y") else math.inf
        assert value(f"free_stiffness_{name}", alone) == pytest.approx(expected)
        assert many.values[f"free_stiffness_{name}"].tolist() == pytest.approx([expected, expected])


@every_machine
def test_the_condition_is_at_least_one_and_below_the_ratio_of_eigenvalues(case):
    """In the Frobenius norm a condition is between 1 and the usual one."""
    response = respond(case.machine)
    there = SPATIAL if response.configuration.plane is None else PLANAR
    scale = np.array([float(response.configuration.length) if i < 3 else 1.0 for i in there])
    soft = block(response.compliance, there, range(6)) * np.outer(scale, scale)
    values = np.linalg.eigvalsh(soft)
    if np.isfinite(soft).all() and values[0] > 1e-12 * values[-1]:
        found = value("frobenius_condition", response)
        assert 1.0 - CONDITION <= found <= values[-1] / values[0] * (1.0 + CONDITION)
        assert found == pytest.approx(np.sqrt(np.sum(values**2) * np.sum(values**-2.0)) / len(there), rel=CONDITION)


def test_a_machine_alike_in_all_directions_has_condition_one():
    """The Orthoglide at its isotropic point, with alike actuators, in translation."""
    response = respond(load("orthoglide"))
    soft = block(response.compliance, SPATIAL, TRANSLATIONS)
    assert np.ptp(np.linalg.eigvalsh(soft)) < 1e-9 * soft.max()
    assert value("least_translational_stiffness", response) == pytest.approx(1.0 / soft[0, 0])


def test_rigid_and_free_are_exact():
    rigid = respond(load("zhang-gosselin-4dof", ["stiffness.passive_links=rigid"]))
    assert value("greatest_rotational_stiffness", rigid) == math.inf
    assert value("frobenius_condition", rigid) == math.inf
    free = respond(load("zhang-gosselin-4dof", ["stiffness.passive_links=0"]))
    assert free.status != Status.OK or value("least_translational_stiffness", free) == 0.0


def test_leg_lengths_of_the_reference():
    """Lengths of the paper's machine: 0.797602, 0.764484, 0.665658, 0.625594 m."""
    response = respond(load("zhang-gosselin-4dof"))
    assert value("longest_leg", response) == pytest.approx(0.797602, abs=5e-7)
    assert value("shortest_leg", response) == pytest.approx(0.625594, abs=5e-7)
    assert math.isnan(value("longest_leg", respond(load("delta"))))


def test_actuator_loads_are_those_of_the_analysis():
    machine = load(
        "zhang-gosselin-4dof", ['load.force=["30 N","0 N","-500 N"]', 'load.moment=["0 N*m","4 N*m","0 N*m"]']
    )
    told = analyze(machine).load
    forces = [abs(one.load) for one in told.springs if one.actuated]
    assert value("actuator_force", respond(machine)) == pytest.approx(max(forces))
    assert math.isnan(value("actuator_moment", respond(machine)))
    crank = load("hexapod-rus", ['load.force=["0 N","0 N","-500 N"]'])
    moments = [abs(one.load) for one in analyze(crank).load.springs if one.actuated]
    assert value("actuator_moment", respond(crank)) == pytest.approx(max(moments))


def test_every_condition_has_a_name_of_its_own():
    """Of K by its eigenvalues and in the Frobenius norm, of W, of the actuators' Jacobian: four numbers, four names."""
    machine = load("hexapod", ["pose.x=20 mm"])
    found = analyze(machine)
    told, written = plain_of(found), as_dataset(found)
    names = ("stiffness_condition", "wrench_condition", "jacobian_condition")
    assert [told[name] for name in names] == [float(written[name]) for name in names]
    assert len({*(told[name] for name in names), value("frobenius_condition", respond(machine))}) == 4
    assert "condition" not in {*told, *written, *QUANTITIES}
    assert QUANTITIES["frobenius_condition"].symbol == "condition of K (Frobenius)"
