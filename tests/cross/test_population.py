"""Designs times poses through kept programs, against the same points as a table, values and derivatives."""

import numpy as np
import pytest

from kinetostat.engine.batch import evaluate, evaluate_designs
from kinetostat.engine.derivatives import differentiate, evaluate_gradient
from kinetostat.engine.points import PointTable, Population
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import values

NAMES = ("compliance_z", "stiffness_x", "singularity_margin", "least_rotational_stiffness", "longest_leg")
LINKS = ("geometry.passive_links.0", "geometry.passive_links.1")
DESIGNS = {"geometry.platform_radius": (0.10, 0.14), **dict.fromkeys(LINKS, (0.2, 0.5))}
POSES = {"pose.x": (-0.02, 0.02), "pose.theta5": (-1.1, -1.0)}


def drawn(ranges, count, seed):
    source = np.random.default_rng(seed)
    return {path: source.uniform(*ends, count) for path, ends in ranges.items()}


def stiff_path(name):
    """An actuator's stiffness of a bundled machine."""
    return next(p for p, v in values(load(name)).items() if p.split(".")[-1] in ("stiffness", "0") and 1e2 < v < 1e20)


def test_every_design_at_every_pose():
    machine, population = load("zhang-gosselin-4dof"), Population(drawn(DESIGNS, 30, 0), drawn(POSES, 7, 1))
    found = evaluate_designs(machine, population, NAMES)
    assert population.shape == found.status.shape == (30, 7)
    columns = {path: np.repeat(values, 7) for path, values in population.designs.items()}
    columns |= {path: np.tile(values, 30) for path, values in population.poses.items()}
    expected = evaluate(machine, PointTable(columns), NAMES)
    np.testing.assert_array_equal(found.status.ravel(), expected.status)
    assert (found.status != 0).any(), "some designs must be out of reach"
    for name in NAMES:
        np.testing.assert_allclose(found.values[name].ravel(), expected.values[name], rtol=1e-9)


@pytest.mark.parametrize("name", ["zhang-gosselin-4dof", "tripteron"])
def test_without_poses_it_is_the_machines_own(name):
    machine, path = load(name), stiff_path(name)
    population = Population({path: float(values(machine)[path]) * np.array([0.9, 1.0, 1.1])}, {})
    found = evaluate_designs(machine, population, ["compliance_x"])
    expected = evaluate(machine, PointTable(population.designs), ["compliance_x"])
    assert found.status.shape == (3, 1)
    np.testing.assert_allclose(found.values["compliance_x"][:, 0], expected.values["compliance_x"], rtol=1e-9)


@pytest.mark.parametrize("machine", ["zhang-gosselin-4dof", "planar-3rpr"])
def test_derivatives_are_those_of_the_engine(machine):
    loaded = load(machine)
    shares = np.array([0.95, 1.0, 1.02, 1.05])
    designs = {p: float(values(loaded)[p]) * shares for p in ("geometry.platform_radius", "geometry.base_radius")}
    population, by = Population(designs, {}), tuple(designs)
    found = differentiate(loaded, population, ["compliance_x", "singularity_margin"], by)
    expected = evaluate_gradient(loaded, PointTable(designs), ["compliance_x", "singularity_margin"], by)
    np.testing.assert_allclose(found.slopes[:, :, :, 0], expected.gradients, rtol=1e-9)
    np.testing.assert_allclose(found.values["singularity_margin"][:, 0], expected.values[1], rtol=1e-12)


def test_derivatives_where_joints_are_found_by_iteration():
    machine, path = load("tripteron"), stiff_path("tripteron")
    population = Population({path: float(values(machine)[path]) * np.array([1.0, 1.1])}, {})
    found = differentiate(machine, population, ["compliance_x"], [path])
    expected = evaluate_gradient(machine, PointTable(population.designs), "compliance_x", [path])
    np.testing.assert_allclose(found.slopes[0, 0, :, 0], expected.gradients[0, 0], rtol=1e-12)


def test_a_free_spring_among_the_designs():
    """A stiffness of exactly 0 is a joint: it is computed apart, in values and in derivatives."""
    machine = load("zhang-gosselin-4dof", ["stiffness.passive_actuator=1000 N*m/rad"])
    population = Population({"stiffness.passive_actuator": np.array([0.0, 500.0])}, {})
    found = evaluate_designs(machine, population, ["compliance_x"])
    sloped = differentiate(machine, population, ["compliance_x"], population.paths)
    np.testing.assert_allclose(found.values["compliance_x"], sloped.values["compliance_x"], rtol=1e-9)
    assert np.isfinite(found.values["compliance_x"]).all()
    assert found.values["compliance_x"][0, 0] > found.values["compliance_x"][1, 0]
