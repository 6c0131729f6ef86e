"""The numbers of a machine that may be wrong: places of joints on their links, zeros and gains, shared sizes.

A leg is a row of motions from the base to the platform. An error is a small screw motion that is inserted between two
of them: before a joint it moves or tilts this joint on its link, and behind the last joint it moves the platform on the
leg. Errors that a passive joint takes up by its own freedom are left out, and so are those that no motion of the leg
can tell from the errors before them. Thus a strut between two balls keeps both centres and its zero, and a leg in
general 4 numbers for each revolute, 2 for each slide and 6 for its end.

A number that several legs share, such as the base radius of a family, is a combination of errors of these legs. Where
it changes, joints lie elsewhere at the home place and actuators count from elsewhere; the rates of both make one error,
which is exact for what enters linearly.

Source: theory (45) and (49).
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from kinetostat.accuracy.closing import Screws, at_points, free_screws, in_lengths, independent_columns
from kinetostat.accuracy.rows import ActuatorReading, HomeRows, LegRow, Unit, home_rows, random_coordinates
from kinetostat.algebra.vector import AXES, ZERO, Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.leg import Joint
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.numerics.motions import Motions, logarithm
from kinetostat.tolerances import NO_LINK, PARALLEL_AXES, SEEN_BY_LEG

SHARED_STEP = 1e-5
"""Step of central differences, rad or in units of the machine's length: their error is its square, 1e-10, and round-off
adds about 1e-16 over the step."""
SHARED_KINDS = ("length", "angle")
"""Kinds of the numbers of a family that are shared errors."""
SHARED_TABLE = "geometry."
"""Beginning of the paths of numbers of a family that are shared errors."""
ZEROS, BASE, PLATFORM, LENGTHS, LINKS, TILTS, OFFSETS = range(7)
"""Ranks of errors: where only some of them can be told apart, those of the lower ranks are listed. What people measure
and set comes first."""


@dataclass(frozen=True)
class MachineError:
    """A number of the machine as built that may differ from the drawn one.

    Attributes:
        path: "legs.leg 1.base joint.x", "legs.leg 1.actuator.zero"; or the field of a family that many legs share.
        kind: kind of its quantity: "length", "angle" or "share".
        group: "geometry", "zeros", "gains", "clearances", "compliances" or "shared".
        words: its name for people, "position of the base joint of leg 1 on the base along x".
        leg: name of its leg; empty if several legs share the number.
    """

    path: str
    kind: str
    group: str
    words: str
    leg: str


@dataclass(frozen=True, eq=False)
class Insertion:
    """A small screw motion that an error puts into a leg.

    Attributes:
        leg: number of the leg.
        behind: number of the leg's motions that come before it.
        twist: the screw motion per unit of the error, in home place [6].
        factor: function that computes the factor of the twist [n] at coordinates of the leg [n x coordinates]; None
            if the factor is 1.
    """

    leg: int
    behind: int
    twist: Array
    factor: Callable[[Array], Array] | None = None

    def amount(self, coordinates: Array) -> Array:
        """Return the factor of the twist [n] at coordinates of the leg [n x coordinates]."""
        return np.ones(len(coordinates)) if self.factor is None else self.factor(coordinates)


class ErrorSource(NamedTuple):
    """An error and the screw motions that it puts into the legs."""

    error: MachineError
    insertions: tuple[Insertion, ...]


def leg_error_sources(rows: HomeRows) -> list[ErrorSource]:
    """List the errors of all legs that their own motions can tell apart, leg by leg.

    Args:
        rows: the machine at its home place.
    """
    sources: list[ErrorSource] = []
    for number, row in enumerate(rows.legs):
        by_rank = sorted(_candidates(number, row, rows), key=lambda candidate: candidate[0])
        sources += _independent_sources(row, rows, [source for _, source in by_rank])
        sources += _moving_sources(row, rows, list(_clearances(number, row)))[0]
    return sources


def effects(
    row: LegRow, rows: HomeRows, insertions_of_errors: Sequence[Sequence[Insertion]], coordinates: Array
) -> Array:
    """Return the work of the leg's wrenches on its errors at random coordinates [samples * wrenches x errors]."""
    placed = row.chain.place(coordinates)
    platform_point = placed.end.point(np.broadcast_to(rows.point, (len(coordinates), 3)))
    screws = free_screws(row, rows, placed, platform_point)
    wrenches = Screws(screws, independent_columns(screws)).wrenches
    columns = []
    for insertions in insertions_of_errors:
        twists = sum(
            placed.before[insertion.behind].twist(np.broadcast_to(insertion.twist, (len(coordinates), 6)))
            * insertion.amount(coordinates)[:, None]
            for insertion in insertions
        )
        displacements = in_lengths(at_points(np.asarray(twists), platform_point), rows.length)
        columns.append(np.einsum("nim,ni->nm", wrenches, displacements).ravel())
    return np.stack(columns, axis=1) if columns else np.zeros((0, 0))


