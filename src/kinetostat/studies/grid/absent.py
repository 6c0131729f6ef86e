"""Quantities that a machine cannot have: of parts that it lacks, of masses and loads that its file does not say."""

from collections.abc import Sequence

import numpy as np

from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import PARTS, QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.mass import moving_masses
from kinetostat.machine.parameters import Parameter
from kinetostat.spec.errors import InputError
from kinetostat.units import KINDS

UNDER_LOAD = ("actuator_force", "actuator_moment")


def refuse_absent(machine: Machine, names: Sequence[str], varied: Sequence[Parameter] = ()) -> None:
    """Refuse quantities that have no value for a machine, whatever its pose.

    Args:
        machine: as its file has it.
        names: of quantities.
        varied: parameters that take other values than the file's.

    Raises:
        InputError: names the quantity, and what the machine lacks or its file must say.
    """
    if "mass" in names and not any(KINDS[one.quantity.kind].heavy for one in varied):
        _refuse_unknown_mass(machine)
    wanted = [name for name in names if name in PARTS]
    if not wanted:
        return
    response = respond(machine)
    for name in wanted:
        if np.isnan(QUANTITIES[name].value(response)) and response.status == Status.OK:
            raise InputError(f'"{name}" has no meaning here: {machine.name} lacks {PARTS[name]}; leave it out.')
    loaded = any(machine.load.components()) or any(one.path.startswith("load.") for one in varied)
    for name in UNDER_LOAD:
        if name in names and not loaded:
            raise InputError(
                f'"{name}" is not known: nothing says which load {machine.name} bears; add to its file a table [load], '
                'e.g. force = ["0 N", "0 N", "-500 N"].'
            )


def _refuse_unknown_mass(machine: Machine) -> None:
    masses = moving_masses(machine, respond(machine).configuration)
    if all(one.mass is None for one in masses):
        raise InputError(
            f'"mass" is not known: nothing says what {machine.name} weighs; give its links a cross-section with a '
            'density or material, or its table [tool] mass = "12 kg".'
        )
