"""Links that yield: their springs against textbook beams, real bars, and compliance matrices."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from geometry import displacements, rotations, vectors
from kinetostat.algebra.scalar import is_infinite
from kinetostat.algebra.vector import X_AXIS, Y_AXIS, Z_AXIS, ZERO, Vector
from kinetostat.kinetostatics.leg import leg_modes
from kinetostat.machine.leg import Joint, Leg, Line
from kinetostat.machine.link import Beam, Parallelogram, Rigidity, link_axes, lumped_springs, matrix_springs
from numeric import U, columns, matrix, screw, twist_transport, vector

FEW = 1e3 * U
LENGTH = 0.7
EULER = Rigidity(axial=3e6, torsion=70.0, bending_y=150.0, bending_z=400.0)
TIMOSHENKO = replace(EULER, shear_y=8e4, shear_z=5e4)
rigidities = pytest.mark.parametrize("rigidity", [EULER, TIMOSHENKO], ids=["Euler-Bernoulli", "Timoshenko"])


def end_compliance(springs, point):
    """How the far end yields against the near one, at `point`: the sum over springs [6 x 6]."""
    found = np.zeros((6, 6))
    for spring in springs:
        twist = screw(spring.joint.twist(point))
        found += np.outer(twist, twist) / spring.stiffness
    return found


def textbook_stiffness(length, own):
    """The 12 x 12 matrix of a beam element along x (Przemieniecki 1968, eq. 5.116), rows (rx ry rz x y z) x 2 ends."""
    names = ["x", "y", "z", "rx", "ry", "rz"]
    at = {(name, end): 6 * end + ["rx", "ry", "rz", "x", "y", "z"].index(name) for name in names for end in (0, 1)}
    found = np.zeros((12, 12))

    def add(one, other, value):
        found[at[one], at[other]] = found[at[other], at[one]] = value

    for name, k in (("x", own.axial / length), ("rx", own.torsion / length)):
        add((name, 0), (name, 0), k)
        add((name, 1), (name, 1), k)
        add((name, 0), (name, 1), -k)
    for shift, turn, bending, shear, sign in (
        ("y", "rz", own.bending_z, own.shear_y, 1.0),
        ("z", "ry", own.bending_y, own.shear_z, -1.0),
    ):
        phi = 12 * bending / (shear * length**2)
        unit = bending / (length**3 * (1 + phi))
        add((shift, 0), (shift, 0), 12 * unit)
        add((shift, 1), (shift, 1), 12 * unit)
        add((shift, 0), (shift, 1), -12 * unit)
        for end, way in ((0, 1.0), (1, -1.0)):
            add((shift, end), (turn, 0), way * sign * 6 * length * unit)
            add((shift, end), (turn, 1), way * sign * 6 * length * unit)
            add((turn, end), (turn, end), (4 + phi) * length**2 * unit)
        add((turn, 0), (turn, 1), (2 - phi) * length**2 * unit)
    return found


@rigidities
def test_a_beam_is_the_textbook_element(rigidity):
    """All twelve freedoms: what deforms is the far end's twist less the near end's, carried over rigidly."""
    beam = Beam("beam", ZERO, X_AXIS * LENGTH, Z_AXIS, rigidity)
    stiffness = np.linalg.inv(end_compliance(beam.springs, beam.end))
    deforming = np.hstack([-twist_transport(np.eye(3), vector(beam.end)), np.eye(6)])
    expected = textbook_stiffness(LENGTH, rigidity)
    assert deforming.T @ stiffness @ deforming == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())


def test_a_cantilever_bends_as_in_the_handbook():
    """F L^3 / 3 EI + F L / kappa GA down, F L^2 / 2 EI of slope; under a moment M L / EI and M L^2 / 2 EI."""
    beam = Beam("beam", ZERO, X_AXIS * LENGTH, Z_AXIS, TIMOSHENKO)
    found = end_compliance(beam.springs, beam.end)
    down = LENGTH**3 / (3 * 150.0) + LENGTH / 5e4
    assert found[5, 5] == pytest.approx(down, rel=FEW)
    assert found[1, 5] == pytest.approx(-(LENGTH**2) / (2 * 150.0), rel=FEW)
    assert found[1, 1] == pytest.approx(LENGTH / 150.0, rel=FEW)
    assert found[2, 2] == pytest.approx(LENGTH / 400.0, rel=FEW)
    assert found[4, 2] == pytest.approx(LENGTH**2 / (2 * 400.0), rel=FEW)
    assert found[0, 0] == pytest.approx(LENGTH / 70.0, rel=FEW)
    assert found[3, 3] == pytest.approx(LENGTH / 3e6, rel=FEW)


@rigidities
@given(motion=displacements())
def test_a_beam_anywhere(rigidity, motion):
    """The compliance goes with the beam and its section's axes."""
    beam = Beam("beam", ZERO, X_AXIS * LENGTH, Vector(0.3, 0.0, 0.5), rigidity)
    moved = beam.displaced(motion)
    turn = twist_transport(matrix(motion.rotation), np.zeros(3))
    expected = turn @ end_compliance(beam.springs, beam.end) @ turn.T
    assert end_compliance(moved.springs, moved.end) == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())


