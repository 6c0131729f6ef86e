"""Machine code against the same formulas pose by pose on floats, and against them on NumPy arrays."""

import math
import struct
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import pytest

from kinetostat.algebra.scalar import cos, reciprocal, smaller, sqrt, where
from kinetostat.algebra.symmetric import POSITIONS
from kinetostat.arrays import Array, Codes
from kinetostat.engine.batch import by_free_springs, evaluate
from kinetostat.engine.form import plan_for
from kinetostat.engine.kernel import program_of, slab_fill
from kinetostat.engine.machine_code import Program, host_lanes, machine_code_of
from kinetostat.engine.points import Axis, Grid, PointTable
from kinetostat.engine.trace import Body, Graph, Traced, needed_nodes
from kinetostat.engine.trigonometry import cos_and_sin
from kinetostat.equilibrium.state import MachineState
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES, needs_masses
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.motion.response import response_in_motion
from kinetostat.motion.rigid import MotionPlan
from machines import CASES, Case, elastic_machine, every_machine, one_of_each, stiffness_paths
from numeric import lost

Columns = dict[str, Array]

UNLOADED = [q for q in QUANTITIES.values() if not (q.loaded or q.modal)]
NAMES = tuple(quantity.name for quantity in UNLOADED)
DIAGONALS = (*GROUPS["compliance"], *GROUPS["stiffness"])
AGREEMENT = 5e-12
"""Of an entry of K or C against the geometric mean of its two diagonal entries: some hundred roundings, times the
condition of W at a regular pose."""
ROUNDED_ZERO = 1e-24
"""The square of a rounding error, which one route leaves of C in a rigid direction where another has zero."""
REORDERED = 10.0
"""Factor within which the singularity margin of a pose is known: it depends on the order in which vectors are taken,
and that on which components are zero by form: a float that is zero counts as such, a traced value never does."""
REGULAR = 0.05
"""Singularity margin from which numbers are compared so sharply; statuses are compared everywhere."""


@dataclass(frozen=True)
class Found:
    """Every quantity [quantities x points] and the status at some points; NaN where the status is not OK.

    `lost` is what rounding may take of a point's K and C, as a share, beside some hundred units [points].
    """

    values: Array
    status: Codes
    lost: Array | float = 0.0


def native(machine: Machine, columns: Columns, names: tuple[str, ...] = NAMES) -> Found:
    count = len(next(iter(columns.values())))
    found = Found(np.full((len(names), count), 7.0), np.full(count, 7, dtype=np.int8))
    fill = by_free_springs(machine, tuple(columns), names, slab_fill)
    fill(columns, found.values, found.status)
    return found


def whole(machine: Machine, plan: MotionPlan | None) -> Response:
    """The response with what quantities need of rigid parts in motion, as programs have it."""
    state = MachineState(machine)
    return response_in_motion(machine, state.free, state.joints, plan, NAMES)


def by_floats(machine: Machine, columns: Columns) -> Found:
    poses = zip(*(column.tolist() for column in columns.values()), strict=True)
    responses, plans, stiff = [], {}, set(stiffness_paths(machine))
    for pose in poses:
        given = dict(zip(columns, pose, strict=True))
        free = tuple(path for path in given if path in stiff and given[path] == 0.0)
        if free not in plans:
            plans[free] = plan_for(with_values(machine, {path: given[path] for path in given if path in stiff}), NAMES)
        responses.append(whole(with_values(machine, given), plans[free]))
    status = np.array([r.status for r in responses], dtype=np.int8)
    return Found(np.array([read(r) for r in responses]).T, status, np.array([lost(r) for r in responses]))


def by_arrays(machine: Machine, columns: Columns) -> Found:
    count = len(next(iter(columns.values())))
    with np.errstate(all="ignore"):
        response = whole(with_values(machine, columns), plan_for(machine, NAMES, columns))
        status = np.broadcast_to(response.status, count).astype(np.int8)
        found = [np.broadcast_to(q.value(response), count) for q in UNLOADED]
    return Found(np.where(status == Status.OK, found, np.nan), status, lost(respond(machine)))


