"""The machine with its errors as geometry: every leg placed as built, for files and drawings.

Where all legs reach the drawn home place of the platform, the machine as built stands there and its actuators are
commanded otherwise; otherwise actuators stand as drawn, and the platform is where it then is. In the base frame.

Source: theory (45).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.accuracy.closing import coordinates_toward, in_lengths, independent_columns
from kinetostat.accuracy.errors import compliance_path, name_in_leg
from kinetostat.accuracy.model import ErrorModel, error_model
from kinetostat.accuracy.rows import ErrorScrews, HomeRows, LegRow
from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import ZERO, Displacement, Rotation, Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import PlacedChain, closing_gap
from kinetostat.kinematics.closing import pose_coordinates
from kinetostat.kinetostatics.response import compliance_at
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import POSE
from kinetostat.numerics.motions import Motions, exponential, still
from kinetostat.spec.errors import InputError

REACHED = 1e-9
"""Gap of a leg at the drawn home place, rad or in units of the machine's length, up to which it closes there: above
what Newton's method leaves, and far below any error that can be measured."""


@dataclass(frozen=True)
class AsBuilt:
    """A machine as built at its home place.

    Attributes:
        configuration: the machine with every leg as built.
        commands: by actuator, the coordinate that is to be commanded there, m or rad.
        coordinates: by actuator, its real coordinate, m or rad.
        senses: by actuator, 1 if its coordinate grows as its joint moves forward in a file leg by leg, otherwise -1.
    """

    configuration: Configuration
    commands: dict[str, float]
    coordinates: dict[str, float]
    senses: dict[str, float]


def as_built(machine: Machine, errors: Array, model: ErrorModel | None = None) -> AsBuilt:
    """Place a machine with its errors.

    Args:
        machine: the machine as drawn.
        errors: values of the errors, SI, in the order of its `ErrorModel` [errors].
        model: its errors at its home place (`model_at_home`), where they are known already.

    Raises:
        InputError: its legs hold the platform more than they need to, so that those of a machine with errors do not
            close without being bent.
    """
    model = model_at_home(machine) if model is None else model
    if model.overconstrained:
        raise InputError(
            f"{machine.name} is overconstrained: with these errors its legs close only by being bent, which no file of "
            "rigid links can say; use the record of the fit instead."
        )
    values = np.asarray(errors, dtype=float)
    configuration, coordinates = _configuration_near(model, values, still(1), None)
    return _with_actuators(model, values, configuration, coordinates)


def compliances_as_built(errors: Array, model: ErrorModel) -> Array:
    """Return C of a machine with errors at the tool point, at all poses of a model, base axes, SI [n x 6 x 6].

    Where all legs reach the drawn place of the platform it stands there; if they do not at some pose, actuators stand
    as drawn at all of them.

    Args:
        errors: values of the errors, SI, in the order of the model [errors].
        model: the errors of a machine that is not overconstrained.
    """
    drawn = model.drawn.state
    configuration, _ = _configuration_near(model, np.asarray(errors, dtype=float), drawn.platform, drawn.coordinates)
    rows = compliance_at(model.machine, configuration).rows()
    return stacked_columns([entry for row in rows for entry in row], len(model)).reshape(-1, 6, 6)


def _configuration_near(
    model: ErrorModel, values: Array, target: Motions, drawn: Sequence[Array] | None
) -> tuple[Configuration, list[Array]]:
    """Place all legs with errors [errors] where their platform is displaced to a target, or near it.

    Args:
        model: the errors of the machine.
        values: values of the errors.
        target: displacement of the platform from its home place [n].
        drawn: coordinates of the legs there without errors; None to have them found.
    """
    of_actuators = np.array([error.group in ("zeros", "gains") for error in model.errors])
    link_screws = model.error_screws(np.where(of_actuators, 0.0, values))
    rows, platform = model.rows, target
    coordinates = [
        drawn[number] if drawn and not screws else coordinates_toward(row, target, rows.length, screws)
        for number, (row, screws) in enumerate(zip(rows.legs, link_screws, strict=True))
    ]
    chains = _placed_chains(rows, coordinates, link_screws)
    if max(_gap(target, chain.end, rows.length) for chain in chains) > REACHED:
        # Actuators stand as drawn: the platform goes to where the legs close, and joints follow it.
        platform = model.closed_state(values).platform
        coordinates = [
            coordinates_toward(row, platform, rows.length, screws)
            for row, screws in zip(rows.legs, link_screws, strict=True)
        ]
        chains = _placed_chains(rows, coordinates, link_screws)
    factors = {e.path: 1.0 + v for e, v in zip(model.errors, values, strict=True) if e.group == "compliances"}
    legs = [
        _with_compliances(_leg_as_built(leg, row, chain, screws), factors)
        for leg, row, chain, screws in zip(rows.configuration.legs, rows.legs, chains, link_screws, strict=True)
    ]
    placement = _displacement(platform) @ rows.configuration.platform
    return replace(rows.configuration, platform=placement, legs=tuple(legs)), coordinates


def _placed_chains(rows: HomeRows, coordinates: Sequence[Array], screws: ErrorScrews) -> list[PlacedChain]:
    legs = zip(rows.legs, coordinates, screws, strict=True)
    return [row.chain.place(leg_coordinates, errors=leg_screws) for row, leg_coordinates, leg_screws in legs]


def model_at_home(machine: Machine) -> ErrorModel:
    """Return the errors of a machine at its home place: that of a family's file, or the home pose of one leg by leg."""
    pose = {}
    if machine.family.chains is not None:
        chains = machine.chains()
        home = pose_coordinates(chains.home)
        pose = {f"{POSE}{name}": np.array([float(home[name])]) for name in chains.pose}
    return error_model(machine, pose, 1, np.zeros(6))


