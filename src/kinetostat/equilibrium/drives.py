"""Inertia of rotors through their transmission, and friction of joints: what coordinates of a leg have beside springs.

A rotor turns against the spring of its actuator, which stands for drive and transmission: while the machine vibrates,
the deflection of that spring is the rotor's motion. A linear actuator with the lead l turns its rotor by 2 pi / l per
metre, a rotary one by its ratio; inertia and friction of the rotor count with the square of that.

Source: theory (57). Units are those of `mechanism`.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, reciprocal
from kinetostat.arrays import Array
from kinetostat.equilibrium.chains import ElasticLeg, Units
from kinetostat.machine.drives import numbers_of_drive
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError


def with_drives(leg: ElasticLeg, units: Units, machine: Machine) -> ElasticLeg:
    """Add what rotors and friction do to the coordinates of a leg.

    Args:
        leg: the leg without drives.
        units: the units in which it is counted.
        machine: the machine, with tables [drives] and [damping].

    Raises:
        InputError: rotors have an inertia or friction, but nothing says how far they turn.
    """
    damping = machine.tables["damping"]
    drives = {
        coordinate: numbers_of_drive(machine, "drives", spring)
        for coordinate, spring in enumerate(leg.springs)
        if spring is not None and spring.actuated
    }
    given = [number for drive in drives.values() for number in (drive.rotor_inertia, drive.rotor_damping)]
    given += [damping.hinges, damping.slides]
    if all(is_zero(number) for number in given):
        return leg
    rotors, dampers = np.array(leg.rotors), np.array(leg.dampers)
    if units.count is None:
        rotors, dampers = rotors.astype(object), dampers.astype(object)
    for coordinate, spring in enumerate(leg.springs):
        if spring is None:
            dampers[:, coordinate] = _friction(leg, coordinate, units, damping)
        elif spring.actuated:
            drive = drives[coordinate]
            turns = rotor_turns(spring, drive)
            square = turns * turns
            for amounts, number in ((rotors, drive.rotor_inertia), (dampers, drive.rotor_damping)):
                if not is_zero(number):
                    amounts[:, coordinate] = units.inertia(square * number, spring.joint.point is not None)
    return replace(leg, rotors=rotors, dampers=dampers)


def rotor_turns(spring: Spring, drives: Any) -> Scalar:
    """Radians by which the rotor of an actuator turns per metre or radian of the actuator; 0.0 if nothing says it.

    Args:
        spring: the actuator's spring.
        drives: the table [drives] as this drive has it, see `machine.drives`.

    Raises:
        InputError: rotors have an inertia or friction, but nothing says how far they turn.
    """
    slides = spring.joint.point is None
    given = drives.lead if slides else drives.ratio
    if is_zero(given):
        if all(is_zero(number) for number in (drives.rotor_inertia, drives.rotor_damping, drives.rotor_friction)):
            return 0.0
        field, example, kind = ("lead", '"10 mm"', "linear") if slides else ("ratio", "50", "rotary")
        raise InputError(
            f"drives.{field} is 0, but drives.rotor_inertia, drives.rotor_damping or drives.rotor_friction is given "
            f"and the actuators are {kind}: nothing says how far a rotor turns; write {field} = {example} in the "
            "table [drives]."
        )
    return reciprocal(given) * (2.0 * math.pi) if slides else given


def _friction(leg: ElasticLeg, coordinate: int, units: Units, damping: Any) -> Array:
    """Friction of a passive coordinate; the bars of a parallelogram turn about both of their ends."""
    result = units.nothing
    for motion, follows in enumerate(leg.chain.coordinate):
        if follows != coordinate:
            continue
        turning = leg.chain.twists[:, motion, :3]
        if all(is_zero(part) for part in turning.flat):
            result = result + units.inertia(damping.slides, turns=False)
        else:
            result = result + units.inertia(damping.hinges, turns=True) * (turning * turning).sum(axis=1)
    return result
