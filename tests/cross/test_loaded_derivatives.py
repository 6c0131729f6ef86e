"""Derivatives of loaded states, by the implicit function theorem, against differences of states of the solver."""

import numpy as np
import pytest
from test_loaded_routes import moved_by_about

from kinetostat import sensitivity
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.loaded import Way, loaded_fill
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.status import Status
from kinetostat.machine.parameters import parameters, values
from kinetostat.studies.optimisation.assessment import Assessor
from kinetostat.studies.optimisation.search import search
from machines import load_without_limits
from refusals import refused
from studies import best, written

BY = {
    "hexapod": ("geometry.base_radius", "geometry.base_angles.0", "stiffness.actuator.0"),
    "zhang-gosselin-4dof": ("geometry.passive_links.0", "geometry.base_angle", "stiffness.passive_links.1"),
    "planar-3rpr": ("geometry.base_radius", "geometry.base_angles.1", "stiffness.actuator.1"),
    "tricept": ("geometry.platform_radius", "stiffness.actuator.0"),
}
LOADS = ("load.force.0", "load.moment.2", "load.gravity.1", "load.gravity_angle", "tool.mass", "tool.centre_of_mass.0")


def differences(machine, path, quantities):
    """Derivatives by a parameter from four states, without the error of second order in the step."""
    here = values(machine)[path]
    step = 3e-3 * (abs(here) or 1.0)
    shares = np.array([-1.0, 1.0, -0.5, 0.5, -0.25, 0.25])
    states, status = np.empty((len(quantities), 6)), np.empty(6, dtype=np.int8)
    loaded_fill(machine, [path], quantities, Way.ANY_MACHINE)({path: here + step * shares}, states, status)
    assert (status == Status.OK).all()
    wide, middle, narrow = (np.diff(states[:, k : k + 2])[:, 0] / (2 * step * shares[k + 1]) for k in (0, 2, 4))
    first, second = (4 * middle - wide) / 3, (4 * narrow - middle) / 3
    return (16 * second - first) / 15


@pytest.mark.parametrize("name", BY)
def test_derivatives_are_differences_of_states(name):
    machine = moved_by_about(name, 5e-3)
    known = {leaf for p in parameters(machine.family) for leaf in p.leaves}
    paths = [path for path in (*BY[name], *LOADS, "pose.x") if path in known]
    quantities = ["displacement_x", "tangent_free_stiffness_x", "tangent_stiffness_x", "load_factor"]
    here = values(machine)
    column = next(path for path in here if path.startswith("pose."))
    answer = evaluate_gradient(machine, PointTable({column: np.array([here[column]])}), quantities, paths)
    assert answer.status.tolist() == [Status.OK]
    exact = answer.gradients[:, :, 0]
    expected = np.array([differences(machine, path, quantities) for path in paths]).T
    sizes = np.array([abs(here[path]) or 1.0 for path in paths])  # what counts is the change per percent
    for slopes, differing in zip(exact * sizes, expected * sizes, strict=True):
        assert slopes == pytest.approx(differing, rel=1e-6, abs=1e-6 * float(np.abs(differing).max()))
    assert np.count_nonzero(exact) > 0.7 * exact.size


def test_sensitivities_of_the_sag_name_its_loads_and_springs():
    machine = load_without_limits("hexapod", ["tool.mass=20 kg", "load.gravity=[0, 0, -9.81]"])
    answer = sensitivity(machine, ["displacement_z"])
    percents = {influence.path: influence.percents[0] for influence in answer.parameters}
    assert percents["load.gravity.2"] == pytest.approx(-1.0, abs=1e-4)  # it is negative, so that a percent adds to it
    assert percents["tool.mass"] == pytest.approx(1.0, abs=1e-4)
    assert sum(share for path, share in percents.items() if path.startswith("stiffness")) == pytest.approx(
        -1.0, abs=1e-4
    )


def test_a_pose_far_from_its_free_state_says_why_it_has_no_derivatives():
    machine = load_without_limits("hexapod", ["load.force=[0, 0, -1e12]"])
    answer = sensitivity(machine, ["displacement_z"])
    assert answer.status is not Status.OK
    assert "no derivatives here" in answer.message


SAG = """
schema = 1
name = "less sag"
machine = "{machine}"
[set]
load.gravity = [0, 0, -9.81]
tool.mass = "20 kg"
[[variables]]
path = "geometry.base_radius"
from = "{least}"
to = "{most}"
[[objectives]]
quantity = "{quantity}"
goal = "maximize"
[optimizer]
method = "{method}"
population = 8
generations = 3
starts = 2
"""


def best_of(quantity, machine, least, most, method):
    study = written(SAG.format(quantity=quantity, machine=machine, least=least, most=most, method=method))
    return best(search(Assessor(study)))


def test_searches_find_the_least_sag_with_derivatives_and_without():
    exact, other = (best_of("displacement_z", "hexapod", "9 cm", "14 cm", method) for method in ("gradient", "genetic"))
    assert -1e-5 < other <= exact < 0.0
    assert other == pytest.approx(exact, rel=0.02)


def test_searches_of_other_machines_need_no_derivatives():
    assert best_of("load_factor", "hexapod-rus", "44 cm", "46 cm", "genetic") > 1.0
    with refused(r'"load_factor" of .* has no derivatives.*optimizer.method = genetic'):
        best_of("load_factor", "hexapod-rus", "44 cm", "46 cm", "gradient")
