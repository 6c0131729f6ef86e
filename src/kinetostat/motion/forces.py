"""Forces that move a rigid machine: those of its drives along a motion, part by part, and the loads of its joints.

Every mass asks for a force, its mass times its acceleration less its weight; virtual work takes these to the drives
(d'Alembert's principle). Over scalars; nothing here iterates, and nothing knows how drives are built (`drives` in
`studies`).

Source: theory (90)-(93). Units are those of `rigid`: forces in N, moments in N times the machine's length.
"""

from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, inner_product, is_infinite, is_zero, sqrt, total, where
from kinetostat.algebra.screw import NO_WRENCH, Twist, Wrench
from kinetostat.algebra.solve import Row, complement, identity, right_inverse
from kinetostat.algebra.symmetric import SIZE
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.motion.rates import BodyMotion, LegMotion, MachineMotion
from kinetostat.motion.rigid import MassPoint, RigidLeg, RigidMachine

PARTS = ("weight", "inertia", "process", "friction", "springs")
"""Parts of what drives must do: against the weight of all parts, to accelerate masses and rotors, against the loads on
the platform, against friction of joints and drives, and against flexure hinges."""
STANDSTILL_RATE = 1e-12
"""Rate of a joint, rad/s or in lengths of the machine per second, up to which it stands still: Coulomb friction is as
large at any speed, that of round-off included."""


@dataclass(frozen=True)
class ForceDemand:
    """Forces that a machine asks for, along its platform's twist and the coordinates of its legs.

    Attributes:
        platform: the wrench along the platform's twist, at the origin.
        legs: generalised forces of each leg's coordinates.
        carried: for each leg and each k, the wrench that all asks for that lies beyond its first k motions.
    """

    platform: Wrench
    legs: tuple[Row, ...]
    carried: tuple[tuple[Wrench, ...], ...]

    def __add__(self, other: "ForceDemand") -> "ForceDemand":
        rows = [[a + b for a, b in zip(*pair, strict=True)] for pair in zip(self.legs, other.legs, strict=True)]
        wrenches = zip(self.carried, other.carried, strict=True)
        carried = tuple(tuple(a + b for a, b in zip(*pair, strict=True)) for pair in wrenches)
        return ForceDemand(self.platform + other.platform, tuple(rows), carried)


def force_on(mass: Scalar, at: Vector, acceleration: Vector) -> Wrench:
    """Return the wrench at the origin that accelerates a mass at a point."""
    force = acceleration * mass
    return Wrench(at.cross(force), force)


def _acceleration(at: Vector, body: BodyMotion, real_twist: Twist) -> Vector:
    """Return the acceleration of a point of a body, theory (88)."""
    speed = real_twist.translational + real_twist.rotational.cross(at)
    return body.change.translational + body.change.rotational.cross(at) + body.twist.rotational.cross(speed)


def _accelerating_wrenches(
    masses: Sequence[MassPoint],
    pairs: Sequence[tuple[int, int]],
    bodies: Sequence[BodyMotion],
    real_twists: Sequence[Twist],
    length: Scalar,
) -> list[Wrench]:
    """Return the wrench that accelerates each mass, theory (90).

    Args:
        masses: masses of a leg or of the platform.
        pairs: pairs of masses that are the halves of a bar.
        bodies: for each mass, the motion of the body that carries it.
        real_twists: for each mass, the twist with which this body really moves.
        length: length of the machine, m.
    """
    carriers = list(zip(masses, bodies, real_twists, strict=True))
    accelerations = [_acceleration(mass.point, body, twist) for mass, body, twist in carriers]
    forces = [gain * (mass.uncoupled * length) for mass, gain in zip(masses, accelerations, strict=True)]
    for first, second in pairs:
        coupled = (masses[first].mass - masses[first].uncoupled) * length
        forces[first] = forces[first] + accelerations[second] * coupled
        forces[second] = forces[second] + accelerations[first] * coupled
    wrenches = []
    for (mass, body, twist), force in zip(carriers, forces, strict=True):
        moment = mass.point.cross(force)
        if mass.tensor:
            spin_rate = mass.spin(body.change.rotational) + twist.rotational.cross(mass.spin(body.twist.rotational))
            moment = moment + spin_rate
        wrenches.append(Wrench(moment, force))
    return wrenches


