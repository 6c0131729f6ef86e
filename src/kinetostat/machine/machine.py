"""The machine: a family, its parameters as plain frozen data, and what the family makes of them at a pose.

Parameters may be floats or traced scalars. Methods that change numbers have them checked by `parameters` and `spec`, as
a file is; nothing here solves. Points and axes are in the base frame.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.screw import COMPONENTS, Wrench
from kinetostat.algebra.vector import IDENTITY, ZERO, Displacement, Vector
from kinetostat.display import ENGINEERING, Display, read_display
from kinetostat.frozen import dataclass
from kinetostat.machine.common_tables import COMMON_TABLES, STATES, NamedLoad, check_inertia, table_of_one_drive
from kinetostat.machine.leg import Joint, Leg, Spring, Station, Turn
from kinetostat.machine.links import LinkKind, link_tables
from kinetostat.machine.orientation import numbers_for, single_angles
from kinetostat.machine.parameters import POSE, Given, check_contrast, parameters, read_numbers, values, with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import quantities
from kinetostat.spec.immutable import FixedDict, Immutable, immutable_data
from kinetostat.spec.renamed import renamed_property
from kinetostat.spec.requirements import Requirement
from kinetostat.spec.tolerance_table import Tolerance
from kinetostat.units import KINDS, UnitError

BASE_FRAME = Displacement(IDENTITY, ZERO)
"""The base frame, placed in itself."""
POSE_DIGITS = 6
"""Digits of a coordinate of the pose: people have written it themselves, and look for what they wrote."""


@dataclass(frozen=True)
class Closure:
    """A condition for a leg to close: two joints must be neither too far apart for its links nor too near.

    Attributes:
        leg: name of the leg.
        span: distance of the two joints at this pose, m.
        shortest, longest: the least and the greatest distance that its links can bridge, m.
    """

    leg: str
    span: Scalar
    shortest: Scalar
    longest: Scalar


@dataclass(frozen=True)
class Plane:
    """The plane of a planar machine: twists out of it are absent, neither rigid nor free.

    Attributes:
        frame: its origin (m) and axes in the base frame; z is its normal.
    """

    frame: Displacement = BASE_FRAME

    @property
    def freedoms(self) -> tuple[Joint, ...]:
        """The rotation and the two translations that exist: rz, x, y of the plane."""
        axes = self.frame.rotation
        return Joint(axes.z, self.frame.translation), Joint(axes.x), Joint(axes.y)

    @property
    def missing_freedoms(self) -> tuple[Joint, ...]:
        """The two rotations and the translation that do not exist: rx, ry, z of the plane."""
        axes = self.frame.rotation
        return Joint(axes.x, self.frame.translation), Joint(axes.y, self.frame.translation), Joint(axes.z)

    def nearest(self, point: Vector) -> Vector:
        """The point of the plane below or above a point, m: in the plane both move alike."""
        normal = self.frame.rotation.z
        return point - normal * normal.dot(point - self.frame.translation)

    def displaced(self, motion: Displacement) -> "Plane":
        """The plane after a rigid displacement of the whole machine."""
        return Plane(motion @ self.frame)


@dataclass(frozen=True)
class Configuration:
    """A machine at a pose.

    Attributes:
        platform: placement of the platform in the base frame; its translation is the reference point P.
        legs: every leg, placed.
        closures: the conditions under which this placement exists.
        length: a characteristic length of the machine, m; scales rows in solves, no result depends on it.
        plane: the plane of a planar machine; None for a spatial one.
    """

    platform: Displacement
    legs: tuple[Leg, ...]
    closures: tuple[Closure, ...]
    length: Scalar
    plane: Plane | None = None


@dataclass(frozen=True)
class Member:
    """A link that can move.

    Attributes:
        leg: the leg that it belongs to, or empty.
        name: unique within the machine.
        length: the length from joint to joint, m.
        mass: kg; 0 where nothing says it.
        bending: least E I, N·m²; 0 where nothing says it.
        growth: the growth by which it makes its leg longer because it is warmer than when the machine was built, m.
        ends: gives both ends of its axis at the pose; None where they are not known.
        centre: gives its centre of mass at the pose; None for a uniform link.
        inertia: gives its inertia about that centre at the pose, base axes: xx, yy, zz, xy, xz, yz, kg·m²; None where
            nothing says it.
    """

    leg: str
    name: str
    length: Scalar
    mass: Scalar
    bending: Scalar = 0.0
    growth: Scalar = 0.0
    ends: Callable[[], tuple[Station, ...]] | None = None
    centre: Callable[[], Station] | None = None
    inertia: Callable[[], tuple[Scalar, ...]] | None = None


@dataclass(frozen=True)
class Step:
    """An element of a chain at the home pose, and whether a joint coordinate moves it."""

    element: Any
    moves: bool


@dataclass(frozen=True)
class ClosedLeg:
    """Joint coordinates of a leg in closed form.

    Attributes:
        amounts: a coordinate per movable element: m of a slide, the cosine and sine of a revolute; NaN where the leg
            cannot reach.
        closure: the condition for the leg to reach.
        gap: square of what keeps the leg from closing, without a unit; None where only the place of its end says it.
    """

    amounts: Sequence[Scalar | Turn]
    closure: Closure
    gap: Scalar | None = None


class Inverse(Protocol):
    """The closed form of a leg's joint coordinates."""

    def close(self, steps: Sequence[Step], motion: Displacement) -> ClosedLeg:
        """Find the coordinates that displace the platform end by `motion`."""


