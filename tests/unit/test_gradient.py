"""Derivatives of traced results: every rule against differences with more digits, as nodes and as numbers."""

import math

import numpy as np
import pytest

from kinetostat.algebra.scalar import cos, sin, smaller, sqrt, where
from kinetostat.engine.gradient import InterpretedBody, gradient, share_of, with_gradients
from kinetostat.engine.machine_code import Program, machine_code_of
from kinetostat.engine.trace import Body, Graph, needed_nodes

RULES = {
    "sum": lambda x, y: x + y + 2.0,
    "difference": lambda x, y: x - y - 2.0,
    "taken from a number": lambda x, y: 3.0 - x * y,
    "opposite": lambda x, y: -(x + y),
    "product": lambda x, y: 3.0 * x * y,
    "powers": lambda x, y: x * x * x * y,
    "quotient": lambda x, y: x / y,
    "reciprocals": lambda x, y: 2.0 / x + 1.0 / y,
    "quotients of one divisor": lambda x, y: (x * x) / (x + y) + (y * y) / (x + y),
    "root": lambda x, y: sqrt(x * x + y * y),
    "size": lambda x, y: abs(x - y) * x,
    "size of a negative": lambda x, y: abs(-x) * y,
    "angles": lambda x, y: cos(x) * sin(y),
    "negative angle": lambda x, y: sin(-x) * cos(-y),
    "choice": lambda x, y: where(x < y, x * x, y * x),
    "both signs": lambda x, y: where(x <= y, x, -x) * y,
    "choice between numbers": lambda x, y: where(x < y, 2.0, 3.0) * x,
    "two conditions": lambda x, y: where((x < y) & (abs(x) < 1.0), x, y),
    "smaller": smaller,
    "kept apart": lambda x, y: where(x > y, sqrt(where(x > y, x - y, 1.0)), 0.0),
    "nothing": lambda *_: 3.0,
    "itself": lambda *both: both[1],
}
"""Functions of two scalars that use every operation of a graph."""
EXACT = 1e-13
STEP = np.longdouble(3e-4)
WEIGHTS = {-3: -1 / 60, -2: 3 / 20, -1: -3 / 4, 1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
"""Central differences of sixth order: what is left out is STEP^6 times the seventh derivative over 140."""


def points(count=101):
    """Pairs of both signs and either order, none near a kink."""
    rng = np.random.default_rng(4)
    x, y = rng.uniform(0.5, 2.0, (2, count)) * rng.choice([-1.0, 1.0], (2, count))
    apart = abs(abs(x) - abs(y)) > 0.1
    return x[apart & (abs(abs(x) - 1.0) > 0.01)], y[apart & (abs(abs(x) - 1.0) > 0.01)]


def differences(function, x, y):
    """Derivatives by x and by y [2 x points]."""
    x, y = (a.astype(np.longdouble) for a in (x, y))
    by_x = sum(w * (function(x + k * STEP, y) + 0 * x) for k, w in WEIGHTS.items()) / STEP
    by_y = sum(w * (function(x, y + k * STEP) + 0 * x) for k, w in WEIGHTS.items()) / STEP
    return np.array([by_x, by_y])


def bodies(function, fixed=False):
    """A traced function as a body, and its inputs x and y; x is the same at all points if `fixed`."""
    graph = Graph()
    x, y = graph.input(fixed=fixed), graph.input()
    result = function(x, y)
    return Body([x] if fixed else [], [y] if fixed else [x, y], [result], 0.0), (x, y)


def run(runnable, fixed, columns):
    """Value and both derivatives [3 x points]."""
    found, codes = np.full((3, len(columns[0])), 7.0), np.full(len(columns[0]), 7, dtype=np.int8)
    runnable.run(np.array(fixed), columns, found, codes)
    assert (codes == 0).all()
    return found


@pytest.mark.parametrize("name", RULES)
def test_every_rule_is_that_of_calculus(name):
    body, inputs = bodies(RULES[name])
    x, y = points()
    expected = differences(RULES[name], x, y)
    for runnable in (Program(machine_code_of(with_gradients(body, inputs))), InterpretedBody(body, inputs)):
        value, *slopes = run(runnable, [], [x, y])
        assert value == pytest.approx(RULES[name](x, y) + 0 * x, rel=EXACT)
        assert np.array(slopes) == pytest.approx(expected.astype(float), rel=EXACT, abs=EXACT)


@pytest.mark.parametrize("name", RULES)
def test_an_input_may_be_the_same_at_all_points(name):
    body, inputs = bodies(RULES[name], fixed=True)
    y = points()[1]
    expected = differences(RULES[name], 0.3 + 0 * y, y)
    for runnable in (Program(machine_code_of(with_gradients(body, inputs))), InterpretedBody(body, inputs)):
        assert run(runnable, [0.3], [y])[1:] == pytest.approx(expected.astype(float), rel=EXACT, abs=EXACT)


def test_an_input_that_is_given_twice_has_its_derivative_twice():
    graph = Graph()
    x = graph.input()
    body, inputs = Body([], [x], [x * x], 0.0), [x, x]
    for runnable in (Program(machine_code_of(with_gradients(body, inputs))), InterpretedBody(body, inputs)):
        results, codes = np.empty((3, 2)), np.empty(2, dtype=np.int8)
        runnable.run(np.empty(0), [np.array([1.0, 3.0])], results, codes)
        assert results.tolist() == [[1.0, 9.0], [2.0, 6.0], [2.0, 6.0]]


def test_what_depends_on_fixed_inputs_alone_is_computed_once():
    graph = Graph()
    x, y = graph.input(fixed=True), graph.input()
    by_x, by_y = gradient(x * x * y, [x, y])
    assert by_y.fixed
    assert not by_x.fixed


def test_a_cosine_is_differentiated_as_such_and_not_as_its_series():
    """By its series, the derivative at many turns would be that of the remainder: wrong at every quarter turn."""
    body, inputs = bodies(lambda x, y: cos(x) + y)
    x = np.concatenate([np.arange(-8, 9) * np.pi / 4, [1e5, -3e5]])
    for runnable in (Program(machine_code_of(with_gradients(body, inputs))), InterpretedBody(body, inputs)):
        assert run(runnable, [], [x, x])[1] == pytest.approx(-np.sin(x), rel=1e-15, abs=1e-15)


def test_equal_derivatives_are_one_node():
    graph = Graph()
    x, y = graph.input(), graph.input()
    shared = sqrt(x * x + y * y)
    first, again = gradient(shared, [x, y]), gradient(shared, [x, y])
    assert first == again
    assert len(needed_nodes(first)) <= 14
    assert gradient(x * y, [x, y]) == [y, x]


def test_what_does_not_depend_has_no_derivative():
    graph = Graph()
    x, y = graph.input(), graph.input()
    assert gradient(2.0, [x, y]) == [0.0, 0.0]
    assert gradient(y, [x]) == [0.0]
    assert gradient(y, [y]) == [1.0]
    assert gradient(where(x < y, 1.0, 2.0), [x, y]) == [0.0, 0.0]


def test_inputs_may_be_nodes_on_the_way():
    graph = Graph()
    x = graph.input()
    middle = x * x
    by_middle, by_x = gradient(3.0 * middle, [middle, x])
    assert by_middle == 3.0
    assert isinstance(by_x, type(x))


def test_a_branch_not_taken_leaves_nothing_behind():
    body, inputs = bodies(lambda x, y: where(x > 0.0, 1.0 / where(x > 0.0, x, 1.0), 0.0) + y)
    x = np.array([-1.0, 0.0, 2.0, -3.0, 4.0, 0.0, 1.0, 1.0])
    for runnable in (Program(machine_code_of(with_gradients(body, inputs))), InterpretedBody(body, inputs)):
        by_x = run(runnable, [], [x, x])[1]
        assert by_x == pytest.approx(np.where(x > 0, -1.0 / np.where(x > 0, x, 1.0) ** 2, 0.0), rel=1e-15)


def test_an_unknown_operation_is_refused():
    with pytest.raises(ValueError, match="no derivative of power"):
        share_of("power", (1.0, 2.0), 1.0, 0, math.nan)
