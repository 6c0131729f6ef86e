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
"""Digits of a fitted value: more than any measurement has, and few enough to hide the round-off of changing units."""
PRINTER_FAMILY = "delta-linear"
"""Family of the machines whose firmware knows the numbers of a linear delta."""
TOWERS = "ABC"
"""Names of the towers, in the order of the machine's legs, as firmware calls them."""
NOMINAL_ANGLES = (210.0, 330.0, 90.0)
"""Angles of the towers A, B, C of an ideal printer, from the x axis, degrees."""
FIRMWARE_STEP = 1e-6
"""Step of central differences of firmware numbers, in plausible sizes of the unknowns: a nanometre or a nanoradian,
which leaves seven digits of the rates."""
NUMBERS_WITH_INTERVALS = ("radius", "rods", "angles", "raised", "scale")
"""Firmware numbers that have intervals: those that a user sets."""
SAME_SCALE = 1e-9
"""Difference of a scale from 1 up to which it is round-off."""


def fitted_file_values(answer: Identification) -> dict[str, float] | None:
    """Return the values of the machine's file that a fit changes, by path, SI.

    Returns:
        The values as identified; None where errors were found that no value of the file can hold.
    """
    machine = answer.machine
    errors = dict(zip(answer.observed.model.errors, answer.errors.tolist(), strict=True))
    if any(size and error.group in ("geometry", "clearances") for error, size in errors.items()):
        return None
    drawn = values(machine)
    shared = {e.path: float(drawn[e.path]) + size for e, size in errors.items() if size and e.group == "shared"}
    factors = np.array([1.0 + size for error, size in errors.items() if error.group == "compliances"])
    stiffnesses = {} if (factors == 1.0).all() else _fitted_stiffnesses(machine, factors)
    if stiffnesses is None:
        return None
    fitted = shared | stiffnesses
    # Rounded in the units in which the file has them, so that it can be written with few digits.
    kinds = {leaf: field.quantity.kind for field in parameters(machine.family) for leaf in field.leaves}
    written = written_at(machine, fitted)
    return {path: rounded_value(value, kinds[path], written[path], DIGITS) for path, value in fitted.items()}


def identified_machine(answer: Identification) -> Machine | None:
    """Return the machine with the values of its file as identified; None where these cannot hold all that was found."""
    fitted = fitted_file_values(answer)
    return None if fitted is None else answer.machine.with_values(fitted)


def _fitted_stiffnesses(machine: Machine, factors: Array) -> dict[str, float] | None:
    """Find the stiffnesses of the file by which the compliances of springs are multiplied by factors.

    A stiffness of the file belongs to those springs whose compliance halves as it is doubled. The machine with the
    stiffnesses that were found is compared with the wanted one, so that a spring of two stiffnesses, or of none, is
    noticed.

    Args:
        machine: the machine as drawn.
        factors: factor on the compliance of each spring that deflects [springs].

    Returns:
        The stiffnesses by path, SI; None where there are none with which all springs are as wanted.
    """
    drawn, fitted = _compliances(machine), {}
    for path, value in values(machine).items():
        stiffness = float(value)
        if not path.startswith(SPRINGS) or not 0.0 < stiffness < math.inf:
            continue
        stiffer = _compliances(machine.with_values({path: DOUBLED * stiffness}))
        is_of_path = DOUBLED * stiffer == drawn if stiffer.shape == drawn.shape else np.zeros(drawn.shape, dtype=bool)
        factors_of_path = set(factors[is_of_path].tolist())
        if len(factors_of_path) == 1 and factors_of_path != {1.0}:
            fitted[path] = stiffness / factors_of_path.pop()
    reached, wanted = _compliances(machine.with_values(fitted)), drawn * factors
    as_wanted = reached.shape == wanted.shape and np.allclose(reached, wanted, rtol=FITTED_COMPLIANCE, atol=0.0)
    return fitted if as_wanted else None


def _compliances(machine: Machine) -> Array:
    """Compliances of the springs that deflect, in the order of their errors [springs]."""
    compliances = np.array([float(compliance) for compliance in state_of(machine).free.statics.compliance])
    return np.asarray(compliances[np.isfinite(compliances) & (compliances > 0.0)])


def with_home(answer: Identification, record: dict[str, Any]) -> dict[str, Any]:
    """Add to the record of a fit where actuators stand at the home pose of the machine as built.

    A machine whose file can hold all that was found stands where the fitted file says, and counts as the drawn one
    does; any other stands where the drawn one goes with its errors.

    Args:
        answer: the fit.
        record: its plain data, which are extended by commands, coordinates and senses of actuators under "home", and
            the values of the fitted file, if it can hold all, under "numbers"; where the machine cannot be placed,
            by the reason under "machine_file".
    """
    fitted = fitted_file_values(answer)
    home: dict[str, Any] = {}
    try:
        built = as_built(answer.machine, answer.errors)
        home = {"commands": built.commands, "actuators": built.coordinates, "senses": built.senses}
    except InputError as error:
        if fitted is None:
            return {**record, "machine_file": str(error)}
    if fitted is None:
        return {**record, "home": home}
    coordinates = home_coordinates(answer.machine.with_values(fitted))
    of_file = {"actuators": coordinates, "senses": dict.fromkeys(coordinates, 1.0)}
    return {**record, "home": home | of_file, "numbers": fitted}


