"""A fit in the words of the machine's own file: its numbers as identified, where these say all that was found.

Zeros and gains of actuators stay in the record of the fit. Errors of single joints, which the file of a family cannot
say, are the business of `exchange.leg_by_leg`.
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
from kinetostat.units import rounded_value

SPRINGS = ("stiffness.", "legs.")
"""Beginnings of the paths of stiffnesses: of a family, and of a machine written leg by leg."""
DOUBLED = 2.0
"""Factor on a stiffness of the file by which its springs are recognised; exact in binary."""
DIGITS = 12
"""Of a number as identified: more than any measurement has, and few enough for every unit."""
SAME_COMPLIANCE = 1e-12
"""Relative difference of two compliances that are the same but for round-off."""


def own_numbers(answer: Identification) -> dict[str, float] | None:
    """Return the numbers of the machine's file that a fit changes, by path, SI.

    Returns:
        The numbers as identified; None where errors were found that no number of the file says.
    """
    given = values(answer.machine)
    numbers: dict[str, float] = {}
    errors = dict(zip(answer.observed.model.errors, answer.errors.tolist(), strict=True))
    for error, value in errors.items():
        if error.group == "shared" and value:
            numbers[error.path] = float(given[error.path]) + value
        elif error.group in ("geometry", "clearances") and value:
            return None
    softer = np.array([1.0 + value for error, value in errors.items() if error.group == "compliances"])
    stiffnesses = {} if (softer == 1.0).all() else _own_stiffnesses(answer.machine, softer)
    return None if stiffnesses is None else _readable(answer.machine, numbers | stiffnesses)


def _readable(machine: Machine, numbers: dict[str, float]) -> dict[str, float]:
    """Round numbers in the units of the machine's file, so that they can be written in these."""
    kinds = {leaf: field.quantity.kind for field in parameters(machine.family) for leaf in field.leaves}
    written = written_at(machine, numbers)
    return {path: rounded_value(value, kinds[path], written[path], DIGITS) for path, value in numbers.items()}


def identified_machine(answer: Identification) -> Machine | None:
    """Return the machine with its own numbers as identified; None where these do not say all that was found."""
    numbers = own_numbers(answer)
    return None if numbers is None else answer.machine.with_values(numbers)


def _own_stiffnesses(machine: Machine, softer: Array) -> dict[str, float] | None:
    """Find the stiffnesses of the file with which springs are softer by factors.

    A number of the file stands for those springs that become stiffer as it does. The machine with the numbers that were
    found is compared with the wanted one, so that a spring of two numbers, or of none, is noticed.

    Args:
        machine: as drawn.
        softer: for each spring that deflects.

    Returns:
        The stiffnesses by path, SI; None where there are none with which all springs are as wanted.
    """
    drawn, result = _compliances(machine), {}
    for path, value in ((path, float(number)) for path, number in values(machine).items()):
        if not path.startswith(SPRINGS) or not 0.0 < value < math.inf:
            continue
        stiffer = _compliances(machine.with_values({path: DOUBLED * value}))
        factors = set(softer[DOUBLED * stiffer == drawn].tolist()) if stiffer.shape == drawn.shape else set()
        if len(factors) == 1 and factors != {1.0}:
            result[path] = value / factors.pop()
    reached = _compliances(machine.with_values(result))
    wanted = drawn * softer
    same = reached.shape == wanted.shape and np.allclose(reached, wanted, rtol=SAME_COMPLIANCE, atol=0.0)
    return result if same else None


def _compliances(machine: Machine) -> Array:
    """Of the springs that deflect, in the order of their errors [springs]."""
    sizes = np.array([float(size) for size in state_of(machine).free.statics.compliance])
    return np.asarray(sizes[np.isfinite(sizes) & (sizes > 0.0)])


def with_home(answer: Identification, record: dict[str, Any]) -> dict[str, Any]:
    """Add to the record of a fit where actuators stand at the home pose of the machine as built.

    Args:
        answer: of the fit.
        record: plain data. It gets the numbers that the machine's own file has as identified, if these say all; where
            the machine cannot be placed as built, the reason under "machine_file".
    """
    machine = identified_machine(answer)
    try:
        built = as_built(answer.machine, answer.errors)
        home = {"commands": built.commands, "actuators": built.coordinates, "senses": built.senses}
    except InputError as error:
        if machine is None:
            return {**record, "machine_file": str(error)}
        home = {}
    if machine is None:
        return {**record, "home": home}
    stands = home_coordinates(machine)  # its file counts as the drawn one does
    home |= {"actuators": stands, "senses": dict.fromkeys(stands, 1.0)}
    return {**record, "home": home, "numbers": own_numbers(answer)}