def _gap(target: Motions, end: Motions, length: float) -> float:
    """Return the distance of the end of a leg from its target, rad or in units of the length."""
    return float(np.abs(in_lengths(closing_gap(target, end), length)).max())


def _displacement(motion: Motions) -> Displacement:
    """Return a displacement over scalars: floats at a single pose, otherwise arrays [n]."""
    if len(motion.translation) == 1:
        columns = [Vector(*column) for column in motion.rotation[0].T.tolist()]
        return Displacement(Rotation(*columns), Vector(*motion.translation[0].tolist()))
    columns = [Vector(*motion.rotation[:, :, axis].T) for axis in range(3)]
    return Displacement(Rotation(*columns), Vector(*motion.translation.T))


def _leg_as_built(leg: Leg, row: LegRow, placed: PlacedChain, screws: dict[int, Array]) -> Leg:
    """Return a leg with every element displaced by what carries it; joints by the errors before them, too.

    Args:
        leg: the leg as drawn, at its home place.
        row: the same leg as a row of motions.
        placed: the row with its errors, at the place where the leg is wanted.
        screws: the screw motions by its errors, by the number of motions before them.
    """
    chain: list[Element] = []
    for element, behind in zip(leg.chain, row.motions_before, strict=True):
        is_motion = isinstance(element, Spring) and element.actuated and behind < len(row.twists)
        is_joint = isinstance(element, Parallelogram) or element.freedoms or is_motion
        carrier = _carrier_with_error(placed, screws, behind) if is_joint else placed.before[behind]
        displaced = element.displaced(_displacement(carrier))
        if isinstance(displaced, Parallelogram) and isinstance(element, Parallelogram):
            far = _displacement(_carrier_with_error(placed, screws, behind + 1)).apply(element.far)
            displaced = replace(displaced, far=far, fixed_normal=None)
        if isinstance(displaced, Joint) and isinstance(element, Joint) and chain and behind not in screws:
            displaced = _with_same_centre(leg.chain[len(chain) - 1], chain[-1], element, displaced)
        chain.append(displaced)
    return replace(leg, chain=tuple(chain), lines=(), idle=leg.idle or _idle_freedoms(chain))


def _idle_freedoms(chain: list[Element]) -> tuple[int, ...]:
    """Return the passive freedoms that follow from those before them, as the spin of a strut, at the first pose."""
    joints = [joint for element in chain for joint in element.freedoms]
    points = [joint.point for joint in joints if joint.point is not None]
    origin = points[0] if points else ZERO
    length = max([_at_first_pose((point - origin).norm()) for point in points], default=0.0) or 1.0
    twists = [[_at_first_pose(c) for c in joint.twist(origin).components()] for joint in joints]
    independent = independent_columns(in_lengths(np.array(twists).reshape(-1, 6), length).T[None])
    return tuple(number for number in range(len(joints)) if number not in independent)


def _at_first_pose(scalar: Scalar) -> float:
    return float(np.ravel(scalar)[0])


def _with_same_centre(drawn_before: Element, before: Element, drawn: Joint, joint: Joint) -> Joint:
    """Return a joint about the very point of the one before it, if both have one point in the drawing.

    Round-off would part the points, and the axes of a Hooke joint then no longer meet.

    Args:
        drawn_before, before: the element before it, as drawn and as built.
        drawn, joint: the joint, as drawn and as built.
    """
    if not (isinstance(drawn_before, Joint) and isinstance(before, Joint)) or drawn.point is None:
        return joint
    return replace(joint, point=before.point) if drawn_before.point == drawn.point else joint


def _carrier_with_error(placed: PlacedChain, screws: dict[int, Array], behind: int) -> Motions:
    """Return the displacement of what lies behind so many motions of a leg and the error there."""
    before = placed.before[behind]
    return before @ exponential(screws[behind]) if behind in screws else before


def _with_compliances(leg: Leg, factors: dict[str, float]) -> Leg:
    """Return a leg with springs as built, by the factors of compliances; elements of several springs stay as drawn."""
    chain: list[Element] = []
    for element in leg.chain:
        if isinstance(element, Spring):
            titles = (element.part_name, element.name)
            paths = [compliance_path(leg.name, name_in_leg(title, leg.name)) for title in titles]
            factor = next((factors[path] for path in paths if path in factors), 1.0)
            element = replace(element, stiffness=element.stiffness / factor)
        chain.append(element)
    return replace(leg, chain=tuple(chain))


def _with_actuators(
    model: ErrorModel, values: Array, configuration: Configuration, coordinates: list[Array]
) -> AsBuilt:
    """Return the machine as built with its actuators: what to command, where they really are, and their senses."""
    value_by_path = {error.path: value for error, value in zip(model.errors, values, strict=True)}
    commands, real_coordinates, senses = {}, {}, {}
    for row, joints in zip(model.rows.legs, coordinates, strict=True):
        for unit in row.units:
            if unit.drive is not None:
                name, path = f"{row.name} {unit.name}", f"legs.{row.name}.{unit.name}"
                zero, gain = (value_by_path.get(f"{path}.{error}", 0.0) for error in ("zero", "gain"))
                real = unit.drive.home + unit.drive.sense * float(joints[0, unit.drive.coordinate])
                real_coordinates[name], senses[name] = real, float(unit.drive.sense)
                commands[name] = (real - zero) / (1.0 + gain)
    return AsBuilt(configuration, commands, real_coordinates, senses)
