"""An independent engine for machines written leg by leg: K, C and their ranks in 120 decimal digits, from the file.

It knows nothing of kinetostat: it reads the text itself, closes the legs exactly, and shares every load among rigid and
elastic members by least energy. The numbers of a file count as they are written, not as doubles, so that rigid members
which hold the same motion do so to all digits, and a rank is a gap of twenty powers of ten or an error.

Wrenches are [moment; force] and twists [rotation; displacement], at the tool point in base axes. Lengths are in units
of the machine's size inside, in metres outside.
"""

import tomllib
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from decimal import Decimal, localcontext
from functools import wraps
from typing import Any

import numpy as np

DIGITS = 120
ZERO, SURELY = Decimal("1e-80"), Decimal("1e-60")
"""Shares of the largest entry: a pivot below the first is round-off, one above the second is none; the softest spring
of the machines here is 1e20 times as soft as the hardest."""
CLOSED = Decimal("1e-110")
NEAR_SINGULAR = 3e-3
MATERIALS = {"steel": ("210e9", "81e9"), "aluminium": ("70e9", "27e9"), "cast-iron": ("110e9", "43.7e9")}
POSE = ("x", "y", "z", "roll", "pitch", "yaw")
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798")

Array = Any
"""A NumPy array of Decimal, or of floats on the way to the pose."""


class UndecidedRankError(ArithmeticError):
    """A pivot is neither round-off nor surely more: not even 120 digits decide the rank."""


class UnsuitablePoseError(ValueError):
    """The legs do not close at the pose, or stand too near a singularity on the way to it, or the platform is free."""