def _demand_of(
    machine: RigidMachine,
    platform: Sequence[Wrench] = (),
    of_legs: Sequence[Sequence[Wrench]] | None = None,
    of_coordinates: Sequence[Row] | None = None,
) -> ForceDemand:
    """Add up what masses and coordinates ask for, from the platform back to the base.

    Args:
        machine: the machine.
        platform: wrenches that the platform asks for.
        of_legs: for each leg, the wrench that each of its masses asks for; none if None.
        of_coordinates: for each leg, the forces that its coordinates ask for; none if None.
    """
    rows, carried = [], []
    for number, leg in enumerate(machine.legs):
        wrenches = of_legs[number] if of_legs else ()
        beyond = [NO_WRENCH]
        row = list(of_coordinates[number]) if of_coordinates else [0.0] * len(leg.rates_by_twist)
        for motion in reversed(range(len(leg.screws))):
            load = beyond[0]
            for mass, wrench in zip(leg.masses, wrenches, strict=False):
                if mass.carried == motion + 1:
                    load = load + wrench
            place = leg.coordinates[motion]
            if place >= 0:
                row[place] = row[place] + load.work(leg.screws[motion])
            beyond.insert(0, load)
        rows.append(row)
        carried.append(tuple(beyond[:-1]))
    whole = NO_WRENCH
    for wrench in platform:
        whole = whole + wrench
    return ForceDemand(whole, tuple(rows), tuple(carried))


def inertia(machine: RigidMachine, motion: MachineMotion, real_motion: MachineMotion | None = None) -> ForceDemand:
    """Return the demand of masses and rotors along a motion, theory (90); arguments as of `rates.leg_motion`."""
    real_motion = real_motion or motion
    count, real_twist = len(machine.platform), real_motion.platform.twist
    platform = _accelerating_wrenches(
        machine.platform, (), [motion.platform] * count, [real_twist] * count, machine.length
    )
    of_legs, of_rotors = [], []
    for leg, leg_motion, real_leg_motion in zip(machine.legs, motion.legs, real_motion.legs, strict=True):
        bodies = [leg_motion.bodies[mass.carried] for mass in leg.masses]
        real_twists = [real_leg_motion.bodies[mass.carried].twist for mass in leg.masses]
        of_legs.append(_accelerating_wrenches(leg.masses, leg.pairs, bodies, real_twists, machine.length))
        rotors = [machine.drives[n].inertia * leg_motion.change[k] for k, n in enumerate(leg.drives, leg.passive)]
        of_rotors.append([0.0] * leg.passive + rotors)
    return _demand_of(machine, platform, of_legs, of_rotors)


def weight(machine: RigidMachine) -> ForceDemand:
    """Return the demand of the weight of all parts."""
    up = ZERO - machine.gravity
    platform, *of_legs = (
        [force_on(mass.mass, mass.point, up) for mass in masses]
        for masses in (machine.platform, *(leg.masses for leg in machine.legs))
    )
    return _demand_of(machine, platform, of_legs)


def process(machine: RigidMachine) -> ForceDemand:
    """Return the demand of the loads of the file on the platform."""
    return _demand_of(machine, [NO_WRENCH - machine.process])


def hinges(machine: RigidMachine) -> ForceDemand:
    """Return the demand of flexure hinges, which bend."""
    return _demand_of(machine, of_coordinates=[[*leg.springs, *(0.0 for _ in leg.drives)] for leg in machine.legs])


def friction(machine: RigidMachine, motion: MachineMotion) -> ForceDemand:
    """Return the demand of friction of joints and drives, theory (91); where nothing moves, Coulomb's is zero."""
    rows = [_leg_friction(machine, leg, moving) for leg, moving in zip(machine.legs, motion.legs, strict=True)]
    return _demand_of(machine, of_coordinates=rows)


def _leg_friction(machine: RigidMachine, leg: RigidLeg, motion: LegMotion) -> Row:
    """Return the forces of friction of a leg along its coordinates: of joints, of ball joints as a whole, of drives."""
    row: Row = [part.viscous * rate for part, rate in zip(leg.friction, motion.rates, strict=False)]
    in_balls = {place for ball in leg.balls for place in ball}
    for place, part in enumerate(leg.friction):
        if place not in in_balls and not is_zero(part.coulomb):
            row[place] = row[place] + part.coulomb * direction_of_motion(motion.rates[place])
    for ball in leg.balls:
        coulomb = leg.friction[ball[0]].coulomb
        if is_zero(coulomb):
            continue
        axes = [leg.screws[leg.coordinates.index(place)].rotational for place in ball]
        turning = ZERO
        for place, axis in zip(ball, axes, strict=True):
            turning = turning + axis * motion.rates[place]
        speed = turning.norm()
        share = where(speed > 0.0, 1.0 / where(speed > 0.0, speed, 1.0), 0.0)
        for place, axis in zip(ball, axes, strict=True):
            row[place] = row[place] + coulomb * (axis.dot(turning) * share)
    for place, number in enumerate(leg.drives, leg.passive):
        drive, rate = machine.drives[number], motion.rates[place]
        row.append(drive.viscous * rate + (drive.coulomb + drive.guide_friction) * direction_of_motion(rate))
    return row


def direction_of_motion(rate: Scalar) -> Scalar:
    """Return 1 for a joint that moves forward, -1 for one that moves back, 0 for one that stands still."""
    if is_zero(rate):
        return 0.0
    return where(rate > STANDSTILL_RATE, 1.0, where(rate < -STANDSTILL_RATE, -1.0, 0.0))


