"""Drives balance the load: its virtual work over every motion of the mechanism is that of the springs that it moves."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exact_engine import Closed, Machine
from ideal_machines import CASES as FILES
from ideal_machines import MECHANISMS, Draw
from kinetostat import load
from kinetostat.equilibrium.solving import Rest
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.forward import stand
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.actuators import senses_of
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.studies.under_load import under_load
from machines import two_sided

SMALL = 1e-6
"""Greatest displacement under the load, rad or lengths of the machine: balance at the free state errs by so much."""
AHEAD = 1e-5
"""Change of a coordinate of the pose that shows the motion of the drives; differences err by its square."""
WORK = 1e-4
"""Share of the load times the motion that may be left over."""
directions = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).filter(lambda c: np.linalg.norm(c) > 0.1)


def balanced(twist, wrench, resisted, length):
    """Whether a load does the work over a motion that the springs resist, which is small beside what it could do."""
    units = np.array([length] * 3 + [1.0] * 3)
    possible = np.linalg.norm(twist * units) * np.linalg.norm(wrench / units)
    return abs(twist @ wrench - resisted) <= WORK * possible


def lightly_loaded(machine, wrench):
    """A wrench of this direction that moves the machine by at most `SMALL`, and its state under it."""
    response = respond(machine)
    length = float(response.configuration.length)
    units = np.array([1.0] * 3 + [1.0 / length] * 3)  # of twists
    exists = np.isin(np.arange(6), machine.family.components)
    wrench = np.where(exists, wrench, 0.0) * units
    softest = np.linalg.norm(np.array(response.compliance.rows(), dtype=float) * np.outer(units, units))
    moved = softest * np.linalg.norm(wrench / units)
    # Nothing moves where all is rigid, or where a planar machine is pushed out of its plane.
    wrench = wrench * (SMALL / moved if moved > 0.0 else 0.0)
    names = [f"load.{kind}.{i}" for kind in ("moment", "force") for i in range(3)]
    loaded = {name: float(c) for name, c, there in zip(names, wrench, exists, strict=True) if there}
    return wrench, under_load(with_values(machine, loaded))


def place(machine):
    """The rotation of the platform, the tool point, and how far forward the drive of each leg stands."""
    joints = solve_joints(machine) if machine.family.chains else None
    response = respond(machine, joints)
    turn = response.configuration.platform.rotation
    columns = np.column_stack([np.array(axis.components(), dtype=float) for axis in (turn.x, turn.y, turn.z)])
    actuators = stand(machine, joints)
    senses = [1.0] * len(actuators) if machine.family.chains else senses_of(response.configuration)
    drives = {a.leg: float(sense * a.coordinate) for a, sense in zip(actuators, senses, strict=True)}
    return columns, np.array(response.reference.components(), dtype=float), drives


@cache
def motions_of_the_pose(machine):
    """By each coordinate of the pose: the twist that a small change of it gives, and how far each drive moves."""
    length = float(respond(machine).configuration.length)
    kinds = {path: p.quantity.kind for p in parameters(machine.family) for path in p.leaves if path.startswith("pose.")}
    motions = {}
    for path, kind in kinds.items():
        step = AHEAD * (length if kind == "length" else 1.0)
        (before, start, q), (after, end, p) = (
            place(with_values(machine, {path: values(machine)[path] + sign * step})) for sign in (-1.0, 1.0)
        )
        turned = after @ before.T
        skew = 0.5 * (turned - turned.T)
        rotation = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        motions[path] = np.concatenate([rotation, end - start]), {leg: p[leg] - q[leg] for leg in q}
    return motions


@two_sided
@settings(max_examples=4)
@given(wrench=directions)
def test_drives_of_bundled_machines_balance_every_load(case, wrench):
    """Over the motions that the coordinates of the pose give, in which nothing but the drives deforms."""
    machine = case.machine
    length = float(respond(machine).configuration.length)
    wrench, state = lightly_loaded(machine, wrench)
    assert state.rest is Rest.OK
    # Parts of a drive in a row carry one load, and a drive of stiffness 0 carries none.
    carried = {spring.leg: spring.load for spring in state.springs if spring.actuated}
    for path, (twist, moved) in motions_of_the_pose(machine).items():
        resisted = sum(carried.get(leg, 0.0) * distance for leg, distance in moved.items())
        assert balanced(twist, wrench, resisted, length), (path, twist * wrench, resisted)


def balances_every_motion(machine, closed, wrench):
    """Whether it does so over the motions that an independent engine finds admissible, and how many these are."""
    wrench, state = lightly_loaded(machine, wrench)
    assert state.rest is Rest.OK, state.message
    carried = {spring.name.removesuffix(" actuator"): spring.load for spring in state.springs}
    motions = closed.admissible()
    for twist, sprung in motions:
        resisted = sum(carried[name] * amount for name, amount in sprung.items() if name in carried)
        assert balanced(twist, wrench, resisted, closed.length), (twist * wrench, resisted)
    return len(motions)


@pytest.mark.parametrize("mechanism", MECHANISMS)
@settings(max_examples=4)
@given(seed=st.integers(0, 10_000), wrench=directions)
def test_drives_of_overconstrained_machines_balance_every_load(mechanism, seed, wrench, tmp_path_factory):
    draw = Draw(mechanism, seed, hinges=False)  # under load, flexure hinges pull back to the home pose
    path = tmp_path_factory.mktemp("balance") / "machine.toml"
    path.write_text(draw.text, "utf-8")
    balances_every_motion(load(path), draw.closed, wrench)


@pytest.mark.parametrize("name", ["ideal-links-agile-eye", "ideal-links-exechon", "ideal-links-delta"])
def test_drives_of_machines_with_ideal_links_balance_a_load(name):
    """Such machines were said to carry 10 N with motors that carry nothing."""
    machine = Machine((FILES / f"{name}.toml").read_text("utf-8"))
    wrench = np.array([0.3, -0.5, 0.2, 1.0, 0.7, -0.4])
    assert balances_every_motion(load(FILES / f"{name}.toml"), Closed(machine, machine.pose), wrench) == 3
