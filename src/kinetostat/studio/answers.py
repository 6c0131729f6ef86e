"""What a page wants to know of a machine, each as one function that runs in a thread. Touches no page; no formula."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import Array, Axis, Grid
from kinetostat.kinematics.singularity import free_twist
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import SINGULAR, Response, respond
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Load, Machine
from kinetostat.machine.parameters import find, values
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.sensitivity import Sensitivity, sensitivity
from kinetostat.views.scene import machine_scene as scenes
from kinetostat.views.scene.overlaid import overlays_of
from kinetostat.views.scene.overlays import Measure, twist_solids
from kinetostat.views.scene.profiles import Proportions
from kinetostat.views.scene.solids import Scene, as_data, solid_data

SIDE = 41
"""Points of a map along each coordinate."""
CURVE_POINTS = 61


@dataclass(frozen=True)
class PictureWish:
    """The machine to draw, with the proportions it was loaded with.

    Attributes:
        machine, sizes: of it.
        fit: whether the camera is to move so that all of it is seen.
    """

    machine: Machine
    sizes: Proportions
    fit: bool = False


@dataclass(frozen=True)
class Picture:
    """A machine at its pose as data for the view; `scene` is None where there is nothing to draw."""

    status: Status
    scene: dict[str, Any] | None


def picture(wish: PictureWish) -> Picture:
    """The machine at its pose; a singular pose can be drawn as well, with the motion that it leaves free."""
    response = respond(wish.machine)
    status = Status(int(response.status))
    if status is not Status.OK and not _drawable(status, response):
        return Picture(status, None)
    scene = scenes.machine_scene(wish.machine, response.configuration, wish.sizes)
    if status is Status.SINGULAR:
        scene = _with_free_twist(scene, response, wish.sizes)
    return Picture(status, {**as_data(scene), "fit": wish.fit})


def _drawable(status: Status, response: Response) -> bool:
    points = [c for leg in response.configuration.legs for p in leg.path for c in p.components()]
    return status is Status.SINGULAR and all(math.isfinite(c) for c in points)


def _with_free_twist(scene: Scene, response: Response, sizes: Proportions) -> Scene:
    """The twist that the platform keeps with all actuators locked, unless it is a leg that locks up."""
    if not all(leg.singularity_margin > SINGULAR for leg in response.legs):
        return scene
    twist = free_twist(response.legs, float(response.configuration.length))
    arrows = twist_solids([twist], response.reference, Measure(sizes.diagonal, sizes.leg))
    return Scene((*scene.solids, *arrows), scene.labels, scene.centre, scene.size, scene.floor)


@dataclass(frozen=True)
class ReportWish:
    """The machine to analyse, and the factor of its deflected shape; None to choose one."""

    machine: Machine
    sizes: Proportions
    exaggeration: float | None


@dataclass(frozen=True)
class Report:
    """An analysis, the solids that show it, and the factor by which deflections are exaggerated (None without load)."""

    analysis: Analysis
    solids: list[dict[str, Any]]
    exaggeration: float | None


def report(wish: ReportWish) -> Report:
    """Everything that one pose has to say."""
    found = analyze(wish.machine)
    solids, factor = overlays_of(found, wish.sizes, wish.exaggeration)
    return Report(found, [solid_data(solid) for solid in solids], factor)


@dataclass(frozen=True)
class Ends:
    """A field and the ends between which it varies, SI."""

    path: str
    low: float
    high: float


@dataclass(frozen=True)
class MapWish:
    """All that can be mapped over two fields of a machine; `since` is when the designer asked, s."""

    machine: Machine
    across: Ends
    up: Ends
    since: float


def compliance_map(wish: MapWish) -> dict[str, Array]:
    """Every quantity at 41 x 41 points, the second field running fastest; NaN where there is no answer.

    All coordinates of the pose are columns of the program, and the load is left out where it decides nothing, so that
    one program serves every pose and load.
    """
    machine = _unloaded(wish.machine)
    held, family = values(machine), machine.family
    axes = [
        Axis(find(family, ends.path).leaves, np.linspace(ends.low, ends.high, SIDE)) for ends in (wish.across, wish.up)
    ]
    taken = {leaf for axis in axes for leaf in axis.paths}
    rest = [path for path in held if path.startswith("pose.") and path not in taken]
    grid = Grid([*axes, *(Axis((path,), np.array([float(held[path])])) for path in rest)])
    return evaluate(machine, grid, list(map_quantities(machine)), repeated=True).values


def _unloaded(machine: Machine) -> Machine:
    """The machine without its load, unless its actuators have limits, which a load may exceed."""
    limits = machine.tables["limits"]
    if is_set(limits.actuator_force) or is_set(limits.actuator_moment):
        return machine
    return replace(machine, tables={**machine.tables, "load": Load()})


@dataclass(frozen=True)
class CurveWish:
    """Several quantities over one field of a machine."""

    machine: Machine
    field: Ends
    quantities: tuple[str, ...]


@dataclass(frozen=True)
class Curves:
    """Values of the field and of each quantity; None where there is no finite answer."""

    across: list[float]
    values: dict[str, list[float | None]]


def curves(wish: CurveWish) -> Curves:
    """The quantities along the field, at a constant factor from point to point."""
    across = np.geomspace(wish.field.low, wish.field.high, CURVE_POINTS)
    grid = Grid([Axis(find(wish.machine.family, wish.field.path).leaves, across)])
    found = evaluate(wish.machine, grid, wish.quantities)
    return Curves(
        across.tolist(),
        {name: finite(found.values[name]) for name in wish.quantities},
    )


def finite(values: Array) -> list[float | None]:
    """Numbers for a page: None where there is no finite one."""
    return [value if math.isfinite(value) else None for value in values.tolist()]


@dataclass(frozen=True)
class RankingWish:
    """A quantity of a machine whose sensitivities are asked for."""

    machine: Machine
    quantity: str


def ranking(wish: RankingWish) -> Sensitivity:
    """Which parameters decide about the quantity."""
    return sensitivity(wish.machine, [wish.quantity])


def map_quantities(machine: Machine) -> dict[str, str]:
    """Names and labels of what may be mapped: diagonals of C and K, 1/C_ii, and the singularity margin."""
    names, groups = machine.family.component_names, ("compliance", "stiffness", "free_stiffness")
    found = {f"{group}_{name}": f"{group.replace('_', ' ')} {name}" for group in groups for name in names}
    return {**found, "singularity_margin": "singularity margin"}
