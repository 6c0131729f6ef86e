"""Elastic elements: how springs are grouped, and from which stiffness on one of them counts as rigid."""

import math

import numpy as np
import pytest

from kinetostat.engine.batch import responses
from kinetostat.engine.points import Axis, Grid
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import (
    LINKS_TOGETHER,
    diagonal_with,
    element_share,
    elements,
    is_isostatic,
    rigid_from,
    stiffness_equations,
    with_links_together,
)
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.machine.machine import springs
from machines import every_machine

EXCESS = 0.01


def found_in(machine):
    response = respond(machine)
    return response, {element.name: element for element in elements(response.configuration)}


def test_what_is_alike_in_several_legs_is_one_element():
    _, found = found_in(load("tripteron"))
    assert list(found) == ["slide ×3", "proximal ×3", "distal ×3"]
    assert found["slide ×3"].stiffness == 1e6
    assert found["slide ×3"].unit == "N/m"
    assert found["proximal ×3"].unit == ""
    _, paper = found_in(load("zhang-gosselin-4dof"))
    assert list(paper) == ["actuator ×4", "passive link 1", "passive link 2"]


def test_a_removed_leg_is_no_element():
    _, found = found_in(load("passive-leg-4dof-driven"))
    assert found["actuator ×3"].parts == ("leg 2 actuator", "leg 3 actuator", "leg 4 actuator")


@every_machine
def test_shares_of_all_elements_are_the_whole(case):
    response, found = found_in(case.machine)
    parts = np.sum([element_share(response, element) for element in found.values()], axis=0)
    assert parts == pytest.approx(np.array(response.compliance.diagonal()), rel=1e-9, abs=1e-30)


@every_machine
def test_at_the_limit_an_element_adds_one_percent(case):
    """The definition itself, by solving the statics again with softer or stiffer springs."""
    response = respond(case.machine)
    kept = case.machine.family.components
    for element in with_links_together(elements(response.configuration)):
        factors = rigid_from(response, element, EXCESS)[:, 0]
        rigid = diagonal_with(response, element, 0.0)
        for i in kept:
            if 1e-9 < factors[i] < 1e9:
                soft = diagonal_with(response, element, float(factors[i]))[i]
                assert soft / rigid[i] - 1.0 == pytest.approx(EXCESS, rel=1e-6)


def test_both_ways_to_the_limit_agree():
    """Stiff but not rigid legs turn an isostatic machine's closed form into the search, which must find the same."""
    machine = load("zhang-gosselin-4dof")
    response, found = found_in(machine)
    assert is_isostatic(response)
    assert not is_isostatic(respond(load("tripteron")))
    link = found["passive link 1"]
    x = 3
    share = element_share(response, link)[x]
    rest = response.compliance.diagonal()[x] - share
    assert rigid_from(response, link, EXCESS)[x, 0] == pytest.approx(EXCESS * rest / share, rel=1e-9)


def test_nothing_else_yields():
    machine = load("zhang-gosselin-4dof")
    response = respond(machine)
    together = with_links_together(elements(response.configuration))[-1]
    assert together.name == LINKS_TOGETHER
    factors = rigid_from(response, together, EXCESS)[:, 0]
    assert factors[2] == 0.0
    assert factors[4] == 0.0
    assert (factors[[0, 1, 3, 5]] > 0.0).all()


def test_a_rigid_element_has_a_limit_too():
    """The limit does not depend on what the element is now."""
    limits = []
    for stiffness in ("1e3", "1e6", "rigid"):
        response, found = found_in(load("zhang-gosselin-4dof", [f"stiffness.passive_links.0={stiffness}"]))
        link = found["passive link 1"]
        own = 1.0 if link.stiffness == math.inf else link.stiffness
        limits.append(own / rigid_from(response, link, EXCESS)[3, 0])
    assert limits == pytest.approx([limits[0]] * 3, rel=1e-9)


def test_many_poses_are_single_poses():
    machine = load("tripteron")
    xs = np.array([0.4, 0.5, 0.6])
    many = responses(machine, Grid([Axis(("pose.x",), xs)]))
    assert (np.asarray(many.status) == Status.OK).all()
    for element in elements(respond(machine).configuration):
        together = rigid_from(many, element, EXCESS)
        for n, x in enumerate(xs):
            alone = rigid_from(respond(load("tripteron", [f"pose.x={x}"])), element, EXCESS)[:, 0]
            assert together[:, n] == pytest.approx(alone, rel=1e-9)


@every_machine
def test_k_is_the_sum_that_its_equations_say(case):
    response, found = found_in(case.machine)
    equations = stiffness_equations(response, list(found.values()))
    if equations is None:
        return
    held = springs(response.configuration)
    for i in case.machine.family.components:
        terms = [held[found[name].springs[0]].stiffness * float(m.entry(i, i)) for name, m in equations.items()]
        assert sum(terms) == pytest.approx(float(response.stiffness.entry(i, i)), rel=1e-9)
