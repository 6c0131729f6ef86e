"""A load on any machine: motion, leg wrenches, spring loads and joint reactions are in balance with it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry import vectors
from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.kinetostatics.loading import deflection, joint_reactions, leg_wrenches, spring_loads
from kinetostat.machine.machine import springs
from machines import every_machine, few, regular
from numeric import array, motions, respring, screw, vector

BALANCED = 1e-9
"""Of the load, lengths in units of the machine's: some digits less than float64, by the condition of W."""
SHARED = 1e-6
"""Where legs share a load by their compliance, its contrast of some 1e3 and that of the geometry come on top."""
loads = st.builds(Wrench, vectors(100.0), vectors(1000.0)).filter(lambda w: np.linalg.norm(screw(w)) > 1.0)


def in_newtons(response, wrench):
    """A wrench [6], its moment over the machine's length."""
    return screw(wrench) / np.repeat([float(response.configuration.length), 1.0], 3)


def that_exists(response, load):
    """A load without what a planar machine does not feel."""
    exists = motions(response) @ motions(response).T @ screw(load)
    return Wrench(type(load.rotational)(*exists[:3].tolist()), type(load.rotational)(*exists[3:].tolist()))


@every_machine
@few
@given(data=st.data(), load=loads)
def test_the_tool_point_moves_by_c_times_the_load(case, data, load):
    response = data.draw(regular(case))
    moved = deflection(response.statics, load)
    assert isinstance(moved, Twist)
    assert screw(moved) == pytest.approx(array(response.compliance) @ screw(load), rel=1e-12, abs=1e-18)


@every_machine
@few
@given(data=st.data(), load=loads)
def test_the_legs_take_the_load_and_nothing_else(case, data, load):
    """Their wrenches sum to it, and none works on the passive joints of its leg."""
    response = data.draw(regular(case))
    load = that_exists(response, load)
    carried = leg_wrenches(response, load)
    size, length = np.linalg.norm(in_newtons(response, load)), float(response.configuration.length)
    largest = max(np.linalg.norm(in_newtons(response, wrench)) for wrench in carried)
    left = sum(in_newtons(response, wrench) for wrench in carried) - in_newtons(response, load)
    exists = motions(response) @ motions(response).T
    assert np.linalg.norm(exists @ left) <= BALANCED * (size + largest)
    for leg, wrench in zip(response.legs, carried, strict=True):
        for twist in leg.passive:
            reach = np.linalg.norm(screw(twist) * np.repeat([length, 1.0], 3))
            assert abs(wrench.work(twist)) <= BALANCED * largest * reach


@every_machine
@few
@given(data=st.data(), load=loads)
def test_a_spring_carries_what_its_leg_brings_to_it(case, data, load):
    """By virtual work on the spring's own twist: F_e = w_leg . b_e."""
    response = data.draw(regular(case))
    load, length = that_exists(response, load), float(response.configuration.length)
    carried, found = leg_wrenches(response, load), iter(spring_loads(response, load))
    largest = max(np.linalg.norm(in_newtons(response, wrench)) for wrench in carried)
    for leg, wrench in zip(response.legs, carried, strict=True):
        for twist in leg.elastic:
            reach = np.linalg.norm(screw(twist) * np.repeat([length, 1.0], 3))
            assert next(found) == pytest.approx(wrench.work(twist), abs=BALANCED * largest * reach)
    assert list(found) == []


@every_machine
@few
@given(data=st.data(), load=loads)
def test_the_work_of_the_load_is_stored_in_the_springs(case, data, load):
    """Clapeyron: w . t = sum of F_e times its deformation s_e F_e."""
    response = data.draw(regular(case))
    work = load.work(deflection(response.statics, load))
    stored = sum(s * f * f for s, f in zip(response.statics.compliance, spring_loads(response, load), strict=True))
    assert stored == pytest.approx(work, rel=1e-9)


