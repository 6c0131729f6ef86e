"""What the page shows of vibrations: modes, the receptance of the tool about them, and the swing of a mode.

As the functions of `answers` these run in threads and touch no page. The formulas are in `vibration`.
"""

from dataclasses import dataclass
from typing import Any

from kinetostat.arrays import Array, Complex
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.vibration import Vibration, frequency_range, modes
from kinetostat.views.scene.analysis_overlays import swing_data
from kinetostat.views.scene.proportions import Proportions

POINTS, NEAR = 300, 40
"""Frequencies of a response, over its range and about each mode besides: what a small plot can show."""


@dataclass(frozen=True)
class Ringing:
    """The vibrations of a machine, and how its tool feels varying forces.

    Attributes:
        answer: modes at the pose; none where it has no answer or nothing can ring.
        frequencies: of the response, Hz [frequencies]; none where there are no modes.
        receptance: of the tool, SI [frequencies x 6 x 6].
    """

    answer: Vibration
    frequencies: Array | None = None
    receptance: Complex | None = None


def ringing(machine: Machine) -> Ringing | str:
    """Find modes and response of a machine at its pose, or say what it lacks, which is a mass as a rule."""
    try:
        answer = modes(machine)
    except InputError as error:
        return str(error)
    if not answer.modes:
        return Ringing(answer)
    frequencies = frequency_range(answer, points=POINTS, near=NEAR)
    return Ringing(answer, frequencies, answer.receptance(frequencies.tolist()))


@dataclass(frozen=True)
class SwingRequest:
    """A mode to be drawn.

    Attributes:
        answer: with its modes.
        number: of the mode, from 0.
        sizes: proportions of the picture.
    """

    answer: Vibration
    number: int
    sizes: Proportions


def swing(request: SwingRequest) -> list[dict[str, Any]]:
    """Both ends of a mode's swing, for the browser to move the machine between them."""
    shape, machine = request.answer.modes[request.number].shape, request.answer.machine
    if shape is None:
        return []
    return swing_data(machine, request.answer.state.configuration, request.sizes, shape)