def exactly(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let a function calculate in 120 digits."""

    @wraps(function)
    def calculated(*arguments: Any, **named: Any) -> Any:
        with localcontext() as context:
            context.prec = DIGITS
            return function(*arguments, **named)

    return calculated


def numbers(values: Sequence[Any]) -> Array:
    """An array of Decimal."""
    return np.vectorize(lambda value: Decimal(value), otypes=[object])(np.array(values, dtype=object))


def identity(size: int) -> Array:
    return numbers(np.eye(size, dtype=int).tolist())


def sine_and_cosine(angle: Any) -> tuple[Any, Any]:
    """By Taylor's series for a Decimal, else by NumPy."""
    if not isinstance(angle, Decimal):
        return np.sin(angle), np.cos(angle)
    term, sums, power = Decimal(1), [Decimal(0), Decimal(0)], 0
    while abs(term) > Decimal(10) ** -(DIGITS + 5):
        sums[power % 2] += -term if power % 4 > 1 else term
        power += 1
        term *= angle / power
    return sums[1], sums[0]


def skew(v: Array) -> Array:
    zero = v[0] - v[0]
    return np.array([[zero, -v[2], v[1]], [v[2], zero, -v[0]], [-v[1], v[0], zero]], dtype=v.dtype)


def cross(a: Array, b: Array) -> Array:
    return skew(a) @ b


def norm(v: Array) -> Any:
    square = v @ v
    return square.sqrt() if isinstance(square, Decimal) else np.sqrt(square)


def unit(v: Array) -> Array:
    return v / norm(v)


def turn_about(axis: Array, angle: Any) -> Array:
    """A rotation by Rodrigues' formula."""
    sine, cosine = sine_and_cosine(angle)
    cross_matrix = skew(axis)
    one = np.eye(3, dtype=int).astype(axis.dtype)
    return one + sine * cross_matrix + (1 - cosine) * (cross_matrix @ cross_matrix)


def orientation(roll: Any, pitch: Any, yaw: Any, kind: Any) -> Array:
    """Q = Rz(yaw) Ry(pitch) Rx(roll)."""
    x, y, z = np.eye(3, dtype=int).astype(kind)
    return turn_about(z, yaw) @ turn_about(y, pitch) @ turn_about(x, roll)


@dataclass
class Freedom:
    """A motion of a chain: about an axis, along it, or the swing of two bars.

    `soft` is its compliance in SI (rad/(N m) or m/N) where a spring or servo holds it, None where it is passive; `name`
    is that of its leg and joint.
    """

    kind: str
    point: Array
    axis: Array
    soft: Decimal | None = None
    far: Array = None
    name: str = ""


@dataclass
class Flexible:
    """Something in a chain with a compliance in SI at a point, base axes at the home pose; it moves with its body."""

    point: Array
    compliance: Array


@dataclass
class Pair:
    """The bars of a parallelogram that stretch: stiffness of each in N/m, width in m. It follows its freedom."""

    stiffness: Decimal
    width: Decimal


class Machine:
    """A machine file as chains at the home pose."""

    @exactly
    def __init__(self, text: str) -> None:
        tables = tomllib.loads(text, parse_float=Decimal)
        assert tables["family"] == "legs"
        self.sections = tables.get("sections", {})
        self.home = numbers(tables["platform"]["point"])
        self.pose = {name: Decimal(value) for name, value in tables.get("pose", {}).items()}
        self.offset = numbers(tables.get("tool", {}).get("offset", [0, 0, 0]))
        self.legs = [self._chain(leg) for leg in tables["legs"]]
        points = [numbers(joint["point"]) - self.home for leg in tables["legs"] for joint in leg["joints"]]
        self.size = (sum(p @ p for p in points) / len(points)).sqrt()

    def _chain(self, leg: dict[str, Any]) -> list[Any]:
        chain: list[Any] = []
        for joint, following in zip(leg["joints"], [*leg["joints"][1:], None], strict=True):
            seat = _seat(joint)
            moving = _freedoms(joint)
            for freedom in moving:
                if isinstance(freedom, Freedom):
                    freedom.name = f"{leg['name']} {joint['name']}"
            travels = joint["type"] in ("prismatic", "cylindrical")
            chain += [*moving, *seat] if travels else [*seat, *moving]
            link = leg.get("links", {}).get(joint["joins"][1])
            if link and following:
                start = numbers(joint["far"] if joint["type"] == "parallelogram" else joint["point"])
                chain += self._link(link, start, numbers(following["point"]))
        return chain

    def _link(self, link: dict[str, Any], start: Array, end: Array) -> list[Flexible]:
        """A link as the compliance of its end while its start is clamped, or of springs at its start."""
        if link["model"] == "rigid":
            return []
        if link["model"] == "matrix":
            return [Flexible(end, _whole(link["compliance"]))]
        young, shear, area, second_y, second_z, torsion, factor = _section(self.sections[link["section"]])
        span = end - start
        length = norm(span)
        x = unit(span)
        up = numbers(link["up"]) if "up" in link else numbers([1, 2, 4])
        if abs(abs(unit(up) @ x) - 1) < Decimal("1e-9"):
            up = numbers([1, -2, 3])
        y = unit(cross(up, x))
        axes = np.column_stack([x, y, cross(x, y)])
        c = numbers(np.zeros((6, 6), dtype=int).tolist())
        c[0, 0], c[3, 3] = length / (shear * torsion), length / (young * area)
        if link["model"] == "lumped":
            c[1, 1], c[2, 2] = length / (3 * young * second_y), length / (3 * young * second_z)
            return [Flexible(start, _turned(axes, c))]
        for across, about, sign, second in ((4, 2, 1, second_z), (5, 1, -1, second_y)):
            c[about, about] = length / (young * second)
            c[across, across] = length**3 / (3 * young * second)
            c[across, about] = c[about, across] = sign * length**2 / (2 * young * second)
            if link["model"] == "timoshenko":
                c[across, across] += length / (factor * shear * area)
        return [Flexible(end, _turned(axes, c))]


def _turned(axes: Array, compliance: Array) -> Array:
    """A 6 x 6 from axes given as columns to base axes."""
    both = numbers(np.zeros((6, 6), dtype=int).tolist())
    both[:3, :3] = both[3:, 3:] = axes
    return both @ compliance @ both.T


def _whole(compliance: Sequence[Any]) -> Array:
    """A 6 x 6 of six numbers or of six rows."""
    rows = numbers(compliance)
    return rows if rows.ndim == 2 else np.diag(rows) + Decimal(0)


def _section(section: dict[str, Any]) -> tuple[Decimal, ...]:
    """E, G, A, I about y and z, J and the shear factor."""
    named = MATERIALS.get(section.get("material", ""), (0, 0))
    young = Decimal(section.get("youngs_modulus", named[0]))
    shear = Decimal(section.get("shear_modulus", named[1]))
    if section["shape"] == "own":
        area, second_y, second_z, torsion = (
            Decimal(section[key]) for key in ("area", "second_moment_y", "second_moment_z", "torsion_constant")
        )
        return young, shear, area, second_y, second_z, torsion, Decimal(5) / 6
    if section["shape"] == "round":
        outer, inner = Decimal(section["diameter"]), Decimal(0)
    else:
        assert section["shape"] == "tube"
        outer, inner = Decimal(section["outer_diameter"]), Decimal(section["inner_diameter"])
    area, second = PI / 4 * (outer**2 - inner**2), PI / 64 * (outer**4 - inner**4)
    poisson, ratio = young / (2 * shear) - 1, (inner / outer) ** 2
    thick = (1 + ratio) ** 2
    factor = 6 * (1 + poisson) * thick / ((7 + 6 * poisson) * thick + (20 + 12 * poisson) * ratio)
    return young, shear, area, second, second, 2 * second, factor


def _freedoms(joint: dict[str, Any]) -> list[Any]:
    kind, point = joint["type"], numbers(joint["point"])
    soft = None if "stiffness" not in joint else _compliance(joint["stiffness"])
    if kind == "revolute":
        return [Freedom("turn", point, unit(numbers(joint["axis"])), soft)]
    if kind == "prismatic":
        return [Freedom("slide", point, unit(numbers(joint["axis"])), soft)]
    assert soft is None
    if kind == "universal":
        return [Freedom("turn", point, unit(numbers(joint[key]))) for key in ("first_axis", "second_axis")]
    if kind == "spherical":
        return [Freedom("turn", point, axis) for axis in identity(3)]
    if kind == "parallelogram":
        bars = Freedom("swing", point, unit(numbers(joint["axis"])), far=numbers(joint["far"]))
        stretch = joint.get("bar_stiffness", "rigid")
        return [bars] if stretch == "rigid" else [bars, Pair(Decimal(stretch), Decimal(joint["width"]))]
    assert kind == "fixed"
    return []


def _compliance(stiffness: Any) -> Decimal:
    return Decimal(0) if stiffness == "rigid" else 1 / Decimal(stiffness)


def _seat(joint: dict[str, Any]) -> list[Flexible]:
    """The bearings of a joint: its matrix, or its stiffness in its own axes."""
    point = numbers(joint["point"])
    if "compliance" in joint:
        return [Flexible(point, _whole(joint["compliance"]))]
    radial, axial, tilt, torsion = (
        _compliance(joint.get(f"stiffness_{way}", "rigid")) for way in ("radial", "axial", "tilt", "torsion")
    )
    if not any((radial, axial, tilt, torsion)):
        return []
    if joint["type"] == "universal":
        axis = unit(cross(numbers(joint["first_axis"]), numbers(joint["second_axis"])))
    else:
        axis = unit(numbers(joint["axis"]))
    along = np.outer(axis, axis)
    across = identity(3) - along
    c = numbers(np.zeros((6, 6), dtype=int).tolist())
    c[:3, :3], c[3:, 3:] = torsion * along + tilt * across, axial * along + radial * across
    return [Flexible(point, c)]


# Places


@dataclass
class Placed:
    """A chain at given coordinates: its motions and flexible parts, and what has become of its last body."""

    freedoms: list[tuple[str, Array, Array, Decimal | None]]
    flexible: list[Flexible]
    turn: Array
    shift: Array


def place(chain: Sequence[Any], coordinates: Sequence[Any], kind: Any) -> Placed:
    """Move a chain; `kind` is object for Decimal, float for the way to the pose."""
    turn, shift = np.eye(3, dtype=int).astype(kind), np.zeros(3, dtype=int).astype(kind)
    freedoms: list[Any] = []
    flexible: list[Flexible] = []
    left, bars = iter(coordinates), None
    for part in chain:
        if isinstance(part, Pair):
            flexible += _stretching(part, *bars) if bars else []
            continue
        point = turn @ part.point.astype(kind) + shift
        if isinstance(part, Flexible):
            flexible.append(Flexible(point, _turned(turn, part.compliance) if kind is object else None))
            continue
        axis = turn @ part.axis.astype(kind)
        amount = next(left)
        if part.kind == "turn":
            moved = turn_about(axis, amount)
            turn, shift = moved @ turn, moved @ (shift - point) + point
        elif part.kind == "slide":
            shift = shift + amount * axis
        else:
            span = turn @ part.far.astype(kind) + shift - point
            normal = unit(cross(axis, span))
            now = turn_about(normal, amount / norm(span)) @ span
            shift = shift + now - span
            bars = point, axis, normal, now
            axis = cross(normal, unit(now))
        freedoms.append(("turn" if part.kind == "turn" else "slide", point, axis, part.soft))
    return Placed(freedoms, flexible, turn, shift)


def _stretching(pair: Pair, point: Array, side: Array, normal: Array, span: Array) -> list[Flexible]:
    """Two bars that stretch: along them, and about the normal of their plane by their difference."""
    if not isinstance(point[0], Decimal):
        return []
    along = unit(span)
    sine = cross(side, along) @ normal
    c = numbers(np.zeros((6, 6), dtype=int).tolist())
    # The bars stretch by f_1/k and f_2/k; a couple about the normal is (f_1 - f_2) w sin / 2.
    c[3:, 3:] = np.outer(along, along) / (2 * pair.stiffness)
    c[:3, :3] = np.outer(normal, normal) * 2 / (pair.stiffness * (pair.width * sine) ** 2)
    return [Flexible(point, c)]


class Closed:
    """A machine whose legs close at its pose."""

    def __init__(self, machine: Machine, pose: dict[str, Decimal], steps: int = 12) -> None:
        """Follow the legs from the home pose to a pose, straight, and then close them to all digits.

        Raises:
            UnsuitablePoseError: if they do not close, or come near a singularity on the way.
        """
        self.machine, self.given = machine, pose
        self.counts = [sum(isinstance(part, Freedom) for part in leg) for leg in machine.legs]
        self.free = [name for name in POSE if name not in pose]
        self.length = float(machine.size)
        home = dict(zip(POSE, [*(float(c) for c in machine.home), 0.0, 0.0, 0.0], strict=True))
        unknown = np.array([0.0] * sum(self.counts) + [home[name] for name in self.free])
        for step in range(1, steps + 1):
            share = step / steps
            now = {name: home[name] + share * (float(value) - home[name]) for name, value in pose.items()}
            unknown = self._closed_nearly(unknown, now)
        self.nearly = unknown
        self._close(unknown)

    def _parts(self, unknown: Array, given: dict[str, Any], kind: Any) -> tuple[list[Placed], dict[str, Any]]:
        ends = np.cumsum([0, *self.counts])
        placed = [place(leg, unknown[a:b], kind) for leg, a, b in zip(self.machine.legs, ends, ends[1:], strict=False)]
        return placed, given | dict(zip(self.free, unknown[ends[-1] :], strict=True))

    def _gaps(self, unknown: Array, given: dict[str, Any], kind: Any) -> tuple[Array, Array, Array]:
        """How far the legs' ends are from the platform, its rotation and P, in rad and units of the size."""
        placed, pose = self._parts(unknown, given, kind)
        turn = orientation(pose["roll"], pose["pitch"], pose["yaw"], kind)
        centre = np.array([pose[name] for name in "xyz"], dtype=kind)
        length = self.machine.size if kind is object else self.length
        home = self.machine.home.astype(kind)
        gaps = []
        for leg in placed:
            rotated = sum(cross(turn[:, i], leg.turn[:, i]) for i in range(3)) / 2
            gaps += [rotated, (leg.turn @ home + leg.shift - centre) / length]
        return np.concatenate(gaps), turn, centre

    def _rates(self, unknown: Array, given: dict[str, float]) -> Array:
        """Rates of the gaps by the unknowns, near a closed state; floats."""
        placed, pose = self._parts(unknown, given, float)
        centre = np.array([pose[name] for name in "xyz"], dtype=float)
        rates = np.zeros((6 * len(placed), len(unknown)))
        column = 0
        for k, leg in enumerate(placed):
            for kind, point, axis, _ in leg.freedoms:
                moved = np.concatenate([axis, cross(axis, centre - point)]) if kind == "turn" else [0, 0, 0, *axis]
                rates[6 * k : 6 * k + 6, column] = moved
                column += 1
        yaw = turn_about(np.eye(3)[2], pose["yaw"])
        pitch = yaw @ turn_about(np.eye(3)[1], pose["pitch"])
        axes = {"roll": pitch[:, 0], "pitch": yaw[:, 1], "yaw": np.eye(3)[2]}
        for name in self.free:
            motion = [0, 0, 0, *np.eye(3)["xyz".index(name)]] if name in "xyz" else [*axes[name], 0, 0, 0]
            rates[:, column] = np.tile(-np.array(motion, dtype=float), len(placed))
            column += 1
        scale = np.tile([1.0] * 3 + [1.0 / self.length] * 3, len(placed))
        units = [self.length if kind == "slide" else 1.0 for leg in placed for kind, *_ in leg.freedoms] + [
            self.length if name in "xyz" else 1.0 for name in self.free
        ]
        self.units = np.array(units)
        return scale[:, None] * rates * self.units

    def _inverse(self, unknown: Array, given: dict[str, float]) -> Array:
        left, values, right = np.linalg.svd(self._rates(unknown, given))
        rank = int((values > 1e-7).sum())
        if values[rank - 1] < NEAR_SINGULAR:
            raise UnsuitablePoseError("near a singularity")
        return self.units[:, None] * (right[:rank].T / values[:rank]) @ left[:, :rank].T

    def _closed_nearly(self, unknown: Array, given: dict[str, float]) -> Array:
        """The unknowns with the least gaps: on the way, a pose that gives all coordinates is not one of the machine."""
        for _ in range(12):
            gaps = self._gaps(unknown, given, float)[0]
            step = self._inverse(unknown, given) @ gaps
            size = np.abs(step / self.units).max()
            if size > 0.3:
                raise UnsuitablePoseError("out of reach")
            unknown = unknown - step
            if size < 1e-7:
                return unknown
        raise UnsuitablePoseError("not closed")

    def motions(self) -> Array:
        """An orthonormal basis of how the platform can move while all legs stay closed, if the pose leaves all to them.

        Rows are the coordinates in the order of `POSE`, in units of the size and rad [6 x freedoms].
        """
        values, right = np.linalg.svd(self._rates(self.nearly, {}))[1:]
        left, sizes, _ = np.linalg.svd(right[int((values > 1e-7).sum()) :, -6:].T)
        return left[:, : int((sizes > 1e-7).sum())]

    def admissible(self) -> list[tuple[Array, dict[str, float]]]:
        """Small motions that keep all legs closed while rigid springs are locked, whatever the pose gives; floats.

        Returns:
            Of each, the twist of the tool point, base axes, rad and m; and the motions of the sprung joints by name.
        """
        everywhere = [part for leg in self.machine.legs for part in leg if isinstance(part, Freedom)]
        freely = copy(self)
        freely.free = list(POSE)
        unknown = np.array([*self.nearly[: len(everywhere)], *(float(self.pose[name]) for name in POSE)])
        rates = freely._rates(unknown, {})
        locked = [np.eye(rates.shape[1])[i] for i, part in enumerate(everywhere) if part.soft == 0]
        values, right = np.linalg.svd(np.array([*rates, *locked]))[1:]
        tool = (self.centre + self.turn @ self.machine.offset).astype(float)
        first = freely._parts(unknown, {}, float)[0][0]
        motions = []
        for motion in right[int((values > 1e-7).sum()) :] * freely.units:
            twist = np.zeros(6)
            for (kind, point, axis, _), amount in zip(first.freedoms, motion, strict=False):
                moved = [*axis, *cross(axis, tool - point)] if kind == "turn" else [0, 0, 0, *axis]
                twist += amount * np.array(moved, dtype=float)
            sprung = {part.name: float(c) for part, c in zip(everywhere, motion, strict=False) if part.soft is not None}
            motions.append((twist, sprung))
        return motions

    @exactly
    def _close(self, unknown: Array) -> None:
        nearly = {name: float(value) for name, value in self.given.items()}
        inverse = self._inverse(unknown, nearly)
        exact = numbers([Decimal(float(c)) for c in unknown])
        for _ in range(30):
            gaps, self.turn, self.centre = self._gaps(exact, self.given, object)
            largest = max(abs(gap) for gap in gaps)
            if largest < CLOSED:
                break
            step = inverse @ np.array([float(gap / largest) for gap in gaps])
            exact = exact - numbers([Decimal(float(c)) for c in step]) * largest
        else:
            raise UnsuitablePoseError(f"the legs close to {largest:.1e} only")
        self.placed, pose = self._parts(exact, self.given, object)
        self.pose = {name: pose[name] for name in POSE}


# Statics


@dataclass
class Answer:
    """C and K at the tool point, base axes, SI, as floats; K is infinite on the diagonal of what cannot move.

    `rank` is that of C, `held` the number of wrenches that a load leaves undecided, `redundant` of all internal loads.
    """

    compliance: Array
    stiffness: Array
    rank: int
    redundant: int
    held: int


@exactly
def answer(closed: Closed) -> Answer:
    """Share unit loads by least energy.

    Raises:
        UnsuitablePoseError: if the platform can move while nothing deforms.
        UndecidedRankError: if a rank is not decided.
    """
    machine, size = closed.machine, closed.machine.size
    tool = closed.centre + closed.turn @ machine.offset
    wrenches, energy = [], []
    for leg in closed.placed:
        carried = _carried(leg, tool, size)
        wrenches.append(carried)
        energy.append(carried.T @ _softness(leg, tool, size) @ carried)
    every = np.concatenate(wrenches, axis=1)
    whole = numbers(np.zeros((every.shape[1],) * 2, dtype=int).tolist())
    first = 0
    for block in energy:
        whole[first : first + len(block), first : first + len(block)] = block
        first += len(block)
    balance, internal = solve(every)
    if balance is None:
        raise UnsuitablePoseError("the platform is free")
    both = np.concatenate([internal, balance], axis=1)
    form = both.T @ whole @ both
    largest = max(abs(entry) for entry in form.flat)
    reduced, decided = _without(form, internal.shape[1], largest)
    factor = _factor(reduced, largest)
    units = np.array([Decimal(1)] * 3 + [size] * 3, dtype=object)
    compliance = np.outer(units, units) * _without_round_off(factor @ factor.T, largest) / size
    stiffness = _stiffness(factor) * size / np.outer(units, units)
    return Answer(
        compliance.astype(float),
        stiffness.astype(float),
        factor.shape[1],
        internal.shape[1],
        internal.shape[1] - decided,
    )


def _twist(kind: str, point: Array, axis: Array, tool: Array, size: Decimal) -> Array:
    if kind == "slide":
        return np.concatenate([numbers([0, 0, 0]), axis])
    return np.concatenate([axis, cross(axis, (tool - point) / size)])


def _carried(leg: Placed, tool: Array, size: Decimal) -> Array:
    """A basis of the wrenches that do no work on the passive motions of a leg, as columns."""
    passive = [_twist(*freedom[:3], tool, size) for freedom in leg.freedoms if freedom[3] is None]
    # Work exchanges nothing: a wrench is [moment; force], a twist [rotation; displacement].
    return solve(np.array(passive, dtype=object))[1] if passive else identity(6)


def _softness(leg: Placed, tool: Array, size: Decimal) -> Array:
    """The quadratic form of the energy of a leg over the wrench at the tool point, in units of the size."""
    total = numbers(np.zeros((6, 6), dtype=int).tolist())
    for kind, point, axis, soft in leg.freedoms:
        if soft:
            felt = _twist(kind, point, axis, tool, size)
            total = total + np.outer(felt, felt) * (soft * size if kind == "turn" else soft / size)
    units = np.array([Decimal(1)] * 3 + [1 / size] * 3, dtype=object)
    for part in leg.flexible:
        shift = identity(6)
        shift[:3, 3:] = skew((tool - part.point) / size)
        total = total + shift.T @ (np.outer(units, units) * part.compliance * size) @ shift
    return total


def _decide(pivot: Decimal, largest: Decimal) -> bool:
    """Whether a pivot is more than round-off."""
    share = abs(pivot) / largest if largest else Decimal(0)
    if ZERO < share < SURELY:
        raise UndecidedRankError(f"a pivot is {share:.1e} of the largest")
    return share >= SURELY


def solve(matrix: Array) -> tuple[Array | None, Array]:
    """Solve A x = e_i for all i, by Gauss and Jordan's elimination with complete pivoting.

    Returns:
        Solutions as columns, None where the rows of A are dependent; and a basis of the null space as columns.
    """
    height, wide = matrix.shape
    rows = np.concatenate([matrix, identity(height)], axis=1)
    largest = max(abs(entry) for entry in matrix.flat)
    taken: list[int] = []
    for k in range(min(height, wide)):
        left = [j for j in range(wide) if j not in taken]
        sizes = np.abs(rows[k:, left])
        i, j = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
        if not _decide(sizes[i, j], largest):
            break
        i, column = i + k, left[j]
        rows[[k, i]] = rows[[i, k]]
        rows[k] = rows[k] / rows[k, column]
        for other in range(height):
            if other != k:
                rows[other] = rows[other] - rows[other, column] * rows[k]
        taken.append(column)
    left = [j for j in range(wide) if j not in taken]
    null = numbers(np.zeros((wide, len(left)), dtype=int).tolist())
    for n, column in enumerate(left):
        null[column, n] = Decimal(1)
        null[taken, n] = -rows[: len(taken), column]
    if len(taken) < height:
        return None, null
    solution = numbers(np.zeros((wide, height), dtype=int).tolist())
    solution[taken] = rows[:, wide:]
    return solution, null


def _without(form: Array, count: int, largest: Decimal) -> tuple[Array, int]:
    """Minimise a quadratic form over its first variables: what is left of it, and how many of them it decides."""
    left, decided = list(range(count)), 0
    while left:
        k = max(left, key=lambda i: form[i, i])
        if not _decide(form[k, k], largest):
            assert all(not _decide(entry, largest) for entry in form[left].flat)
            break
        form = form - np.outer(form[:, k], form[k]) / form[k, k]
        left.remove(k)
        decided += 1
    return form[count:, count:], decided


def _without_round_off(form: Array, largest: Decimal) -> Array:
    """The same with exact zeros."""
    return np.vectorize(lambda entry: entry if _decide(entry, largest) else Decimal(0), otypes=[object])(form)


def _factor(form: Array, largest: Decimal) -> Array:
    """V of full rank with V V^T the form, a column for each pivot."""
    columns = []
    for _ in range(len(form)):
        k = max(range(len(form)), key=lambda i: form[i, i])
        if not _decide(form[k, k], largest):
            break
        column = form[:, k] / form[k, k].sqrt()
        columns.append(column)
        form = form - np.outer(column, column)
    if not columns:
        return numbers(np.zeros((6, 0), dtype=int).tolist())
    return np.array(columns, dtype=object).T


def _stiffness(factor: Array) -> Array:
    """K by the wrenches that make each unit displacement which is possible, the others held.

    K_ij = z_i . z_j where V z_i is the displacement i; infinite where there is none. Entries that couple what can move
    with what cannot are NaN.
    """
    stiffness = np.full((6, 6), Decimal("NaN"), dtype=object)
    amounts = [_amounts(factor, i) for i in range(6)]
    for i, a in enumerate(amounts):
        stiffness[i, i] = Decimal("Infinity") if a is None else a @ a
        for j, b in enumerate(amounts):
            if i != j and a is not None and b is not None:
                stiffness[i, j] = a @ b
    return stiffness


def _amounts(factor: Array, component: int) -> Array | None:
    """z with V z = e_i; None where the platform cannot move so."""
    rank = factor.shape[1]
    if not rank:
        return None
    target = numbers([int(i == component) for i in range(6)])
    null = solve(factor.T)[1]  # wrenches that move nothing
    if any(_decide(work, Decimal(1)) for work in (null.T @ target)):
        return None
    normal = factor.T @ factor
    inverse = solve(normal)[0]
    return inverse @ (factor.T @ target)