@dataclass(frozen=True)
class Chains:
    """The legs of a machine at its home pose.

    Attributes:
        legs: their elements in order.
        home: placement of the platform.
        pose: values of the coordinates that the pose gives, by name: x, y, z (m, base frame), roll, pitch, yaw (rad).
        length: a characteristic length, m; the posture of idle freedoms with slides depends on it.
        inverses: closed form of each leg's joint coordinates, None where it has none.
    """

    legs: tuple[tuple[Step, ...], ...]
    home: Displacement
    pose: Mapping[str, Scalar]
    length: Scalar
    inverses: tuple["Inverse | None", ...] = ()

    @property
    def size(self) -> int:
        """Number of joint coordinates."""
        return sum(step.moves for steps in self.legs for step in steps)


class DriveTable(NamedTuple):
    """A table that a single drive has in machine files, beside those of all drives (`machine.actuators`).

    Attributes:
        path: the path of the table, such as "servo.leg 1".
        fields: names of the fields that are written there.
    """

    path: str
    fields: tuple[str, ...]

    @property
    def of_all(self) -> str:
        """The table of all drives with the same fields: "drives" or "servo"."""
        return self.path.partition(".")[0]

    @property
    def drive(self) -> str:
        """The name of the drive, or of the leg whose drives are meant."""
        return self.path.partition(".")[2]


