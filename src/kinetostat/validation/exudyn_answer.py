"""Six unit wrenches on a multibody system, one by one: the compliance that Exudyn answers, tangent and finite."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.vector import Vector
from kinetostat.machine.machine import Configuration
from kinetostat.spec.errors import InputError
from kinetostat.validation.answer import Answer, Trial
from kinetostat.validation.exudyn_bodies import TRANSLATION_FIRST, Body, Multibody
from kinetostat.validation.exudyn_machine import build

Array = npt.NDArray[np.float64]

SHARES = (1e-3, 1e-4, 1e-5)
"""How far finite loads move the platform: rad, or share of the machine's length."""
VARIED = "how far loads move the platform, rad or share of the machine's length"
UNBALANCED = 1e-6
"""Share of a load that may be left over where the equations of equilibrium are solved as well as they can be."""
LOST = 1e-15
"""Relative size of a stiffness below which a motion counts as idle."""
EPS = float(np.finfo(float).eps)


def solve(configuration: Configuration, reference: Vector) -> Answer:
    """C from the engine's linearised equations, confirmed by its nonlinear statics under ever smaller loads.

    Args:
        configuration: placed machine.
        reference: where loads act and motions are read, base frame, m.

    Raises:
        InputError: if the machine has a part that cannot be built, or a motion that nothing resists.
    """
    length = float(configuration.length)
    model, _ = build(configuration, reference)
    model.system.Assemble()
    greatest = float(np.max(np.abs(model.system.ComputeLinearizedSystem(_settings(model))[1]))) or 1.0
    model, platform = build(configuration, reference, unit=greatest)
    tangent = _tangent(model, platform)
    if not np.any(tangent):
        return Answer(tangent, tangent, VARIED, ())
    trials = tuple(_finite_loads(model, platform, tangent, length))
    return Answer(tangent, _without_load(trials), VARIED, trials)


def _without_load(trials: tuple[Trial, ...]) -> Array | None:
    """C under the two smallest loads taken to none: central differences err by the load squared."""
    if len(trials) < 2:
        return None
    small, large = trials[:2]
    ratio = (large.scale / small.scale) ** 2
    return (ratio * small.compliance - large.compliance) / (ratio - 1.0)


def _tangent(model: Multibody, platform: Body) -> Array:
    """C of the unloaded system; the engine linearises and projects onto what its constraints leave free."""
    model.system.Assemble()
    found = model.system.ComputeLinearizedSystem(
        _settings(model), projectIntoConstraintNullspace=True, returnConstraintNullspace=True
    )
    stiffness = found[1]
    free = np.asarray(found[4]) if len(found) > 3 else np.eye(len(stiffness))
    rows = model.system.GetNodeODE2Index(platform.node) + np.array(TRANSLATION_FIRST)
    loads = free[:, rows] / model.unit
    if not loads.size:
        return np.zeros((6, 6))
    motion = np.linalg.lstsq(stiffness, loads, rcond=LOST)[0]
    if np.max(np.abs(stiffness @ motion - loads)) > UNBALANCED * np.max(np.abs(loads)):
        raise InputError(
            "Exudyn finds a motion that nothing resists beside the machine's stiffest parts: it is free, or "
            "stiffnesses differ by more than some nine decades."
        )
    return np.asarray((free.T @ motion)[rows])


def _finite_loads(model: Multibody, platform: Body, tangent: Array, length: float) -> Iterable[Trial]:
    """Nonlinear statics with loads that move the platform by each of SHARES, central differences; smallest first."""
    system, items = model.system, model.items
    marker = model.marker(platform, platform.at, np.eye(3))
    loads = [system.AddLoad(kind(markerNumber=marker, loadVector=[0.0] * 3)) for kind in (items.Torque, items.Force)]
    system.Assemble()
    rest = system.systemData.GetODE2Coordinates()
    unit_loads = _loads_for_unit_motion(tangent, length)
    for share in sorted(SHARES):
        found = np.zeros((6, 6))
        for j in np.flatnonzero(unit_loads):
            wrench = share * unit_loads[j] * np.eye(6)[j]
            ends = [_displacement(model, platform, loads, rest, sign * wrench / model.unit) for sign in (1.0, -1.0)]
            if ends[0] is None or ends[1] is None:
                break
            found[:, j] = (ends[0] - ends[1]) / (2.0 * wrench[j])
        else:
            yield Trial(share, found)


def _loads_for_unit_motion(tangent: Array, length: float) -> Array:
    """Per wrench the N or N·m that would move the platform by 1 rad or by `length` (m), whichever comes first.

    A wrench that moves nothing is as great as the others; one that a planar machine does not know is 0.
    """
    arms = np.repeat([length, 1.0], 3)
    motion = np.max(np.abs(tangent) * np.repeat([1.0, 1.0 / length], 3)[:, None], axis=0) / arms
    known = np.any(tangent != 0.0, axis=0)
    felt = motion > 1e-9 * np.max(motion)
    return np.asarray(known / (np.where(felt, motion, np.max(motion)) * arms))


def _displacement(model: Multibody, platform: Body, loads: list[Any], rest: Any, wrench: Array) -> Array | None:
    """Displacement of the platform (rad, m) under a wrench in the engine's unit of force; None if it found none."""
    system, engine = model.system, model.engine
    for load, part in zip(loads, (wrench[:3], wrench[3:]), strict=True):
        system.SetLoadParameter(load, "loadVector", part)
    system.systemData.SetODE2Coordinates(rest, engine.ConfigurationType.Initial)
    if not engine.MainSolverStatic().SolveSystem(system, _settings(model)):
        return None
    moved = np.array(system.GetNodeOutput(platform.node, engine.OutputVariableType.Coordinates))
    return moved[TRANSLATION_FIRST]


def _settings(model: Multibody) -> Any:
    """Silent, nothing written, and a solver that copes with redundant constraints and idle motions."""
    settings = model.engine.SimulationSettings()
    settings.linearSolver.solverType = model.engine.LinearSolverType.EigenDense
    settings.linearSolver.ignoreSingularJacobian = True
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.adaptiveStep = False
    settings.solution.file.write = False
    newton = settings.staticSolver.newton
    newton.relativeTolerance = 1e-9
    newton.absoluteTolerance = 10.0 * EPS  # the greatest stiffness is 1: nearer to balance, rounding decides
    newton.maxIterations = 30
    return settings