def read(response: Response) -> list[float]:
    return [q.value(response) if response.status == Status.OK else math.nan for q in UNLOADED]


def scales(found: Array) -> Array:
    """What each quantity is compared with: for entries of K and C the mean of their diagonals, else itself."""
    result = np.abs(found)
    for first in (NAMES.index("compliance_rx"), NAMES.index("stiffness_rx")):
        diagonal = [first + POSITIONS.index((i, i)) for i in range(6)]
        for k, (i, j) in enumerate(POSITIONS, first):
            with np.errstate(invalid="ignore"):
                mean = np.sqrt(np.abs(found[diagonal[i]])) * np.sqrt(np.abs(found[diagonal[j]]))
            result[k] = np.where(np.isfinite(mean), mean, result[k])
    errors = [k for k, name in enumerate(NAMES) if name.startswith("reversal_error_")]
    result[errors] = result[errors].max(axis=0, initial=0.0)  # of a platform that only translates, turns are round-off
    return result


def assert_same(actual: Found, expected: Found) -> None:
    np.testing.assert_array_equal(actual.status, expected.status)
    np.testing.assert_array_equal(np.isnan(actual.values), np.isnan(expected.values))
    endless = np.isinf(expected.values)
    np.testing.assert_array_equal(np.isinf(actual.values), endless)
    np.testing.assert_array_equal(actual.values[endless], expected.values[endless])
    compared = np.isfinite(expected.values) & (expected.values[NAMES.index("singularity_margin")] > REGULAR)
    error = np.abs(np.subtract(actual.values, expected.values, where=compared, out=np.zeros(compared.shape)))
    allowed = (AGREEMENT + expected.lost) * scales(expected.values) + ROUNDED_ZERO
    row = NAMES.index("singularity_margin")
    allowed[row] = math.inf
    assert np.all(error[compared] <= allowed[compared])
    ratio = actual.values[row, compared[row]] / expected.values[row, compared[row]]
    assert np.all((ratio > 1.0 / REORDERED) & (ratio < REORDERED))


def drawn(case: Case, section: str, count: int, seed: int = 1) -> Columns:
    """Columns of what varies in a section of the machine; where it varies nothing there, of its tool point."""
    rng = np.random.default_rng(seed)
    chosen = {path: bounds for path, bounds in case.ranges.items() if path.startswith(section)}
    return {path: rng.uniform(low, high, count) for path, (low, high) in chosen.items()}


def springs(machine: Machine) -> list[str]:
    """One path of each kind of stiffness: the first leg's."""
    kinds = {
        path.rstrip("0123456789").split(".", 2)[-1] if "legs." in path else path.rstrip("0123456789"): path
        for path in reversed(stiffness_paths(machine))
    }
    return list(kinds.values())


@one_of_each
@pytest.mark.parametrize("section", ["pose.", "tool."])
def test_equals_floats(case: Case, section: str) -> None:
    machine, columns = case.machine, drawn(case, section, 103)
    assert_same(native(machine, columns), by_floats(machine, columns))


@every_machine
def test_equals_floats_whatever_varies(case: Case) -> None:
    machine, columns = case.machine, drawn(case, "", 53)
    assert_same(native(machine, columns), by_floats(machine, columns))


@elastic_machine
def test_equals_arrays(case: Case) -> None:
    machine, columns = case.machine, drawn(case, "", 2001, seed=2)
    found = native(machine, columns)
    assert_same(found, by_arrays(machine, columns))
    assert np.mean(found.status == Status.OK) > 0.3


@every_machine
def test_all_stiffnesses_varied(case: Case) -> None:
    machine, rng = case.machine, np.random.default_rng(3)
    columns = drawn(case, "pose.", 53) | {path: 10.0 ** rng.uniform(3, 6, 53) for path in stiffness_paths(machine)}
    assert_same(native(machine, columns), by_floats(machine, columns))


