"""Laws that every answer fulfils, whatever the machine: each compares an answer with one that was got another way.

A law takes a `Case` and returns a sentence about what breaks it, or None. Tolerances are shares of an entry's scale.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from random import Random
from typing import Any

import numpy as np
from cable_energy import BALANCED, Energy, platform_displacement
from grown_legs import LENGTH
from same_machines import in_other_units, quarter, reordered, turned, with_matrices

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.engine.batch import Evaluation, evaluate, responses
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.solving import Rest
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.forward import stand
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import build
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values, with_values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.under_load import LoadedState, under_load
from kinetostat.studies.vibration import modes
from kinetostat.tolerances import AGREED
from kinetostat.validation.comparison import validate

Document = dict[str, Any]

SAME = 1e-7
"""Of two ways to one answer: a regular pose loses some digits of 16, a spring of great contrast some more."""
ONE_PROGRAM = 1e-9
"""Of machine code and single poses, which compute alike."""
EXACTLY_HELD = 1e-20
"""Share of the other block, in one unit, below which a block is rigid."""
STEP = 1e-4
"""Of a pose for differences, rad or in units of the machine's length."""
SMOOTH = 0.05
"""By how much two differences may differ, one over half of the step of the other."""
SHORTER = 16.0
"""Times that a step is longer than the one which confirms a jump."""
NOTHING = 1e-6
"""Change of C, as a share, in which differences have lost their digits."""
PUSH = 1e-4
"""Share of a load by which it is changed for differences."""
LOADED = 1e-5
"""Of the states of rest of one machine in two frames: Newton's method ends within 1e-10 of the machine's length."""
IN_A_ROW = 0.1
"""Times the largest turn of a spring, rad: bearings tilt about two axes in a row, chosen by the frame of the file."""
AS_LOADED = 2e-3
"""Of differences under load, with that."""
NEAR = 1.0
"""How far a rest of cables may be from the pose, rad and m, that must be found."""
MASSLESS = 1e9
"""Frequency, Hz, above which what moves has a mass of round-off only."""
MOST_JOINTS = 16
"""Of a machine that is rebuilt in an engine: the time goes with the cube of their number."""
RANKED = 0.3
"""Share of the machines written otherwise whose rank is counted as well, by a whole analysis."""
COMPILED = 0.15
"""Share of the grids that are computed by machine code, which takes longest to make."""


@dataclass
class Case:
    """A machine that was grown, its document in SI, and what it is judged with."""

    document: Document
    machine: Machine
    response: Response
    rng: Random

    @cached_property
    def state(self) -> MachineState:
        """Of the machine, of which all questions are asked."""
        return state_of(self.machine)

    @cached_property
    def analysis(self) -> Analysis:
        """Of the machine at its pose: it takes ten times as long as the response alone."""
        return analyze(self.state)

    @cached_property
    def loaded(self) -> LoadedState | None:
        """The machine at rest; None where it has no loads, or no mass for its gravity."""
        return loaded_state_of(self.state)

    @property
    def placement(self) -> tuple[Array, Array]:
        """Position of P, m, and the rotation of the platform [3 x 3]."""
        return placement_of(self.response)

    @property
    def planar(self) -> bool:
        return self.document.get("space") == "planar"


def response_of(machine: Machine) -> Response:
    """Of a machine at its pose."""
    return respond(machine, solve_joints(machine) if machine.family.chains else None)


def loaded_state_of(machine: Machine | MachineState) -> LoadedState | None:
    """The machine at rest; None where that is refused."""
    try:
        return under_load(machine)
    except InputError:
        return None


def placement_of(response: Response) -> tuple[Array, Array]:
    """Position of P, m, and the rotation of the platform [3 x 3]."""
    platform = response.configuration.platform
    rotation = platform.rotation
    columns = [axis.components() for axis in (rotation.x, rotation.y, rotation.z)]
    return np.array(platform.translation.components(), dtype=float), np.array(columns, dtype=float).T


def matrix_of(response: Response) -> Array:
    """C, base axes [6 x 6]."""
    return np.array(response.compliance.rows(), dtype=float)