@every_machine
@few
@given(data=st.data(), load=loads)
def test_the_springs_move_the_legs_as_the_platform_moves(case, data, load):
    """Compatibility: along what a leg can carry, its springs yield by just as much as the platform moves."""
    response = data.draw(regular(case))
    moved = deflection(response.statics, load)
    yielding = iter([s * f for s, f in zip(response.statics.compliance, spring_loads(response, load), strict=True)])
    scale = np.repeat([float(response.configuration.length), 1.0], 3)
    for leg in response.legs:
        own = [next(yielding) for _ in leg.loads]
        for n, wrench in enumerate(leg.wrenches):
            shifts = [row[n] * d for row, d in zip(leg.loads, own, strict=True)]
            reach = np.linalg.norm(screw(wrench) / scale) * np.linalg.norm(screw(moved) * scale)
            assert sum(shifts) == pytest.approx(wrench.work(moved), abs=SHARED * (reach + sum(map(abs, shifts))))


@every_machine
@few
@given(data=st.data(), load=loads)
def test_a_free_actuator_carries_nothing(case, data, load):
    """In a redundant machine the others take over; where none can, there is no answer."""
    whole = data.draw(regular(case))
    actuators = [
        e
        for e, spring in enumerate(spring for leg in whole.configuration.legs for spring in leg.springs)
        if spring.actuated
    ]
    e = data.draw(st.sampled_from(actuators))
    response = respring(whole, {e: 0.0})
    if np.isfinite(array(response.compliance)).all() and response.status == 0:
        load = that_exists(response, load)
        assert spring_loads(response, load)[e] == 0.0
        carried = [in_newtons(response, wrench) for wrench in leg_wrenches(response, load)]
        left = sum(carried) - in_newtons(response, load)
        exists = motions(response) @ motions(response).T
        assert np.linalg.norm(exists @ left) <= 1e-6 * max(np.linalg.norm(w) for w in carried)


@every_machine
@few
@given(data=st.data(), load=loads)
def test_joints_pass_on_what_they_can(case, data, load):
    """No moment about a free axis, no force along a free slide, its load in a held one; links only add arms."""
    response = data.draw(regular(case))
    load = that_exists(response, load)
    reactions = joint_reactions(response, load)
    carried = dict(zip((s.name for s in springs(response.configuration)), spring_loads(response, load), strict=True))
    length, size = float(response.configuration.length), np.linalg.norm(in_newtons(response, load))
    largest = max([np.linalg.norm(in_newtons(response, reaction.wrench)) for reaction in reactions], default=0.0) + size
    for leg, wrench in zip(response.configuration.legs, leg_wrenches(response, load), strict=True):
        own = {reaction.joint: reaction for reaction in reactions if reaction.leg == leg.name}
        held = {s.joint.name or s.name: s for s in leg.springs if s.actuated or s.hinge}
        assert set(own) == {joint.name for joint in leg.passive} | set(held)
        for name, spring in held.items():
            about = own[name].wrench.at_offset(response.reference - own[name].point)
            carries = about.work(spring.joint.twist(response.reference))
            assert carries == pytest.approx(carried[spring.name], abs=BALANCED * largest * max(length, 1.0))
        for joint in leg.passive:
            reaction = own[joint.name]
            moment, force = vector(reaction.wrench.rotational), vector(reaction.wrench.translational)
            axis = vector(joint.axis)
            if joint.point is None:
                assert abs(force @ axis) <= BALANCED * largest
            elif joint.pitch == 0.0 and joint.point == reaction.point:
                assert abs(moment @ axis) <= BALANCED * largest * length
            arm = vector(reaction.point) - vector(response.reference)
            expected = vector(wrench.rotational) - np.cross(arm, vector(wrench.translational))
            assert moment == pytest.approx(expected, abs=BALANCED * largest * length)
            assert force == pytest.approx(vector(wrench.translational), abs=BALANCED * largest)