def demands(machine: RigidMachine, motion: MachineMotion) -> dict[str, ForceDemand]:
    """Return the demands of a motion, by part, see `PARTS`."""
    return {
        "weight": weight(machine),
        "inertia": inertia(machine, motion),
        "process": process(machine),
        "friction": friction(machine, motion),
        "springs": hinges(machine),
    }


@dataclass(frozen=True)
class DriveStatics:
    """The drives of a machine as they meet a demand, theory (92).

    Attributes:
        ways: twists that the legs allow; those of the axes where they allow all.
        inverse: forces of the drives by generalised forces along the ways [drives][ways].
        rates: rates of the drives by the ways [drives][ways].
    """

    ways: tuple[Row, ...]
    inverse: tuple[Row, ...]
    rates: tuple[Row, ...]


def drive_statics(machine: RigidMachine) -> DriveStatics:
    """Solve the statics of the drives; of more drives than ways, with the least energy in their springs."""
    ways = machine.ways or tuple(identity(SIZE))
    by_twist: list[Row] = [[] for _ in machine.drives]
    for leg in machine.legs:
        for place, number in enumerate(leg.drives, leg.passive):
            by_twist[number] = leg.rates_by_twist[place]
    rates = [[inner_product(row, way) for way in ways] if machine.ways else row for row in by_twist]
    weights = _stiffness_roots(machine)
    weighted_rates = [[rate * share for rate in row] for row, share in zip(rates, weights, strict=True)]
    solution, _, _ = right_inverse([list(row) for row in zip(*weighted_rates, strict=True)])
    inverse = [[entry * share for entry in row] for row, share in zip(solution, weights, strict=True)]
    return DriveStatics(ways, tuple(inverse), tuple(rates))


def _stiffness_roots(machine: RigidMachine) -> list[Scalar]:
    """Return roots of the drives' stiffness, by which more drives than ways share a load; alike if a drive is rigid."""
    stiffnesses = [drive.spring.stiffness for drive in machine.drives]
    if not machine.plan.overactuated or any(map(is_infinite, stiffnesses)):
        return [1.0] * len(stiffnesses)
    shrink = 1.0 / machine.length
    return [sqrt(k) if d.slides else sqrt(k) * shrink for k, d in zip(stiffnesses, machine.drives, strict=True)]


def along_ways(machine: RigidMachine, ways: Sequence[Row], demand: ForceDemand) -> Row:
    """Return generalised forces along some twists of the platform, with the legs following, theory (92)."""
    whole = list(demand.platform.components())
    for leg, row in zip(machine.legs, demand.legs, strict=True):
        for rates, force in zip(leg.rates_by_twist, row, strict=True):
            if not is_zero(force):
                whole = [a + b * force for a, b in zip(whole, rates, strict=True)]
    return [inner_product(way, whole) for way in ways]


def drive_forces(machine: RigidMachine, statics: DriveStatics, demand: ForceDemand) -> Row:
    """Return the forces of the drives, positive along their motion: N of slides, N times the length of turns."""
    forces = along_ways(machine, statics.ways, demand)
    return [inner_product(row, forces) for row in statics.inverse]


def leg_wrenches(machine: RigidMachine, demand: ForceDemand, forces: Sequence[Scalar]) -> list[Wrench]:
    """Return the wrench that the platform exerts on each leg, at the origin, theory (93).

    What legs carry among themselves, where they keep the platform from the same motion, is the least that balances it.

    Args:
        machine: the machine.
        demand: the sum of all demands.
        forces: forces of the drives.
    """
    leg_demands, imbalance = [], NO_WRENCH - demand.platform
    for leg, row in zip(machine.legs, demand.legs, strict=True):
        of_drives = [0.0] * leg.passive + [forces[number] for number in leg.drives]
        differences = [force - driving for force, driving in zip(row, of_drives, strict=True)]
        wrench = [
            total([rates[i] * force for rates, force in zip(leg.rates_by_twist, differences, strict=True)])
            for i in range(6)
        ]
        leg_demands.append(Wrench.of(wrench))
        imbalance = imbalance - leg_demands[-1]
    constraints = [row for leg in machine.legs for row in leg.constraints]
    if not constraints:
        return leg_demands
    amounts = iter(_constraint_amounts(machine, constraints, imbalance))
    result = []
    for leg, leg_wrench in zip(machine.legs, leg_demands, strict=True):
        for row in leg.constraints:
            leg_wrench = leg_wrench + Wrench.of(row) * next(amounts)
        result.append(leg_wrench)
    return result


def _constraint_amounts(machine: RigidMachine, constraints: Sequence[Row], imbalance: Wrench) -> Row:
    """Return the least amounts of the legs' constraint wrenches that balance the platform across its ways."""
    basis = complement(machine.ways)[0] if machine.ways else identity(SIZE)
    powers = [[inner_product(way, row) for row in constraints] for way in basis]
    solution, _, _ = right_inverse(powers)
    missing = [inner_product(way, imbalance.components()) for way in basis]
    return [inner_product(row, missing) for row in solution]