def difference(actual: Array, expected: Array) -> float:
    """Largest difference of the blocks of two matrices [6 x 6] as a share of the scale of each block."""
    blocks = (slice(0, 3), slice(3, 6))
    units = (LENGTH, 1.0)
    finite = np.isfinite(expected)
    if not np.array_equal(finite, np.isfinite(actual)):
        return math.inf
    actual, expected = np.where(finite, actual, 0.0), np.where(finite, expected, 0.0)
    sizes = [float(np.linalg.norm(expected[b, b]) * u * u) for b, u in zip(blocks, units, strict=True)]
    sizes = [max(size, EXACTLY_HELD * max(sizes), 1e-100) for size in sizes]
    return max(
        float(np.linalg.norm(actual[a, b] - expected[a, b])) * units[i] * units[j] / math.sqrt(sizes[i] * sizes[j])
        for i, a in enumerate(blocks)
        for j, b in enumerate(blocks)
    )


def differs(actual: Array, expected: Array, what: str, allowed: float = SAME) -> str | None:
    """A sentence where two matrices are not the same."""
    apart = difference(actual, expected)
    return f"{what}: C differs by {apart:.1g}" if not apart < allowed else None


def compared(case: Case, other: Machine, transport: Array, what: str) -> str | None:
    """Compare status, rank and C with those of the same machine written otherwise."""
    again = response_of(other)
    if int(again.status) != Status.OK:
        return f"{what}: status {Status(int(again.status)).word}"
    if case.rng.random() < RANKED and (rank := analyze(other).rank) != case.analysis.rank:
        return f"{what}: rank {rank} instead of {case.analysis.rank}"
    return differs(matrix_of(again), _moved(matrix_of(case.response), transport), what)


def _moved(compliance: Array, transport: Array) -> Array:
    return transport @ compliance @ transport.T if np.isfinite(compliance).all() else compliance


def one_matrix(case: Case) -> str | None:
    """K and C are symmetric, without negative eigenvalues, inverse to each other; the rank is that of their numbers."""
    analysis = case.analysis
    unit = np.array([LENGTH if name.startswith("r") else 1.0 for name in analysis.components])
    scales = {
        "K": (analysis.stiffness, np.outer(1.0 / unit, 1.0 / unit)),
        "C": (analysis.compliance, np.outer(unit, unit)),
    }
    known = {name: np.array(rows) * scale for name, (rows, scale) in scales.items() if rows is not None}
    for name, m in known.items():
        if abs(m - m.T).max() > 1e-12 * abs(m).max():
            return f"{name} is not symmetric"
        if np.linalg.eigvalsh(m)[0] < -1e-11 * abs(m).max():
            return f"{name} has a negative eigenvalue"
    if "K" in known and "K is infinite" in analysis.message:
        return f"K is finite, but it is said: {analysis.message}"
    return _inverse_to_each_other(known["K"], known["C"], analysis) if len(known) == 2 else _ranked(known, analysis)


def _inverse_to_each_other(k: Array, c: Array, analysis: Analysis) -> str | None:
    apart = abs(k @ c - np.eye(len(k))).max()
    if apart > 1e-13 * np.trace(k) * np.trace(c):
        return f"K C differs from 1 by {apart:.1g}"
    return f"K and C are finite, but the rank is {analysis.rank}" if analysis.rank != len(k) else None


def _ranked(known: dict[str, Array], analysis: Analysis) -> str | None:
    """Whether the rank of C is neither below what its numbers show, nor above what they can."""
    if "C" not in known or analysis.rank is None:
        return None
    sizes = np.linalg.eigvalsh(known["C"])
    if not np.sum(sizes > 1e-6 * sizes[-1]) <= analysis.rank <= np.sum(sizes > 1e-17 * sizes[-1]):
        return f"C has a rank of {analysis.rank}, and the eigenvalues {sizes}"
    return None


def order_of_legs(case: Case) -> str | None:
    """The order in which legs are written does not matter."""
    other = build(reordered(case.document, case.rng.shuffle), "reordered")
    return compared(case, other, np.eye(6), "legs in another order")


