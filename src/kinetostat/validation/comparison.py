"""The compliance of a machine compared with that of an independent engine, and the list of engines.

What an engine returns, and the difference of two compliances, come first. How a machine is built in an engine is the
business of the engine's own module, imported only when it is used.
"""

import math
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from itertools import zip_longest
from typing import TypeVar

import numpy as np

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.installation import extra_command
from kinetostat.studies.cleaning import clean_matrix
from kinetostat.tolerances import AGREED, RIGID_BLOCK_OF_ENGINE, ROUND_OFF_OF_ENTRY
from kinetostat.validation.machine_from_file import machine_from_file
from kinetostat.vibration.modes import frequencies

ROTATIONS, TRANSLATIONS = slice(0, 3), slice(3, 6)
AnyAnswer = TypeVar("AnyAnswer")


@dataclass(frozen=True)
class Trial:
    """One of the results from which an engine's final one follows.

    Attributes:
        scale: value of the quantity that was varied, see `Answer.varied`.
        compliance: C at the reference point, base axes, rx ry rz x y z [6 x 6].
    """

    scale: float
    compliance: Array


@dataclass(frozen=True)
class Answer:
    """An engine's compliance of a machine.

    Attributes:
        compliance: C at the reference point, base axes, rx ry rz x y z [6 x 6]; rows that a planar machine does not
            have are 0.
        second_best: C by the engine's next best way, if there is one; their difference is the uncertainty.
        varied: the quantity that the trials vary, in words.
        trials: the trials in the order of their scale.
    """

    compliance: Array
    second_best: Array | None
    varied: str
    trials: tuple[Trial, ...]


def block_differences(
    actual: Array, expected: Array, length: float, vanishing: float = RIGID_BLOCK_OF_ENGINE, scale: Array | None = None
) -> dict[str, float]:
    """Return the relative difference of two compliances in their blocks: rotation, coupling, translation.

    A block of `expected`, or of `scale` if it is given, is measured by its Frobenius norm, the coupling by the
    geometric mean of the two diagonal blocks: for a positive semi-definite matrix it is at most that, and no unit is
    mixed. Where the machine is rigid in one diagonal block (it is below the share `vanishing` of the other), there is
    nothing to compare with; then the other block is the measure, converted by `length` (m).
    """
    measure = expected if scale is None else scale
    rotation, translation = (float(np.linalg.norm(measure[block, block])) for block in (ROTATIONS, TRANSLATIONS))
    if rotation * length**2 < vanishing * translation:
        rotation = translation / length**2
    elif translation < vanishing * rotation * length**2:
        translation = rotation * length**2
    blocks = {
        "rotation": (ROTATIONS, ROTATIONS, rotation),
        "coupling": (ROTATIONS, TRANSLATIONS, float(np.sqrt(rotation * translation))),
        "translation": (TRANSLATIONS, TRANSLATIONS, translation),
    }
    error, result = actual - expected, {}
    for name, (rows, columns, size) in blocks.items():
        norm = max(float(np.linalg.norm(error[rows, columns])), float(np.linalg.norm(error[columns, rows])))
        result[name] = norm / size if size > 0.0 else norm
    return result


def difference(actual: Array, expected: Array, length: float, vanishing: float = RIGID_BLOCK_OF_ENGINE) -> float:
    """Return the largest of the relative differences of the blocks."""
    return max(block_differences(actual, expected, length, vanishing).values())


INSTALL_ENGINE = "Install it with `{}`."
"""A sentence for messages, with the command in it."""


