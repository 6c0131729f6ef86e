"""Forces that move a rigid machine: those of its drives along a motion, part by part, and the loads of its joints.

Every mass asks for a force, its mass times its acceleration less its weight; virtual work takes these to the drives
(d'Alembert's principle). Over scalars; nothing here iterates, and nothing knows how drives are built (`drives` in
`studies`).

Source: theory (90)-(93). Units are those of `rigid`: forces in N, moments in N times the machine's length.
"""

from collections.abc import Sequence

from kinetostat.algebra.scalar import Scalar, is_infinite, is_zero, sqrt, total, where
from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.solve import Row, complement, right_inverse
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.frozen import dataclass
from kinetostat.motion.rates import LegMotion, MachineMotion, Moving
from kinetostat.motion.rigid import MassPoint, RigidLeg, RigidMachine

PARTS = ("weight", "inertia", "process", "friction", "springs")
"""Parts of what drives must do: against the weight of all parts, to accelerate masses and rotors, against the loads on
the platform, against friction of joints and drives, and against flexure hinges."""
NOTHING = Wrench(ZERO, ZERO)
STANDING = 1e-12
"""Rate of a joint, rad/s or in lengths of the machine per second, up to which it stands: round-off, not a motion."""


@dataclass(frozen=True)
class ForceDemand:
    """Forces that a machine asks for, along its platform's twist and the coordinates of its legs.

    Attributes:
        platform: the wrench along the platform's twist, at the origin.
        legs: generalised forces of each leg's coordinates.
        carried: for each leg, the wrench that what lies beyond each number of its motions asks for.
    """

    platform: Wrench
    legs: tuple[Row, ...]
    carried: tuple[tuple[Wrench, ...], ...]

    def __add__(self, other: "ForceDemand") -> "ForceDemand":
        rows = [[a + b for a, b in zip(*pair, strict=True)] for pair in zip(self.legs, other.legs, strict=True)]
        wrenches = zip(self.carried, other.carried, strict=True)
        beyond = tuple(tuple(a + b for a, b in zip(*pair, strict=True)) for pair in wrenches)
        return ForceDemand(self.platform + other.platform, tuple(rows), beyond)


def force_on(mass: Scalar, at: Vector, acceleration: Vector) -> Wrench:
    """The wrench at the origin that accelerates a mass at a point."""
    force = acceleration * mass
    return Wrench(at.cross(force), force)


def _acceleration(at: Vector, body: Moving, moving: Twist) -> Vector:
    """Acceleration of a point of a body, theory (88); `moving` is how the body really moves."""
    speed = moving.translational + moving.rotational.cross(at)
    return body.change.translational + body.change.rotational.cross(at) + body.twist.rotational.cross(speed)


def _inertial(
    masses: Sequence[MassPoint],
    pairs: Sequence[tuple[int, int]],
    bodies: Sequence[Moving],
    moving: Sequence[Twist],
    length: Scalar,
) -> list[Wrench]:
    """The wrench that accelerates each mass, theory (90); bodies are those that carry the masses."""
    gained = [_acceleration(m.point, body, way) for m, body, way in zip(masses, bodies, moving, strict=True)]
    momenta = [acceleration * (mass.uncoupled * length) for mass, acceleration in zip(masses, gained, strict=True)]
    for first, second in pairs:
        coupled = (masses[first].mass - masses[first].uncoupled) * length
        momenta[first] = momenta[first] + gained[second] * coupled
        momenta[second] = momenta[second] + gained[first] * coupled
    wrenches = []
    for mass, force, body, way in zip(masses, momenta, bodies, moving, strict=True):
        torque = mass.point.cross(force)
        if mass.tensor:
            spun = mass.spin(body.change.rotational) + way.rotational.cross(mass.spin(body.twist.rotational))
            torque = torque + spun
        wrenches.append(Wrench(torque, force))
    return wrenches