@one_of_each
@pytest.mark.parametrize("stiffness", [0.0, math.inf], ids=["free", "rigid"])
@pytest.mark.parametrize("varied", [False, True], ids=["fixed", "varied"])
def test_rigid_and_free_springs(case: Case, stiffness: float, varied: bool) -> None:
    machine, columns = case.machine, drawn(case, "pose.", 20)
    for path in springs(machine):
        one = with_values(machine, {} if varied else {path: stiffness})
        more = columns | ({path: np.resize([stiffness, 5e3], 20)} if varied else {})
        assert_same(native(one, more), by_floats(one, more))


@every_machine
def test_all_rigid(case: Case) -> None:
    machine, columns = case.machine, drawn(case, "pose.", 20)
    stiff = with_values(machine, dict.fromkeys(stiffness_paths(machine), math.inf))
    found = native(stiff, columns)
    assert_same(found, by_floats(stiff, columns))


FOUR = "zhang-gosselin-4dof"
OBSTACLES = [
    ({"pose.z": 1.5}, Status.OUT_OF_REACH),
    ({"pose.x": 0.0, "pose.z": 1.36}, Status.SINGULAR),  # the passive leg stretched
    ({"pose.theta6": 0.0}, Status.SINGULAR),
    ({"pose.theta6": math.pi}, Status.SINGULAR),
    ({"pose.z": math.nan}, Status.OUT_OF_REACH),
]


@pytest.mark.parametrize(("obstacle", "status"), OBSTACLES, ids=str)
@pytest.mark.parametrize("varied", [False, True], ids=["fixed", "varied"])
def test_bad_poses(obstacle: dict[str, float], status: Status, varied: bool) -> None:
    columns = {path: np.full(9, value) for path, value in drawn(CASES[0], "pose.", 1).items()}
    machine = with_values(load(FOUR), {} if varied else obstacle)
    rest = {path: column for path, column in columns.items() if varied or path not in obstacle}
    columns = rest | ({path: np.full(9, value) for path, value in obstacle.items()} if varied else {})
    found = native(machine, columns, tuple(name for name in NAMES if varied or not needs_masses([name])))
    assert np.all(found.status == status)
    assert np.all(np.isnan(found.values))


def test_a_bad_pose_leaves_its_neighbours_alone() -> None:
    machine, columns = load(FOUR), drawn(CASES[0], "pose.", 50)
    for k, (obstacle, _) in enumerate(OBSTACLES[:3]):
        for path, value in obstacle.items():
            columns[path][7 * k + 3] = value
    found = native(machine, columns)
    assert_same(found, by_floats(machine, columns))
    assert np.flatnonzero(found.status).tolist() == [3, 10, 17]


@pytest.mark.parametrize("turns", [1.0, 1e4, 1e7])
def test_any_turn_of_an_angle(turns: float) -> None:
    """Whole turns change nothing but the rounding of the angle itself."""
    machine, columns = load(FOUR), drawn(CASES[0], "pose.", 100)
    turned = columns | {"pose.theta6": columns["pose.theta6"] + turns * 2.0 * math.pi}
    expected = by_floats(machine, turned)
    assert_same(native(machine, turned), expected)
    fixed = with_values(machine, {"pose.theta6": float(turned["pose.theta6"][0])})
    first = {path: column[:1] for path, column in columns.items() if path != "pose.theta6"}
    np.testing.assert_allclose(native(fixed, first).values[0, 0], expected.values[0, 0], rtol=AGREEMENT)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 100])
def test_any_number_of_points(count: int) -> None:
    """Slabs write their own points, whatever their number, and nothing beside."""
    machine, columns = load(FOUR), drawn(CASES[0], "pose.", 100)
    whole = native(machine, columns, DIAGONALS)
    values_around, status_around = np.full((12, count + 6), 7.0), np.full(count + 6, 7, dtype=np.int8)
    inner = slice(3, count + 3)
    part = {path: column[:count] for path, column in columns.items()}
    slab_fill(machine, tuple(part), DIAGONALS)(part, values_around[:, inner], status_around[inner])
    np.testing.assert_array_equal(values_around[:, inner], whole.values[:, :count])
    np.testing.assert_array_equal(status_around[inner], whole.status[:count])
    assert np.all(np.delete(values_around, np.r_[inner], axis=1) == 7.0)
    assert np.all(np.delete(status_around, np.r_[inner]) == 7)