def _moving_sources(row: LegRow, rows: HomeRows, sources: Sequence[ErrorSource]) -> tuple[list[ErrorSource], Array]:
    """Return the errors that move the platform at any of the random coordinates, and their `effects`."""
    columns = effects(row, rows, [source.insertions for source in sources], random_coordinates(row, rows.length))
    moving = np.flatnonzero(np.linalg.norm(columns, axis=0) > SEEN_BY_LEG / rows.length)
    return [sources[int(number)] for number in moving], columns[:, moving]


def _independent_sources(row: LegRow, rows: HomeRows, sources: Sequence[ErrorSource]) -> list[ErrorSource]:
    """Return the errors whose effects do not follow from the effects of those before them, in the order of the leg."""
    moving, columns = _moving_sources(row, rows, sources)
    independent = [moving[number] for number in independent_columns(columns[None])]
    return sorted(independent, key=lambda source: source.insertions[0].behind)


def _candidates(number: int, row: LegRow, rows: HomeRows) -> Iterator[tuple[int, ErrorSource]]:
    """Generate every error that the joints and the end of a leg may have, each with its rank."""
    last_point: Vector | None = None
    for place, unit in enumerate(row.units):
        joint = _JointErrors(number, row.name, unit)
        if unit.drive:
            yield from _with_rank(ZEROS, joint.drive(row, unit.drive))
        if place == 0:
            yield from _with_rank(BASE, joint.shifts("on the base"))
        else:
            yield from _errors_of_link(joint, row.units[place - 1].name, last_point, NO_LINK * rows.length)
        point = unit.point or last_point or ZERO
        if unit.kind != "ball":
            yield from _with_rank(TILTS, joint.tilts(point))
        if unit.kind == "universal":
            yield from _with_rank(OFFSETS, joint.between_axes(point))
        if unit.bars:
            yield from _with_rank(LENGTHS, joint.bars(unit.bars, row.coordinate[unit.first]))
        last_point = unit.point or last_point
    axes = [Vector(*column) for column in rows.rotation.T.tolist()]
    last_joint, end = _JointErrors(number, row.name, row.units[-1]), len(row.twists)
    for name, axis in zip("xyz", axes, strict=True):
        yield PLATFORM, last_joint.platform_shift(name, axis, end)
        yield TILTS, last_joint.platform_tilt(name, axis, last_point or Vector(*rows.point.tolist()), end)


def _errors_of_link(
    joint: "_JointErrors", joint_before: str, last_point: Vector | None, no_link: float
) -> Iterator[tuple[int, ErrorSource]]:
    """Generate the errors of where a joint lies on the link from the one before it, each with its rank.

    The link begins at the last point, the last centre of a joint; up to a distance of `no_link`, m, there is no link.
    """
    point = joint.unit.point
    if point is None or last_point is None:
        yield from _with_rank(LINKS, joint.shifts("on its link"))
    elif (span := point - last_point).norm() > no_link:
        along = span * (1.0 / span.norm())
        yield LENGTHS, joint.length(along, joint_before)
        yield from _with_rank(LINKS, joint.shifts("on its link", along))
    elif joint.unit.kind != "ball":
        yield from _with_rank(OFFSETS, joint.shifts("on its link"))


def _with_rank(rank: int, sources: Iterable[ErrorSource]) -> Iterator[tuple[int, ErrorSource]]:
    return ((rank, source) for source in sources)