def turned_machine(case: Case) -> str | None:
    """A machine that is turned and moved as a whole has the same C, loaded state and frequencies, turned."""
    turn = quarter(case.rng, case.planar)
    shift = np.array([case.rng.uniform(-1.0, 1.0) for _ in range(3)]) * [1.0, 1.0, 0.0 if case.planar else 1.0]
    other = build(turned(case.document, case.placement, turn, shift), "turned")
    both = np.kron(np.eye(2), turn)
    return compared(case, other, both, "turned") or _same_rest(case, other, both, "turned")


def other_units(case: Case) -> str | None:
    """A machine in other units of length and force is the same."""
    metre, newton = 10.0 ** case.rng.choice((-1, 1, 2)), 10.0 ** case.rng.choice((-2, 0, 3))
    other = build(in_other_units(case.document, metre, newton), "in other units")
    units, state = np.repeat([1.0, metre], 3), state_of(other)
    transport = np.diag(units) / math.sqrt(metre * newton)
    rest = _same_rest(case, state, np.diag(units), "in other units")
    return compared(case, other, transport, "in other units") or rest or _same_modes(case, state)


def _same_rest(case: Case, other: Machine | MachineState, transport: Array, what: str) -> str | None:
    """Compare the states of rest of one machine written in two ways."""
    if case.loaded is None:
        return None
    again = loaded_state_of(other)
    if again is None or again.rest is not case.loaded.rest:
        return f"{what}: under load {again and again.rest.word} instead of {case.loaded.rest.word}"
    if len(case.loaded.displacement) < 6:
        return None
    ours, theirs = transport @ case.loaded.displacement, np.array(again.displacement)
    scale = max(float(np.linalg.norm(ours)), 1e-9)
    apart = float(np.linalg.norm(ours - theirs)) / scale
    turns = max((abs(spring.deformation) for spring in case.loaded.springs if spring.turning), default=0.0)
    return f"{what}: displacements under load differ by {apart:.1g}" if apart > LOADED + IN_A_ROW * turns else None


def _same_modes(case: Case, other: MachineState) -> str | None:
    """Seconds are the same in all units."""
    try:
        ours, theirs = modes(case.state), modes(other)
    except InputError:
        return None
    pairs = zip([m.frequency for m in ours.modes][:3], [m.frequency for m in theirs.modes][:3], strict=False)
    return next((f"frequencies {a} and {b} Hz" for a, b in pairs if abs(a - b) > 1e-5 * a and a < MASSLESS), None)


