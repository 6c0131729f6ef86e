"""The result of an identification as values of the machine file, and as numbers of a printer's firmware.

The file can hold it only if every error that was found is a parameter of the file (a shared length, a stiffness). Zeros
and gains of actuators stay in the record of the fit. Errors of single joints, which the file of a family cannot say,
are the business of `exchange.leg_by_leg`.

The firmware of a linear delta knows a delta radius, the lengths of the rods, the angles of the towers, and where the
carriages stand at their endstops. Errors of the endstops are zeros of the actuators in a fit. Another radius or other
rods change the height of the nozzle below the carriages as well, which the endstops must then make good.

Sources of the firmware's words and signs: Klipper, docs/Config_Reference.md ("Linear Delta Kinematics"); Marlin, M665
and M666; RepRapFirmware, LinearDeltaKinematics, M665 and M666.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from kinetostat.accuracy.built import as_built
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
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


FAMILY, TOWERS = "delta-linear", "ABC"
NOMINAL_ANGLES = (210.0, 330.0, 90.0)
"""Angles of the towers A, B, C of an ideal printer, from the x axis, degrees."""
STEP = 1e-6
"""Step of central differences of firmware numbers, in plausible sizes of the unknowns."""
SAME_SCALE = 1e-9
"""Difference of a scale from 1 up to which it is round-off."""


@dataclass(frozen=True)
class FirmwareNumbers:
    """Numbers of a controller, with halves of their 95 % intervals; lengths in mm, angles in degrees.

    Attributes:
        radius: delta radius, from the middle of the platform's rods to those of the carriages.
        rods: length of the rods of towers A, B, C.
        angles: angles by which the towers are beyond their nominal 210, 330 and 90 degrees.
        raised: by how much `position_endstop` of each tower must be raised: its carriage stands so much higher.
        scale: factor on the way of all carriages: rotation_distance, or 1 over steps per mm.
        halves: half of the interval of each number, by its name: "radius", "rods", "angles", "raised", "scale".
        heights: height by which the carriage of each tower stands higher at its endstop than the controller assumes.
        nozzle_rises: height by which the nozzle is higher below the same carriages, because radius or rods are others.
    """

    radius: float
    rods: tuple[float, ...]
    angles: tuple[float, ...]
    raised: tuple[float, ...]
    scale: float
    halves: Mapping[str, tuple[float, ...]]
    heights: tuple[float, ...]
    nozzle_rises: tuple[float, ...]

    @property
    def marlin_endstops(self) -> tuple[tuple[float, ...], float]:
        """Changes of M666, none of which is above 0, and the change of H: Marlin lowers the carriages that are high."""
        lowest = min(self.heights)
        return tuple(lowest - height for height in self.heights), lowest + float(np.mean(self.nozzle_rises))

    @property
    def reprap_endstops(self) -> tuple[tuple[float, ...], float]:
        """Changes of M666, whose mean is 0, and the change of H: the firmware is told which carriages are high."""
        mean = float(np.mean(self.heights))
        return tuple(height - mean for height in self.heights), mean + float(np.mean(self.nozzle_rises))


def firmware_numbers(answer: Identification) -> FirmwareNumbers | None:
    """The numbers of a controller that a fit gives; None of a machine that is not a linear delta."""
    if answer.machine.family.name != FAMILY:
        return None
    fit = answer.fit
    values = _numbers(answer, fit.values)
    sizes = STEP * answer.sizes
    rates = np.stack(
        [
            (_numbers(answer, fit.values + step) - _numbers(answer, fit.values - step)) / (2.0 * size)
            for step, size in zip(np.diag(sizes), sizes, strict=True)
        ],
        axis=1,
    )
    halves = np.sqrt(np.einsum("ij,jk,ik->i", rates, fit.interval, rates))
    names = ("radius", "rods", "angles", "raised", "scale")
    ends = np.split(np.arange(11), [1, 4, 7, 10])
    parts = {name: tuple(values[rows].tolist()) for name, rows in zip(names, ends, strict=True)}
    wide = {name: tuple(halves[rows].tolist()) for name, rows in zip(names, ends, strict=True)}
    return FirmwareNumbers(
        parts["radius"][0],
        parts["rods"],
        parts["angles"],
        parts["raised"],
        parts["scale"][0],
        wide,
        tuple(values[11:14].tolist()),
        tuple(values[14:17].tolist()),
    )


def _numbers(answer: Identification, values: Array) -> Array:
    """Radius, rods, angles, raised endstops, scale, heights of the carriages, and of the nozzle under them [17]."""
    errors = answer.observed.errors(values)
    found_errors = {error.path: size for error, size in zip(answer.observed.model.errors, errors, strict=True)}
    geometry = answer.machine.tables["geometry"]

    def by_tower(field: str) -> Array:
        return np.array([found_errors.get(f"geometry.{field}.{number}", 0.0) for number in range(3)])

    radius = np.mean(geometry.tower_radius) - geometry.platform_radius
    changed = radius + by_tower("tower_radius").mean() - found_errors.get("geometry.platform_radius", 0.0)
    rods = np.array(geometry.rod_length)
    longer = rods + by_tower("rod_length")
    nominal = np.radians(NOMINAL_ANGLES)
    angles = np.array(geometry.tower_angles) + by_tower("tower_angles") - nominal
    zeros, gains = (
        np.array(
            [
                sum(
                    size
                    for error, size in zip(answer.observed.model.errors, errors, strict=True)
                    if error.group == group and error.leg == f"tower {tower}"
                )
                for tower in TOWERS
            ]
        )
        for group in ("zeros", "gains")
    )
    height = found_errors.get("geometry.platform_height", 0.0)
    nozzle_rises = np.sqrt(rods**2 - radius**2) - np.sqrt(longer**2 - changed**2) - height
    turned = np.degrees(np.arctan2(np.sin(angles), np.cos(angles)))
    lengths = 1e3 * np.array([changed, *longer])
    return np.array(
        [*lengths, *turned, *(1e3 * (zeros + nozzle_rises)), 1.0 + gains.mean(), *(1e3 * zeros), *(1e3 * nozzle_rises)]
    )


def klipper_text(numbers: FirmwareNumbers) -> str:
    """Lines for printer.cfg of Klipper; endstops as changes of what stands there."""
    lines = ["[printer]", "kinematics: delta", f"delta_radius: {numbers.radius:.6f}", ""]
    for number, (tower, nominal) in enumerate(zip("abc", NOMINAL_ANGLES, strict=True)):
        lines += [
            f"[stepper_{tower}]",
            f"angle: {nominal + numbers.angles[number]:.6f}",
            f"arm_length: {numbers.rods[number]:.6f}",
            f"# position_endstop: add {numbers.raised[number]:+.6f} to the present one",
        ]
        if abs(numbers.scale - 1.0) > SAME_SCALE:
            lines.append(f"# rotation_distance: multiply the present one by {numbers.scale:.8f}")
        lines.append("")
    return "\n".join(lines)


def marlin_text(numbers: FirmwareNumbers) -> str:
    """Commands for Marlin; M666 and H as changes of what is set."""
    endstops, height = numbers.marlin_endstops
    mean = float(np.mean(numbers.rods))
    trims = " ".join(f"{name}{rod - mean:.5f}" for name, rod in zip(TOWERS, numbers.rods, strict=True))
    return "\n".join(
        [
            f"M665 L{mean:.5f} R{numbers.radius:.5f} {_letters(numbers.angles, 5)} {trims}",
            f"; M665 H: add {height:+.5f} to the present H",
            f"M666 {_letters(endstops, 5)} ; if all were 0 before",
            "; otherwise add these to the present ones, and take the greatest of the sums from each of them and from H",
            *_scale_lines(numbers),
            "M500",
            "",
        ]
    )


def reprap_text(numbers: FirmwareNumbers) -> str:
    """Commands for RepRapFirmware; M666 and H as changes of what is set."""
    endstops, height = numbers.reprap_endstops
    rods = ":".join(f"{rod:.5f}" for rod in numbers.rods)
    return "\n".join(
        [
            f"M665 L{rods} R{numbers.radius:.5f} {_letters(numbers.angles, 5)}",
            f"; M665 H: add {height:+.5f} to the present H",
            f"M666 {_letters(endstops, 5)} ; add these to the present ones",
            *_scale_lines(numbers),
            "M500",
            "",
        ]
    )


def _letters(values: tuple[float, ...], digits: int) -> str:
    return " ".join(f"{letter}{value + 0.0:.{digits}f}" for letter, value in zip("XYZ", values, strict=True))


def _scale_lines(numbers: FirmwareNumbers) -> list[str]:
    if abs(numbers.scale - 1.0) <= SAME_SCALE:
        return []
    return [f"; M92: divide the present steps per mm of all towers by {numbers.scale:.8f}"]