def _clearances(number: int, row: LegRow) -> Iterator[ErrorSource]:
    """Generate the clearances of the passive joints of a leg, one for each direction in which a joint holds."""
    for unit in row.units:
        if unit.drive or unit.bars:
            continue
        joint = _JointErrors(number, row.name, unit)
        for name, axis in _named_directions(unit.axes[0] if unit.kind == "slide" else None):
            yield joint.clearance(name, axis)


def _named_directions(axis: Vector | None) -> list[tuple[str, Vector]]:
    """Name the base axes or, for an axis, two directions across it: two base axes if possible, else u (level) and v."""
    if axis is None:
        return list(zip("xyz", AXES, strict=True))
    level = [pair for pair in zip("xyz", AXES, strict=True) if abs(pair[1].dot(axis)) < PARALLEL_AXES]
    if len(level) == 2:
        return level
    across = AXES[2].cross(axis)
    u = across * (1.0 / across.norm())
    return [("u", u), ("v", axis.cross(u))]


def _direction(axis: Vector) -> str:
    """Return the name of a base axis, or the components of another direction."""
    for name, base in zip("xyz", AXES, strict=True):
        if abs(axis.dot(base)) > 1.0 - PARALLEL_AXES:  # by the cosine: up to an angle of 1e-6, for words
            return name
    return "(" + ", ".join(f"{float(c) + 0.0:.2f}" for c in axis.components()) + ")"


def _slide(axis: Vector) -> Array:
    """Return the screw of a unit displacement along an axis [6]."""
    return np.array(Joint(axis).twist(ZERO).components(), dtype=float)


def _turn(axis: Vector, point: Vector) -> Array:
    """Return the screw of a unit rotation about an axis through a point [6]."""
    return np.array(Joint(axis, point).twist(ZERO).components(), dtype=float)