def _demand(
    machine: RigidMachine,
    platform: Sequence[Wrench],
    of_legs: Sequence[Sequence[Wrench]],
    further: Sequence[Row] | None = None,
) -> ForceDemand:
    """Add up the wrenches that masses ask for, from the platform back to the base; `further` acts on coordinates."""
    rows, carried = [], []
    for number, (leg, wrenches) in enumerate(zip(machine.legs, of_legs, strict=True)):
        beyond = [NOTHING]
        row = [0.0] * len(leg.rates_by_twist) if further is None else list(further[number])
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
    whole = NOTHING
    for wrench in platform:
        whole = whole + wrench
    return ForceDemand(whole, tuple(rows), tuple(carried))


def inertia(machine: RigidMachine, motion: MachineMotion, along: MachineMotion | None = None) -> ForceDemand:
    """The demand of masses and rotors along a motion, theory (90); `along` as in `rates.leg_motion`."""
    along = along or motion
    platform = _inertial(
        machine.platform,
        (),
        [motion.platform] * len(machine.platform),
        [along.platform.twist] * len(machine.platform),
        machine.length,
    )
    of_legs, rotors = [], []
    for leg, there, moving in zip(machine.legs, motion.legs, along.legs, strict=True):
        bodies = [there.bodies[mass.carried] for mass in leg.masses]
        ways = [moving.bodies[mass.carried].twist for mass in leg.masses]
        of_legs.append(_inertial(leg.masses, leg.pairs, bodies, ways, machine.length))
        spun = [machine.drives[n].inertia * there.change[place] for place, n in enumerate(leg.drives, leg.passive)]
        rotors.append([0.0] * leg.passive + spun)
    return _demand(machine, platform, of_legs, rotors)


def weight(machine: RigidMachine) -> ForceDemand:
    """The demand of the weight of all parts."""
    up = ZERO - machine.gravity
    platform = [force_on(mass.mass, mass.point, up) for mass in machine.platform]
    return _demand(machine, platform, [[force_on(m.mass, m.point, up) for m in leg.masses] for leg in machine.legs])


def process(machine: RigidMachine) -> ForceDemand:
    """The demand of the loads of the file on the platform."""
    return _demand(machine, [NOTHING - machine.process], [() for _ in machine.legs])


def hinges(machine: RigidMachine) -> ForceDemand:
    """The demand of flexure hinges, which bend."""
    rows = [[*leg.springs, *(0.0 for _ in leg.drives)] for leg in machine.legs]
    return _demand(machine, [], [() for _ in machine.legs], rows)


def friction(machine: RigidMachine, motion: MachineMotion) -> ForceDemand:
    """The demand of friction of joints and drives, theory (91): none of Coulomb's where nothing moves."""
    rows = [_leg_friction(machine, leg, moving) for leg, moving in zip(machine.legs, motion.legs, strict=True)]
    return _demand(machine, [], [() for _ in machine.legs], rows)


def _leg_friction(machine: RigidMachine, leg: RigidLeg, motion: LegMotion) -> Row:
    row: Row = []
    for part, rate in zip(leg.friction, motion.rates, strict=False):
        row.append(part.viscous * rate)
    in_balls = {place for ball in leg.balls for place in ball}
    for place, part in enumerate(leg.friction):
        if place not in in_balls and not is_zero(part.coulomb):
            row[place] = row[place] + part.coulomb * sense(motion.rates[place])
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
        row.append(drive.viscous * rate + (drive.coulomb + drive.guide_friction) * sense(rate))
    return row


def sense(rate: Scalar) -> Scalar:
    """1 of a joint that moves forward, -1 of one that moves back, 0 of one that stands: round-off has no friction."""
    if is_zero(rate):
        return 0.0
    return where(rate > STANDING, 1.0, where(rate < -STANDING, -1.0, 0.0))


