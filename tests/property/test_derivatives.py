"""Exact derivatives against differences with more digits, against JAX, and against laws that every machine obeys."""

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.engine import derivatives
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.closing import Joints, closing_equations
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import parameters, values, with_values
from machines import CASES, KINDS, elastic_machine, elastic_paths, few, one_of_each, regular_machines

CLOSE = 1e-7
"""Of the largest share in a derivative along a direction: differences near a singularity keep some eight digits."""
SAME = 1e-10
"""Between two routes that only order operations otherwise: some thousand roundings, times the condition of W."""
ROUNDED = 1e-20
"""A derivative that is but the rounding of zero."""
STEP = np.longdouble(1e-6)
"""Share of a size, or of the machine's length, or rad. What differences miss falls with the fourth power of it: where a
leg is nearly folded, ten times as much leaves a millionth of the derivative. Round-off is far below that here."""
AT = np.array([-2, -1, 1, 2], dtype=np.longdouble)
WEIGHTS = np.array([1, -8, 8, -1], dtype=np.longdouble) / 12
"""Central differences of fourth order."""


def softness(machine):
    """Names of the diagonal entries of C that exist."""
    return [f"compliance_{name}" for name in machine.family.component_names]


def smooth_paths(machine):
    """What K and C depend on; not the springs that are rigid or free by form, nor what only limits and loads are."""
    held, stiff = values(machine), {p.path for p in parameters(machine.family) if p.quantity.stiff}
    kept = [path for path in held if not path.startswith(("load.", "limits."))]
    return [path for path in kept if np.isfinite(held[path]) and not (path in stiff and held[path] == 0.0)]


def here(machine):
    """The machine's own pose as the one point of a table."""
    path, value = next((path, value) for path, value in values(machine).items() if path.startswith("pose."))
    return PointTable({path: np.array([value])})


def slopes_at(machine, names, paths):
    found = evaluate_gradient(machine, here(machine), names, paths)
    assert found.status[0] == 0
    return found.values[:, 0], found.gradients[:, :, 0]


def following(machine, changed):
    """The joints of a changed machine written leg by leg, with all digits of its numbers."""
    if not machine.family.chains:
        return None
    now = np.array(solve_joints(machine).coordinates)
    home, step = machine.chains(), 1e-6
    shifts = [
        np.array(closing_equations(home, now + e)) - closing_equations(home, now - e) for e in np.eye(len(now)) * step
    ]
    back = np.linalg.pinv(np.array(shifts, dtype=float).T / (2 * step), rcond=1e-6)
    found = now[:, None] + np.zeros((len(now), len(AT)), dtype=np.longdouble)
    for _ in range(8):
        found = found - back @ np.array([g + 0 * found[0] for g in closing_equations(changed.chains(), list(found))])
    return Joints(tuple(found), 0)


@elastic_machine
@few
@given(data=st.data())
def test_differences_with_more_digits_agree(case, data):
    """Along a random direction through all parameters and pose coordinates at once."""
    machine = data.draw(regular_machines(case))
    names, paths, held = softness(machine), smooth_paths(machine), values(machine)
    found, slopes = slopes_at(machine, names, paths)
    closing = ~np.isnan(slopes).any(axis=0)
    assert closing.all() or machine.family.chains
    length = float(respond(machine).configuration.length)
    kinds = {p.path: p.quantity.kind for p in parameters(machine.family)}
    units = np.array([abs(held[path]) or (length if kinds[path] == "length" else 1.0) for path in paths]) * closing
    way = units * np.random.default_rng(data.draw(st.integers(0, 2**32))).uniform(-1, 1, len(paths))
    lines = {path: np.longdouble(held[path]) + d * STEP * AT for path, d in zip(paths, way, strict=True) if d}
    changed = with_values(machine, lines)
    response = respond(changed, following(machine, changed))
    for name, value, slope in zip(names, found, slopes, strict=True):
        expected = np.sum(WEIGHTS * QUANTITIES[name].value(response)) / STEP
        shares = np.where(closing, slope, 0.0) * way
        assert abs(float(expected) - shares.sum()) <= CLOSE * max(np.abs(shares).max(), abs(value)), name