@dataclass(frozen=True, eq=False)
class Family:
    """A kind of machine: what people must write about one, and its kinematics.

    Attributes:
        name: the name as written in machine files.
        summary: one line for lists.
        tables: the tables of a machine file by name (dots for tables in tables): dataclasses of annotated fields.
        configure: makes the machine at its pose from one instance per table, by keyword.
        planar: whether its platform moves in the x-y plane only.
        chains: makes the legs at the home pose from the tables, for a family whose poses have to be solved for: joint
            coordinates are then found that close them (`kinematics.closure`), and `configure` takes these as `joints`.
        literals: the entries of its machine files that are not numbers, by table.
        links: the links with a mass, of a family in closed form.
        members: gives all links that can move of a machine written leg by leg, from its tables.
        loads: names of the loads at other points of the platform that its files have, see `named_loads`.
        own_drives: the tables that single drives have in its files.
        recipe: the recipe of a family that is made while the program runs, a function and its arguments that make it
            again elsewhere; other families are pickled by name.
    """

    name: str
    summary: str
    tables: Mapping[str, type]
    configure: Callable[..., Configuration]
    planar: bool = False
    chains: Callable[..., "Chains"] | None = None
    literals: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    links: tuple[LinkKind, ...] = ()
    members: Callable[..., list[Member]] | None = None
    loads: tuple[str, ...] = ()
    own_drives: tuple[DriveTable, ...] = ()
    recipe: tuple[Callable[..., "Family"], tuple[Any, ...]] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "tables", immutable_data(self.tables))
        object.__setattr__(self, "literals", immutable_data(self.literals))

    @property
    def components(self) -> tuple[int, ...]:
        """Places of those of rx ry rz x y z that exist."""
        return (2, 3, 4) if self.planar else (0, 1, 2, 3, 4, 5)

    @property
    def component_names(self) -> tuple[str, ...]:
        """Their names: rx ry rz x y z, or rz x y."""
        return tuple(COMPONENTS[i] for i in self.components)

    @cached_property
    def every_table(self) -> dict[str, type]:
        """Its own tables and the common ones."""
        named = {f"load.{name}": NamedLoad for name in self.loads}
        single = {table.path: table_of_one_drive(*table) for table in self.own_drives}
        return FixedDict({**self.tables, **link_tables(self.links), **COMMON_TABLES, **single, **named})


@dataclass(frozen=True)
class Written:
    """The file that a machine was read from, so that saving it keeps comments, units and order.

    Attributes:
        text: the text of its file.
        settings: overrides "path=value" with which it was read.
    """

    text: str
    settings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Machine(Immutable):
    """A machine of some family with its reference pose; never modified, only replaced.

    Attributes:
        name: the name for people.
        family: the kind of machine.
        tables: one instance per table of the family and per common one, SI.
        display: units and digits in which people read its results, from the table [display].
        written: the file it was read from; None where it was made of data. Comparisons leave it out.
        requirements: the requirements of its file's table [requirements], by name; they change no number
            (`studies.requirements`).
        tolerances: the tolerances of its file's table [tolerances], by what they are about; they change
            no number of the drawn machine.
        loaded: whether its file says `state = "loaded"` in [load]: what is shown where no quantity is named is then the
            machine at rest under its loads.
        whole_check: compares numbers that have changed, by name, with all others, as reading a file does; None of a
            machine that was not read.
    """

    name: str
    family: Family
    tables: Mapping[str, Any]
    display: Display = ENGINEERING
    written: Written | None = field(default=None, compare=False, repr=False)
    requirements: Mapping[str, Requirement] = field(default_factory=dict)
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)
    loaded: bool = False
    whole_check: Callable[["Machine", Iterable[str]], "Machine"] | None = field(default=None, compare=False, repr=False)

    sections = renamed_property("tables")
    own_sections = renamed_property("family_tables")

    def __repr__(self) -> str:
        return f"<Machine {self.name!r}, family {self.family.name}>"

    @checked
    def in_units(self, units: str) -> "Machine":
        """The machine with results shown in other units, as `--units` and [display] take them.

        Raises:
            InputError: a unit is unknown.
        """
        try:
            return replace(self, display=read_display({"units": units, "digits": self.display.digits}))
        except UnitError as error:
            raise InputError(f"{error}.") from None

    def configure(self, joints: Sequence[Scalar] = ()) -> Configuration:
        """The machine at its pose; `joints` are its coordinates where the family must be solved for them."""
        placed = {"joints": joints} if self.family.chains else {}
        return self.family.configure(**self.family_tables, **placed)

    @checked
    def with_values(self, values: Mapping[str, Given] | None = None, **fields: Given) -> "Machine":
        """The machine with other numbers, checked as a file would be: machine.with_values(x="5 mm", base_radius=0.26).

        It is of the same family, so that what has been compiled for it is used again.

        Args:
            values: the values by name of the field: SI, text with a unit, or for a field with several entries an array
                or list of one for each; infinity is "rigid". `quaternion`, `rotation` and `tilt` stand for roll, pitch
                and yaw, as in a file's [pose].
            fields: the same as keywords; dots in names are written as underscores.

        Raises:
            InputError: an unknown field, a value of another kind or out of bounds, an array of the wrong length, or
                numbers that contradict each other.
        """
        changes = {**(values or {}), **fields}
        machine = self.with_drafted_values(changes)
        return machine if self.whole_check is None else self.whole_check(machine, changes)

    def with_drafted_values(self, values: Mapping[str, Given]) -> "Machine":
        """The machine with other numbers as `with_values` takes them, of which each is only checked by itself.

        While a slider is dragged, numbers may contradict each other.

        Raises:
            InputError: as for `with_values`, but for contradictions.
        """
        changes = numbers_for(quantities(self.family.tables["pose"]), values, single_angles)
        machine = with_values(self, read_numbers(self.family, changes))
        check_contrast(machine, self.name)
        check_inertia(machine.tables, self.name)
        return machine

    def chains(self) -> Chains:
        """The legs at the home pose, for a family without closed form.

        Raises:
            InputError: the family places its joints in closed form.
        """
        if self.family.chains is None:
            raise InputError(f"family {self.family.name} places its joints in closed form and has no chains.")
        return self.family.chains(**self.family_tables)

    @property
    def family_tables(self) -> dict[str, Any]:
        """The tables that its family asks for, by name."""
        return {name: self.tables[name] for name in self.family.tables}

    @property
    def state(self) -> str:
        """The word of its file for `loaded`, a key of `STATES`."""
        return next(word for word, loaded in STATES.items() if loaded is self.loaded)

    @property
    def load(self) -> Wrench:
        """The wrench of the file's table [load], at the tool point, base axes (N·m, N)."""
        return _wrench(self.tables["load"])

    @property
    def named_loads(self) -> list[tuple[Vector, Wrench]]:
        """Point of each table [load.NAME], from P in platform axes (m), and its wrench there, base axes."""
        tables = [self.tables[f"load.{name}"] for name in self.family.loads]
        return [(Vector(*table.point), _wrench(table)) for table in tables]

    @property
    def reference(self) -> str:
        """The reference point of K, C and the load: "tool point T" if the file has a tool, else "platform point P"."""
        return "tool point T" if any(self.tables["tool"].offset) else "platform point P"

    def tool_point(self, platform: Displacement) -> Vector:
        """The tool point T in the base frame, m: P itself unless the file has a table [tool]."""
        return platform.apply(Vector(*self.tables["tool"].offset))

    def reference_point(self, configuration: Configuration) -> Vector:
        """The point of K, C and all screws in the base frame, m: the tool point, in the plane of a planar machine."""
        point = self.tool_point(configuration.platform)
        return point if configuration.plane is None else configuration.plane.nearest(point)


