"""The result of an identification written as values of the machine file.

This works only if every error that was found is a parameter of the file (a shared length, a stiffness); otherwise there
are no such values. Zeros and gains of actuators stay in the record of the fit. Errors of single joints, which the file
of a family cannot say, are the business of `exchange.leg_by_leg`.
"""

import math
from typing import Any

import numpy as np

from kinetostat.accuracy.built import as_built
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import state_of
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.machine.saving import written_at
from kinetostat.spec.errors import InputError
from kinetostat.studies.commanding import home_coordinates
from kinetostat.studies.identification.identification import Identification
from kinetostat.tolerances import FITTED_COMPLIANCE
from kinetostat.units import rounded_value

SPRINGS = ("stiffness.", "legs.")
"""Beginnings of the paths of stiffnesses: of a family, and of a machine written leg by leg."""
DOUBLED = 2.0
"""Factor on a stiffness of the file by which its springs are recognised; exact in binary."""
DIGITS = 12
"""Digits of a fitted value: more than any measurement has, and few enough for every unit."""


def fitted_file_values(answer: Identification) -> dict[str, float] | None:
    """Return the values of the machine's file that a fit changes, by path, SI.

    Returns:
        The values as identified; None where errors were found that no value of the file says.
    """
    errors = dict(zip(answer.observed.model.errors, answer.errors.tolist(), strict=True))
    if any(size and error.group in ("geometry", "clearances") for error, size in errors.items()):
        return None
    drawn = values(answer.machine)
    shared = {e.path: float(drawn[e.path]) + size for e, size in errors.items() if size and e.group == "shared"}
    factors = np.array([1.0 + size for error, size in errors.items() if error.group == "compliances"])
    stiffnesses = {} if (factors == 1.0).all() else _fitted_stiffnesses(answer.machine, factors)
    return None if stiffnesses is None else _readable(answer.machine, shared | stiffnesses)


def _readable(machine: Machine, numbers: dict[str, float]) -> dict[str, float]:
    """Round numbers in the units of the machine's file, so that they can be written in these."""
    kinds = {leaf: field.quantity.kind for field in parameters(machine.family) for leaf in field.leaves}
    written = written_at(machine, numbers)
    return {path: rounded_value(value, kinds[path], written[path], DIGITS) for path, value in numbers.items()}


def identified_machine(answer: Identification) -> Machine | None:
    """Return the machine with the values of its file as identified; None where these do not say all that was found."""
    return _machine_of(answer, fitted_file_values(answer))


def _machine_of(answer: Identification, fitted: dict[str, float] | None) -> Machine | None:
    return None if fitted is None else answer.machine.with_values(fitted)


def _fitted_stiffnesses(machine: Machine, factors: Array) -> dict[str, float] | None:
    """Find the stiffnesses of the file by which the compliances of springs are multiplied by factors.

    A stiffness of the file stands for those springs that become stiffer as it does. The machine with the stiffnesses
    that were found is compared with the wanted one, so that a spring of two stiffnesses, or of none, is noticed.

    Args:
        machine: as drawn.
        factors: factor on the compliance of each spring that deflects.

    Returns:
        The stiffnesses by path, SI; None where there are none with which all springs are as wanted.
    """
    drawn, fitted = _compliances(machine), {}
    for path, given in values(machine).items():
        stiffness = float(given)
        if not path.startswith(SPRINGS) or not 0.0 < stiffness < math.inf:
            continue
        doubled = _compliances(machine.with_values({path: DOUBLED * stiffness}))
        of_springs = set(factors[DOUBLED * doubled == drawn].tolist()) if doubled.shape == drawn.shape else set()
        if len(of_springs) == 1 and of_springs != {1.0}:
            fitted[path] = stiffness / of_springs.pop()
    reached = _compliances(machine.with_values(fitted))
    wanted = drawn * factors
    same = reached.shape == wanted.shape and np.allclose(reached, wanted, rtol=FITTED_COMPLIANCE, atol=0.0)
    return fitted if same else None


def _compliances(machine: Machine) -> Array:
    """Compliances of the springs that deflect, in the order of their errors [springs]."""
    compliances = np.array([float(compliance) for compliance in state_of(machine).free.statics.compliance])
    return np.asarray(compliances[np.isfinite(compliances) & (compliances > 0.0)])


def with_home(answer: Identification, record: dict[str, Any]) -> dict[str, Any]:
    """Add to the record of a fit where actuators stand at the home pose of the machine as built.

    Args:
        answer: the fit.
        record: plain data. It gets the values of the machine's file as identified under "numbers", if these say all;
            where the machine cannot be placed as built, the reason under "machine_file".
    """
    fitted = fitted_file_values(answer)
    machine = _machine_of(answer, fitted)
    try:
        home = _home_as_built(answer)
    except InputError as error:
        if machine is None:
            return {**record, "machine_file": str(error)}
        home = {}
    if machine is None:
        return {**record, "home": home}
    return {**record, "home": home | _home_of_file(machine), "numbers": fitted}


def _home_as_built(answer: Identification) -> dict[str, Any]:
    """Commands and places of actuators at the home pose of the machine with its errors, and how these count.

    Raises:
        InputError: the machine cannot be placed with its errors.
    """
    built = as_built(answer.machine, answer.errors)
    return {"commands": built.commands, "actuators": built.coordinates, "senses": built.senses}


def _home_of_file(machine: Machine) -> dict[str, Any]:
    """Places of actuators at the home pose of a machine by its fitted file, which counts as the drawn one does."""
    coordinates = home_coordinates(machine)
    return {"actuators": coordinates, "senses": dict.fromkeys(coordinates, 1.0)}