@dataclass(frozen=True)
class FirmwareNumbers:
    """Numbers of a controller, with halves of their 95 % intervals; lengths in mm, angles in degrees.

    Attributes:
        radius: delta radius, from the middle of the platform's rods to those of the carriages.
        rods: length of the rods of towers A, B, C.
        angles: angle of each tower less its nominal 210, 330 or 90 degrees.
        raised: height by which `position_endstop` of each tower must be raised.
        scale: factor on the travel of all carriages: on rotation_distance, or 1 over that on steps per mm.
        halves: half of the interval of each number, by its name: "radius", "rods", "angles", "raised", "scale".
        heights: height by which the carriage of each tower stands higher at its endstop than the controller assumes.
        nozzle_rises: height by which the nozzle is higher below the same carriages, by the new radius and rods.
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
    if answer.machine.family.name != PRINTER_FAMILY:
        return None
    fit = answer.fit
    numbers = _numbers_by_name(answer, fit.values)
    ends = []
    for step in np.diag(FIRMWARE_STEP * answer.sizes):
        ahead, behind = (_numbers_by_name(answer, values) for values in (fit.values + step, fit.values - step))
        ends.append((ahead, behind, 2.0 * step.sum()))
    halves = {}
    for name in NUMBERS_WITH_INTERVALS:
        rates = np.stack([(ahead[name] - behind[name]) / width for ahead, behind, width in ends], axis=1)
        halves[name] = tuple(np.sqrt(np.einsum("ij,jk,ik->i", rates, fit.interval, rates)).tolist())
    return FirmwareNumbers(
        radius=float(numbers["radius"][0]),
        rods=tuple(numbers["rods"].tolist()),
        angles=tuple(numbers["angles"].tolist()),
        raised=tuple(numbers["raised"].tolist()),
        scale=float(numbers["scale"][0]),
        halves=halves,
        heights=tuple(numbers["heights"].tolist()),
        nozzle_rises=tuple(numbers["nozzle_rises"].tolist()),
    )


def _numbers_by_name(answer: Identification, values: Array) -> dict[str, Array]:
    """The fields of `FirmwareNumbers` but its intervals, by name, at values of the unknowns [1 or 3 each]."""
    errors = list(zip(answer.observed.model.errors, answer.observed.errors(values), strict=True))
    size_by_path = {error.path: size for error, size in errors}
    geometry = answer.machine.tables["geometry"]

    def of_towers(field: str) -> Array:
        return np.array([size_by_path.get(f"geometry.{field}.{number}", 0.0) for number in range(len(TOWERS))])

    def of_actuators(group: str) -> Array:
        legs = [f"tower {tower}" for tower in TOWERS]
        return np.array([sum(size for e, size in errors if e.group == group and e.leg == leg) for leg in legs])

    drawn_radius, drawn_rods = np.mean(geometry.tower_radius) - geometry.platform_radius, np.array(geometry.rod_length)
    radius = drawn_radius + of_towers("tower_radius").mean() - size_by_path.get("geometry.platform_radius", 0.0)
    rods = drawn_rods + of_towers("rod_length")
    angles = np.array(geometry.tower_angles) + of_towers("tower_angles") - np.radians(NOMINAL_ANGLES)
    heights = of_actuators("zeros")
    rods_lift = np.sqrt(drawn_rods**2 - drawn_radius**2) - np.sqrt(rods**2 - radius**2)
    nozzle_rises = rods_lift - size_by_path.get("geometry.platform_height", 0.0)
    return {
        "radius": 1e3 * np.array([radius]),
        "rods": 1e3 * rods,
        "angles": np.degrees(np.arctan2(np.sin(angles), np.cos(angles))),
        "raised": 1e3 * (heights + nozzle_rises),
        "scale": np.array([1.0 + of_actuators("gains").mean()]),
        "heights": 1e3 * heights,
        "nozzle_rises": 1e3 * nozzle_rises,
    }


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


def _letters(numbers: tuple[float, ...], digits: int) -> str:
    return " ".join(f"{letter}{number + 0.0:.{digits}f}" for letter, number in zip("XYZ", numbers, strict=True))


def _scale_lines(numbers: FirmwareNumbers) -> list[str]:
    if abs(numbers.scale - 1.0) <= SAME_SCALE:
        return []
    return [f"; M92: divide the present steps per mm of all towers by {numbers.scale:.8f}"]
