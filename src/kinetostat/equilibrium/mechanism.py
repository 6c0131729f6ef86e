"""A machine as a mechanism that can move far: coordinates of its joints and springs, its masses, drives and loads.

The free state is the machine at its pose with relaxed springs; all coordinates are zero there. Each leg is a row of
screw motions from base to platform (a product of exponentials). Nothing is solved here.

Lengths are in units of the machine's length, and forces in units of a typical stiffness times that length, so that all
numbers can be compared. Arrays have the poses first [n]. The origin is the tool point of the free state; axes are those
of the base.

Source: theory (35) and (57).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar, arctan2, is_zero, total
from kinetostat.algebra.vector import Displacement
from kinetostat.arrays import Array, Integers
from kinetostat.equilibrium.elastic_legs import ElasticLeg, LikeLegs, Masses, like_legs
from kinetostat.equilibrium.leg_reader import GivenMotions, Units, Weight, elastic_leg
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.machine.actuators import numbers_of_drive, rotor_turns
from kinetostat.machine.leg import Spring, Turn
from kinetostat.machine.loads import gravity_of, located_members, platform_masses, turned_tensor
from kinetostat.machine.machine import Configuration, Machine, Member
from kinetostat.numerics.motions import of_scalars


@dataclass(frozen=True)
class LegwisePlaces:
    """Places in a list of numbers that has the platform first, and then one leg after the other.

    Attributes:
        platform: places of what moves the platform: its twist along its ways, or coordinates of the chain that carries
            it.
        coordinates: places of the coordinates of each leg.
        wrenches: places of the wrench on each leg, behind its coordinates; none in a list of motions alone.
        count: length of the list.
    """

    platform: slice
    coordinates: tuple[slice, ...]
    wrenches: tuple[slice, ...]
    count: int

    @property
    def motions(self) -> Integers:
        """Places of the platform and of all coordinates, in the order of a list of motions alone."""
        return np.concatenate([np.arange(part.start, part.stop) for part in (self.platform, *self.coordinates)])

    @property
    def all_wrenches(self) -> Integers:
        """Places of the wrenches on all legs."""
        return np.setdiff1d(np.arange(self.count), self.motions)


def legwise_places(platform: int, legs: Sequence[ElasticLeg], wrench_size: int) -> LegwisePlaces:
    """Number what moves the platform, and then of each leg its coordinates and the components of its wrench."""
    end = platform
    coordinates, wrenches = [], []
    for leg in legs:
        coordinates.append(slice(end, end + leg.size))
        wrenches.append(slice(end + leg.size, end + leg.size + wrench_size))
        end += leg.size + wrench_size
    return LegwisePlaces(slice(0, platform), tuple(coordinates), tuple(wrenches), end)


@dataclass(frozen=True)
class Mechanism:
    """A machine at n poses, in units of its own.

    Attributes:
        legs: its legs as rows of screw motions.
        driven: the springs of the actuators that can be driven, in the order of the legs.
        growth: thermal elongation of each link that is warmer, in units of length [n x links].
        platform: masses of platform, tool and payload.
        wrench: sum of the moments of all loads, and the force at the tool point, base axes [n x 6].
        pushed: points of the platform at which further forces act, in the free state [n x forces x 3].
        forces: the forces at these points, base axes [n x forces x 3].
        gravity: acceleration of free fall, base axes, m/s² [n x 3].
        ways: basis of the twists that the platform can have, orthonormal columns [6 x 6, or 6 x 3 of a planar machine].
        length: unit of length, m [n].
        force: unit of force, N [n].
        weighs: whether any mass is known.
    """

    legs: tuple[ElasticLeg, ...]
    driven: tuple[Spring, ...]
    growth: Array
    platform: Masses
    wrench: Array
    pushed: Array
    forces: Array
    gravity: Array
    ways: Array
    length: Array
    force: Array
    weighs: bool

    def at(self, rows: Integers) -> "Mechanism":
        """The mechanism at some of its poses [rows]."""
        return replace(
            self,
            legs=tuple(leg.at(rows) for leg in self.legs),
            platform=self.platform.at(rows),
            growth=self.growth[rows],
            wrench=self.wrench[rows],
            pushed=self.pushed[rows],
            forces=self.forces[rows],
            gravity=self.gravity[rows],
            length=self.length[rows],
            force=self.force[rows],
        )

    @cached_property
    def like_legs(self) -> list[LikeLegs]:
        """The legs, those of one form together."""
        return like_legs(self.legs)

    @cached_property
    def unknown_places(self) -> LegwisePlaces:
        """Places among the unknowns of the equations of equilibrium: of the twist, all coordinates and all wrenches."""
        ways = self.ways.shape[1]
        return legwise_places(ways, self.legs, wrench_size=ways)

    @cached_property
    def motion_places(self) -> LegwisePlaces:
        """Places in a small motion: of the twist and all coordinates."""
        return legwise_places(self.ways.shape[1], self.legs, wrench_size=0)

    def given_amounts(self, actuators: Array) -> Array:
        """Return the amounts by which the motions are driven that no coordinate moves [n x amounts].

        Args:
            actuators: amounts of all actuators [n x actuators]; the growth of the links follows them.
        """
        return np.concatenate([actuators, self.growth], axis=1)

    @property
    def undriven_amounts(self) -> Array:
        """The same amounts while the actuators stand where they are."""
        return self.given_amounts(np.zeros((len(self.length), len(self.driven))))

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of the actuators that can be driven."""
        return tuple(spring.joint.name or spring.part_name for spring in self.driven)

    @property
    def twist_units(self) -> Array:
        """Units of the components of twists, rad and m [n x 6]."""
        return np.concatenate([np.ones((len(self.length), 3)), np.repeat(self.length[:, None], 3, axis=1)], axis=1)

    @property
    def compliance_units(self) -> Array:
        """Units of the entries of compliances, SI [n x 6 x 6]."""
        units = self.twist_units
        return units[:, :, None] * units[:, None] / (self.length * self.force)[:, None, None]


