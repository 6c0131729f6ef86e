"""Sets of wrenches that the drives of a machine hold at a pose, as faces over scalars, and the speeds that they allow.

A set of wrenches is an intersection of slabs `lower <= n . w <= upper`, which is exact for any number of drives, with
bounds of either sign (a cable pulls only) and beside any structure that carries loads without a drive. What a machine
file says about its drives is in `drive_limits`; vertices and pictures are made elsewhere.

Source: theory (81)-(84). Screws are at the tool point, base axes.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations

from kinetostat.algebra.scalar import Scalar, inner_product, is_zero, larger, reciprocal, smaller, sqrt, total, where
from kinetostat.algebra.screw import NO_MOTION, Twist, Wrench
from kinetostat.algebra.solve import Conjugated, conjugate, right_inverse
from kinetostat.algebra.symmetric import SIZE
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.leg import INFINITE, combine, free_springs_as_joints
from kinetostat.machine.leg import Leg, Spring
from kinetostat.machine.leg_screws import LegScrews
from kinetostat.machine.limits import is_set
from kinetostat.machine.machine import Configuration
from kinetostat.tolerances import DEPENDENT_GENERATORS, LEAST_LOAD_OF_DRIVE, UNREACHED_COMPONENT

BLOCKS = {"rotation": slice(0, 3), "translation": slice(3, 6)}
"""Components of a screw that turn, and that move."""


@dataclass(frozen=True)
class Transmission:
    """The way in which the drives of a machine and its platform act on each other.

    Attributes:
        shares: for each drive, its load per unit of each wrench on the platform where nothing else loads the legs: a
            twist xi, theory (81).
        internal: for each drive, its load per unit of each independent internal load of the legs.
        doubtful: whether some internal loads may load no drive, as where structure is overconstrained.
        wrenches: for each drive, the wrench that a unit of its load exerts on the platform; its speed is the power of
            that on a twist. None where two drives of a leg move the platform in one way.
        constraints: wrenches that legs, or a plane, exert without any drive: of unit size, moments over the length.
        length: characteristic length, m.
        margin: 0 where the legs do not hold the platform with locked drives.
    """

    shares: tuple[Twist, ...]
    internal: tuple[tuple[Scalar, ...], ...]
    doubtful: bool
    wrenches: tuple[Wrench, ...] | None
    constraints: tuple[Wrench, ...]
    length: Scalar
    margin: Scalar


def transmission(configuration: Configuration, legs: Sequence[LegScrews], guide: Sequence[Wrench] = ()) -> Transmission:
    """Find how drives and platform act on each other, as rigid bodies: flexures bend freely.

    Args:
        configuration: the machine at its pose.
        legs: their screws at the tool point, base axes.
        guide: wrenches of a planar machine against twists that do not exist there.

    Source: theory (81).
    """
    rigid = [_without_flexures(leg.springs, screws) for leg, screws in zip(configuration.legs, legs, strict=True)]
    shrink = reciprocal(configuration.length)
    wrenches = [wrench for leg in rigid for wrench in leg.wrenches] + list(guide)
    columns = [wrench.in_newtons(shrink) for wrench in wrenches]
    if len(columns) < SIZE:
        return Transmission(
            shares=(),
            internal=(),
            doubtful=False,
            wrenches=None,
            constraints=(),
            length=configuration.length,
            margin=0.0,
        )
    balances = right_inverse([list(row) for row in zip(*columns, strict=True)])
    amounts_by_component = list(zip(*balances.solution, strict=True))
    shares, internal, driving, constraints = [], [], [], list(guide)
    first, each_drive_moves, doubtful = 0, True, False
    for leg, screws in zip(configuration.legs, rigid, strict=True):
        rows, in_leg = _loads_of_drives(leg, screws), slice(first, first + len(screws.wrenches))
        for row in rows:
            # The load of the drive by the amounts of the leg's wrenches that balance a unit wrench, or each other.
            loads = [inner_product(row, amounts[in_leg]) for amounts in amounts_by_component]
            shares.append(Twist(Vector(*loads[:3]) * shrink, Vector(*loads[3:])))
            internal.append(tuple(inner_product(row, amounts[in_leg]) for amounts in balances.null))
        of_drives, undriven = _by_drives(screws.wrenches, rows)
        each_drive_moves, doubtful = each_drive_moves and of_drives is not None, doubtful or bool(undriven)
        driving += of_drives or []
        constraints += undriven
        first = in_leg.stop
    return Transmission(
        shares=tuple(shares),
        internal=tuple(internal),
        doubtful=doubtful,
        wrenches=tuple(driving) if each_drive_moves else None,
        constraints=tuple(wrench * _reciprocal_size(wrench.in_newtons(shrink)) for wrench in constraints),
        length=configuration.length,
        margin=balances.margin,
    )


def _loads_of_drives(leg: Leg, screws: LegScrews) -> list[tuple[Scalar, ...]]:
    """For each drive of a leg that holds something, its load per unit of each wrench of the leg."""
    pairs = zip(leg.springs, screws.loads, strict=True)
    return [row for spring, row in pairs if spring.actuated and not is_zero(spring.stiffness)]


def _reciprocal_size(components: Sequence[Scalar]) -> Scalar:
    return reciprocal(sqrt(total([c * c for c in components])))


def _without_flexures(springs: Sequence[Spring], leg: LegScrews) -> LegScrews:
    """A leg whose flexure hinges and free springs are passive joints."""
    softened = (INFINITE if spring.hinge else s for spring, s in zip(springs, leg.compliance, strict=True))
    return free_springs_as_joints(replace(leg, compliance=tuple(softened)))


def _by_drives(
    wrenches: Sequence[Wrench], rows: Sequence[Sequence[Scalar]]
) -> tuple[list[Wrench] | None, list[Wrench]]:
    """Split what a leg carries into a wrench for each of its drives, and wrenches that load none of them.

    Args:
        wrenches: the wrenches that the leg carries.
        rows: for each drive, its load per unit of each of them.

    Returns:
        For each drive, the wrench with a unit of its load and none of the others; None if there are more drives than
        wrenches. And the wrenches that load none.
    """
    if not rows:
        return [], list(wrenches)
    if len(rows) > len(wrenches):
        return None, []
    if len(wrenches) == 1:
        load = rows[0][0]  # 0 at a dead point, where a crank is in line with its rod and cannot move the platform
        return [wrenches[0] * (1.0 / where(abs(load) > LEAST_LOAD_OF_DRIVE, load, LEAST_LOAD_OF_DRIVE))], []
    amounts, null, _ = right_inverse([list(row) for row in rows])
    driving = [combine(wrenches, [row[k] for row in amounts]) for k in range(len(rows))]
    return driving, [combine(wrenches, column) for column in null]


@dataclass(frozen=True)
class Face:
    """A pair of parallel faces of a set of wrenches: lower <= normal . w <= upper.

    Attributes:
        normal: a twist of any size, base axes, at the tool point.
        lower, upper: bounds of its power with a wrench of the set, W; infinite where nothing bounds the set.
        drives: numbers of the drives that are at their bounds there.
    """

    normal: Twist
    lower: Scalar
    upper: Scalar
    drives: tuple[int, ...] = ()

    @property
    def room(self) -> Scalar:
        """Distance of w = 0 to the nearer face, W; negative outside."""
        return smaller(self.upper, -self.lower)


def wrench_faces(
    drives: Transmission, bounds: Sequence[tuple[Scalar, Scalar]], carried: Sequence[Scalar] = ()
) -> list[Face]:
    """Return all faces of the set of wrenches that the drives hold; degenerate ones have a normal of zero.

    With as many drives as freedoms each drive makes a pair of faces. With r more of them, loads xi . w + T z leave r
    internal loads z open. They can be chosen if and only if no mix v of the drives with T^T v = 0 is asked for more
    than its bounds allow (Farkas' lemma), and mixes of the fewest drives, r + 1 of them, say it all.

    Args:
        drives: the way in which drives and platform act on each other.
        bounds: least and greatest load of each drive, N or N·m.
        carried: what each drive carries already, e.g. by the weight; nothing if empty.

    Source: theory (82).
    """
    carried = list(carried) or [0.0] * len(bounds)
    faces = []
    for mix in _circuits(drives):
        lower, upper, normal = 0.0, 0.0, NO_MOTION
        for drive, amount in mix:
            least, most = bounds[drive]
            ends = _times(amount, least), _times(amount, most)
            load_before = amount * carried[drive]
            lower, upper = lower + smaller(*ends) - load_before, upper + larger(*ends) - load_before
            normal = normal + drives.shares[drive] * amount
        faces.append(Face(normal, lower, upper, tuple(drive for drive, _ in mix)))
    return faces


def _times(amount: Scalar, bound: Scalar) -> Scalar:
    """A bound of a drive in a mix: 0 where the drive has no part in it, even if the bound is infinite."""
    if is_set(bound):
        return amount * bound
    return where(amount > 0.0, bound, where(amount < 0.0, -bound, 0.0))


def _circuits(drives: Transmission) -> list[list[tuple[int, Scalar]]]:
    """The mixes of the fewest drives that no internal load enters: drives with their amounts.

    The amounts of a mix are minors of the matrix of internal loads, with a row for each drive: the determinants that
    remain when one of the mix's rows is left out, with alternating signs (Cramer's rule).
    """
    count, degree = len(drives.shares), len(drives.internal[0]) if drives.internal else 0
    if degree == 0:
        return [[(drive, 1.0)] for drive in range(count)]
    rows = _rows_of_internal_loads(drives)

    @cache
    def minor(chosen: tuple[int, ...]) -> Scalar:
        """The determinant of some rows in as many first columns, expanded along the last of these."""
        last = len(chosen) - 1
        entries = [(k, rows[row][last]) for k, row in enumerate(chosen)]
        if last == 0:
            return entries[0][1]
        minors = [(k, c, chosen[:k] + chosen[k + 1 :]) for k, c in entries if not is_zero(c)]
        return total([c * minor(others) * (-1.0) ** (last - k) for k, c, others in minors])

    result = []
    for chosen in combinations(range(len(rows)), degree + 1):
        amounts = [minor(chosen[:k] + chosen[k + 1 :]) * (-1.0) ** k for k in range(degree + 1)]
        square = total([amount * amount for amount in amounts])
        independent = square > DEPENDENT_GENERATORS * DEPENDENT_GENERATORS
        mix = [(drive, amount) for drive, amount in zip(chosen, amounts, strict=True) if drive < count]
        result.append([(drive, where(independent, amount, 0.0)) for drive, amount in mix if not is_zero(amount)])
    return [mix for mix in result if mix]


def _rows_of_internal_loads(drives: Transmission) -> list[list[Scalar]]:
    """The load of each drive by each internal load, in rows.

    Internal loads that load no drive, to round-off, get a row of their own below the drives: mixes then leave them out,
    and every other choice of drives is counted as degenerate.
    """
    rows = [list(row) for row in drives.internal]
    if not drives.doubtful:
        return rows
    count, degree = len(rows), len(rows[0])
    modes = conjugate([list(column) for column in zip(*rows, strict=True)], [1.0] * count, [1.0] * count)
    sizes = [sqrt(inverse) for inverse in modes.inverses]
    rows = [[column[i] * size for column, size in zip(modes.columns, sizes, strict=True)] for i in range(count)]
    for k, inverse in enumerate(modes.inverses):
        rows.append([where(inverse > 0.0, 0.0, 1.0) if j == k else 0.0 for j in range(degree)])
    return rows


def greatest_ball(faces: Sequence[Face], block: slice, length: Scalar) -> Scalar:
    """Radius of the largest ball of forces (N) at no moment, or of moments (N·m) at no force, about no wrench at all.

    It is the largest force that the drives hold in whichever direction it acts. Infinite where no drive feels the
    block; negative where the drives do not even hold the loads that count already.

    Args:
        faces: faces of the set of wrenches.
        block: one of `BLOCKS`, or a single component of one.
        length: characteristic length, m.

    Source: theory (83).
    """
    radius: Scalar = math.inf
    for face in faces:
        size, felt = _size_of_part(face.normal.components(), block, length)
        radius = smaller(_reach(face.room, size, felt, _reach_if_unfelt(face)), radius)
    return radius


def greatest_along(faces: Sequence[Face], row: int, length: Scalar) -> Scalar:
    """The greatest wrench along both ways of one component, with no other, N or N·m; compare `greatest_ball`."""
    return greatest_ball(faces, slice(row, row + 1), length)


def _reach(room: Scalar, size: Scalar, felt: Scalar, if_unfelt: Scalar) -> Scalar:
    """The multiple of a unit that a bound allows if a unit takes up `size` of its room; else `if_unfelt`."""
    return where(felt, room * reciprocal(where(felt, size, 1.0)), if_unfelt)


def _reach_if_unfelt(face: Face) -> Scalar:
    """Infinity where a face that a wrench does not meet holds w = 0; degenerate faces, which are 0 <= 0, do."""
    return where(face.room < 0.0, -math.inf, math.inf)


def _size_of_part(components: Sequence[Scalar], part: slice, length: Scalar) -> tuple[Scalar, Scalar]:
    """The size of some components of a twist, and whether that is more than round-off of the whole."""
    area = length * length
    squares = [c * c for c in components]
    square = total(squares[part])
    turning = part.start < SIZE // 2
    whole = total([*(c * area for c in squares[:3]), *squares[3:]])
    felt = (square * area if turning else square) > UNREACHED_COMPONENT * whole
    return sqrt(square), felt


def greatest_speed(drives: Transmission, speeds: Sequence[Scalar], block: slice) -> Scalar:
    """The greatest speed (m/s) of the tool point that the drives allow in whichever direction the machine can move.

    It moves without turning, or for the other block turns (rad/s) about the tool point without moving it: directions
    that the structure does not allow then do not count. NaN where it allows none.

    Args:
        drives: the way in which drives and platform act on each other.
        speeds: greatest speed of each drive, m/s or rad/s.
        block: one of `BLOCKS`.

    Source: theory (84).
    """
    if drives.wrenches is None:
        return math.nan
    shrink, turning, structure = reciprocal(drives.length), block.start == 0, _forbidden_motions(drives, block)
    radius: Scalar = math.inf
    for wrench, speed in zip(drives.wrenches, speeds, strict=True):
        size, felt = _allowed_size(wrench.in_newtons(shrink), block, structure)
        needed = size * drives.length if turning else size
        radius = smaller(_reach(speed, needed, felt, math.inf), radius)
    return where(radius < math.inf, radius, math.nan)


def _forbidden_motions(drives: Transmission, block: slice) -> Conjugated | None:
    """An orthonormal basis of the motions in a block that the structure does not allow; None where it allows all."""
    shrink = reciprocal(drives.length)
    stopped = [list(wrench.in_newtons(shrink)[block]) for wrench in drives.constraints]
    stopped = [column for column in stopped if not all(is_zero(c) for c in column)]
    return conjugate(stopped, [1.0] * 3, [1.0] * 3) if stopped else None


def _allowed_size(whole: Sequence[Scalar], block: slice, structure: Conjugated | None) -> tuple[Scalar, Scalar]:
    """The size of the part of six components that allowed motions in a block have, and whether it is no round-off.

    Args:
        whole: the components.
        block: one of `BLOCKS`.
        structure: see `_forbidden_motions`.
    """
    part = list(whole[block])
    for column, inverse in zip(structure.columns, structure.inverses, strict=True) if structure else ():
        share = inverse * total([a * b for a, b in zip(part, column, strict=True)])
        part = [a - share * b for a, b in zip(part, column, strict=True)]
    square = total([c * c for c in part])
    return sqrt(square), square > UNREACHED_COMPONENT * total([c * c for c in whole])


def acceleration_faces(
    drives: Transmission,
    rows: Sequence[Twist],
    bounds: Sequence[tuple[Scalar, Scalar]],
    carried: Sequence[Scalar],
) -> list[Face]:
    """Return all faces of the set of accelerations from rest that the drives allow, as `wrench_faces` does of wrenches.

    Args:
        drives: the way in which drives and platform act on each other.
        rows: for each drive, its load per unit of acceleration at the tool point.
        bounds: least and greatest load of each drive, N or N·m.
        carried: what each drive carries at rest.

    Source: theory (82) with what a drive carries by an acceleration in the place of what it carries by a wrench.
    """
    return wrench_faces(replace(drives, shares=tuple(rows)), bounds, carried)


def greatest_acceleration(faces: Sequence[Face], drives: Transmission, block: slice) -> Scalar:
    """The greatest acceleration from rest that the drives allow in whichever direction the machine can move.

    It is one without turning (m/s²), or for the other block one about the tool point without moving it (rad/s²). It is
    negative where the drives do not hold what they carry at rest, infinite where nothing that moves has a mass, and NaN
    where nothing moves.

    Args:
        faces: faces of the set of accelerations.
        drives: the way in which drives and platform act on each other.
        block: one of `BLOCKS`.
    """
    length, turning, structure = drives.length, block.start == 0, _forbidden_motions(drives, block)
    radius: Scalar = math.inf
    for face in faces:
        rotational, translational = face.normal.rotational, face.normal.translational * length
        size, felt = _allowed_size((*rotational.components(), *translational.components()), block, structure)
        needed = size if turning else size * reciprocal(length)
        radius = smaller(_reach(face.room, needed, felt, _reach_if_unfelt(face)), radius)
    stopped = total([where(inverse > 0.0, 1.0, 0.0) for inverse in structure.inverses]) if structure else 0.0
    return where(stopped < SIZE // 2 - 0.5, radius, math.nan)  # one at least of a block's three motions remains


def greatest_acceleration_along(faces: Sequence[Face], drives: Transmission, row: int) -> Scalar:
    """The greatest acceleration from rest of one component alone, either way; 0 where the structure forbids it.

    Args:
        faces, drives: see `greatest_acceleration`.
        row: number of the component, of rx ry rz x y z = 0 ... 5.
    """
    return _where_structure_allows(drives, row, greatest_along(faces, row, drives.length))


def greatest_speed_along(drives: Transmission, speeds: Sequence[Scalar], row: int) -> Scalar:
    """The greatest rate of one component alone that the drives allow, m/s or rad/s; 0 where the structure forbids it.

    Args:
        drives, speeds: see `greatest_speed`.
        row: number of the component, of rx ry rz x y z = 0 ... 5.
    """
    if drives.wrenches is None:
        return math.nan
    shrink = reciprocal(drives.length)
    rate: Scalar = math.inf
    for wrench, speed in zip(drives.wrenches, speeds, strict=True):
        part = abs(wrench.components()[row])
        components = wrench.in_newtons(shrink)
        felt = components[row] * components[row] > UNREACHED_COMPONENT * total([c * c for c in components])
        rate = smaller(_reach(speed, part, felt, math.inf), rate)
    return _where_structure_allows(drives, row, rate)


def _where_structure_allows(drives: Transmission, row: int, amount: Scalar) -> Scalar:
    """An amount of one component alone, or 0 where the structure forbids this motion."""
    for wrench in drives.constraints:
        entry = wrench.in_newtons(reciprocal(drives.length))[row]
        amount = where(entry * entry > UNREACHED_COMPONENT, 0.0, amount)
    return amount