def _wrench(table: Any) -> Wrench:
    return Wrench(Vector(*table.moment), Vector(*table.force))


def springs(configuration: Configuration) -> list[Spring]:
    """All springs of the machine, leg by leg: the order of every per-spring result."""
    return [spring for leg in configuration.legs for spring in leg.springs]


def frame_of(machine: Machine, axes: str = "base") -> str:
    """Name the axes, "base" or "platform", and the point to which K and C of a machine refer."""
    return f"{axes} axes at the {machine.reference}"


def pose_of(machine: Machine, varied: Collection[str] = ()) -> str:
    """List the coordinates of the pose that do not vary, in the units of its display; empty where all vary."""
    numbers = values(machine)
    fixed = [p for p in parameters(machine.family) if p.path.startswith(POSE) and p.path not in varied]
    shown = (
        machine.display.show(float(numbers[p.path]), KINDS[p.quantity.kind].unit, digits=POSE_DIGITS) for p in fixed
    )
    return ", ".join(f"{p.path.removeprefix(POSE)} {text}" for p, text in zip(fixed, shown, strict=True))


def setting_of(machine: Machine, varied: Collection[str] = ()) -> str:
    """Write frame and pose in one line; the arguments are those of `pose_of`."""
    return "; ".join(text for text in (frame_of(machine), pose_of(machine, varied)) if text)