def test_columns_of_any_kind() -> None:
    machine, columns = load(FOUR), drawn(CASES[0], "pose.", 20)
    apart = {path: np.repeat(column, 2)[::2] for path, column in columns.items()}
    np.testing.assert_array_equal(native(machine, apart).values, native(machine, columns).values)
    whole_numbers = columns | {"stiffness.actuator.0": np.full(20, 2000)}
    doubled = with_values(machine, {"stiffness.actuator.0": 2000.0})
    assert_same(native(machine, whole_numbers), native(doubled, columns))


def test_arrays_that_do_not_fit_are_refused() -> None:
    columns = drawn(CASES[0], "pose.", 20)
    fill = slab_fill(load(FOUR), tuple(columns), DIAGONALS)
    with pytest.raises(ValueError, match="contiguous"):
        fill(columns, np.empty((12, 40))[:, ::2], np.empty(20, dtype=np.int8))
    with pytest.raises(ValueError, match="one length"):
        fill(columns, np.empty((12, 19)), np.empty(20, dtype=np.int8))


def test_a_program_serves_all_machines_of_one_form() -> None:
    """What is equal in one is equal in the other, and so are signs."""
    machine, columns = load(FOUR), drawn(CASES[0], "pose.", 20)
    changed = {"geometry.base_radius": 0.3, "geometry.base_angle": 0.2, "stiffness.actuator.1": 4e4}
    machine, other = with_values(machine, {"stiffness.actuator.1": 3e4}), with_values(machine, changed)
    slab_fill(machine, tuple(columns), NAMES)
    made = program_of.cache_info().misses
    slab_fill(other, tuple(columns), NAMES)
    assert program_of.cache_info().misses == made
    assert_same(native(other, columns), by_floats(other, columns))


def test_threads_share_a_program() -> None:
    machine, columns = load(FOUR), drawn(CASES[0], "pose.", 4000)
    expected = native(machine, columns)
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: native(machine, columns), range(16)):
            np.testing.assert_array_equal(found.values, expected.values)


def test_large_and_small_batches_agree() -> None:
    """`evaluate` takes other arithmetic for many points than for few; the results and their order are the same."""
    machine, bounds = load(FOUR), CASES[0].ranges
    counts = {"pose.x": 50, "pose.theta5": 50, "pose.theta6": 50}
    grid = Grid([Axis((path,), np.linspace(*bounds[path], count)) for path, count in counts.items()])
    seen: list[int] = []
    large = evaluate(machine, grid, NAMES, lambda done, _: seen.append(done))
    some = range(7, grid.size, 1009)
    points = PointTable({path: np.array([grid.columns(k, k + 1)[path][0] for k in some]) for path in counts})
    small = evaluate(machine, points, NAMES)
    taken = np.array([large.values[name][list(some)] for name in NAMES])
    assert_same(Found(taken, large.status[list(some)]), Found(np.array([*small.values.values()]), small.status))
    assert seen == sorted(seen)
    assert seen[-1] == grid.size


def test_results_that_nothing_varies() -> None:
    """C does not depend on an actuator that is a column, where only the singularity margin is asked for."""
    machine = load(FOUR)
    found = native(machine, {"stiffness.actuator.0": np.linspace(1.0, 2.0, 30)}, ("singularity_margin",))
    assert np.all(found.values == found.values[0, 0])
    assert found.values[0, 0] == pytest.approx(respond(machine).singularity_margin, rel=AGREEMENT)


def run_one(graph: Graph, x: Traced, result: object, at: Array) -> Array:
    found = np.empty((1, len(at)))
    program = Program(machine_code_of(Body([], [x], [result], 0.0)))
    program.run(np.empty(0), [at], found, np.empty(len(at), dtype=np.int8))
    return found[0]


SPECIAL = np.array([0.0, 1.0, -1.0, 2.5, -0.3, math.inf, -math.inf, math.nan, 1e-320, 1e300])