@dataclass(frozen=True)
class _JointErrors:
    """The errors of one joint of a leg, each with its words and the screw motion that it puts into the leg.

    Attributes:
        number: number of the leg.
        leg: name of the leg.
        unit: the joint.
    """

    number: int
    leg: str
    unit: Unit

    @property
    def title(self) -> str:
        """The joint with its leg."""
        return f"{self.unit.name} of {self._of}"

    @property
    def _of(self) -> str:
        return self.leg if "leg" in self.leg else f'leg "{self.leg}"'

    def shifts(self, where: str, along: Vector | None = None) -> Iterator[ErrorSource]:
        """Generate the errors of a joint that lies elsewhere on the base or on its link; none along the link."""
        for name, axis in _named_directions(along):
            words = f"position of the {self.title} {where} along {_direction(axis)}"
            yield self._source(name, "length", words, _slide(axis))

    def platform_shift(self, name: str, axis: Vector, end: int) -> ErrorSource:
        """Return the error of the last joint that lies elsewhere on the platform, which is so much behind."""
        words = f"position of the {self.title} on the platform along {_direction(axis)}"
        return self._source(f"platform.{name}", "length", words, _slide(-axis), end)

    def length(self, along: Vector, before: str) -> ErrorSource:
        """Return the error of a link that is longer."""
        words = f"length of {self._of} from its {before} to its {self.unit.name}"
        return self._source("length", "length", words, _slide(along))

    def tilts(self, point: Vector) -> Iterator[ErrorSource]:
        """Generate the errors of a joint whose axes are turned on the link before it; none about its own first axis."""
        part, own_axis = ("axis", self.unit.axes[0]) if self.unit.bars is None else ("near side", None)
        for name, axis in _named_directions(own_axis):
            words = f"direction of the {part} of the {self.title} about {_direction(axis)}"
            yield self._source(f"r{name}", "angle", words, _turn(axis, point))

    def platform_tilt(self, name: str, axis: Vector, point: Vector, end: int) -> ErrorSource:
        """Return the error of the last joint that is turned on the platform, behind all motions of the leg."""
        words = f"direction of the {self.title} on the platform about {_direction(axis)}"
        return self._source(f"platform.r{name}", "angle", words, -_turn(axis, point), end)

    def between_axes(self, point: Vector) -> Iterator[ErrorSource]:
        """Generate the errors of a universal joint whose axes are not perpendicular or do not meet."""
        normal = self.unit.axes[0].cross(self.unit.axes[1])
        normal, behind = normal * (1.0 / normal.norm()), self.unit.first + 1
        words = f"angle between the axes of the {self.title}"
        yield self._source("skew", "angle", words, _turn(normal, point), behind)
        words = f"distance between the axes of the {self.title}"
        yield self._source("offset", "length", words, _slide(normal), behind)

    def bars(self, bars: Parallelogram, coordinate: int) -> Iterator[ErrorSource]:
        """Generate the errors of bars that are both longer, or longer on one side than on the other."""
        along, span = bars.along, float((bars.far - bars.near).norm())
        cosine, sine = float(bars.side.dot(along)), float(bars.normal.dot(bars.side.cross(along)))

        def rotation_per_difference(coordinates: Array) -> Array:
            """Return the width over the distance of the bars [n]: close bars turn the far side more."""
            angle = coordinates[:, coordinate] / span
            return np.asarray(1.0 / (sine * np.cos(angle) + cosine * np.sin(angle)))

        behind = self.unit.first + 1
        words = f"length of both bars of the {self.title}"
        yield self._source("length", "length", words, _slide(along), behind)
        words = f"length of the bar of the {self.title} at +side less that at -side"
        twist = _turn(bars.normal, bars.far) / float(bars.width)
        yield self._source("difference", "length", words, twist, behind, rotation_per_difference)

    def drive(self, row: LegRow, drive: ActuatorReading) -> Iterator[ErrorSource]:
        """Generate zero and gain of the joint's actuator."""

        def actuator_coordinate(coordinates: Array) -> Array:
            return np.asarray(drive.home + drive.sense * coordinates[:, drive.coordinate])

        twist = row.twists[self.unit.first] * drive.sense
        kind = "length" if drive.slides else "angle"
        yield self._source("zero", kind, f"zero of the {self.title}", twist, group="zeros")
        words = f"gain of the {self.title}"
        yield self._source("gain", "share", words, twist, factor=actuator_coordinate, group="gains")

    def clearance(self, name: str, axis: Vector) -> ErrorSource:
        """Return the error of a joint that is free to move a little where it should hold."""
        words = f"clearance of the {self.title} along {_direction(axis)}"
        return self._source(f"clearance.{name}", "length", words, _slide(axis), group="clearances")

    def _source(
        self,
        name: str,
        kind: str,
        words: str,
        twist: Array,
        behind: int | None = None,
        factor: Callable[[Array], Array] | None = None,
        group: str = "geometry",
    ) -> ErrorSource:
        """Return an error of this joint; it acts before the joint if `behind` is None, see `Insertion`."""
        path = f"legs.{self.leg}.{self.unit.name}.{name}"
        error = MachineError(path=path, kind=kind, group=group, words=words, leg=self.leg)
        insertion = Insertion(self.number, self.unit.first if behind is None else behind, twist, factor)
        return ErrorSource(error, (insertion,))


def shared_error_sources(machine: Machine, rows: HomeRows) -> list[ErrorSource]:
    """List the lengths and angles of the table [geometry] of a family; none of a machine written leg by leg.

    Args:
        machine: the machine with numbers.
        rows: the machine at its home place.
    """
    if machine.family.chains:
        return []
    nominal, sources = values(machine), []
    fields = {leaf: p for p in parameters(machine.family) if p.path.startswith(SHARED_TABLE) for leaf in p.leaves}
    for path, field in fields.items():
        kind = field.quantity.kind
        if kind not in SHARED_KINDS:
            continue
        step = SHARED_STEP * (rows.length if kind == "length" else 1.0)
        more, less = (home_rows(with_values(machine, {path: float(nominal[path]) + s * step})) for s in (1.0, -1.0))
        insertions = tuple(_shared_insertions(rows, more, less, 2.0 * step))
        if insertions and all(np.isfinite(insertion.twist).all() for insertion in insertions):
            error = MachineError(path=path, kind=kind, group="shared", words=field.quantity.meaning, leg="")
            sources.append(ErrorSource(error, insertions))
    return sources


