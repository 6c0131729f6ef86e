"""Sets of wrenches that bounded forces can hold: every number against linear programmes, to 1e-9."""

import numpy as np
import pytest
from scipy.optimize import linprog

from kinetostat.numerics.polytopes import capacity, faces, wrench_closure

LEAST, MOST = 0.1, 2.0
SHAPES = [(3, 4), (3, 6), (6, 7), (6, 8), (6, 9)]


def machines(size, forces, count, seed=0):
    draw = np.random.default_rng(seed)
    wrenches = draw.normal(size=(count, size, forces))
    held = np.einsum("ndm,nm->nd", wrenches, draw.uniform(LEAST, MOST, size=(count, forces)))
    return wrenches, held


def bounds(count, forces, most=MOST):
    return np.full((count, forces), LEAST), np.full((count, forces), most)


@pytest.mark.parametrize(("size", "forces"), SHAPES)
def test_faces_are_as_far_as_linear_programmes_reach(size, forces):
    wrenches, _ = machines(size, forces, 3)
    across = faces(wrenches.transpose(1, 2, 0))
    above, below = across.ends(*(bound.T for bound in bounds(3, forces)))
    for row in range(3):
        for face in range(0, above.shape[0], 5):
            cost = across.normals[:, face, row] @ wrenches[row]
            far, near = (sign * linprog(-sign * cost, bounds=(LEAST, MOST)).fun for sign in (1.0, -1.0))
            assert above[face, row] == pytest.approx(-far, abs=1e-9)
            assert below[face, row] == pytest.approx(near, abs=1e-9)


@pytest.mark.parametrize(("size", "forces"), SHAPES)
def test_capacity_is_how_far_a_wrench_may_go_towards_its_nearest_face(size, forces):
    """A ball within a convex set touches its nearest face: the way there by a linear programme is as long."""
    wrenches, held = machines(size, forces, 12, seed=1)
    inside = capacity(wrenches, *bounds(12, forces), held[:, None])
    assert (inside > 0.0).all()
    for row in range(12):
        across = faces(wrenches[[row]].transpose(1, 2, 0))
        normals = across.normals[:, :, 0].T
        ways = [
            linprog(
                np.append(np.zeros(forces), -1.0),
                A_eq=np.column_stack([wrenches[row], -sign * normal]),
                b_eq=held[row],
                bounds=[(LEAST, MOST)] * forces + [(None, None)],
            ).fun
            for normal in normals[:: max(1, len(normals) // 60)]
            for sign in (1.0, -1.0)
        ]
        assert inside[row] <= min(-way for way in ways) + 1e-9
        above, below = across.ends(*(bound[[row]].T for bound in bounds(12, forces)))
        slack = np.stack([above[:, 0] - normals @ held[row], below[:, 0] + normals @ held[row]])
        side, face = np.unravel_index(slack.argmin(), slack.shape)
        touched = linprog(
            np.append(np.zeros(forces), -1.0),
            A_eq=np.column_stack([wrenches[row], (2.0 * side - 1.0) * normals[face]]),
            b_eq=held[row],
            bounds=[(LEAST, MOST)] * forces + [(None, None)],
        )
        assert inside[row] == pytest.approx(-touched.fun, abs=1e-9)


def test_boxes_and_polytopes_are_held_as_their_corners_are():
    wrenches, held = machines(3, 5, 6, seed=2)
    half = np.full((6, 3), 0.05)
    corners = np.stack(np.meshgrid(*[[-0.05, 0.05]] * 3), axis=-1).reshape(1, 8, 3) + held[:, None]
    box = capacity(wrenches, *bounds(6, 5), held[:, None], half)
    assert np.allclose(box, capacity(wrenches, *bounds(6, 5), corners), atol=1e-12)
    alone = [capacity(wrenches, *bounds(6, 5), corners[:, [k]]) for k in range(8)]
    assert np.allclose(box, np.min(alone, axis=0), atol=1e-12)


@pytest.mark.parametrize("most", [MOST, np.inf])
def test_a_wrench_is_outside_exactly_where_a_linear_programme_finds_no_forces(most):
    wrenches, _ = machines(3, 5, 80, seed=3)
    wanted = np.random.default_rng(4).normal(size=(80, 3)) * 4.0
    inside = capacity(wrenches, *bounds(80, 5, most), wanted[:, None])
    for row in range(80):
        found = linprog(np.zeros(5), A_eq=wrenches[row], b_eq=wanted[row], bounds=(LEAST, most))
        assert (inside[row] >= 0.0) == (found.status == 0)
    assert (inside < 0.0).any()
    assert (inside > 0.0).any()


@pytest.mark.parametrize(("size", "forces"), SHAPES)
def test_forces_close_on_wrenches_exactly_where_linear_programmes_hold_every_direction(size, forces):
    draw = np.random.default_rng(5)
    wrenches = draw.normal(size=(40, size, forces))
    wrenches[::2, :, -1] = -np.einsum("ndm,nm->nd", wrenches[::2, :, :-1], draw.uniform(0.5, 1.0, (20, forces - 1)))
    closed = wrench_closure(wrenches) > 1e-9
    directions = np.vstack([np.eye(size), -np.ones(size)])
    for row in range(40):
        held = [linprog(np.zeros(forces), A_eq=wrenches[row], b_eq=d).status == 0 for d in directions]
        assert closed[row] == all(held)
    assert closed[::2].all()


def test_a_set_that_is_flat_holds_no_wrench_beside_it_and_a_line_has_no_capacity():
    flat = np.array([[[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]]])
    inside = capacity(flat, *bounds(1, 3), np.array([[[1.0, 1.0, 0.0], [1.0, 1.0, 0.5]]]))
    assert inside[0] == pytest.approx(-0.5)
    assert np.isnan(capacity(np.ones((1, 3, 3)), *bounds(1, 3), np.zeros((1, 1, 3)))[0])
