"""The machine with its errors as geometry: every leg placed as built, for files and drawings.

Where all legs reach the drawn home place of the platform, the machine as built stands there and its actuators are
commanded otherwise; otherwise actuators stand as drawn, and the platform is where it then is. In the base frame.

Source: theory (45).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.accuracy.closing import coordinates_toward, in_lengths, independent_columns
from kinetostat.accuracy.model import ErrorModel, error_model
from kinetostat.accuracy.rows import Errors, LegRow
from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import ZERO, Displacement, Rotation, Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import PlacedChain, closing_gap
from kinetostat.kinematics.closing import pose_of
from kinetostat.kinetostatics.response import compliance_at
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import POSE
from kinetostat.numerics.motions import Motions, exponential, still
from kinetostat.spec.errors import InputError

REACHED = 1e-9
"""Gap of a leg at the drawn home place, rad or in units of the machine's length, with which it counts as reached."""


@dataclass(frozen=True)
class AsBuilt:
    """A machine as built at its home place.

    Attributes:
        configuration: with every leg where it is.
        commands: by actuator, the coordinate that is to be commanded there, m or rad.
        coordinates: by actuator, where it really stands.
        senses: by actuator, 1 or -1: whether its coordinate grows as its joint moves forward in a file leg by leg.
    """

    configuration: Configuration
    commands: dict[str, float]
    coordinates: dict[str, float]
    senses: dict[str, float]


def as_built(machine: Machine, errors: Array, model: ErrorModel | None = None) -> AsBuilt:
    """Place a machine with its errors.

    Args:
        machine: as drawn.
        errors: SI, in the order of its `ErrorModel` [errors].
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
    return AsBuilt(configuration, *_commands(model, values, coordinates))


def compliances_as_built(errors: Array, model: ErrorModel) -> Array:
    """C of a machine with errors at the tool point, at all poses of a model, base axes, SI [n x 6 x 6].

    Where all legs reach the drawn place of the platform it stands there; if they do not at some pose, actuators stand
    as drawn at all of them.

    Args:
        errors: SI, in the order of the model [errors].
        model: of a machine that is not overconstrained.
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
        model: of the machine.
        values: of the errors.
        target: displacement of the platform from its home place [n].
        drawn: coordinates of the legs there without errors; None to have them found.
    """
    actuators = np.array([error.group in ("zeros", "gains") for error in model.errors])
    links = model.leg_errors(np.where(actuators, 0.0, values))
    rows = model.rows
    coordinates = [
        drawn[number] if drawn and not links[number] else coordinates_toward(row, target, rows.length, links[number])
        for number, row in enumerate(rows.legs)
    ]
    every = zip(rows.legs, coordinates, links, strict=True)
    gaps = [_gap(target, row.chain.place(q, errors=e).end, rows.length) for row, q, e in every]
    platform = target
    if max(gaps) > REACHED:
        platform, coordinates = _driven_legs(model, values, links)
    places = [row.chain.place(q, errors=e) for row, q, e in zip(rows.legs, coordinates, links, strict=True)]
    parts = zip(rows.configuration.legs, rows.legs, places, links, strict=True)
    legs = [_leg(leg, row, place, link) for leg, row, place, link in parts]
    softer = {e.path: 1.0 + v for e, v in zip(model.errors, values, strict=True) if e.group == "compliances"}
    legs = [replace(leg, chain=tuple(_softer(leg, part, softer) for part in leg.chain)) for leg in legs]
    configuration = replace(
        rows.configuration, platform=_displacement(platform) @ rows.configuration.platform, legs=tuple(legs)
    )
    return configuration, coordinates


def model_at_home(machine: Machine) -> ErrorModel:
    """The errors of a machine at its home place: that of a family's file, or the home pose of one leg by leg."""
    return error_model(machine, _home_pose(machine), 1, np.zeros(6))


def _home_pose(machine: Machine) -> dict[str, Array]:
    """The pose at the home place: that of a family's file, or the home pose of a machine leg by leg."""
    if machine.family.chains is None:
        return {}
    chains = machine.chains()
    home = pose_of(chains.home)
    return {f"{POSE}{name}": np.array([float(home[name])]) for name in chains.pose}


def _gap(target: Motions, end: Motions, length: float) -> float:
    """Distance of the end of a leg from its target, rad or in units of the length."""
    return float(np.abs(in_lengths(closing_gap(target, end), length)).max())


def _driven_legs(model: ErrorModel, values: Array, links: Errors) -> tuple[Motions, list[Array]]:
    """Place the platform with actuators as drawn, and all joints with it, actuators with their errors."""
    state = model.closed_state(values)
    coordinates = [
        coordinates_toward(row, state.platform, model.rows.length, errors)
        for row, errors in zip(model.rows.legs, links, strict=True)
    ]
    return state.platform, coordinates