def _shared_insertions(rows: HomeRows, more: HomeRows, less: HomeRows, step: float) -> Iterator[Insertion]:
    """Generate the motions of joints and zeros per unit of a number; `step` lies between the two other machines."""
    home = Motions(more.rotation[None], more.point[None]) @ Motions(less.rotation[None], less.point[None]).inverse()
    platform = logarithm(home)[0] / step
    for number, (row, more_row, less_row) in enumerate(zip(rows.legs, more.legs, less.legs, strict=True)):
        for unit, more_unit, less_unit in zip(row.units, more_row.units, less_row.units, strict=True):
            for motion in range(unit.first, unit.last):
                twist = _axis_motion(motion, unit, more_unit, less_unit) / step
                if twist.any():
                    yield Insertion(number, motion, twist)
                    yield Insertion(number, motion + 1, -twist)  # only the axis lies elsewhere, not what follows it
            if unit.drive and more_unit.drive and less_unit.drive and more_unit.drive.home != less_unit.drive.home:
                rate = unit.drive.sense * (less_unit.drive.home - more_unit.drive.home) / step
                yield Insertion(number, unit.first, row.twists[unit.first] * rate)
        if platform.any():
            yield Insertion(number, len(row.twists), platform)


def _axis_motion(motion: int, unit: Unit, more: Unit, less: Unit) -> Array:
    """Return the screw motion that takes the axis of a motion from one place to another [6].

    Args:
        motion: number of the motion in the leg.
        unit, more, less: its joint as drawn, with more, and with less of a number.
    """
    place = motion - unit.first
    axis = 0 if unit.bars else place  # both motions of a parallelogram have its one normal
    turning = less.axes[axis].cross(more.axes[axis])
    point, more_point, less_point = (
        joint.bars.far if joint.bars and place else joint.point for joint in (unit, more, less)
    )
    if point is None or more_point is None or less_point is None or unit.kind == "slide":
        return np.array([*turning.components(), 0.0, 0.0, 0.0], dtype=float)
    shift = point.cross(turning) + more_point - less_point
    return np.array([*turning.components(), *shift.components()], dtype=float)


@dataclass(frozen=True)
class FlexibleSpring:
    """Motion of the tool at n poses by the compliance of a spring.

    Attributes:
        twist: twist of the tool per unit of the deformation, at the tool point, base axes, SI [n x 6].
        compliance: compliance of the spring, m/N or rad/(N·m) [n].
    """

    twist: Array
    compliance: Array

    def deflection(self, wrenches: Array) -> Array:
        """Return the twist of the tool by its deformation under wrenches at the tool point [n x 6], SI [n x 6]."""
        load = np.einsum("ni,ni->n", self.twist, wrenches)
        return np.asarray(self.twist * (self.compliance * load)[:, None])


def flexible_springs(response: Response, count: int) -> Iterator[tuple[FlexibleSpring, MachineError]]:
    """Generate the springs that deflect, each with the relative error of its compliance.

    Args:
        response: response of the machine at the poses.
        count: number of poses.
    """
    springs = [(leg.name, spring) for leg in response.configuration.legs for spring in leg.springs]
    springs_of_part = Counter(spring.part_name for _, spring in springs)
    with_effects = zip(springs, response.statics.flexibility, response.statics.compliance, strict=True)
    for (leg, spring), twist, spring_compliance in with_effects:
        compliance = stacked_columns([spring_compliance], count)[:, 0]
        if np.isfinite(compliance).all() and (compliance > 0.0).any():
            title = spring.part_name if springs_of_part[spring.part_name] == 1 else spring.name
            name = name_in_leg(title, leg)
            words = f"compliance of the {name} of {leg}, relative"
            error = MachineError(compliance_path(leg, name), kind="share", group="compliances", words=words, leg=leg)
            yield FlexibleSpring(stacked_columns(twist.components(), count), compliance), error


def name_in_leg(title: str, leg: str) -> str:
    """Return the name of a part without that of its leg; it is a part of a path, and so it has no dot."""
    return title.removeprefix(f"{leg} ").replace(".", " ")


def compliance_path(leg: str, spring: str) -> str:
    """Return the path of the error of a spring's compliance, by the names of its leg and of the spring in it."""
    return f"legs.{leg}.{spring}.compliance"
