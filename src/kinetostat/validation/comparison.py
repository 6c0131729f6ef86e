"""Our compliance beside that of an independent engine: which engines there are, and what they say of a machine."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.algebra.vector import Vector
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.machine import Configuration, Machine, need_machine
from kinetostat.machine.parameters import values
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studies.rounding import ROUNDING, clean_matrix
from kinetostat.validation.answer import Answer, block_differences, difference

Array = npt.NDArray[np.float64]

AGREED = 1e-6
"""Relative difference up to which two compliances count as one."""
INSTALL = "Install it with: pip install 'kinetostat[validate]'"


@dataclass(frozen=True)
class Engine:
    """An engine that is not ours.

    Attributes:
        name: by which it is asked for.
        package: as installed.
        needs: modules that must be there.
        builder: our module whose `solve` rebuilds a machine in it.
        summary: what it makes of a machine.
    """

    name: str
    package: str
    needs: tuple[str, ...]
    builder: str
    summary: str

    @property
    def version(self) -> str | None:
        """Of the installed package; None if it is not installed."""
        if any(find_spec(module) is None for module in self.needs):
            return None
        try:
            return version(self.package)
        except PackageNotFoundError:
            return None

    def solve(self, configuration: Configuration, reference: Vector) -> Answer:
        """C of a placed machine at a point (base frame, m).

        Raises:
            InputError: if the engine is not installed, has no part for one of the machine's, or fails.
        """
        if self.version is None:
            raise InputError(f"The engine {self.name} is not installed. {INSTALL}")
        solve: Callable[[Configuration, Vector], Answer] = import_module(self.builder).solve
        try:
            return solve(configuration, reference)
        except InputError:
            raise
        except Exception as trouble:  # engines raise what they like, down to bare exceptions
            reason = str(trouble).partition("\n")[0]
            raise InputError(f"The engine {self.name} could not answer for this machine: {reason}") from trouble


KNOWN = (
    Engine(
        "exudyn",
        "exudyn",
        ("exudyn", "scipy"),
        "kinetostat.validation.exudyn_answer",
        "multibody dynamics: rigid bodies, exact constraints and springs",
    ),
    Engine(
        "pynite",
        "PyNiteFEA",
        ("Pynite", "scipy"),
        "kinetostat.validation.pynite_machine",
        "frame analysis: straight members, releases and stiff parts",
    ),
)
"""Every engine that a machine can be rebuilt in, the one for any machine first."""


@dataclass(frozen=True)
class Validation:
    """Two answers to one question; matrices at T in base axes, order rx ry rz x y z, SI.

    Attributes:
        machine: what was asked about.
        engine, version: who answered beside us.
        ours, theirs: C [6 x 6] without rounding; rows that a planar machine does not have are 0.
        differences: relative, by block: rotation, coupling, translation.
        uncertainty: how far the engine's two best answers differ, in the same measure; infinite if it has but one.
        varied: what the engine's trials vary, for people.
        trials: scale and difference from ours of each.
    """

    machine: Machine
    engine: str
    version: str
    ours: Array
    theirs: Array
    differences: dict[str, float]
    uncertainty: float
    varied: str
    trials: tuple[tuple[float, float], ...]

    def __repr__(self) -> str:
        return f"<Validation of {self.machine.name!r} with {self.engine}: differs by {self.difference:.1e}>"

    @property
    def difference(self) -> float:
        """The largest of the blocks' relative differences."""
        return max(self.differences.values())


def as_json(validation: Validation) -> dict[str, Any]:
    """The validation as plain data for `--json`, SI."""
    machine = validation.machine
    pose = {path.removeprefix("pose."): value for path, value in values(machine).items() if path.startswith("pose.")}
    return {
        "name": machine.name,
        "pose": pose,
        "order": list(COMPONENTS),
        "engine": validation.engine,
        "version": validation.version,
        "ours": validation.ours.tolist(),
        "theirs": validation.theirs.tolist(),
        "differences": validation.differences,
        "difference": validation.difference,
        "allowed": AGREED,
        "uncertainty": validation.uncertainty,
        "varied": validation.varied,
        "trials": [{"scale": scale, "difference": apart} for scale, apart in validation.trials],
    }


def engines() -> dict[str, str]:
    """Name and version of every engine that is installed."""
    return {engine.name: found for engine in KNOWN if (found := engine.version) is not None}


def choose(name: str | None) -> Engine:
    """The engine of that name, or the first that is installed.

    Raises:
        InputError: if there is none.
    """
    if name is None:
        installed = [engine for engine in KNOWN if engine.version is not None]
        if not installed:
            names = " or ".join(engine.package for engine in KNOWN)
            raise InputError(f"No independent engine is installed; {names} can be compared with. {INSTALL}")
        return installed[0]
    found = [engine for engine in KNOWN if engine.name == name]
    if not found:
        raise InputError(f"There is no engine {shorten(name)}; known are {', '.join(e.name for e in KNOWN)}.")
    return found[0]


def validate(machine: Machine, engine: str | None = None) -> Validation:
    """Rebuild a machine in an engine that is not ours and compare the compliances at its tool point.

    Args:
        machine: at its pose, where it must be reachable, regular and without a free direction.
        engine: name of the engine; the first that is installed if None.

    Raises:
        InputError: if there is no such engine, no compliance to compare, or a part that the engine cannot have.
    """
    need_machine(machine)
    chosen = choose(engine)
    response = respond(machine)
    ours = _our_compliance(response)
    answer = chosen.solve(response.configuration, response.reference)
    length = float(response.configuration.length)
    uncertainty = _uncertainty(answer, ours, length)
    trusted = max(ROUNDING, uncertainty if uncertainty < AGREED else 0.0)
    return Validation(
        machine,
        chosen.name,
        chosen.version or "",
        np.array(clean_matrix(ours.tolist())),
        np.array(clean_matrix(answer.compliance.tolist(), trusted)),
        block_differences(answer.compliance, ours, length),
        uncertainty,
        answer.varied,
        tuple((trial.scale, difference(trial.compliance, ours, length)) for trial in answer.trials),
    )


def _uncertainty(answer: Answer, ours: Array, length: float) -> float:
    if answer.rival is None:
        return math.inf
    return max(block_differences(answer.rival, answer.compliance, length, scale=ours).values())


def _our_compliance(response: Response) -> Array:
    status = Status(response.status)
    if status is not Status.OK:
        raise InputError(f"There is nothing to validate at this pose. {status.sentence}")
    ours = np.array(response.compliance.rows(), dtype=float)
    if not np.all(np.isfinite(ours)):
        raise InputError("A spring without stiffness leaves the platform free: there is no compliance to compare.")
    if not np.any(ours):
        raise InputError("Every part is rigid: C is 0 in any engine, and there is nothing to compare.")
    return ours