@given(vectors(), vectors(), rotations())
def test_link_axes(start, end, turn):
    """x along the link, z in the plane of the link and `up` and on its side, y = z x x: right-handed."""
    up = turn.z
    span = end - start
    assume(span.norm() > 0.1)
    assume(up.cross(span).norm() > 0.05 * span.norm())
    axes, length = link_axes(start, end, up)
    q = matrix(axes)
    assert length == pytest.approx(span.norm())
    assert q.T @ q == pytest.approx(np.eye(3), abs=FEW)
    assert np.linalg.det(q) == pytest.approx(1.0)
    assert vector(axes.x) * length == pytest.approx(vector(span), abs=FEW)
    assert axes.z.dot(up) > 0.0
    assert axes.y.dot(up) == pytest.approx(0.0, abs=FEW)


def test_a_rigid_beam_has_springs_that_do_not_yield():
    assert {spring.stiffness for spring in Beam("beam", ZERO, X_AXIS, Z_AXIS, Rigidity()).springs} == {math.inf}


@pytest.mark.parametrize("springs", [lumped_springs, lambda *row: Beam(*row).springs], ids=["lumped", "beam"])
def test_what_is_rigid_by_form_stays_so_at_lengths_of_many_poses(springs):
    """An array of infinities would count as a spring that a pose may soften."""
    along = Vector(np.array([0.5, 0.7]), 0.0, 0.0)
    assert all(is_infinite(spring.stiffness) for spring in springs("link", ZERO, along, Z_AXIS, Rigidity()))


def test_springs_of_a_link_belong_to_it():
    springs = Beam("arm", ZERO, X_AXIS, Z_AXIS, EULER).springs
    assert len({spring.name for spring in springs}) == 6
    assert {spring.part for spring in springs} == {"arm"}
    assert not any(spring.actuated for spring in springs)


def test_a_lumped_link_yields_at_its_tip_as_a_beam_does_under_forces():
    """3 EI / L at the end that is built in: F L^3 / 3 EI across, F L / EA along, M L / GJ in torsion."""
    found, beam = (
        end_compliance(springs, X_AXIS * LENGTH)
        for springs in (
            lumped_springs("link", ZERO, X_AXIS * LENGTH, Z_AXIS, EULER),
            Beam("beam", ZERO, X_AXIS * LENGTH, Z_AXIS, EULER).springs,
        )
    )
    assert found[3:, 3:] == pytest.approx(beam[3:, 3:], rel=FEW, abs=1e-12)
    assert found[0, 0] == pytest.approx(beam[0, 0], rel=FEW)
    assert found[1, 1] == pytest.approx(LENGTH / (3 * 150.0), rel=FEW)


def test_a_lumped_bending_about_a_passive_joint_is_idle():
    """Tables I and II of the paper: a revolute leaves two of the three torsional springs, a Hooke joint one."""
    springs = lumped_springs("link", ZERO, X_AXIS * LENGTH, Z_AXIS, EULER)
    for passive, felt in (((Z_AXIS,), {"torsion", "bending y"}), ((Y_AXIS, Z_AXIS), {"torsion"})):
        chain = (*(Joint(axis, ZERO) for axis in passive), *springs)
        screws = Leg("leg", chain).screws(X_AXIS, 1.0)
        loaded = {
            spring.name.removeprefix("link ")
            for spring, row in zip(springs, screws.loads, strict=True)
            if max(map(abs, row)) > FEW
        }
        assert loaded == felt | {"tension"}


@st.composite
def parallelograms(draw):
    """Two bars of 1 m and more, their ends on sides that may be oblique to them."""
    near, far, side = draw(vectors()), draw(vectors()), draw(rotations()).z
    span = far - near
    assume(span.norm() > 0.5)
    assume(side.cross(span).norm() > 0.2 * span.norm())
    return Parallelogram("bars", near, far, side, draw(st.floats(0.05, 0.5)), draw(st.floats(1e4, 1e7)))


def bars_of(pair):
    """Both bars, as lines of force through their far ends."""
    return [Line(far, (far - near) * (1.0 / (far - near).norm())) for near, far in pair.bars]


