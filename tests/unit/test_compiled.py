"""Compiled functions: shapes, names, derivatives, prepared buffers, threads, pickles, and what is refused."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from kinetostat import InputError, Status, analyze, compile, evaluate, load  # noqa: A004
from kinetostat.engine.form import Specimen, TraceOptions, form_of, objectives_of
from kinetostat.engine.trace import needed_nodes
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.machine.machine import Machine

POSE = ("x", "y", "z", "roll", "pitch", "yaw")
HERE = (0.01, -0.02, 0.15, 0.1, -0.05, 0.2)
SAME = 1e-12


@pytest.fixture(scope="module")
def hexapod() -> Machine:
    return load("hexapod")


def test_a_function_gives_what_evaluate_gives(hexapod):
    function = compile(hexapod, POSE, ["stiffness", "compliance_z"])
    expected = evaluate(hexapod, np.array([HERE]), ["stiffness", "compliance_z"])
    np.testing.assert_allclose(function(*HERE), [expected[name].item() for name in function.quantities], rtol=SAME)
    assert function.inputs == tuple(f"pose.{name}" for name in POSE)
    assert function.shape == (7,)


@pytest.mark.parametrize(("quantities", "front"), [("stiffness_x", ()), (["stiffness_x"], (1,)), ("C", (6, 6))])
def test_shapes_broadcast_and_quantities_come_in_front(hexapod, quantities, front):
    function = compile(hexapod, ["x", "z"], quantities)
    x, z = np.array([[0.0], [0.01], [0.02]]), np.array([0.14, 0.15])
    whole = function(x, z)
    assert whole.shape == (*front, 3, 2)
    assert function.status(x, z).shape == (3, 2)
    np.testing.assert_array_equal(function(0.02, 0.15), whole[..., 2, 1])
    assert function(np.empty((0, 2)), 0.15).shape == (*front, 0, 2)
    assert np.shape(function(0.0, 0.15)) == front


def test_a_matrix_is_that_of_the_analysis(hexapod):
    np.testing.assert_allclose(
        compile(hexapod, "x", "K")(0.01), analyze(load("hexapod", ["x=1 cm"])).K, rtol=1e-9, atol=1e-3
    )


def test_a_planar_machine_has_a_matrix_of_three_rows():
    assert compile(load("planar-3rpr"), "x", "K")(0.0).shape == (3, 3)


def test_derivatives_are_those_of_differences(hexapod):
    function = compile(hexapod, POSE, ["stiffness_x", "free_stiffness_z"])
    value, jacobian = function.value_and_jacobian(*HERE)
    np.testing.assert_allclose(value, function(*HERE), rtol=SAME)
    np.testing.assert_array_equal(jacobian, function.jacobian(*HERE))
    assert jacobian.shape == (2, 6)
    for k, step in enumerate(1e-6 * np.eye(6)):
        change = (function(*(HERE + step)) - function(*(HERE - step))) / 2e-6
        np.testing.assert_allclose(jacobian[:, k], change, rtol=1e-5, atol=1e-6 * np.abs(jacobian).max())
    assert function.jacobian(np.zeros((3, 1)), *np.tile(HERE[1:], (2, 1)).T).shape == (2, 6, 3, 2)


def test_a_field_of_several_entries_is_one_input():
    """Its derivative is the sum of those by the entries."""
    function = compile(load("zhang-gosselin-4dof"), ["stiffness.actuator"], "stiffness_z")
    at, step = 1e7, 10.0
    assert function.jacobian(at).shape == (1,)
    change = (function(at + step) - function(at - step)) / (2.0 * step)
    assert function.jacobian(at)[0] == pytest.approx(change, rel=1e-5)


def test_where_there_is_no_answer_values_are_nan_and_the_status_says_why(hexapod):
    function = compile(hexapod, ["z"], "stiffness_x")
    z = np.array([0.15, 50.0, np.nan])
    values, status = function(z), function.status(z)
    assert (status == Status.OK).tolist() == [True, False, False]
    np.testing.assert_array_equal(np.isnan(values), status != Status.OK)
    assert np.isnan(function.jacobian(50.0)).all()


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "delta"])
def test_values_alone_are_the_values_and_know_no_status(name):
    machine, pose = load(name), load(name).tables["pose"]
    whole, alone = (
        compile(machine, ["x", "z"], ["stiffness", "compliance"], judged=judged) for judged in (True, False)
    )
    x, z = pose.x + np.linspace(-1e-3, 1e-3, 9), pose.z + np.linspace(-1e-3, 1e-3, 9)
    assert not whole.status(x, z).any()
    np.testing.assert_allclose(alone(x, z), whole(x, z), rtol=SAME)
    with pytest.raises(InputError, match="judged"):
        alone.status(x, z)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(alone))(x, z), alone(x, z))


def test_values_alone_know_no_limits_and_cost_fewer_operations():
    machine = load("hexapod", ["limits.longest_leg=30 cm"])
    assert np.isnan(compile(machine, "z", "stiffness_x")(0.4))
    assert np.isfinite(compile(machine, "z", "stiffness_x", judged=False)(0.4))
    form, _ = form_of(machine, ["pose.z"])
    objectives = ((("stiffness_x", 1.0),),)
    bodies = [objectives_of(Specimen(machine), form, objectives, TraceOptions(judged=j)).body for j in (True, False)]
    whole, alone = (len(needed_nodes([*body.results, body.code])) for body in bodies)
    assert alone < 0.95 * whole


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "hexapod-hardware", "planar-3rrr"])
@pytest.mark.parametrize("count", [1, 3, 21])
def test_buffers_have_the_numbers_of_a_call(name, count):
    machine = load(name)
    function = compile(machine, ["x", "y"], ["stiffness_x", "compliance_y"])
    buffers = function.buffers(count)
    start = buffers.inputs.copy()
    rng = np.random.default_rng(3)
    for reach in (1e-3, 0.02, 30.0):  # the last is out of reach for most
        buffers.inputs[:] = start + rng.uniform(-reach, reach, start.shape)
        results = buffers()
        assert results is buffers.results
        np.testing.assert_array_equal(results, function(*buffers.inputs))
        np.testing.assert_array_equal(buffers.status, function.status(*buffers.inputs))


def test_buffers_know_angles_of_many_turns(hexapod):
    """They are turned back first, as in a call; alone or between other inputs."""
    far = 0.1 + 2.0 * np.pi * np.ceil(LARGEST_ANGLE / 6.0)
    for names in (["roll", "x", "yaw"], ["pitch", "roll"]):
        function = compile(hexapod, names, "stiffness_x")
        buffers = function.buffers()
        for row in range(len(names)):
            buffers.inputs[:] = 0.01
            buffers.inputs[row] = far if names[row] != "x" else 0.0
            near = [0.1 if value == far else value for value in buffers.inputs[:, 0]]
            assert buffers()[0, 0] == pytest.approx(function(*near), rel=1e-8)


def test_buffers_of_a_varying_stiffness_see_the_free_spring():
    machine = load("zhang-gosselin-4dof")
    function = compile(machine, ["stiffness.actuator.0"], "compliance_z")
    buffers = function.buffers(2)
    buffers.inputs[0] = 0.0, 1e6
    np.testing.assert_array_equal(buffers()[0], function(buffers.inputs[0]))
    assert buffers.results[0, 0] > buffers.results[0, 1]


def test_threads_share_a_function(hexapod):
    function = compile(hexapod, ["x", "z"], ["stiffness", "compliance"])
    x = np.linspace(-0.05, 0.05, 400)
    expected = function(x, 0.15)
    with ThreadPoolExecutor(8) as pool:
        whole = np.concatenate(list(pool.map(lambda part: function(part, 0.15), np.split(x, 40))), axis=1)
    np.testing.assert_array_equal(whole, expected)


@pytest.mark.parametrize("name", ["hexapod", "hexapod-hardware"])
def test_a_function_can_be_pickled(name):
    function = compile(load(name), ["z"], ["stiffness_x", "compliance_z"])
    again = pickle.loads(pickle.dumps(function))
    assert (again.inputs, again.quantities, again.shape) == (function.inputs, function.quantities, function.shape)
    assert again.machine == function.machine
    z = again.buffers().inputs[0, 0]
    np.testing.assert_array_equal(again(z), function(z))


@pytest.mark.parametrize(
    ("inputs", "quantities", "words"),
    [
        ([], "stiffness_x", "names no field"),
        (["nothing"], "stiffness_x", "is not a field"),
        (["x", "pose.x"], "stiffness_x", "pose.x is an input twice"),
        (["x"], "stifness_x", "did you mean stiffness_x"),
        (["x"], ["K", "stiffness_x"], 'quantities="K"'),
        (["x"], ["stiffness_x", 3], "quantities[1] is 3"),
    ],
)
def test_what_cannot_be_compiled_is_refused(hexapod, inputs, quantities, words):
    with pytest.raises(InputError) as error:
        compile(hexapod, inputs, quantities)
    assert words in str(error.value)


@pytest.mark.parametrize("count", [0, -1, 1.5, "1"])
def test_buffers_need_a_number_of_poses(hexapod, count):
    with pytest.raises(InputError, match="give a whole number from 1"):
        compile(hexapod, ["x"], "stiffness_x").buffers(count)


def test_arrays_that_do_not_fit_are_refused(hexapod):
    function = compile(hexapod, ["x", "z"], "stiffness_x")
    for given, words in (
        ((0.0,), "2, one for each of pose.x, pose.z"),
        (([0.0] * 2, [0.0] * 3), "fit"),
        (("a", 1), "fit"),
    ):
        with pytest.raises(InputError) as error:
            function(*given)
        assert words in str(error.value)
