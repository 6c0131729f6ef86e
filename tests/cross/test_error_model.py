"""Small errors of a machine's numbers: to first order against exactly, and both against other routes."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from kinetostat.accuracy.errors import Insertion, effects, leg_error_sources
from kinetostat.accuracy.model import error_model
from kinetostat.accuracy.rows import home_rows, random_coordinates
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.kinematics.forward import assembly_modes, system_of
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.actuators import actuators_of
from kinetostat.machine.loading import build, load
from kinetostat.machine.machine import springs
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.spec.errors import InputError
from machines import load_without_limits, one_of_each

POSES = 6


def around(machine, turn=0.1, share=0.04, seed=1):
    """Poses around that of a machine."""
    rng, given = np.random.default_rng(seed), values(machine)
    length = float((machine.chains() if machine.family.chains else machine.configure()).length)
    kinds = {p.path: p.quantity.kind for p in parameters(machine.family) if p.path.startswith("pose.")}
    spans = {path: turn if kind == "angle" else share * length for path, kind in kinds.items()}
    return {path: given[path] + rng.uniform(-span, span, POSES) for path, span in spans.items()}


def place_of(model, path):
    """The place of an error in the model."""
    return [error.path for error in model.errors].index(path)


def drawn(model, size, seed=2):
    """Random errors, SI, of a size in rad or machine lengths; no clearances, which stand where others do."""
    rng, length = np.random.default_rng(seed), model.length
    unit = [0.0 if e.group == "clearances" else length if e.kind == "length" else 1.0 for e in model.errors]
    return size * np.array(unit) * rng.uniform(-1.0, 1.0, len(unit))


def moved_by_forward(there, here, goal):
    """Rotation vector and displacement of the tool point from one machine's pose to another's, actuators alike."""
    (mode, *_) = assembly_modes(system_of(there), goal, 0, 0.0)
    start = respond(here).configuration.platform
    turn = np.array([a.components() for a in (mode.placement.rotation.x, mode.placement.rotation.y)], dtype=float)
    back = np.array([a.components() for a in (start.rotation.x, start.rotation.y)], dtype=float)
    full = [np.column_stack([*axes, np.cross(*axes)]) for axes in (turn, back)]
    spin = full[0] @ full[1].T
    rotation = 0.5 * np.array([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]])
    tools = [np.array(here.tool_point(place).components(), dtype=float) for place in (mode.placement, start)]
    return np.concatenate([rotation, tools[0] - tools[1]])


@one_of_each
def test_what_the_rates_leave_out_is_of_second_order(case):
    model = error_model(case.machine, around(case.machine), POSES)
    rates, errors = model.rates(), drawn(model, 1e-4)
    left = []
    for size in (4.0, 2.0, 1.0):
        exact, status = model.displacement(size * errors)
        assert (status == Status.OK).all()
        left.append(np.abs(exact - rates @ (size * errors)).max())
    orders = np.log2(np.array(left[:-1]) / left[1:])
    assert (np.abs(orders - 2.0) < 0.1).all()


@one_of_each
def test_rates_at_errors_are_the_derivative_there(case):
    model = error_model(case.machine, around(case.machine), POSES)
    at, way = drawn(model, 3e-3), drawn(model, 1e-5, 5)
    ends = [model.displacement(at + sign * way)[0] for sign in (1.0, -1.0)]
    slope = 0.5 * (ends[0] - ends[1])[:, 3:]
    left = np.abs(slope - (model.rates(values=at) @ way)[:, 3:]).max()
    # Legs that share a misfit turn with it, which the rates leave out.
    assert left < (1e-4 if case.name != "tripteron" else 1e-2) * np.abs(slope).max()


@one_of_each
def test_no_error_of_a_leg_is_missing_and_none_is_there_twice(case):
    rows = home_rows(case.machine)
    listed = [s for s in leg_error_sources(rows) if s.error.group != "clearances"]
    for number, row in enumerate(rows.legs):
        mine = [source for source in listed if source.insertions[0].leg == number]
        if any(unit.kind == "ball" for unit in row.units) or not mine:
            continue  # between the three axes of a ball nothing is made
        everywhere = [
            (Insertion(number, behind, np.diag([1.0] * 3 + [rows.length] * 3)[way]),)
            for behind in range(len(row.twists) + 1)
            for way in range(6)
        ]
        # The bars' difference and gains depend on the coordinates, which no constant displacement does.
        everywhere += [s.insertions for s in mine if s.error.path.endswith(("difference", "gain"))]
        unit = []
        for insertions in (everywhere, [s.insertions for s in mine]):
            columns = effects(row, rows, insertions, random_coordinates(row, rows.length))
            sizes = np.linalg.norm(columns, axis=0)
            unit.append((columns / sizes)[:, sizes > 1e-9])
        basis, triangle = np.linalg.qr(unit[1])
        assert np.abs(np.diag(triangle)).min() > 1e-7, row.name
        assert np.linalg.norm(unit[0] - basis @ (basis.T @ unit[0]), axis=0).max() < 1e-6, row.name


POINTS = {"legs.leg 1.base joint.x": (0, 0, 0), "legs.leg 3.base joint.z": (2, 0, 2)} | {
    "legs.leg 5.platform joint.platform.y": (4, 2, 1),
    "legs.leg 6.platform joint.platform.z": (5, 2, 2),
}
"""Where a file has the number that an error changes: leg, joint and entry of its point."""


def test_a_hexapod_moves_as_the_same_machine_drawn_with_its_errors():
    """The file of the machine leg by leg, with other numbers, goes through forward kinematics."""
    document = document_of(load_without_limits("hexapod"))
    settings = ["pose.x=0.03", "pose.roll=0.1", "pose.yaw=-0.08"]
    machine = build(document, "drawn", settings)
    pose = {path: np.array([value]) for path, value in values(machine).items() if path.startswith("pose.")}
    model = error_model(machine, pose, 1)
    sizes = dict(zip(POINTS, (2e-3, -1e-3, 1.5e-3, 1e-3), strict=True))
    errors, goal = np.zeros(len(model.errors)), model.drawn.actuators[0].copy()
    for path, size in sizes.items():
        leg, joint, entry = POINTS[path]
        joints = document["legs"][leg]["joints"]
        joints[joint]["point"][entry] += size
        joints[1]["axis"] = (np.array(joints[2]["point"]) - joints[0]["point"]).tolist()
        errors[place_of(model, path)] = size
    errors[place_of(model, "legs.leg 2.actuator.zero")] = 0.5e-3
    errors[place_of(model, "legs.leg 4.actuator.gain")] = 1e-3
    goal += [0.0, 0.5e-3, 0.0, 1e-3 * goal[3], 0.0, 0.0]
    moved, _ = model.displacement(errors)
    expected = moved_by_forward(build(document, "built", settings), machine, goal)
    assert np.abs(expected).max() > 1e-4
    assert moved[0, 3:] == pytest.approx(expected[3:], abs=1e-10)
    assert moved[0, :3] == pytest.approx(expected[:3], rel=1e-4)  # the sine of the angle stands for the angle there


@pytest.mark.parametrize("name", ["delta", "hexapod", "planar-3rrr", "zhang-gosselin-4dof", "orthoglide"])
def test_what_legs_share_moves_the_tool_as_the_family_does(name):
    machine = load_without_limits(name)
    goal = np.array([float(a.coordinate) for a in actuators_of(machine.configure())])
    model = error_model(machine, {}, 1)
    shared = [n for n, error in enumerate(model.errors) if error.group == "shared"]
    assert shared
    for number in shared:
        error, step = model.errors[number], 1e-5
        value = float(values(machine)[error.path])
        ends = [
            moved_by_forward(with_values(machine, {error.path: value + sign * step}), machine, goal)
            for sign in (1.0, -1.0)
        ]
        slope = (ends[0] - ends[1]) / (2.0 * step)
        assert model.rates()[0, :, number] == pytest.approx(slope, abs=1e-4 * max(np.abs(slope).max(), 1.0)), error.path


@pytest.mark.parametrize("name", ["passive-leg-3dof-pu-driven", "tripteron", "hexapod"])
def test_legs_share_an_error_with_the_least_energy(name):
    """The tool moves per zero of an actuator as much as the actuator carries per load on the tool (Betti)."""
    setting = ["stiffness.actuator.0=100 N/um"] if name == "passive-leg-3dof-pu-driven" else []
    machine = load_without_limits(name, setting)
    model, response = error_model(machine, {}, 1), respond(machine)
    assert (sum(len(leg.wrenches) for leg in response.legs) > 6) == (name != "hexapod")
    pairs = zip(springs(response.configuration), response.statics.flexibility, strict=True)
    driven = [np.array(twist.components(), dtype=float) for spring, twist in pairs if spring.actuated]
    zeros = [rates for rates, error in zip(model.rates()[0].T, model.errors, strict=True) if error.group == "zeros"]
    for rates, twist in zip(zeros, driven, strict=True):
        assert rates == pytest.approx(np.sign(rates @ twist) * twist, abs=1e-6 * np.abs(twist).max())


def bars_of(machine):
    """Near and far ends of the six bars of a Delta, base frame [6 x 3]."""
    ends = [pair for leg in machine.configure().legs for pair in leg.chain[4].bars]
    return np.array([[[float(c) for c in end.components()] for end in pair] for pair in ends])


def solved(misfit, wanted):
    return least_squares(misfit, np.zeros(6), args=(wanted,), xtol=1e-15, ftol=1e-15, gtol=1e-15).x


def test_a_delta_with_bars_of_different_length_tilts():
    """Against the six lengths of its bars, from elbows that stand still to a platform that is free."""
    machine = load_without_limits("delta", ["pose.x=0.04", "pose.y=-0.02"])
    model, bars = error_model(machine, {}, 1), bars_of(machine)
    point = model.drawn.tool[0]
    lengths = np.linalg.norm(bars[:, 1] - bars[:, 0], axis=1)

    def misfit(moved, wanted):
        angle = np.linalg.norm(moved[:3])
        axis = moved[:3] / max(angle, 1e-30)
        skew = np.cross(np.eye(3), axis)
        turn = np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew
        tips = (bars[:, 1] - point) @ turn.T + point + moved[3:]
        return np.linalg.norm(tips - bars[:, 0], axis=1) - wanted

    size = 1e-5
    for leg, name in enumerate(("leg 1", "leg 2", "leg 3")):
        longer = lengths.copy()
        longer[2 * leg] += 0.5 * size
        longer[2 * leg + 1] -= 0.5 * size
        expected = solved(misfit, longer) / size
        rates = model.rates()[0, :, place_of(model, f"legs.{name}.parallelogram.difference")]
        assert np.linalg.norm(expected[:3]) > 1.0  # rad per m: it tilts
        assert rates == pytest.approx(expected, rel=1e-3, abs=1e-3)
        both = lengths.copy()
        both[2 * leg : 2 * leg + 2] += size
        expected = solved(misfit, both) / size
        rates = model.rates()[0, :, place_of(model, f"legs.{name}.parallelogram.length")]
        assert np.abs(rates[:3]).max() < 1e-9  # equal bars keep the platform level
        assert rates == pytest.approx(expected, rel=1e-3, abs=1e-3)


def test_compliances_deflect_the_tool_by_their_share_of_the_load():
    machine = load_without_limits("hexapod", ["load.force.2=100"])
    model = error_model(machine, {}, 1)
    response = respond(machine)
    compliance = np.array(response.compliance.rows(), dtype=float)
    expected = compliance @ np.array(response.load.components(), dtype=float)
    assert model.deflections(model.drawn.load)[0].sum(axis=1) == pytest.approx(expected)


def test_only_the_pose_and_the_loads_of_a_machine_vary():
    with pytest.raises(InputError, match=r'geometry\.base_radius" is not a coordinate.*vary.*"pose\.x"'):
        error_model(load("hexapod"), {"geometry.base_radius": np.ones(2)}, 2)