@given(parallelograms(), vectors())
def test_a_parallelogram_moves_as_two_bars_let_it(pair, reference):
    """Its freedom changes neither bar's length; with spherical joints as well, the two bars are all that holds."""
    (freedom,) = pair.freedoms
    assert freedom.axis.norm() == pytest.approx(1.0, rel=FEW)
    for bar in bars_of(pair):
        assert bar.wrench(reference).work(freedom.twist(reference)) == pytest.approx(0.0, abs=FEW)
    assert pair.mover == freedom


@given(parallelograms())
def test_a_parallelogram_yields_as_two_bars_do(pair):
    """Between spherical joints, K is the sum of k f f^T over two real bars, whatever the angle of the short sides."""
    chain = (Joint(pair.side, pair.near), Joint(pair.along, pair.near), pair, Joint(pair.side, pair.far))
    leg = Leg("leg", chain).screws(pair.far, 1.0)
    assume(leg.singularity_margin > 0.05)
    found = sum(k * np.outer(screw(b), screw(b)) for b, k in leg_modes(leg))
    forces = columns([bar.wrench(pair.far) for bar in bars_of(pair)])
    expected = pair.bar * forces @ forces.T
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-8 * expected.max())


@given(parallelograms(), st.floats(-0.2, 0.2))
def test_a_parallelogram_that_moves_keeps_its_bars_and_turns_nothing(pair, amount):
    moved, shift = pair.motion_by(amount)
    assert matrix(shift.rotation) == pytest.approx(np.eye(3), abs=FEW)
    for (near, far), (_, before) in zip(moved.bars, pair.bars, strict=True):
        assert (far - near).norm() == pytest.approx((pair.far - pair.near).norm(), rel=FEW)
        assert vector(far) == pytest.approx(vector(shift.apply(before)), abs=FEW)
    slope = (pair.motion_by(1e-6)[1].translation - pair.motion_by(-1e-6)[1].translation) * 5e5
    assert vector(slope) == pytest.approx(vector(pair.freedoms[0].axis), abs=1e-8)


@st.composite
def compliances(draw):
    """Symmetric matrices >= 0 of any rank, rotations in rad/(N·m) and translations in m/N."""
    rank = draw(st.integers(1, 6))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    modes = random.normal(size=(6, rank)) * 10.0 ** random.uniform(-1, 1, rank)
    scale = np.repeat([1e-3, 1e-4], 3)[:, None]
    return (scale * modes) @ (scale * modes).T, rank


@given(compliances(), vectors())
def test_springs_of_a_matrix_yield_as_it_does(given_matrix, point):
    compliance, rank = given_matrix
    springs = matrix_springs("joint", compliance, point)
    assert len(springs) == rank
    assert end_compliance(springs, point) == pytest.approx(compliance, rel=1e-9, abs=1e-9 * np.abs(compliance).max())
    assert len({spring.name for spring in springs}) == rank
    assert all(spring.stiffness > 0.0 for spring in springs)


@pytest.mark.parametrize("entries", [(0, 0, 0, 1, 2, 3), (1, 2, 3, 0, 0, 0), (0, 0, 5, 0, 0, 0), (0, 0, 0, 0, 0, 0)])
def test_springs_of_a_matrix_without_rotations_or_translations(entries):
    found = matrix_springs("joint", np.diag(entries) * 1e-6, X_AXIS)
    assert len(found) == np.count_nonzero(entries)
    assert end_compliance(found, X_AXIS) == pytest.approx(np.diag(entries) * 1e-6, rel=1e-9, abs=1e-18)


def test_a_matrix_of_low_rank_has_no_springs_of_round_off():
    """What a matrix of rank 3 leaves once its turns are subtracted is rigid, however unlike they are."""
    draw = np.random.default_rng(1)
    for contrast in (1.0, 1e-2, 1e-4):
        for _ in range(50):
            columns = draw.normal(size=(6, 3)) * [1.0, 1.0, contrast] * np.repeat([1e-3, 2e-4], 3)[:, None]
            assert len(matrix_springs("link", columns @ columns.T, ZERO)) == 3


@rigidities
def test_a_beam_as_a_matrix_of_ones_own(rigidity):
    beam = Beam("beam", Vector(0.1, 0.2, 0.3), Vector(0.4, -0.2, 0.5), Z_AXIS, rigidity)
    compliance = end_compliance(beam.springs, beam.end)
    again = end_compliance(matrix_springs("own", compliance, beam.end), beam.end)
    assert again == pytest.approx(compliance, rel=1e-6, abs=1e-9 * compliance.max())
