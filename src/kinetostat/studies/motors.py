"""Motors, gears and screws of a catalogue, and which motors fit a motion of a machine. Nothing is drawn here.

A motor fits if its torque is within the peak limit at every point of the motion, the root of the mean square of its
torque is within the continuous limit at the root of the mean square of its speed, and it never turns too fast. Each
motor must accelerate its own rotor as well, so that the same motion asks another torque of each.

Source: theory (100).
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from kinetostat.arrays import Array
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.drive_limits import driven_springs
from kinetostat.machine.actuators import name_of, with_every_drive
from kinetostat.machine.cross_section import MATERIALS
from kinetostat.machine.machine import Machine
from kinetostat.spec import document as documents
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.fields import Quantity, quantities, table
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.drives import DriveLoads, drive_loads, root_mean_square
from kinetostat.studies.dynamics import rigid_form_of
from kinetostat.studies.motions import Motion, read_motion, required_motion
from kinetostat.units import UnitError

CATALOGUE = Path(__file__).with_name("catalogue.toml")
"""The catalogue that comes with kinetostat."""
SOURCE = "source"
"""Field of an entry of a catalogue that says where its numbers are printed."""


@table
class MotorRating:
    """A table [motors.NAME] of a catalogue: a motor that turns."""

    torque: Annotated[float, Quantity("moment", "continuous torque, up to the rated speed", positive=True)]
    peak_torque: Annotated[
        float, Quantity("moment", "greatest torque for a short while, up to the rated speed", positive=True)
    ]
    rated_speed: Annotated[float, Quantity("rate", "speed up to which these torques hold", positive=True)]
    greatest_speed: Annotated[float, Quantity("rate", "speed that the motor must not exceed", positive=True)]
    inertia: Annotated[float, Quantity("moment of inertia", "of its rotor")]

    def limit(self, peak: bool, speeds: Array) -> Array:
        """The torque limit at speeds: constant up to the rated one, then of constant power, and 0 beyond the greatest.

        Args:
            peak: whether to take the limit for a short while, otherwise the continuous one.
            speeds: speeds of the motor, rad/s [n].

        Returns:
            N·m [n].

        Source: theory (100).
        """
        sizes = np.maximum(np.abs(speeds), self.rated_speed)
        torques = (self.peak_torque if peak else self.torque) * self.rated_speed / sizes
        return np.asarray(np.where(sizes > self.greatest_speed, 0.0, torques))


@table
class GearRating:
    """A table [gears.NAME] of a catalogue."""

    ratio: Annotated[float, Quantity("ratio", "turns of the motor per turn of the drive", positive=True)]
    efficiency: Annotated[float, Quantity("ratio", "share of power that it passes on", positive=True, most=1.0)] = 1.0
    inertia: Annotated[float, Quantity("moment of inertia", "of what turns in it, at the motor")] = 0.0


@table
class ScrewRating:
    """A table [screws.NAME] of a catalogue."""

    lead: Annotated[float, Quantity("length", "travel per turn of the motor", positive=True)]
    efficiency: Annotated[float, Quantity("ratio", "share of power that it passes on", positive=True, most=1.0)] = 1.0
    inertia: Annotated[float, Quantity("moment of inertia", "of what turns in it beside the shaft")] = 0.0
    shaft: Annotated[float, Quantity("linear moment of inertia", "of the screw shaft per length")] = 0.0
    diameter: Annotated[float, Quantity("length", "of a solid steel shaft, if `shaft` is not given")] = 0.0
    length: Annotated[float, Quantity("length", "of the screw shaft")] = 0.0

    @property
    def total_inertia(self) -> float:
        """Moment of inertia of all that turns with the screw, kg·m².

        Per length, a solid shaft has pi / 32 times its density times the fourth power of its diameter.
        """
        solid = math.pi / 32.0 * MATERIALS["steel"].density * self.diameter**4
        return self.inertia + (self.shaft or solid) * self.length


TABLES: Mapping[str, Any] = {"motors": MotorRating, "gears": GearRating, "screws": ScrewRating}
"""Tables of a catalogue, with the class of their entries; `Catalogue` has a field of each name."""


@dataclass(frozen=True, eq=False)
class Catalogue(ImmutableAnswer):
    """Motors, gears and screws by name, and where their numbers are printed, by table and name."""

    motors: Mapping[str, MotorRating]
    gears: Mapping[str, GearRating]
    screws: Mapping[str, ScrewRating]
    sources: Mapping[tuple[str, str], str]


def read_catalogue(path: Path | None = None) -> Catalogue:
    """Read a catalogue.

    Args:
        path: path of its TOML file; that of kinetostat if None.

    Raises:
        InputError: there is no such file, or one of its entries has a mistake: names the entry and the field.
    """
    path = path or CATALOGUE
    return catalogue_of(documents.read(path), path.name)


def catalogue_of(document: documents.Document, origin: str) -> Catalogue:
    """Read the catalogue in a document; `origin` names it in messages.

    Raises:
        InputError: one of its entries has a mistake: names the entry and the field.
    """
    ratings: dict[str, dict[str, Any]] = {table_name: {} for table_name in TABLES}
    sources: dict[tuple[str, str], str] = {}
    for table_name, entries in document.items():
        choice(table_name, TABLES, f'the table of "{origin}"')
        if not isinstance(entries, dict):
            raise InputError(
                f'"{origin}": {table_name} is not a table; write [{table_name}.NAME] with its numbers below.'
            )
        for name, written in entries.items():
            where = f'"{origin}": {table_name}.{documents.toml_key(name)}'
            ratings[table_name][name] = _rating(TABLES[table_name], where, written)
            sources[table_name, name] = str(written.get(SOURCE, ""))
    return Catalogue(**ratings, sources=sources)


def _rating(kind: Any, where: str, written: Any) -> Any:
    """Read an entry of a table.

    Args:
        kind: class of the entries of the table, see `TABLES`.
        where: the entry, for messages.
        written: the entry as the document has it.
    """
    if not isinstance(written, dict):
        raise InputError(f"{where} is not a table; write its fields below its name in brackets.")
    fields, values = quantities(kind), dict[str, float | tuple[float, ...]]()
    for field, value in written.items():
        choice(field, [*fields, SOURCE], f"the field of {where}")
        if field == SOURCE:
            continue
        try:
            values[field] = fields[field].read(value)
        except UnitError as error:
            raise InputError(f"{where}.{field} is {shorten(value)}: {error}.") from None
    missing = [field for field in fields if field not in values and not hasattr(kind, field)]
    if missing:
        raise InputError(f"{where} lacks {missing[0]}, {fields[missing[0]].meaning}.")
    return kind(**values)


@former_names(fits="suffices")
@dataclass(frozen=True)
class MotorCandidate:
    """A motor along a motion.

    Attributes:
        name: name of the motor.
        motor: numbers of the motor.
        loads: the demands of the motion on drives with its rotor.
        drive: name of the drive that uses the greatest share of a limit.
        peak: share of the peak limit that is used, at the worst point of the worst drive; infinite if too fast.
        continuous: share of the continuous limit that is used.
        speed: share of the greatest speed that is used.
        inertia_ratio: greatest inertia of the load over that of the motor; None where it is not known.
        source: place where the numbers of the motor are printed.
    """

    name: str
    motor: MotorRating
    loads: DriveLoads
    drive: str
    peak: float
    continuous: float
    speed: float
    inertia_ratio: float | None
    source: str = ""

    @property
    def greatest_share(self) -> float:
        """The greatest of the shares: the motor fits up to 1."""
        return max(self.peak, self.continuous, self.speed)

    @property
    def hardest(self) -> tuple[str, float]:
        """The limit of which the greatest share is used, in words, and that share; the speed if it leaves no torque."""
        shares = {"speed": self.speed, "peak torque": self.peak, "continuous torque": self.continuous}
        return max(shares.items(), key=lambda item: item[1] if math.isfinite(item[1]) else 0.0)

    @property
    def suffices(self) -> bool:
        """Whether the motor does what the motion asks."""
        return self.greatest_share <= 1.0


@former_names(fits="candidates")
@dataclass(frozen=True, eq=False)
class MotorChoice(ImmutableAnswer):
    """The motors of a catalogue along a motion.

    Attributes:
        machine: the machine with lead or ratio of its drives.
        status: status of the first pose without an answer, else OK.
        message: the answer in a sentence.
        candidates: each motor along the motion: those that fit, the smallest first, then the others, the nearest to
            fitting first; none without an answer.
        requirements: verdicts on the motors that the machine's file requires, where they were asked for.
    """

    machine: Machine
    status: Status
    message: str
    candidates: tuple[MotorCandidate, ...] = ()
    requirements: tuple[Any, ...] = ()

    def __repr__(self) -> str:
        return f"<Motors for {self.machine.name!r}: {self.message}>"


@checked
def motors(
    machine: Machine,
    motion: Path | Motion | None = None,
    catalogue: Path | None = None,
    gear: str = "",
    screw: str = "",
    points: int = 400,
) -> MotorChoice:
    """Find which motors of a catalogue fit a motion of a machine.

    Args:
        machine: a machine with masses, friction, and lead or ratio of its drives, unless a gear or a screw is chosen.
        motion: a motion, or the path of its CSV file; that of the requirements of the machine's file if None.
        catalogue: path of the file; that of kinetostat if None.
        gear, screw: names of a gear for rotary drives, or a screw for linear ones, of the catalogue; none if empty.
        points: number of points of the motion that are looked at, about.

    Raises:
        InputError: no motion, a mistake in a file, an unknown gear or screw, or motors of which nothing says how far
            they turn.
    """
    products = read_catalogue(catalogue)
    if not products.motors:
        raise InputError("the catalogue has no motors; write [motors.NAME] with torques, speeds and inertia.")
    geared, inertia = with_transmission(machine, products, gear, screw)
    if isinstance(motion, Path):
        motion = read_motion(geared, motion, points)
    elif motion is None:
        motion = required_motion(geared, points)
    if motion is None:
        raise InputError(
            "no motion is given, and the file requires no motor for one; name its CSV file, or write the requirement "
            f'drives = {{ fits = "{next(iter(products.motors))}", motion = "motion.csv" }}.'
        )
    candidates = []
    for name in products.motors:
        loads = loads_with(geared, products.motors[name], inertia, motion)
        if loads.curves is None or not loads.drives:
            return MotorChoice(geared, loads.status, loads.message)
        candidates.append(candidate_of(products, name, loads))
    ordered = tuple(sorted(candidates, key=_order))
    return MotorChoice(machine=geared, status=Status.OK, message=_message(ordered), candidates=ordered)


def _order(candidate: MotorCandidate) -> tuple[bool, float]:
    """Those that fit come first, by torque; then the others, by the limit that they miss most."""
    return not candidate.suffices, candidate.motor.torque if candidate.suffices else candidate.hardest[1]


def with_transmission(machine: Machine, catalogue: Catalogue, gear: str, screw: str) -> tuple[Machine, float]:
    """The machine with a gear or a screw of a catalogue, and the inertia of what turns with each rotor then, kg·m².

    Raises:
        InputError: there is no gear or screw of that name, both are chosen, or the machine has drives of the other
            kind.
    """
    if gear and screw:
        raise InputError(
            "gear and screw are both given; a gear is for rotary drives and a screw for linear ones, choose one."
        )
    if gear or screw:
        _check_kind_of_drives(machine, linear=bool(screw))
    settings, inertia = dict[str, float](), 0.0
    if gear:
        chosen_gear = catalogue.gears[choice(gear, catalogue.gears, "the gear of the catalogue")]
        settings |= {"drives.ratio": chosen_gear.ratio, "drives.efficiency": chosen_gear.efficiency}
        inertia += chosen_gear.inertia
    if screw:
        chosen_screw = catalogue.screws[choice(screw, catalogue.screws, "the screw of the catalogue")]
        settings |= {"drives.lead": chosen_screw.lead, "drives.efficiency": chosen_screw.efficiency}
        inertia += chosen_screw.total_inertia
    return with_every_drive(machine, settings), inertia


def _check_kind_of_drives(machine: Machine, linear: bool) -> None:
    """Refuse a screw where a drive is rotary, and a gear where one is linear: its efficiency would count there too."""
    others = [s for s in driven_springs(state_of(machine).configuration) if (s.joint.point is None) is not linear]
    if others:
        chosen, needed, kind = ("screw", "linear", "rotary") if linear else ("gear", "rotary", "linear")
        raise InputError(
            f"a {chosen} is for {needed} drives, and the drive {name_of(others[0])} of {machine.name} is {kind}; leave "
            f"{chosen} out, and write lead or ratio, and efficiency, under [drives]."
        )


def loads_with(machine: Machine, motor: MotorRating, inertia: float, motion: Motion) -> DriveLoads:
    """The demands of a motion on the drives of a machine with the rotors of a motor.

    Args:
        machine: the machine with lead or ratio of its drives.
        motor: the motor of all drives.
        inertia: inertia that turns with each rotor, kg·m².
        motion: the motion.

    Raises:
        InputError: nothing says how far the motors turn.
    """
    state = state_of(with_every_drive(machine, {"drives.rotor_inertia": motor.inertia + inertia}))
    loads = drive_loads(state, rigid_form_of(state), motion)
    if any(not drive.rotary for drive in loads.drives):
        raise InputError(
            f"nothing says how far the motors of {machine.name} turn; give drives.lead or drives.ratio, or choose "
            "a screw or a gear of the catalogue."
        )
    return loads


def candidate_of(catalogue: Catalogue, name: str, loads: DriveLoads) -> MotorCandidate:
    """Compare what a motion asks with what a motor of a catalogue may give.

    Args:
        catalogue: the catalogue.
        name: name of the motor.
        loads: the demands of the motion on drives with this motor's rotors.

    Raises:
        ValueError: the loads have no curves, because the motion has no answer.
    """
    motor = catalogue.motors[name]
    if loads.curves is None or loads.motion is None:
        raise ValueError("a motion without an answer asks nothing of a motor")
    torques, speeds = np.abs(loads.curves.motor_torque), np.abs(loads.curves.motor_speed)
    shares = []
    for torque, speed, drive in zip(torques, speeds, loads.drives, strict=True):
        rms_speed = root_mean_square(loads.motion.times, speed)
        limit_at_rms_speed = motor.limit(peak=False, speeds=np.array([rms_speed]))
        shares.append(
            _Shares(
                peak=_greatest_share(torque, motor.limit(peak=True, speeds=speed)),
                continuous=_greatest_share(np.array([drive.rms_torque]), limit_at_rms_speed),
                speed=drive.motor_speed / motor.greatest_speed,
            )
        )
    hardest = max(range(len(shares)), key=lambda k: max(shares[k]))
    ratios = [drive.inertia_ratio for drive in loads.drives if drive.inertia_ratio is not None]
    return MotorCandidate(
        name=name,
        motor=motor,
        loads=loads,
        drive=loads.drives[hardest].name,
        peak=max(share.peak for share in shares),
        continuous=max(share.continuous for share in shares),
        speed=max(share.speed for share in shares),
        inertia_ratio=max(ratios, default=None),
        source=catalogue.sources["motors", name],
    )


class _Shares(NamedTuple):
    """Shares of the limits of a motor that one drive uses: of peak torque, of continuous torque, and of speed."""

    peak: float
    continuous: float
    speed: float


def _greatest_share(torque: Array, limit: Array) -> float:
    """The greatest share of a limit that is used; infinite where there is a torque and no limit left."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(torque == 0.0, 0.0, torque / limit)
    return float(shares.max())


def _message(candidates: tuple[MotorCandidate, ...]) -> str:
    count = sum(candidate.suffices for candidate in candidates)
    best = candidates[0]
    if not count:
        return f"No motor fits: of {best.name}, the nearest, the motion asks {share_in_words(best)}."
    share = f"{100.0 * best.greatest_share:.0f} %"
    return f"{best.name} fits: the motion uses {share} of what it may give; {count} of {len(candidates)} motors fit."


def share_in_words(candidate: MotorCandidate) -> str:
    """The share of the limit that a motion comes nearest to, such as "87 % of its peak torque"."""
    limit, share = candidate.hardest
    return f"{100.0 * share:.0f} % of its {limit}"
