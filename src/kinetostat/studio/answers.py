"""The computations behind the page: a picture, a report, a map, curves, a ranking, modes, their swing, a motion.

Each is a function of a request, which stands before it with its answer; that of the modes takes a machine. They run in
threads (`lanes`), so they take and return frozen data and touch no page. The formulas are elsewhere.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinetostat.arrays import Array, Complex
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import Axis, Grid
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.mobility import free_twist
from kinetostat.kinematics.status import PLACELESS, Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.common_tables import Load
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import find, parameters, values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.drives import DriveLoads, drives
from kinetostat.studies.motions import read_motion, required_motion
from kinetostat.studies.quantities import without_derivatives
from kinetostat.studies.sensitivity import Sensitivity, sensitivity
from kinetostat.studies.under_load import LoadedState, under_load
from kinetostat.studies.vibration import Vibration, frequency_range, modes
from kinetostat.studio.pulling import handles
from kinetostat.tolerances import SINGULAR
from kinetostat.units import KINDS
from kinetostat.views.scene import machine_scene as scenes
from kinetostat.views.scene.anatomy import Proportions
from kinetostat.views.scene.overlays import loaded_overlays, overlays_of, swing_data, twist_solids
from kinetostat.views.scene.solids import Scene, as_data, solid_data

MAP_POINTS = 41
"""Points of a map along each coordinate: the eye sees no more in a small map, and they take milliseconds."""
SLOW_POINTS = 11
"""The same of a quantity that is solved for pose by pose: a map then takes about a second."""
CURVE_POINTS = 61
"""Points of a curve: it looks smooth on a page."""
SINGULARITY = "singularity_margin"
RESPONSE_POINTS = 300
"""Frequencies of a response over its range: about as many as a small plot has pixels across."""
POINTS_ABOUT_MODE = 40
"""Further frequencies about each mode, whose peak is narrower than a pixel."""
MOTION_FILE = Path("motion.csv")
"""Name of a motion in messages."""


@dataclass(frozen=True)
class PictureRequest:
    """The machine to draw.

    Attributes:
        machine: the machine at its present pose.
        sizes: proportions it was loaded with, so that balls and rods keep their thickness while it changes.
        axes: the axes of `pulling`, along and about which its platform can be pulled.
        fit: whether the camera should move until all of it is seen.
    """

    machine: Machine
    sizes: Proportions
    axes: tuple[str, ...] = ()
    fit: bool = False


@dataclass(frozen=True)
class Picture:
    """A machine at its pose as data for the view; `scene` is None where there is nothing to draw."""

    status: Status
    scene: dict[str, Any] | None


def picture(request: PictureRequest) -> Picture:
    """Draw the machine at its pose; at a singular pose, together with the motion that stays free."""
    state = state_of(request.machine)
    response, status = state.response, state.status
    if status is not Status.OK and not _has_picture(status, response):
        return Picture(status, None)
    scene = scenes.machine_scene(request.machine, response.configuration, request.sizes)
    if status is Status.SINGULAR and not request.machine.loaded:
        scene = _with_free_twist(scene, response, request.sizes)
    handle_data = [handle.as_data() for handle in handles(response.configuration, request.axes)]
    return Picture(status, {**as_data(scene), "handles": handle_data, "fit": request.fit})


def _has_picture(status: Status, response: Response) -> bool:
    """Return whether a pose without an answer has a picture: each joint has its place."""
    coordinates = (c for leg in response.configuration.legs for point in leg.path for c in point.components())
    return status not in PLACELESS and all(math.isfinite(coordinate) for coordinate in coordinates)


def _with_free_twist(scene: Scene, response: Response, sizes: Proportions) -> Scene:
    """Add the twist that the platform keeps with all actuators locked; there is none where a leg itself is singular."""
    if not all(leg.singularity_margin > SINGULAR for leg in response.legs):
        return scene
    twist = free_twist(response.legs, float(response.configuration.length), response.guide)
    arrows = twist_solids([twist], response.reference, sizes)
    return Scene((*scene.solids, *arrows), scene.labels, scene.centre, scene.size, scene.floor)


@dataclass(frozen=True)
class ReportRequest:
    """The machine to analyse, and the factor by which its deflections are drawn larger; None to choose one."""

    machine: Machine
    sizes: Proportions
    exaggeration: float | None


@dataclass(frozen=True)
class Report:
    """An analysis and what shows it.

    Attributes:
        analysis: the analysis of the machine at its pose.
        legs: name of the leg in which each joint or link is; empty where the joints have no place.
        sizes: proportions of the picture.
        solids: the solids that show the answers in it.
        exaggeration: factor by which deflections are drawn larger; None without a load.
        loaded: the state of rest, where the machine is to be shown under its loads.
        refused: why its loads are refused; empty if they are not.
    """

    analysis: Analysis
    legs: Mapping[str, str]
    sizes: Proportions
    solids: list[dict[str, Any]]
    exaggeration: float | None
    loaded: LoadedState | None = None
    refused: str = ""

    @property
    def answered(self) -> bool:
        """Whether there is something to show: the machine at rest if it is shown under its loads, else its K and C."""
        if self.loaded is not None or self.refused:
            return self.loaded is not None and self.loaded.has_rest
        return self.analysis.status is Status.OK


def report(request: ReportRequest) -> Report:
    """Analyse the machine at its pose and make the solids that are drawn over it."""
    state = state_of(request.machine)
    analysis = analyze(state)
    placed_legs = () if analysis.status in PLACELESS else state.configuration.legs
    legs = {str(spring.part_name): leg.name for leg in placed_legs for spring in leg.springs}
    loaded, refused = _at_rest(state) if request.machine.loaded else (None, "")
    if loaded is None:
        solids, factor = overlays_of(analysis, request.sizes, request.exaggeration)
    else:
        solids, factor = loaded_overlays(loaded, request.sizes, request.exaggeration)
    return Report(
        analysis=analysis,
        legs=legs,
        sizes=request.sizes,
        solids=[solid_data(solid) for solid in solids],
        exaggeration=factor,
        loaded=loaded,
        refused=refused,
    )


def _at_rest(state: MachineState) -> tuple[LoadedState | None, str]:
    """Return the machine under its loads, or why these are refused."""
    try:
        return under_load(state), ""
    except InputError as error:
        return None, str(error)


@dataclass(frozen=True)
class Ends:
    """A field and the ends between which it varies, SI."""

    path: str
    low: float
    high: float


@dataclass(frozen=True)
class MapRequest:
    """A map over two fields of a machine; `since` is the time at which the designer changed something, s."""

    machine: Machine
    quantity: str
    across: Ends
    up: Ends
    since: float


def quantity_map(request: MapRequest) -> dict[str, Array] | str:
    """Evaluate a quantity at `MAP_POINTS` each way, with all others of `map_quantities` that cost nothing more.

    A program is compiled once and must then serve while the designer moves the machine. Therefore all coordinates of
    the pose are its inputs, also those that do not vary over the map, and the load is left out where it has no effect.
    Natural frequencies that have no program are solved for pose by pose, and so at fewer points.

    Returns:
        Values by quantity, the second field running fastest, NaN at a pose without an answer; or what the file lacks.
    """
    try:
        return _values_of(request)
    except InputError as error:
        return str(error)


def _values_of(request: MapRequest) -> dict[str, Array]:
    is_modal = QUANTITIES[request.quantity].modal
    machine = request.machine if is_modal else _without_load(request.machine)
    present, sides = values(machine), (request.across, request.up)
    leaves = [find(machine.family, ends.path).leaves for ends in sides]
    varied = {leaf for leaves_of_side in leaves for leaf in leaves_of_side}
    has_no_program = is_modal and without_derivatives(machine, [request.quantity], sorted(varied)) is not None
    points = SLOW_POINTS if has_no_program else MAP_POINTS
    axes = [
        Axis(leaves_of_side, np.linspace(ends.low, ends.high, points))
        for leaves_of_side, ends in zip(leaves, sides, strict=True)
    ]
    fixed = [path for path in present if path.startswith("pose.") and path not in varied]
    grid = Grid([*axes, *(Axis((path,), np.array([float(present[path])])) for path in fixed)])
    quantities = [request.quantity] if is_modal else [*_linear_quantities(machine), SINGULARITY]
    return evaluate(machine, grid, quantities, repeated=not has_no_program).values


def _without_load(machine: Machine) -> Machine:
    """Remove the load, unless actuators have limits: a load may exceed them, and then decides the status."""
    limits = machine.tables["limits"]
    if is_set(limits.actuator_force) or is_set(limits.actuator_moment):
        return machine
    return replace(machine, tables={**machine.tables, "load": Load()})


@dataclass(frozen=True)
class CurveRequest:
    """Several quantities over one field of a machine."""

    machine: Machine
    field: Ends
    quantities: tuple[str, ...]


@dataclass(frozen=True)
class Curves:
    """Values of the field and of each quantity; None where the answer is not finite."""

    across: list[float]
    values: dict[str, list[float | None]]


def curves(request: CurveRequest) -> Curves:
    """Evaluate the quantities along the field, at a constant factor from point to point."""
    across = np.geomspace(request.field.low, request.field.high, CURVE_POINTS)
    grid = Grid([Axis(find(request.machine.family, request.field.path).leaves, across)])
    lines = evaluate(request.machine, grid, request.quantities).values
    return Curves(across.tolist(), {name: finite(lines[name]) for name in request.quantities})


def finite(values: Array) -> list[float | None]:
    """Return numbers as JSON can hold them: None where a value is not finite."""
    return [value if math.isfinite(value) else None for value in values.tolist()]


@dataclass(frozen=True)
class RankingRequest:
    """A machine and the quantity whose sensitivities to all parameters are wanted."""

    machine: Machine
    quantity: str


def ranking(request: RankingRequest) -> Sensitivity | str:
    """Rank the parameters by their influence on the quantity, or say why it has no derivatives."""
    try:
        return sensitivity(request.machine, [request.quantity])
    except InputError as error:
        return str(error)


def map_quantities(machine: Machine) -> dict[str, str]:
    """Return names and labels of what may be mapped: diagonals of C and K, 1/C_ii, the singularity margin, frequencies.

    Natural frequencies are offered where the machine has masses, about its state under load where that is shown.
    """
    return {**_linear_quantities(machine), SINGULARITY: "singularity margin", **_frequencies(machine)}


def _linear_quantities(machine: Machine) -> dict[str, str]:
    names, groups = machine.family.component_names, ("compliance", "stiffness", "free_stiffness")
    return {f"{group}_{name}": f"{group.replace('_', ' ')} {name}" for group in groups for name in names}


def has_mass(machine: Machine) -> bool:
    """Return whether any mass or inertia of a machine is not zero."""
    present = values(machine)
    return any(
        present[leaf]
        for parameter in parameters(machine.family)
        if KINDS[parameter.quantity.kind].heavy or parameter.quantity.kind == "inertia"
        for leaf in parameter.leaves
    )


def _frequencies(machine: Machine) -> dict[str, str]:
    """Return the lowest natural frequencies: as many as a platform has whose file gives a mass and no more."""
    if not has_mass(machine):
        return {}
    group = "loaded_frequency" if machine.loaded else "frequency"
    axes = [name for name in machine.family.component_names if name in "xyz"]
    return {f"{group}_{number}": f"frequency {number}" for number in range(1, len(axes) + 1)}


class ToolResponse(NamedTuple):
    """The receptance of the tool, SI [frequencies x 6 x 6], at frequencies in Hz [frequencies]."""

    frequencies: Array
    receptance: Complex


@dataclass(frozen=True)
class ModesAndResponse:
    """The vibrations of a machine, and the response of its tool to varying forces.

    Attributes:
        answer: modes at the pose; none where the pose has no answer or nothing can vibrate.
        response: the response of the tool; None where there are no modes.
    """

    answer: Vibration
    response: ToolResponse | None = None


def modes_and_response(machine: Machine) -> ModesAndResponse | str:
    """Find modes and response of a machine at its pose, or say what it lacks, which is a mass as a rule."""
    try:
        answer = modes(machine)
    except InputError as error:
        return str(error)
    if not answer.modes:
        return ModesAndResponse(answer)
    frequencies = frequency_range(answer, points=RESPONSE_POINTS, near=POINTS_ABOUT_MODE)
    return ModesAndResponse(answer, ToolResponse(frequencies, answer.receptance(frequencies.tolist())))


@dataclass(frozen=True)
class SwingRequest:
    """A mode to be drawn.

    Attributes:
        answer: an answer with modes.
        number: the number of the mode, from 0.
        sizes: proportions of the picture.
    """

    answer: Vibration
    number: int
    sizes: Proportions


def swing(request: SwingRequest) -> list[dict[str, Any]]:
    """Return both ends of a mode's swing, for the browser to move the machine between them."""
    shape, machine = request.answer.modes[request.number].shape, request.answer.machine
    if shape is None:
        return []
    return swing_data(machine, request.answer.state.configuration, request.sizes, shape)


@dataclass(frozen=True)
class MotionRequest:
    """A motion of a machine.

    Attributes:
        machine: the machine.
        text: the CSV file of the motion; if empty, the motion is that of the requirements of the machine's file.
    """

    machine: Machine
    text: str


def drives_along(request: MotionRequest) -> DriveLoads | str:
    """Compute what a motion asks of the drives, or say what is missing; an empty text if there is no motion."""
    machine = request.machine
    try:
        if request.text:
            return drives(machine, read_motion(machine, MOTION_FILE, text=request.text))
        motion = required_motion(machine)
        return "" if motion is None else drives(machine, motion)
    except InputError as error:
        return str(error)