@dataclass(frozen=True)
class Engine:
    """An independent engine, in which a machine can be rebuilt.

    Attributes:
        name: its name as in `kinetostat validate --engine`.
        package: its name for pip.
        needs: modules that must be installed.
        builder: the kinetostat module whose `solve` rebuilds a machine in it.
        summary: its model of a machine, in words.
        modes: the kinetostat module whose `frequencies` rebuilds it with its masses; empty if the engine has none.
    """

    name: str
    package: str
    needs: tuple[str, ...]
    builder: str
    summary: str
    modes: str = ""

    @property
    def version(self) -> str | None:
        """Version of the installed package; None if it is not installed."""
        if any(find_spec(module) is None for module in self.needs):
            return None
        try:
            return version(self.package)
        except PackageNotFoundError:
            return None

    def solve(self, configuration: Configuration, reference: Vector) -> Answer:
        """Return C of a placed machine at a point (base frame, m).

        Raises:
            InputError: if the engine is not installed, has no counterpart of a part of the machine, or fails.
        """
        return self._answer_of(lambda: import_module(self.builder).solve(configuration, reference))

    def frequencies(self, machine: Machine) -> Array:
        """Return the natural frequencies of a machine at its pose, ascending, Hz; none if the engine has no modes.

        Raises:
            InputError: see `solve`.
        """
        return self._answer_of(lambda: import_module(self.modes).frequencies(machine)) if self.modes else np.zeros(0)

    def _answer_of(self, question: Callable[[], AnyAnswer]) -> AnyAnswer:
        """Return the answer of the engine to a question; what it raises becomes an InputError."""
        if self.version is None:
            raise InputError(
                f"The engine {self.name} is not installed. {INSTALL_ENGINE.format(extra_command('validate'))}"
            )
        try:
            return question()
        except InputError:
            raise
        except Exception as trouble:  # engines raise anything, down to bare exceptions
            reason = str(trouble).partition("\n")[0]
            raise InputError(f"The engine {self.name} failed for this machine: {reason}") from trouble


KNOWN = (
    Engine(
        name="exudyn",
        package="exudyn",
        needs=("exudyn", "scipy"),
        builder="kinetostat.validation.exudyn_machine",
        summary="multibody dynamics: rigid bodies, exact constraints and springs",
        modes="kinetostat.validation.exudyn_machine",
    ),
    Engine(
        name="pynite",
        package="PyNiteFEA",
        needs=("Pynite", "scipy"),
        builder="kinetostat.validation.pynite_machine",
        summary="frame analysis: straight members, releases and stiff parts",
    ),
)
"""Every engine in which a machine can be rebuilt; the first can build any machine."""