def _wrench_units(length: Array, force: Array) -> Array:
    return np.stack([force * length] * 3 + [force] * 3, axis=1)


def mechanism_of(
    machine: Machine,
    configuration: Configuration,
    joints: Joints | None,
    count: int | None = 1,
    force: Scalar | None = None,
    members: Sequence[Member] | None = None,
) -> Mechanism:
    """The mechanism of a machine at its pose, or at n poses.

    Args:
        machine: the machine with its pose, or columns of n poses.
        configuration: the machine placed at its pose.
        joints: coordinates that close its legs, if it is written leg by leg.
        count: number of poses, n; None for one pose whose numbers are of any kind, such as traced ones: the arrays then
            hold them as objects.
        force: unit of force, N; if None, a typical stiffness times the unit of length.
        members: its links with both ends at the pose, if they are known.
    """
    length = of_scalars([configuration.length], count)[:, 0]
    force_unit = _unit_of_force(configuration, length, count, force)
    units = Units(machine.reference_point(configuration), length, force_unit, count)
    if members is None:
        members = located_members(machine, configuration, None if joints is None else joints.coordinates)
    driven = [s for leg in configuration.legs for s in leg.springs if s.actuated and not is_zero(s.stiffness)]
    amounts = GivenMotions(len(driven))
    legs = _elastic_legs(machine, configuration, joints, units, amounts, members)
    platform, named = configuration.platform, machine.named_loads
    weights = platform_weights(machine, platform)
    return Mechanism(
        legs=legs,
        driven=tuple(amounts.actuators),
        growth=of_scalars(amounts.growth, count) * units.per_metre,
        platform=units.masses(weights),
        wrench=_sum_of_loads(machine, count) * (1.0 / _wrench_units(length, units.force)),
        pushed=units.points([platform.apply(point) for point, _ in named]),
        forces=units.forces([other.translational for _, other in named]),
        gravity=of_scalars(gravity_of(machine.tables["load"]).components(), count),
        ways=_possible_twists(configuration),
        length=length,
        force=units.force,
        weighs=bool(weights) or any(leg.masses.carried for leg in legs),
    )


def _elastic_legs(
    machine: Machine,
    configuration: Configuration,
    joints: Joints | None,
    units: Units,
    amounts: GivenMotions,
    members: Sequence[Member],
) -> tuple[ElasticLeg, ...]:
    """All legs with springs, links and drives; `amounts` counts their actuators and growing links."""
    returning = any(not is_zero(s.return_stiffness) for leg in configuration.legs for s in leg.springs)
    travels = _travels(machine, joints, units.count) if returning and joints is not None else {}
    legs = []
    for leg in configuration.legs:
        its_members = [m for m in members if m.leg == leg.name or (not m.leg and leg.number is None)]
        chain = elastic_leg(leg, units, amounts, its_members, travels.get(leg.name, ()))
        legs.append(with_drives(chain, units, machine))
    return tuple(legs)


