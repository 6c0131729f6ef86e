"""The order in which a program computes: operands first, every value once, and fewer of them waiting for their use."""

import math

import pytest

from kinetostat.algebra.scalar import finite, is_bounded, ordinary, where
from kinetostat.engine.form import Specimen, TraceOptions, form_of, objectives_of
from kinetostat.engine.kernel import closes_inside
from kinetostat.engine.llvm_source import freeing_first
from kinetostat.engine.trace import Graph, Node, needed_nodes
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.machine.loading import load


def most_waiting(order):
    """The most values that have been computed and are still needed, after any operation."""
    last = {
        operand: place for place, node in enumerate(order) for operand in node.operands if isinstance(operand, Node)
    }
    waiting, most = 0, 0
    ends = [0] * len(order)
    for place, node in enumerate(order):
        if last.get(node, place) > place and not node.fixed:
            waiting += 1
            ends[last[node]] += 1
        waiting -= ends[place]
        most = max(most, waiting)
    return most


@pytest.mark.parametrize("name", ["zhang-gosselin-4dof", "hexapod", "tripteron"])
def test_what_frees_registers_comes_first(name):
    machine = load(name)
    form, _ = form_of(machine, ("pose.x", "pose.z"))
    objectives = tuple(((quantity, 1.0),) for quantity in (*GROUPS["compliance"], *GROUPS["stiffness"]))
    closed = machine.family.chains is not None and closes_inside(machine)
    body = objectives_of(Specimen(machine), form, objectives, TraceOptions(closed=closed)).body
    traced = needed_nodes([*body.results, body.code])
    order = freeing_first(traced)
    assert sorted(node.number for node in order) == [node.number for node in traced]
    places = {node: place for place, node in enumerate(order)}
    assert all(places[o] < places[node] for node in order for o in node.operands if isinstance(o, Node))
    assert most_waiting(order) <= most_waiting(traced)


def test_what_a_formula_knows_leaves_no_code_for_infinity():
    graph = Graph()
    square = graph.input() * 2.0
    assert where(square < math.inf, 1.0, 0.0) not in (0.0, 1.0)
    assert where(finite(square) < math.inf, 1.0, 0.0) == 1.0
    assert not is_bounded(1.0 / graph.input(fixed=True))
    assert is_bounded(1.0 / ordinary(graph.input(fixed=True)))
    assert (finite(math.inf), ordinary(0.0)) == (math.inf, 0.0)
    assert is_bounded(1.0)
    assert not is_bounded(math.inf)


def test_only_a_factor_that_is_zero_by_form_drops_what_may_be_infinite():
    number = Graph().input()
    assert (number * 0.0, 0.0 * number, -number * 0.0) == (0.0, 0.0, 0.0)
    assert isinstance(number - number, Node)
    assert isinstance(number / number, Node)
    assert (ordinary(number) - number, number / number) == (0.0, 1.0)
