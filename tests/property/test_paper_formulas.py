"""Second routes in plain NumPy, written from the paper: eq. 21 (rigid links) and eq. 32 (flexible links).

Nothing of the project but the numbers of a design enters here: the geometry is placed by trigonometry instead of the
closed form, the Jacobians are 4 x 6 and 6 x 6 arrays, and LAPACK inverts them.
"""

import math

import numpy as np
from hypothesis import assume, given

from kinetostat.kinetostatics.response import respond
from kinetostat.machine.parameters import values, with_values
from machines import CASES, REGULAR
from machines import machines as any_machines
from numeric import array, assert_blocks_close

CASE = next(case for case in CASES if case.name == "zhang-gosselin-4dof")
WELL = 1e6
"""Bound on the condition of A J5 and J5', whose inverses the paper's formulas take; LAPACK loses its digits."""
AGREEMENT = 1e-8
"""Two inversions with condition numbers below `WELL`, each in metres and radians without scaling."""


SIMPLE = {
    **{f"tool.offset.{i}": 0.0 for i in range(3)},
    **{f"stiffness.passive_link_bending.{i}": math.inf for i in range(2)},
    "stiffness.leg_axial": math.inf,
    "stiffness.passive_actuator": 0.0,
}
"""What the paper's machine does not have: a tool, links beside its virtual joints, and a drive in the passive leg."""


def machines(case):
    return any_machines(case).map(lambda machine: with_values(machine, SIMPLE))


def revolute(axis, point, tip):
    """Unit twist [omega; v] at the tip."""
    return np.concatenate([axis, np.cross(axis, tip - point)])


def place(design):
    """O, E and P of the passive leg and the pitch, by the law of cosines and the elevations of the links."""
    lower, upper = design["geometry.passive_links.0"], design["geometry.passive_links.1"]
    x, z, y = design["pose.x"], design["pose.z"], design["geometry.passive_leg_offset"]
    span = math.hypot(x, z)
    at_foot = math.acos((lower**2 + span**2 - upper**2) / (2 * lower * span))
    elevation = math.atan2(z, x) - at_foot
    elbow = np.array([lower * math.cos(elevation), y, lower * math.sin(elevation)])
    second = math.atan2(z - elbow[2], x - elbow[0])
    pitch = math.pi / 2 - second - design["pose.theta5"]
    return np.array([0.0, y, 0.0]), elbow, np.array([x, y, z]), elevation, second, pitch


def full_jacobian(design):
    """J5' of eq. 25: columns 51, 52 (virtual), 53, 54 (virtual), 55, 56; twists at P."""
    foot, elbow, tip, first, second, pitch = place(design)
    along_y = np.array([0.0, 1.0, 0.0])
    bend = [np.array([-math.sin(e), 0.0, math.cos(e)]) for e in (first, second)]
    last = np.array([math.cos(pitch), 0.0, -math.sin(pitch)])
    axes = (along_y, bend[0], along_y, bend[1], along_y, last)
    points = (foot, foot, elbow, elbow, tip, tip)
    return np.column_stack([revolute(axis, point, tip) for axis, point in zip(axes, points, strict=True)])


REAL, VIRTUAL = [0, 2, 4, 5], [1, 3]


def orientation(pitch, roll):
    cp, sp, cr, sr = math.cos(pitch), math.sin(pitch), math.cos(roll), math.sin(roll)
    return np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]]) @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])


def inverse_jacobian(design):
    """A and B of eqs. 1-4: a_i = [(Q p_i) x (leg i); leg i], B = diag(rho_i)."""
    *_, pitch = place(design)
    tip, turn = place(design)[2], orientation(pitch, design["pose.theta6"])
    base, top = design["geometry.base_angle"], design["geometry.platform_angle"]
    quarter = math.pi / 2
    rows, lengths = [], []
    for b, p in zip(
        (base, quarter + base, -quarter - base, -base), (top, quarter + top, -quarter - top, -top), strict=True
    ):
        arm = turn @ (design["geometry.platform_radius"] * np.array([math.cos(p), math.sin(p), 0.0]))
        leg = tip + arm - design["geometry.base_radius"] * np.array([math.cos(b), math.sin(b), 0.0])
        rows.append(np.concatenate([np.cross(arm, leg), leg]))
        lengths.append(np.linalg.norm(leg))
    return np.array(rows), np.diag(lengths)


def actuators(design):
    return np.array([design[f"stiffness.actuator.{i}"] for i in range(4)])


def rigid_compliance(design):
    """Eq. 21: Cc = J5 (A J5)^-1 B C B^T (A J5)^-T J5^T."""
    a, b = inverse_jacobian(design)
    j = full_jacobian(design)[:, REAL]
    assume(np.linalg.cond(a @ j) < WELL)
    inverse = np.linalg.inv(a @ j)
    return j @ inverse @ b @ np.diag(1 / actuators(design)) @ b.T @ inverse.T @ j.T


def flexible_stiffness(design):
    """Eq. 32: K = J5'^-T K5 J5'^-1 + A^T B^-T Kj B^-1 A, with K5 = diag(0, k52, 0, k54, 0, 0)."""
    a, b = inverse_jacobian(design)
    j = full_jacobian(design)
    assume(np.linalg.cond(j) < WELL)
    k5 = np.zeros(6)
    k5[VIRTUAL] = [design["stiffness.passive_links.0"], design["stiffness.passive_links.1"]]
    inverse, legs = np.linalg.inv(j), np.linalg.inv(b) @ a
    return inverse.T @ np.diag(k5) @ inverse + legs.T @ np.diag(actuators(design)) @ legs


@given(machines(CASE))
def test_rigid_links_give_equation_21(machine):
    """The springs' stiffness is exactly infinite here; the paper leaves them out."""
    response = respond(with_values(machine, {f"stiffness.passive_links.{i}": math.inf for i in range(2)}))
    assume(response.singularity_margin > REGULAR)
    assert_blocks_close(array(response.compliance), rigid_compliance(values(machine)), AGREEMENT)


@given(machines(CASE))
def test_flexible_links_give_equation_32(machine):
    response = respond(machine)
    assume(response.singularity_margin > REGULAR)
    assert_blocks_close(array(response.stiffness), flexible_stiffness(values(machine)), AGREEMENT)


@given(machines(CASE))
def test_the_inverse_of_equation_32_is_the_compliance(machine):
    response = respond(machine)
    assume(response.singularity_margin > REGULAR)
    stiffness = flexible_stiffness(values(machine))
    assume(np.linalg.cond(stiffness) < WELL)
    assert_blocks_close(array(response.compliance), np.linalg.inv(stiffness), AGREEMENT)