@pytest.mark.parametrize(
    "formula",
    [
        lambda x: 2.0 * x - 1.0,
        lambda x: 1.0 - 3.0 / x,
        lambda x: -(x - 4.0) * -x,
        lambda x: abs(-x) + x,
        lambda x: 1.0 / (1.0 / x),
        lambda x: sqrt(x),
        lambda x: reciprocal(x),
        lambda x: smaller(x, 1.0),
        lambda x: smaller(1.0, -x),
        lambda x: where((x > 0.0) & (x < 2.0), x, -1.0),
        lambda x: where((x >= 1.0) & True, x * x, math.inf),
        lambda x: where(x <= 1.0, math.nan, 0.0),
        lambda x: x - x,
        lambda x: (2.0 - x) - (x - 2.0),
    ],
    ids=range(14),
)
def test_operations_keep_infinities_and_nan(formula) -> None:
    graph = Graph()
    x = graph.input()
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(run_one(graph, x, formula(x), SPECIAL), formula(SPECIAL))


def test_equal_expressions_are_one_node() -> None:
    graph = Graph()
    x, y = graph.input(), graph.input()
    assert x + y is y + x
    assert x * y is y * x
    assert x - y is not y - x
    assert (x - y) is -(y - x)
    assert -abs(x) is -abs(-x)
    assert x * -1.0 is -x
    assert (-x) * y is -(x * y)
    assert x + 0.0 is x
    assert x * 1.0 is x
    assert x / 1.0 is x
    assert len(needed_nodes([x * y + x * y])) == 4


def test_what_depends_on_fixed_inputs_is_fixed() -> None:
    graph = Graph()
    a, x = graph.input(fixed=True), graph.input()
    assert sqrt(a * 2.0).fixed
    assert not (a * x).fixed
    assert where(a < 1.0, 2.0, a).fixed


def test_what_is_known_to_be_ordinary_needs_no_code_for_rigid_and_free() -> None:
    graph = Graph()
    a, b = graph.input(fixed=True, bounds=(1e-25, 1e25)), graph.input(fixed=True)
    assert (reciprocal(reciprocal(a)) < math.inf) is True
    assert (1.0 / sqrt(a * a * 3.0 + a / 7.0) < math.inf) is True
    assert (a > 0.0) is True
    assert (a <= 0.0) is False
    assert a - a == 0.0
    assert a * 0.0 == 0.0
    for unknown in (b, a + b, a - 2.0, reciprocal(b), a * b, b * 2.0):
        assert (unknown < math.inf) is not True
        assert (unknown > 0.0) is not True
        assert not isinstance(unknown - unknown, float)


def test_too_many_ordinary_factors_are_not_known_to_be_ordinary() -> None:
    a = Graph().input(fixed=True, bounds=(1e-25, 1e25))
    product = a
    for _ in range(10):
        product = product * a
    assert (product < math.inf) is True
    assert (product * a < math.inf) is not True


def test_traced_values_cannot_steer_python() -> None:
    x = Graph().input()
    with pytest.raises(TypeError, match="where"):
        bool(x < 1.0)
    with pytest.raises(TypeError, match="where"):
        bool(x)


@pytest.mark.parametrize("largest", [1.0, 7.0, 1e3, 1e6])
def test_cosine_and_sine(largest: float) -> None:
    graph = Graph()
    x = graph.input()
    quarters = np.arange(-20, 20) * (math.pi / 2)
    at = np.concatenate([np.random.default_rng(4).uniform(-largest, largest, 5000), quarters[abs(quarters) <= largest]])
    cosine, sine = (run_one(graph, x, result, at) for result in cos_and_sin(x))
    np.testing.assert_array_max_ulp(cosine, np.cos(at), 3)
    np.testing.assert_array_max_ulp(sine, np.sin(at), 3)
    assert cos(x) is cos_and_sin(x)[0]


def test_lanes_fit_the_processor() -> None:
    assert host_lanes() * struct.calcsize("d") in {16, 32, 64}