def _displacement(motion: Motions) -> Displacement:
    """As scalars: floats at a single pose, else arrays [n]."""
    if len(motion.translation) == 1:
        columns = [Vector(*column) for column in motion.rotation[0].T.tolist()]
        return Displacement(Rotation(*columns), Vector(*motion.translation[0].tolist()))
    columns = [Vector(*motion.rotation[:, :, axis].T) for axis in range(3)]
    return Displacement(Rotation(*columns), Vector(*motion.translation.T))


def _leg(leg: Leg, row: LegRow, place: PlacedChain, errors: dict[int, Array]) -> Leg:
    """A leg with every element displaced by what carries it."""
    chain: list[Element] = []
    for element, behind in zip(leg.chain, row.carried, strict=True):
        joint = isinstance(element, Parallelogram) or element.freedoms or _moving(element, behind, row)
        motion = _displacement(_carrying(place, errors, behind) if joint else place.before[behind])
        moved = element.displaced(motion)
        if isinstance(moved, Parallelogram) and isinstance(element, Parallelogram):
            far = _displacement(_carrying(place, errors, behind + 1)).apply(element.far)
            moved = replace(moved, far=far, fixed_normal=None)
        if isinstance(moved, Joint) and isinstance(element, Joint) and chain and behind not in errors:
            moved = _same_centre(leg.chain[len(chain) - 1], chain[-1], element, moved)
        chain.append(moved)
    return replace(leg, chain=tuple(chain), lines=(), idle=leg.idle or _idle(chain))


def _idle(chain: list[Element]) -> tuple[int, ...]:
    """The passive freedoms that follow from those before them, such as the spin of a strut, at the first pose."""
    joints = [joint for element in chain for joint in element.freedoms]
    points = [joint.point for joint in joints if joint.point is not None]
    about = points[0] if points else ZERO
    length = max([_first((point - about).norm()) for point in points], default=0.0) or 1.0
    twists = np.array([[_first(c) for c in joint.twist(about).components()] for joint in joints]).reshape(-1, 6)
    chosen = independent_columns(in_lengths(twists, length).T[None])
    return tuple(number for number in range(len(joints)) if number not in chosen)


def _first(scalar: Scalar) -> float:
    return float(np.ravel(scalar)[0])


def _same_centre(drawn: Element, before: Element, element: Joint, moved: Joint) -> Joint:
    """A joint about the very point of the one before it, if both have one point in the drawing: round-off apart."""
    if not (isinstance(drawn, Joint) and isinstance(before, Joint)) or element.point is None:
        return moved
    return replace(moved, point=before.point) if drawn.point == element.point else moved


def _moving(element: Element, behind: int, row: LegRow) -> bool:
    """Whether a spring is a motion of the row."""
    return isinstance(element, Spring) and element.actuated and behind < len(row.twists)


def _carrying(place: PlacedChain, errors: dict[int, Array], behind: int) -> Motions:
    before = place.before[behind]
    return before @ exponential(errors[behind]) if behind in errors else before


def _softer(leg: Leg, element: Element, softer: dict[str, float]) -> Element:
    """A spring with its compliance as built; elements of several springs stay as they are drawn."""
    if not isinstance(element, Spring):
        return element
    names = (element.of, element.name)
    paths = [f"legs.{leg.name}.{name.removeprefix(f'{leg.name} ').replace('.', ' ')}.compliance" for name in names]
    factor = next((softer[path] for path in paths if path in softer), 1.0)
    return replace(element, stiffness=element.stiffness / factor)


def _commands(model: ErrorModel, values: Array, coordinates: list[Array]) -> tuple[dict[str, float], ...]:
    """Coordinates to command there, those at which actuators really stand, and the senses of their counts, by joint."""
    known = {error.path: value for error, value in zip(model.errors, values, strict=True)}
    commands, stands, senses = {}, {}, {}
    for row, joints in zip(model.rows.legs, coordinates, strict=True):
        for unit in (unit for unit in row.units if unit.drive):
            drive, path = unit.drive, f"legs.{row.name}.{unit.name}"
            if drive is not None:
                stand = drive.home + drive.sense * float(joints[0, drive.coordinate])
                name = f"{row.name} {unit.name}"
                stands[name], senses[name] = stand, float(drive.sense)
                commands[name] = (stand - known.get(f"{path}.zero", 0.0)) / (1.0 + known.get(f"{path}.gain", 0.0))
    return commands, stands, senses