def demands(machine: RigidMachine, motion: MachineMotion) -> dict[str, ForceDemand]:
    """The demands of a motion, by part, see `PARTS`."""
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
        rates: of the drives by the ways [drives][ways].
    """

    ways: tuple[Row, ...]
    inverse: tuple[Row, ...]
    rates: tuple[Row, ...]


def drive_statics(machine: RigidMachine) -> DriveStatics:
    """Solve the statics of the drives; of more drives than ways, those of least energy in their springs."""
    identity = [[1.0 if i == j else 0.0 for i in range(6)] for j in range(6)]
    ways = machine.ways or tuple(identity)
    by_twist: list[Row] = [[] for _ in machine.drives]
    for leg in machine.legs:
        for place, number in enumerate(leg.drives, leg.passive):
            by_twist[number] = leg.rates_by_twist[place]
    rates = [
        [total([a * b for a, b in zip(row, way, strict=True)]) for way in ways] if machine.ways else row
        for row in by_twist
    ]
    weights = _weights(machine)
    scaled = [[rate * share for rate in row] for row, share in zip(rates, weights, strict=True)]
    solution, _, _ = right_inverse([list(row) for row in zip(*scaled, strict=True)])
    inverse = [[entry * share for entry in row] for row, share in zip(solution, weights, strict=True)]
    return DriveStatics(ways, tuple(inverse), tuple(rates))


def _weights(machine: RigidMachine) -> list[Scalar]:
    """Roots of the drives' stiffness, by which more drives than ways share a load; alike where a drive is rigid."""
    springs = [drive.spring for drive in machine.drives]
    stiff = [s.stiffness for s in springs]
    if not machine.plan.overactuated or any(map(is_infinite, stiff)):
        return [1.0] * len(springs)
    shrink = 1.0 / machine.length
    return [sqrt(k) if d.slides else sqrt(k) * shrink for k, d in zip(stiff, machine.drives, strict=True)]


def along_ways(machine: RigidMachine, ways: Sequence[Row], demand: ForceDemand) -> Row:
    """Generalised forces along some twists of the platform, with the legs following, theory (92)."""
    whole = list(demand.platform.components())
    for leg, row in zip(machine.legs, demand.legs, strict=True):
        for solved, force in zip(leg.rates_by_twist, row, strict=True):
            if not is_zero(force):
                whole = [a + b * force for a, b in zip(whole, solved, strict=True)]
    return [total([a * b for a, b in zip(way, whole, strict=True)]) for way in ways]


def drive_forces(machine: RigidMachine, statics: DriveStatics, demand: ForceDemand) -> Row:
    """Forces of the drives, positive along their motion: N of slides, N times the length of turns."""
    forces = along_ways(machine, statics.ways, demand)
    return [total([a * b for a, b in zip(row, forces, strict=True)]) for row in statics.inverse]


def leg_wrenches(machine: RigidMachine, demand: ForceDemand, forces: Sequence[Scalar]) -> list[Wrench]:
    """The wrench that the platform exerts on each leg, at the origin, theory (93).

    What legs carry among themselves, where they keep the platform from the same motion, is the least that balances it.

    Args:
        machine: the machine.
        demand: all that is asked for.
        forces: of the drives.
    """
    inner, left = [], NOTHING - demand.platform
    for leg, row in zip(machine.legs, demand.legs, strict=True):
        driving = [0.0] * leg.passive + [forces[number] for number in leg.drives]
        parts = [force - given for force, given in zip(row, driving, strict=True)]
        balance = [
            total([solved[i] * part for solved, part in zip(leg.rates_by_twist, parts, strict=True)]) for i in range(6)
        ]
        inner.append(Wrench(Vector(*balance[:3]), Vector(*balance[3:])))
        left = left - inner[-1]
    constraints = [row for leg in machine.legs for row in leg.constraints]
    if not constraints:
        return inner
    basis = [[1.0 if i == j else 0.0 for i in range(6)] for j in range(6)]
    if machine.ways:
        basis = complement(machine.ways)[0]
    powers = [[total([a * b for a, b in zip(way, row, strict=True)]) for row in constraints] for way in basis]
    solution, _, _ = right_inverse(powers)
    missing = [total([a * b for a, b in zip(way, left.components(), strict=True)]) for way in basis]
    amounts = iter([total([a * b for a, b in zip(row, missing, strict=True)]) for row in solution])
    result = []
    for leg, wrench in zip(machine.legs, inner, strict=True):
        for row in leg.constraints:
            amount = next(amounts)
            wrench = wrench + Wrench(Vector(*row[:3]), Vector(*row[3:])) * amount
        result.append(wrench)
    return result