def _sum_of_loads(machine: Machine, count: int | None) -> Array:
    """The sum of the moments of all loads (N·m), and the force at the tool point (N) [n x 6].

    Forces at other points of the platform are apart, because their moment changes as it moves.
    """
    moment = machine.load.rotational
    for _, other in machine.named_loads:
        moment = moment + other.rotational
    return of_scalars([*moment.components(), *machine.tables["load"].force], count)


def _possible_twists(configuration: Configuration) -> Array:
    """An orthonormal basis of the twists that the platform can have [6 x 6, or 6 x 3 of a planar machine]."""
    if configuration.plane is None:
        return np.eye(6)
    turn, *slides = (np.array(joint.axis.components(), dtype=float) for joint in configuration.plane.freedoms)
    return np.column_stack([[*turn, 0.0, 0.0, 0.0], *([0.0, 0.0, 0.0, *axis] for axis in slides)])


def platform_weights(machine: Machine, platform: Displacement) -> list[Weight]:
    """The masses of the platform with its tool, and of the payload, at the pose, with their inertia in base axes."""
    return [
        Weight(part.name, 0, part.centre, part.mass, turned_tensor(platform.rotation.apply, part.inertia))
        for part in platform_masses(machine, platform)
    ]


def _unit_of_force(configuration: Configuration, length: Array, count: int | None, chosen: Scalar | None) -> Array:
    if chosen is not None:
        return of_scalars([chosen], count)[:, 0]
    stiffnesses = [_linear(spring, configuration.length) for leg in configuration.legs for spring in leg.springs]
    return _typical_stiffness(of_scalars(stiffnesses, count)) * length


def _travels(machine: Machine, joints: Joints, count: int | None) -> dict[str, list[Array]]:
    """For each leg, element by element, the travel of the last joint up to it from the home pose, rad or m [n]."""
    remaining = iter(joints.coordinates)
    travels = {}
    for leg, steps in zip(machine.configure(joints.coordinates).legs, machine.chains().legs, strict=True):
        row, last = [], of_scalars([0.0], count)[:, 0]
        for step in steps:
            if step.moves:
                amount = next(remaining)
                travel = arctan2(amount.sine, amount.cosine) if isinstance(amount, Turn) else amount
                last = of_scalars([travel], count)[:, 0]
            row.append(last)
        travels[leg.name] = row
    return travels


def _linear(spring: Spring, length: Scalar) -> Scalar:
    """The stiffness of a spring, N/m; that of a torsion spring over the square of the machine's length."""
    return spring.stiffness if spring.joint.point is None else spring.stiffness * (1.0 / (length * length))


def _typical_stiffness(stiffness: Array) -> Array:
    """The geometric mean of the stiffnesses that are finite and not zero [n]; of traced numbers the harmonic mean.

    Which mean it is matters little: the unit of force only decides what counts as round-off.
    """
    if stiffness.dtype == object:
        softness = [1.0 / k for k in stiffness[0] if not is_zero(k)]
        return of_scalars([float(len(softness)) / total(softness)])[:, 0] if softness else np.ones(1)
    usable = np.isfinite(stiffness) & (stiffness > 0.0)
    logs = np.log(np.where(usable, stiffness, 1.0)).sum(axis=1)
    return np.asarray(np.exp(logs / np.maximum(usable.sum(axis=1), 1)))


def with_drives(leg: ElasticLeg, units: Units, machine: Machine) -> ElasticLeg:
    """Add the inertia of rotors and the friction of joints to the coordinates of a leg, theory (57).

    A rotor turns against the spring of its actuator, which stands for drive and transmission: while the machine
    vibrates, the deflection of that spring is the rotor's motion. A linear actuator with the lead l turns its rotor by
    2 pi / l per metre, a rotary one by its ratio; inertia and friction of the rotor count with the square of that.

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
    numbers = [number for drive in drives.values() for number in (drive.rotor_inertia, drive.rotor_damping)]
    numbers += [damping.hinges, damping.slides]
    if all(is_zero(number) for number in numbers):
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


def _friction(leg: ElasticLeg, coordinate: int, units: Units, damping: Any) -> Array:
    """Friction of a passive coordinate; the bars of a parallelogram turn about both of their ends."""
    result = units.zero
    for motion, follows in enumerate(leg.chain.coordinate):
        if follows != coordinate:
            continue
        turning = leg.chain.twists[:, motion, :3]
        if all(is_zero(part) for part in turning.flat):
            result = result + units.inertia(damping.slides, turns=False)
        else:
            result = result + units.inertia(damping.hinges, turns=True) * (turning * turning).sum(axis=1)
    return result
