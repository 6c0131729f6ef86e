"""A machine as a mechanism that can move far: coordinates of its joints and springs, its masses, and its loads.

The free state is the machine at its pose with relaxed springs; all coordinates are zero there. Each leg is a row of
screw motions from base to platform (a product of exponentials). Nothing is solved here.

Everything is made comparable: lengths are in units of the machine's length, forces in units of a typical stiffness
times it. Arrays have the poses first [n]. The origin is the tool point of the free state; axes are those of the base.

Source: theory (35).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from kinetostat.algebra.scalar import Scalar, is_zero
from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.motion import Array, exponential
from kinetostat.kinematics.closing import stacked
from kinetostat.kinematics.closure import Joints
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Load, Machine
from kinetostat.machine.mass import located_members
from kinetostat.tolerances import DEPENDENT

SIGNS = {"": 0.0, "pulls": 1.0, "pushes": -1.0}
"""Sign of the loads that a spring carries if it carries those of one sign only, by what its file says."""


@dataclass(frozen=True)
class Masses:
    """Point masses that move with a body.

    Attributes:
        carried: how many of the leg's screw motions carry each [m]; not used of the platform.
        point: where they are in the free state [n x m x 3].
        mass: in units of force per m/s² [n x m].
    """

    carried: tuple[int, ...]
    point: Array
    mass: Array


@dataclass(frozen=True)
class Chain:
    """A leg as a row of screw motions.

    Attributes:
        name: of the leg.
        twists: unit twist of each motion in the free state [n x motions x 6].
        coordinate: which coordinate of the leg each motion follows [motions]; -1 where an actuator drives it.
        actuator: which actuator of the machine drives each motion [motions]; -1 where a coordinate does.
        springs: the spring of each coordinate [coordinates]; None of a passive one.
        stiffness: of each coordinate, 0 of a passive one [n x coordinates].
        preload: what each carries where it is zero [n x coordinates].
        sign: of the loads that it can carry, 0 for both [coordinates].
        idle: a basis of motions of the passive coordinates that move nothing [n x coordinates x coordinates], with
            columns of zeros.
        masses: that it carries.
    """

    name: str
    twists: Array
    coordinate: tuple[int, ...]
    actuator: tuple[int, ...]
    springs: tuple[Spring | None, ...]
    stiffness: Array
    preload: Array
    sign: Array
    idle: Array
    masses: Masses

    @property
    def size(self) -> int:
        """How many coordinates it has."""
        return len(self.springs)

    def follows(self, which: tuple[int, ...], count: int) -> Array:
        """1 where a motion follows a coordinate, or an actuator [motions x count]; 0 elsewhere.

        Args:
            which: `coordinate` or `actuator`.
            count: how many there are.
        """
        return (np.array(which, dtype=int)[:, None] == np.arange(count)).astype(float)


@dataclass(frozen=True)
class Mechanism:
    """A machine at n poses, in units of its own.

    Attributes:
        legs: of it.
        actuators: names of the actuators that can be driven, in the order of the legs.
        platform: masses of platform, tool and payload.
        wrench: moment and force at the tool point, base axes [n x 6].
        gravity: [n x 3].
        ways: orthonormal twists that exist, as columns [6 x 6, or 6 x 3 of a planar machine].
        length: m [n].
        force: unit of force, N [n].
        weighs: whether any mass is known.
    """

    legs: tuple[Chain, ...]
    actuators: tuple[str, ...]
    platform: Masses
    wrench: Array
    gravity: Array
    ways: Array
    length: Array
    force: Array
    weighs: bool

    def taken(self, rows: npt.NDArray[np.int64]) -> "Mechanism":
        """The mechanism at some of its poses [rows]."""
        return replace(
            self,
            legs=tuple(_taken(leg, rows) for leg in self.legs),
            platform=replace(self.platform, point=self.platform.point[rows], mass=self.platform.mass[rows]),
            wrench=self.wrench[rows],
            gravity=self.gravity[rows],
            length=self.length[rows],
            force=self.force[rows],
        )

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


def _taken(leg: Chain, rows: npt.NDArray[np.int64]) -> Chain:
    masses = replace(leg.masses, point=leg.masses.point[rows], mass=leg.masses.mass[rows])
    parts = {name: getattr(leg, name)[rows] for name in ("twists", "stiffness", "preload", "idle")}
    return replace(leg, masses=masses, **parts)


def mechanism_of(machine: Machine, response: Response, joints: Joints | None, count: int = 1) -> Mechanism:
    """The mechanism of a machine at its pose, or at n poses.

    Args:
        machine: with its pose, or columns of n poses.
        response: of it.
        joints: coordinates that close its legs, if it is written leg by leg.
        count: of poses, n.
    """
    configuration, origin = response.configuration, response.reference
    length = stacked([configuration.length], count)[:, 0]
    known = [_linear(spring, configuration.length) for leg in configuration.legs for spring in leg.springs]
    typical = _typical(stacked(known, count)) if known else np.ones(count)
    force = typical * length
    units = _Units(origin, length, force, count)
    members = located_members(machine, configuration, None if joints is None else joints.coordinates)
    actuators: list[Spring] = []
    legs = []
    for leg in configuration.legs:
        here = [m for m in members if m.leg == leg.name or (not m.leg and leg.number is None)]
        # The potential of a straight uniform link is that of half its mass at either end.
        halves = [(carried, p, 0.5 * m.length * m.linear_density) for m in here if m.ends for carried, p in m.ends()]
        legs.append(_chain(leg, units, actuators, halves))
    platform = configuration.platform
    tool = machine.tables["tool"]
    centres = [
        platform.apply(Vector(*tool.centre_of_mass)),
        response.reference + platform.rotation.apply(Vector(*tool.payload_centre)),
    ]
    pairs = zip(centres, (tool.mass, tool.payload), strict=True)
    weights = [(0, point, mass) for point, mass in pairs if not is_zero(mass)]
    load = machine.tables["load"]
    wrench = stacked([*load.moment, *load.force], count) / _wrench_units(length, force)
    ways = np.eye(6)
    if configuration.plane is not None:
        turn, *slides = (np.array(joint.axis.components(), dtype=float) for joint in configuration.plane.freedoms)
        ways = np.column_stack([[*turn, 0.0, 0.0, 0.0], *([0.0, 0.0, 0.0, *axis] for axis in slides)])
    return Mechanism(
        tuple(legs),
        tuple(spring.joint.name or spring.of for spring in actuators),
        units.masses(weights),
        wrench,
        _gravity(load, count),
        ways,
        length,
        force,
        bool(weights) or any(leg.masses.carried for leg in legs),
    )


def _gravity(load: Load, count: int) -> Array:
    """Acceleration by gravity, turned as the machine is tilted, m/s² [n x 3]."""
    axis = stacked(load.gravity_axis, count)
    sizes = np.linalg.norm(axis, axis=1, keepdims=True)
    turn = axis / np.where(sizes > 0.0, sizes, 1.0) * stacked([load.gravity_angle], count)
    return exponential(np.concatenate([turn, np.zeros_like(turn)], axis=1)).point(stacked(load.gravity, count))


@dataclass(frozen=True)
class _Units:
    """What lengths and forces are counted in, and where from."""

    origin: Vector
    length: Array
    force: Array
    count: int

    def twist(self, joint: Joint, rate: Scalar = 1.0) -> Array:
        """Unit twist of a joint at the origin, times a rate [n x 6]; a slide by one unit of length."""
        components = stacked(joint.twist(self.origin).components(), self.count) * stacked([rate], self.count)
        if joint.point is not None:
            components[:, 3:] /= self.length[:, None]
        return components

    def points(self, points: Sequence[Vector]) -> Array:
        """Points [n x m x 3]."""
        rows = [stacked((point - self.origin).components(), self.count) / self.length[:, None] for point in points]
        return np.stack(rows, axis=1) if rows else np.zeros((self.count, 0, 3))

    def masses(self, given: Sequence[tuple[int, Vector, Scalar]]) -> Masses:
        """Masses in units of force per m/s²: how many motions carry each, where it is, kg."""
        mass = stacked([m for _, _, m in given], self.count) / self.force[:, None]
        return Masses(tuple(n for n, _, _ in given), self.points([point for _, point, _ in given]), mass)

    def stiffness(self, spring: Spring) -> Array:
        """Of a spring [n]."""
        unit = self.force / self.length if spring.joint.point is None else self.force * self.length
        return stacked([spring.stiffness], self.count)[:, 0] / unit

    def load(self, spring: Spring, load: Scalar) -> Array:
        """In a spring [n]."""
        unit = self.force if spring.joint.point is None else self.force * self.length
        return stacked([load], self.count)[:, 0] / unit


def _linear(spring: Spring, length: Scalar) -> Scalar:
    """The stiffness of a spring as that of a slide, N/m."""
    return spring.stiffness if spring.joint.point is None else spring.stiffness * (1.0 / (length * length))


def _typical(stiffness: Array) -> Array:
    """The geometric mean of those that are finite and not zero [n]."""
    usable = np.isfinite(stiffness) & (stiffness > 0.0)
    logs = np.log(np.where(usable, stiffness, 1.0)).sum(axis=1)
    return np.asarray(np.exp(logs / np.maximum(usable.sum(axis=1), 1)))


def _chain(
    leg: Leg,
    units: _Units,
    actuators: list[Spring],
    weights: Sequence[tuple[int, Vector, Scalar]],
) -> Chain:
    twists: list[Array] = []
    coordinate: list[int] = []
    actuator: list[int] = []
    springs: list[Spring | None] = []
    stiffness, preload = [], []
    before = [0]
    nothing = np.zeros(units.count)

    def moves(row: Array, by: int, driven: int = -1) -> None:
        twists.append(row)
        coordinate.append(by)
        actuator.append(driven)

    def free(rows: Iterable[Array]) -> None:
        for row in rows:
            moves(row, len(springs))
        springs.append(None)
        stiffness.append(nothing)
        preload.append(nothing)

    for element in leg.chain:
        for rows in _passive(element, units):
            free(rows)
        for spring in element.springs:
            row = units.twist(spring.joint)
            if spring.actuated and not is_zero(spring.stiffness):
                moves(row, -1, len(actuators))
                actuators.append(spring)
            if is_zero(spring.stiffness):
                free([row])
            elif not (isinstance(spring.stiffness, float) and np.isinf(spring.stiffness)):
                moves(row, len(springs))
                springs.append(spring)
                stiffness.append(units.stiffness(spring))
                preload.append(units.load(spring, spring.preload))
        before.append(len(twists))
    return Chain(
        leg.name,
        np.stack(twists, axis=1) if twists else np.zeros((units.count, 0, 6)),
        tuple(coordinate),
        tuple(actuator),
        tuple(springs),
        np.stack(stiffness, axis=1) if stiffness else np.zeros((units.count, 0)),
        np.stack(preload, axis=1) if preload else np.zeros((units.count, 0)),
        np.array([SIGNS[spring.acts] if spring else 0.0 for spring in springs]),
        _idle(twists, coordinate, springs, units.count),
        units.masses([(before[carried], point, mass) for carried, point, mass in weights]),
    )


def _passive(element: Element, units: _Units) -> Iterator[list[Array]]:
    """The motions of each passive coordinate of an element: one; two of a parallelogram, which turns there and back."""
    if isinstance(element, Parallelogram):
        rate = 1.0 / (element.far - element.near).norm() * units.length
        near, far = (Joint(element.normal, point) for point in (element.near, element.far))
        yield [units.twist(near, rate), -units.twist(far, rate)]
        return
    for joint in element.freedoms:
        yield [units.twist(joint)]


def _idle(twists: Sequence[Array], coordinate: Sequence[int], springs: Sequence[Spring | None], count: int) -> Array:
    """Motions of the passive coordinates that leave the leg's end where it is, to first order [n x c x c]."""
    passive = [i for i, spring in enumerate(springs) if spring is None]
    result = np.zeros((count, len(springs), len(springs)))
    if not passive:
        return result
    columns = np.stack(
        [sum((t for t, c in zip(twists, coordinate, strict=True) if c == i), np.zeros((count, 6))) for i in passive],
        axis=2,
    )
    columns = np.where(np.isfinite(columns), columns, 0.0)  # where a pose has no place, nothing is idle
    _, sizes, rows = np.linalg.svd(columns, full_matrices=True)
    weights = np.zeros((count, len(passive)))
    weights[:, : sizes.shape[1]] = sizes
    kept = rows * (weights < DEPENDENT)[:, :, None]
    result[:, passive, : len(passive)] = np.swapaxes(kept, 1, 2)
    return result