def moved_tool(case: Case) -> str | None:
    """C at another tool point is that of the same platform."""
    old = values(case.machine)
    offset = np.array([case.rng.uniform(-0.2, 0.2), case.rng.uniform(-0.2, 0.2), case.rng.uniform(-0.2, 0.2)])
    offset *= [1.0, 1.0, 0.0 if case.planar else 1.0]
    other = with_values(case.machine, {f"tool.offset.{i}": float(c) for i, c in enumerate(offset)})
    here = np.array([old[f"tool.offset.{i}"] for i in range(3)])
    x, y, z = case.placement[1] @ (offset - here)
    transport = np.eye(6)
    transport[3:, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return compared(case, other, transport, "another tool point")


def as_matrices(case: Case) -> str | None:
    """Beams are what the textbook says: the 6x6 of each, computed here, gives the same C."""
    machine = build(with_matrices(case.document), "with matrices")
    return differs(matrix_of(response_of(machine)), matrix_of(case.response), "beams as matrices")


def leg_by_leg(case: Case) -> str | None:
    """The machine that is exported leg by leg is the same."""
    machine = build(document_of(case.machine), "exported")
    return differs(matrix_of(response_of(machine)), matrix_of(case.response), "written leg by leg")


def _poses(case: Case) -> tuple[str, float]:
    """A coordinate of the pose that is drawn, and its step."""
    name = case.rng.choice([*case.document["pose"]])
    return f"pose.{name}", STEP * (LENGTH if name in "xyz" else 1.0)


def neighbours(case: Case) -> str | None:
    """C is smooth: what it changes over half of a step is half of what it changes over the whole.

    Beside a singularity a step may be too long for that; a jump is one over a shorter step as well.
    """
    path, step = _poses(case)
    return _jump(case, path, step) and _jump(case, path, step / SHORTER)


def _jump(case: Case, path: str, step: float) -> str | None:
    """Say by how much C jumps beside the pose along a coordinate, if it does."""
    here = values(case.machine)[path]
    near = [response_of(with_values(case.machine, {path: here + s * step})) for s in (-1.0, -0.5, 0.5, 1.0)]
    if any(int(response.status) != Status.OK for response in near):
        return f"a neighbour of a regular pose is {[Status(int(r.status)).word for r in near]}"
    c = [matrix_of(response) for response in near]
    middle = matrix_of(case.response)
    if any(not np.array_equal(np.isfinite(m), np.isfinite(middle)) for m in c):
        return "a neighbour has a free direction, and the pose has not"
    if not np.isfinite(middle).all():
        return None
    whole, half = c[3] - c[0], 2.0 * (c[2] - c[1])
    jump = difference(middle + half, middle + whole)
    change = difference(middle + whole, middle)
    return f"C jumps beside the pose along {path}: by {jump:.1g}" if jump > SMOOTH * change + NOTHING else None


def grid(case: Case) -> str | None:
    """Arrays and machine code give the numbers of single poses."""
    path, step = _poses(case)
    here = values(case.machine)[path]
    poses = here + 100.0 * step * np.linspace(-1.0, 1.0, 5)
    compiled = case.rng.random() < COMPILED
    names = [
        "singularity_margin",
        *(f"{m}_{name}" for m in ("compliance", "stiffness") for name in case.machine.family.component_names),
    ]
    points = PointTable({path: poses})
    answers = evaluate(case.machine, points, names) if compiled else in_arrays(case.machine, points, names)
    for i, pose in enumerate(poses.tolist()):
        machine = with_values(case.machine, {path: pose})
        response, where = response_of(machine), f"{path} = {pose!r}, {'compiled' if compiled else 'in arrays'}"
        status, alone = Status(int(answers.status[i])), Status(int(response.status))
        if status is not alone:
            return f"{where}: {status.word}, alone {alone.word}"
        if alone is not Status.OK:
            continue
        known = {"singularity_margin": float(response.singularity_margin)}
        for name, row in zip(machine.family.component_names, machine.family.components, strict=True):
            known[f"compliance_{name}"] = float(response.compliance.entry(row, row))
            known[f"stiffness_{name}"] = float(response.stiffness.entry(row, row))
        for name, number in known.items():
            if not np.allclose(answers.values[name][i], number, rtol=ONE_PROGRAM, atol=0.0):
                return f"{where}: {name} {answers.values[name][i]}, alone {number}"
    return None


def in_arrays(machine: Machine, points: PointTable, names: list[str]) -> Evaluation:
    """The formulas over NumPy arrays, which no program of the engine runs."""
    response = responses(machine, points)
    with np.errstate(all="ignore"):
        found = {name: np.broadcast_to(QUANTITIES[name].value(response), points.size) for name in names}
    return Evaluation(found, np.broadcast_to(response.status, points.size))


def inner_laws(case: Case) -> str | None:
    """What must hold within one analysis."""
    return one_matrix(case) or work_of_springs(case) or work_of_drives(case)


def work_of_springs(case: Case) -> str | None:
    """The load does the work that the springs take up, to first order and at rest."""
    load = case.analysis.load
    if load is None or not all(map(math.isfinite, load.deflection)) or load.unheld:
        return None
    work = float(np.dot(load.wrench, load.deflection))
    energy = sum(spring.load * spring.deformation for spring in load.springs if math.isfinite(spring.deformation))
    if abs(work - energy) > SAME * max(abs(work), abs(energy)):
        return f"the load does a work of {work} J, the springs take up {energy} J"
    return None


def work_of_drives(case: Case) -> str | None:
    """Drives balance the load: over a small motion of the rigid machine, both do the same work."""
    load = case.analysis.load
    hinges = any(hinged(joint) for leg in case.document["legs"] for joint in leg.get("joints", ()))
    if load is None or load.unheld or hinges or case.analysis.free:
        return None
    path, step = _poses(case)
    here = values(case.machine)[path]
    ends = [with_values(case.machine, {path: here + s * step}) for s in (-1.0, 1.0)]
    responses = [response_of(end) for end in ends]
    if any(int(response.status) != Status.OK for response in responses):
        return None
    placed = [placement_of(response) for response in responses]
    stands = [{a.name: float(a.coordinate) for a in stand(end)} for end in ends]
    carried = {spring.name: spring.load for spring in load.springs if spring.actuated}
    if stands[0].keys() - carried.keys():
        return None  # parts in a row, or rigid drives, have loads under other names
    moved = {name: stands[1][name] - stands[0][name] for name in stands[0]}
    moved = {name: (m + math.pi) % (2.0 * math.pi) - math.pi if abs(m) > 3.0 else m for name, m in moved.items()}
    offset = np.array([values(case.machine)[f"tool.offset.{i}"] for i in range(3)])
    places = [position + rotation @ offset for position, rotation in placed]
    turn = placed[1][1] @ placed[0][1].T
    twist = [*(np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0)]
    motion = dict(zip(COMPONENTS, [*twist, *(places[1] - places[0])], strict=True))
    work = float(np.dot(load.wrench, [motion[name] for name in load.components]))
    drives = sum(carried[name] * m for name, m in moved.items())
    terms = sum(abs(carried[name] * m) for name, m in moved.items())
    size = max(abs(work), terms, 1e-300)
    if min(abs(work - drives), abs(work + drives)) > 1e-3 * size:
        return f"over a motion along {path} the load does {work} J, the drives {drives} J"
    return None


def at_rest(case: Case) -> str | None:
    """A loaded machine answers a further load by its compliance, and its springs do the work of its loads.

    The compliance is given in its symmetric form. A moment m that keeps its direction makes the stiffness unsymmetric
    by half of its cross product, and so the compliance by C [m] C / 2 (theory, tangent stiffness under load).
    """
    state = case.loaded
    if state is None or state.rest is not Rest.OK or state.compliance is None or case.planar:
        return None
    size = max(np.linalg.norm([values(case.machine)[f"load.force.{i}"] for i in range(3)]), 1.0)
    axis = case.rng.randrange(3)
    ends = []
    for sign in (-1.0, 1.0):
        path = f"load.force.{axis}"
        ends.append(loaded_state_of(with_values(case.machine, {path: values(case.machine)[path] + sign * PUSH * size})))
    if any(end is None or end.rest is not Rest.OK for end in ends) or any(end.slack_legs for end in ends):
        return None
    slope = (np.array(ends[1].displacement[3:]) - np.array(ends[0].displacement[3:])) / (2.0 * PUSH * size)
    moment = np.array([values(case.machine)[f"load.moment.{i}"] for i in range(3)])
    compliance, unsymmetric = np.array(state.compliance), np.zeros((6, 6))
    unsymmetric[:3, :3] = np.cross(np.eye(3), moment) / 2.0
    expected = (compliance + compliance @ unsymmetric @ compliance)[3:, 3 + axis]
    scale = float(
        np.sqrt(np.trace(np.array(state.compliance)[3:, 3:]) * abs(np.array(state.compliance)[3 + axis, 3 + axis]))
    )
    noise = 1e-12 / (PUSH * size)
    if np.linalg.norm(slope - expected) > AS_LOADED * scale + noise:
        return (
            f"a further load along {'xyz'[axis]} moves the loaded tool by {slope} m/N; its compliance says {expected}"
        )
    return None


def cables_at_rest(case: Case) -> str | None:
    """Cables hold the platform where their energy is least; where they are said not to, no descent finds a rest."""
    if "type" not in case.document["legs"][0] or case.loaded is None:
        return None
    energy, state = Energy(case.document, case.placement), case.loaded
    if state.rest is Rest.OK:
        left = energy.left_over(platform_displacement(case.document, case.placement, state.displacement))
        return f"cables at rest leave {left:.1g} of the loads" if left > BALANCED else None
    place, left = energy.descended()
    far = np.linalg.norm(place[:3]) + np.linalg.norm(place[3:])
    return f"cables: {state.rest.word}, but they rest at {place}" if left < BALANCED and far < NEAR else None


def weight_as_force(case: Case) -> str | None:
    """The weight of the tool loads actuators as the same force does."""
    tool, load = case.document.get("tool", {}), case.document.get("load", {})
    if "gravity" not in load or "mass" not in tool:
        return None
    weight = tool["mass"] * np.array(load["gravity"])
    arm = case.placement[1] @ (np.array(tool["centre_of_mass"]) - tool.get("offset", [0.0, 0.0, 0.0]))
    more = {"force": weight, "moment": np.cross(arm, weight)}
    written = {**load, **{name: (np.array(load.get(name, [0.0] * 3)) + more[name]).tolist() for name in more}}
    del written["gravity"]
    other = build({**case.document, "load": written}, "weight as a force")
    path, _ = _poses(case)
    names, here = ["actuator_force", "actuator_moment"], PointTable({path: np.array([values(case.machine)[path]])})
    ours, theirs = evaluate(case.machine, here, names).values, evaluate(other, here, names).values
    apart = [name for name in names if not np.allclose(ours[name], theirs[name], rtol=SAME, atol=0.0, equal_nan=True)]
    return (
        f"weight as a force: {apart} {[ours[n][0] for n in apart]}, not {[theirs[n][0] for n in apart]}"
        if apart
        else None
    )


def hinged(joint: Document) -> bool:
    """Whether a joint is a flexure."""
    return "stiffness" in joint and not joint.get("actuated") and joint["type"] != "cable"


def unloaded_rest(case: Case) -> str | None:
    """Without loads, the state of rest is the pose, and its compliance is C; flexures count from the home pose."""
    parts = [part for leg in case.document["legs"] for part in (leg, *leg.get("joints", ()))]
    preloaded = any("preload" in part or hinged(part) for part in parts)
    if preloaded or not np.isfinite(matrix_of(case.response)).all():
        return None
    nothing = {
        path: 0.0 for path in values(case.machine) if path.startswith(("load.force", "load.moment", "load.gravity"))
    }
    state = loaded_state_of(with_values(case.machine, nothing))
    if state is None:
        return None
    if state.rest is not Rest.OK or state.compliance is None:
        return f"without loads: {state.rest.word}, {state.message}"
    kept = case.machine.family.components
    ours, theirs = np.zeros((6, 6)), matrix_of(case.response)
    ours[np.ix_(kept, kept)] = state.compliance
    theirs = np.where(np.isin(np.arange(6), kept), theirs, 0.0)
    return differs(ours, theirs, "at rest without loads")


def engines(case: Case) -> str | None:
    """An independent engine gives the same C and frequencies."""
    if sum(len(leg.get("joints", "cab")) for leg in case.document["legs"]) > MOST_JOINTS:
        return None
    try:
        answer = validate(case.machine)
    except InputError as error:
        return None if "nothing to validate" not in str(error) else str(error)
    if answer.uncertainty > AGREED or not answer.difference > AGREED:
        return None
    return f"{answer.engine} differs by {answer.difference:.1g}: {answer.differences}, frequencies {answer.frequencies}"


LAWS: Mapping[Callable[[Case], str | None], float] = {
    as_matrices: 1.0, unloaded_rest: 0.6, moved_tool: 0.4, neighbours: 0.4, order_of_legs: 0.3, leg_by_leg: 0.3,
    turned_machine: 0.25, other_units: 0.2, grid: 0.15, at_rest: 0.15, engines: 0.05, inner_laws: 0.35,
    cables_at_rest: 1.0, weight_as_force: 0.5,
}  # fmt: skip
"""Every law, and the share of the machines that it judges: those that cost more judge fewer."""


def broken_law(case: Case) -> str | None:
    """The first law that an answer breaks, of those that are drawn for it."""
    for law, share in LAWS.items():
        finding = law(case) if case.rng.random() < share else None
        if finding:
            return f"{law.__name__}: {finding}"
    return None