@dataclass(frozen=True, eq=False)
class Validation(ImmutableAnswer):
    """Compliance of a machine by kinetostat and by an independent engine, at T, base axes, order rx ry rz x y z, SI.

    Attributes:
        machine: the machine at its pose.
        engine, version: name and version of the independent engine.
        ours, theirs: C by kinetostat and by the engine [6 x 6], without round-off; absent rows are 0.
        differences: relative differences by block: rotation, coupling, translation.
        uncertainty: difference of the engine's two best results, in the same measure; infinite if it has only one.
        varied: the quantity that the engine's trials vary, in words.
        trials: scale of each trial, and its difference from kinetostat's C.
        frequencies: the lowest natural frequencies of the unloaded machine by kinetostat and by the engine, Hz; none
            where nothing has a mass, or the engine has no modes.
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
    frequencies: tuple[tuple[float, float], ...] = ()

    def __repr__(self) -> str:
        return f"<Validation of {self.machine.name!r} with {self.engine}: differs by {self.difference:.1e}>"

    @property
    def difference(self) -> float:
        """The largest of the relative differences of the blocks and of the natural frequencies."""
        return max(*self.differences.values(), self.frequency_difference)

    @property
    def diagonal_differences(self) -> Array:
        """The relative difference of each entry of the diagonal of C [6]; NaN where the machine is rigid."""
        ours, theirs = np.diag(self.ours), np.diag(self.theirs)
        return np.abs(np.divide(theirs, ours, out=np.full(len(ours), np.nan), where=ours != 0.0) - 1.0)

    @property
    def frequency_difference(self) -> float:
        """The largest relative difference of the natural frequencies; infinite where only one of the two has a mode."""
        return max((frequency_difference(*pair) for pair in self.frequencies), default=0.0)


def engines() -> dict[str, str]:
    """Return name and version of every engine that is installed."""
    return {engine.name: number for engine in KNOWN if (number := engine.version) is not None}


def choose(name: str | None) -> Engine:
    """Return the engine with a name or, without a name, the first that is installed.

    Raises:
        InputError: if there is none.
    """
    if name is None:
        installed = [engine for engine in KNOWN if engine.version is not None]
        if not installed:
            names = " or ".join(engine.package for engine in KNOWN)
            hint = INSTALL_ENGINE.format(extra_command("validate"))
            raise InputError(f"No independent engine is installed; {names} can be used. {hint}")
        return installed[0]
    named = [engine for engine in KNOWN if engine.name == name]
    if not named:
        raise InputError(f"There is no engine {shorten(name)}; known are {', '.join(e.name for e in KNOWN)}.")
    return named[0]


@checked
def validate(machine: Machine, engine: str | None = None) -> Validation:
    """Rebuild a machine in an independent engine and compare the compliances at its tool point.

    Args:
        machine: the machine at its pose, where it must be reachable, regular and without a free direction.
        engine: name of the engine; the first that is installed if None.

    Raises:
        InputError: if there is no such engine, no compliance to compare, or a part that the engine cannot have.
    """
    chosen = choose(engine)
    state = state_of(machine)
    response = state.free
    ours = _our_compliance(response)
    drawn = machine_from_file(machine, response, state.joints)
    answer = chosen.solve(drawn.configuration, drawn.reference)
    length = float(response.configuration.length)
    uncertainty = _uncertainty(answer, ours, length)
    round_off = max(ROUND_OFF_OF_ENTRY, uncertainty if uncertainty < AGREED else 0.0)
    return Validation(
        machine=machine,
        engine=chosen.name,
        version=chosen.version or "",
        ours=np.array(clean_matrix(ours.tolist())),
        theirs=np.array(clean_matrix(answer.compliance.tolist(), round_off)),
        differences=block_differences(answer.compliance, ours, length),
        uncertainty=uncertainty,
        varied=answer.varied,
        trials=tuple((trial.scale, difference(trial.compliance, ours, length)) for trial in answer.trials),
        frequencies=frequency_pairs(machine, chosen),
    )


def frequency_difference(ours: float, theirs: float) -> float:
    """Return the relative difference of two frequencies (Hz), of which one that is infinite belongs to no mode."""
    return 0.0 if ours == theirs else abs(theirs / ours - 1.0)


def frequency_pairs(machine: Machine, engine: Engine) -> tuple[tuple[float, float], ...]:
    """Return the lowest natural frequencies of an unloaded machine by kinetostat and by an engine, Hz.

    Args:
        machine: the machine at its pose, where it must be sound.
        engine: an engine that is installed.

    Returns:
        A pair for each mode, infinite where one of them has no further mode; none without a mass, or if the engine
        has no modes.

    Raises:
        InputError: if the machine has a part that the engine cannot have.
    """
    lowest = frequencies(state_of(machine).free_equations)[0].tolist()
    ours = [frequency for frequency in lowest if math.isfinite(frequency)]
    if not ours or not engine.modes:
        return ()
    theirs = engine.frequencies(machine)[: len(lowest)].tolist()
    return tuple(zip_longest(ours, theirs, fillvalue=math.inf))


def _uncertainty(answer: Answer, ours: Array, length: float) -> float:
    """Return the difference of an engine's two best results as a share of our C; infinite if it has only one."""
    if answer.second_best is None:
        return math.inf
    return max(block_differences(answer.second_best, answer.compliance, length, scale=ours).values())


def _our_compliance(response: Response) -> Array:
    """Return C by kinetostat [6 x 6].

    Raises:
        InputError: there is none at the pose, or it is 0, so that there is nothing to compare.
    """
    status = Status(response.status)
    if status is not Status.OK:
        raise InputError(f"There is nothing to validate at this pose. {status.sentence}")
    ours = np.array(response.compliance.rows(), dtype=float)
    if not np.all(np.isfinite(ours)):
        raise InputError(
            "A spring without stiffness leaves the platform free, so that there is no finite compliance to compare; "
            "give every spring a stiffness with --set."
        )
    if not np.any(ours):
        raise InputError("Every part is rigid: C is 0 in any engine; give a part a finite stiffness with --set.")
    return ours