@elastic_machine
@few
@given(data=st.data())
def test_compliance_falls_as_all_stiffnesses_grow(case, data):
    """C is homogeneous of degree -1 in all stiffnesses and moduli (Euler), K of degree 1."""
    machine = data.draw(regular_machines(case))
    stiff, held = [path for path in elastic_paths(machine) if 0.0 < values(machine)[path] < np.inf], values(machine)
    names = [*softness(machine), *(name.replace("compliance", "stiffness") for name in softness(machine))]
    found, slopes = slopes_at(machine, names, stiff)
    shares = slopes * np.array([held[path] for path in stiff])
    degrees = np.repeat([-1.0, 1.0], len(found) // 2)
    finite = np.isfinite(found)
    assert (np.abs(shares.sum(axis=1) - degrees * found)[finite] <= CLOSE * np.abs(shares).max(axis=1)[finite]).all()


@one_of_each
def test_machine_code_and_arrays_give_the_same_derivatives(case, monkeypatch):
    machine = case.machine
    names, paths = [softness(machine)[-1], dict.fromkeys(softness(machine), 1.0)], smooth_paths(machine)[::5]
    rng = np.random.default_rng(5)
    ranges = {path: bounds for path, bounds in case.ranges.items() if path.startswith("pose.")}
    table = PointTable({path: rng.uniform(low, high, 37) for path, (low, high) in ranges.items()})
    few_points = evaluate_gradient(machine, table, names, paths)
    monkeypatch.setattr(derivatives, "MACHINE_CODE_FROM", 1)
    many = evaluate_gradient(machine, table, names, paths)
    np.testing.assert_array_equal(few_points.status, many.status)
    assert (few_points.status == 0).any()
    for one, other in ((few_points.values, many.values), (few_points.gradients, many.gradients)):
        np.testing.assert_array_equal(np.isnan(one), np.isnan(other))
        size = np.nan_to_num(np.abs(one)).max(axis=-1, keepdims=True)
        assert (np.abs(one - other) <= SAME * size + ROUNDED)[~np.isnan(one)].all()


BAR = ["sections.bar.diameter", "legs.x.slide.stiffness", "legs.z.shoulder.point.0", "legs.z.elbow.point.1", "pose.z"]


@pytest.mark.parametrize("paths", [BAR, [*BAR, "legs.z.elbow.axis.0"]], ids=["closed forms hold", "an axis tilts"])
def test_closed_forms_and_closing_equations_give_the_same_derivatives(paths, monkeypatch):
    """Machine code goes through closed forms where they hold whatever changes, arrays always through the equations."""
    machine = load("tripteron")
    table = PointTable(
        {path: np.random.default_rng(8).uniform(0.2, 0.8, 40) for path in ("pose.x", "pose.y", "pose.z")}
    )
    followed = evaluate_gradient(machine, table, ["compliance_x", "compliance_ry"], paths)
    monkeypatch.setattr(derivatives, "MACHINE_CODE_FROM", 1)
    found = evaluate_gradient(machine, table, ["compliance_x", "compliance_ry"], paths)
    np.testing.assert_allclose(found.values, followed.values, rtol=1e-10)
    size = np.nan_to_num(np.abs(followed.gradients)).max(axis=2, keepdims=True)
    assert np.isnan(followed.gradients[:, len(BAR) :]).all(), "an axis that tilts opens its leg"
    np.testing.assert_array_equal(np.isnan(found.gradients), np.isnan(followed.gradients))
    rounding = 1e-13 * followed.values.max(axis=1)[:, None, None]
    assert np.all(np.nan_to_num(np.abs(found.gradients - followed.gradients)) <= 1e-9 * size + rounding)


@one_of_each
def test_a_weighted_sum_has_the_weighted_sum_of_derivatives(case):
    machine = case.machine
    names, paths = softness(machine), smooth_paths(machine)
    weights = {name: 1.5 - k for k, name in enumerate(names)}
    found, slopes = slopes_at(machine, names, paths)
    value, slope = slopes_at(machine, weights, paths)
    factors = np.array([*weights.values()])
    assert value[0] == pytest.approx(factors @ found, rel=SAME)
    shares = factors[:, None] * slopes
    closing = ~np.isnan(shares).any(axis=0)
    assert (np.abs(slope[0] - shares.sum(axis=0)) <= SAME * np.abs(shares).max(axis=0) + ROUNDED)[closing].all()


@pytest.mark.parametrize("case", [c for c in CASES if c.name in KINDS and not c.machine.family.chains], ids=repr)
def test_jax_gives_the_same_derivatives(case):
    """Reverse mode of another maker over the same formulas, where the joints are placed in closed form."""
    machine = case.machine
    paths, held = smooth_paths(machine), values(machine)

    def total(numbers):
        response = respond(with_values(machine, dict(zip(paths, numbers, strict=True))))
        return sum(QUANTITIES[name].value(response) for name in softness(machine))

    with jax.enable_x64(True):
        theirs = np.array(jax.grad(total)([held[path] for path in paths]), dtype=float)
    _, ours = slopes_at(machine, dict.fromkeys(softness(machine), 1.0), paths)
    scale = np.array([abs(held[path]) or 1.0 for path in paths])
    assert (np.abs(ours[0] - theirs) * scale <= SAME * np.abs(theirs * scale).max()).all()


def test_by_rigid_and_by_free_springs(monkeypatch):
    """C does not change with a stiffness that is infinite, and not smoothly with one that is zero."""
    machine = with_values(CASES[0].machine, {"stiffness.passive_links.0": np.inf, "stiffness.passive_links.1": 1e4})
    paths = ["stiffness.passive_links.0", "stiffness.passive_links.1", "stiffness.passive_actuator"]
    _, slopes = slopes_at(machine, ["compliance_rz", "stiffness_rz"], paths)
    assert slopes[0, 0] == 0.0
    assert slopes[0, 1] < 0.0
    assert np.isnan(slopes[0, 2])
    for native in (1, 10**9):
        monkeypatch.setattr(derivatives, "MACHINE_CODE_FROM", native)
        table = PointTable({paths[1]: np.array([1e4, 0.0, 2e4])})
        found = evaluate_gradient(machine, table, ["compliance_rz"], paths[1:2])
        assert found.gradients[0, 0, 0] == pytest.approx(slopes[0, 1], rel=SAME)
        assert np.isnan(found.gradients[0, 0, 1])
        assert found.gradients[0, 0, 2] == pytest.approx(slopes[0, 1] / 4, rel=SAME)


def test_out_of_reach_there_is_no_derivative():
    table = PointTable({"pose.z": np.array([0.68, 5.0])})
    found = evaluate_gradient(CASES[0].machine, table, "compliance_z", ["pose.z", "geometry.base_radius"])
    assert found.status.tolist() == [0, 1]
    assert np.isfinite(found.gradients[0, :, 0]).all()
    assert np.isnan(found.gradients[0, :, 1]).all()


def test_no_paths_are_asked():
    found = evaluate_gradient(CASES[0].machine, here(CASES[0].machine), ["compliance_z", "compliance_x"], [])
    assert found.gradients.shape == (2, 0, 1)
    assert found.values[0, 0] == pytest.approx(respond(CASES[0].machine).compliance.entry(5, 5), rel=1e-12)
