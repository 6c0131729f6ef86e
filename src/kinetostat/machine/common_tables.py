"""Tables that any machine file may have: tool, drives, servo loops, damping, cutting, loads and cables.

The table [limits] is in `limits`. The texts are those of help, forms and the JSON Schema.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from kinetostat.machine.limits import Limits
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import (
    LEAST_OF_KIND,
    Field,
    Quantity,
    along_axes,
    inertia_tensor,
    made_table,
    quantities,
    table,
)
from kinetostat.tolerances import ROUND_OFF_OF_INERTIA

Three = tuple[float, float, float]
Six = tuple[float, float, float, float, float, float]
NO_VECTOR: Three = (0.0, 0.0, 0.0)
NO_INERTIA: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
Moment = Annotated[Three, along_axes("moment", "moment about x, y, z")]
Force = Annotated[Three, along_axes("force", "force along x, y, z")]


@table
class Tool:
    """Table [tool], in any machine file: where on the platform loads act and motions are given."""

    offset: Annotated[
        Three, along_axes("length", "tool point T from P in platform axes: x, y, z; K, C and the load are given at T")
    ] = NO_VECTOR
    mass: Annotated[float, Quantity("mass", "mass of the platform and the tool together; 0: not counted")] = 0.0
    centre_of_mass: Annotated[
        Three, along_axes("length", "centre of mass of platform and tool, from P in platform axes: x, y, z")
    ] = NO_VECTOR
    payload: Annotated[float, Quantity("mass", "mass of what the tool carries; 0: nothing")] = 0.0
    payload_centre: Annotated[
        Three, along_axes("length", "centre of the payload from the tool point T in platform axes")
    ] = NO_VECTOR
    inertia: Annotated[
        Six,
        inertia_tensor("inertia of platform and tool about centre_of_mass, platform axes: xx, yy, zz, xy, xz, yz"),
    ] = NO_INERTIA
    payload_inertia: Annotated[
        Six, inertia_tensor("inertia of the payload about payload_centre, in the order of inertia")
    ] = NO_INERTIA


@table
class Drives:
    """Table [drives], in any machine file: rotors, gears and friction of all actuators; [drives.NAME] is for one."""

    rotor_inertia: Annotated[
        float, Quantity("moment of inertia", "inertia of the rotor of each actuator with all that turns with it")
    ] = 0.0
    lead: Annotated[
        float, Quantity("length", "travel of a linear actuator per turn of its rotor", least=LEAST_OF_KIND["length"])
    ] = 0.0
    ratio: Annotated[float, Quantity("ratio", "turns of the rotor per turn of a rotary actuator")] = 0.0
    rotor_damping: Annotated[float, Quantity("torsional damping", "viscous friction that each rotor meets")] = 0.0
    rotor_friction: Annotated[
        float, Quantity("torsional friction", "Coulomb friction that each rotor meets: the same at every speed")
    ] = 0.0
    guide_friction: Annotated[
        float, Quantity("linear friction", "Coulomb friction of a linear actuator in its guide, behind its screw")
    ] = 0.0
    bearing_friction: Annotated[
        float, Quantity("torsional friction", "Coulomb friction of a rotary actuator in its bearing, behind its gear")
    ] = 0.0
    efficiency: Annotated[
        float,
        Quantity("ratio", "share of the rotor's power that gear or screw pass on, and back", positive=True, most=1.0),
    ] = 1.0
    backlash: Annotated[float, Quantity("length", "lost motion of a linear actuator where its direction reverses")] = (
        0.0
    )
    angular_backlash: Annotated[
        float, Quantity("angle", "lost motion of a rotary actuator where its direction reverses")
    ] = 0.0


@table
class ServoGains:
    """Table [servo], in any machine file: the servo loops of all drives, and in [servo.NAME] that of one.

    The transmission between motor and joint has the stiffness of the actuator. The position loop asks for a speed in
    proportion to the position error, and the velocity loop for a torque in proportion to the speed error and to its
    integral.
    """

    position_gain: Annotated[float, Quantity("rate", "speed that the position loop asks for, per position error")] = 0.0
    velocity_gain: Annotated[
        float, Quantity("torsional damping", "torque of the rotor that the velocity loop asks for, per speed error")
    ] = 0.0
    integral_time: Annotated[
        float,
        Quantity(
            "duration",
            "after which the integral part of a constant speed error equals the proportional part; 0: no integral part",
        ),
    ] = 0.0
    position_at_load: Annotated[
        float,
        Quantity(
            "ratio", "share of the position measured behind the transmission; 0: at the motor, 1: by a scale", most=1.0
        ),
    ] = 0.0


@table
class Damping:
    """Table [damping], in any machine file: damping of vibrations, and friction of joints in motion."""

    ratio: Annotated[float, Quantity("ratio", "damping ratio of every mode, added to all other damping")] = 0.0
    per_mass: Annotated[float, Quantity("rate", "Rayleigh damping in proportion to mass")] = 0.0
    per_stiffness: Annotated[float, Quantity("duration", "Rayleigh damping in proportion to stiffness")] = 0.0
    hinges: Annotated[float, Quantity("torsional damping", "viscous friction of each passive joint that turns")] = 0.0
    slides: Annotated[float, Quantity("linear damping", "viscous friction of each passive joint that slides")] = 0.0
    hinge_friction: Annotated[
        float, Quantity("torsional friction", "Coulomb friction of each passive joint that turns, at any speed")
    ] = 0.0
    slide_friction: Annotated[
        float, Quantity("linear friction", "Coulomb friction of each passive joint that slides, at any speed")
    ] = 0.0


@table
class Cutting:
    """Table [cutting], in any machine file: the force of the cut, for its stability."""

    pressure: Annotated[float, Quantity("cutting pressure", "cutting force per area of the chip")] = 0.0
    direction: Annotated[
        Three, along_axes("direction", "direction across the cut, in which a vibration changes the chip; base axes")
    ] = NO_VECTOR


@table
class Load:
    """Table [load], in any machine file: a wrench on the platform at the tool point, and gravity; base axes."""

    moment: Moment = NO_VECTOR
    force: Force = NO_VECTOR
    gravity: Annotated[
        Three, along_axes("acceleration", "gravity along x, y, z: pulls at the platform and, under load, at all links")
    ] = NO_VECTOR
    gravity_angle: Annotated[float, Quantity("angle", "angle by which gravity is turned about gravity_axis")] = 0.0
    gravity_axis: Annotated[
        Three, along_axes("direction", "axis about which gravity_angle turns gravity, of any length")
    ] = (1.0, 0.0, 0.0)
    min_tension: Annotated[
        float, Quantity("force", "least load of what only pulls or pushes; chooses preloads", unset=math.inf)
    ] = math.inf
    max_tension: Annotated[float, Quantity("force", "greatest load of what only pulls or pushes", unset=math.inf)] = (
        math.inf
    )


@table
class CableTable:
    """Table [cables], in any machine file: how tensions are distributed, the wrenches they must hold, and the cables.

    The distribution counts wherever tensions are chosen; the rest counts for `tensions` and for capacity alone.
    """

    level: Annotated[float, Quantity("force", "tension to which all are brought as near as can be; 0: the least")] = 0.0
    exponent: Annotated[
        float,
        Quantity(
            "ratio",
            "power p, 2 to 50: tensions make the sum of |tension - level|^p least",
            positive=True,
            least=2.0,
            most=50.0,
        ),
    ] = 2.0
    force_box: Annotated[
        Three,
        along_axes("force", "half sizes of the box of forces about the load that must be held as well, base axes"),
    ] = NO_VECTOR
    moment_box: Annotated[
        Three,
        along_axes("moment", "half sizes of the box of moments about the load that must be held as well, base axes"),
    ] = NO_VECTOR
    linear_density: Annotated[
        float,
        Quantity("linear density", "mass per length of unstretched cable, which then sags; 0: cables are straight"),
    ] = 0.0
    pulley_radius: Annotated[
        float,
        Quantity(
            "length", "radius of pulleys at the base, which swivel about the vertical through their joint; 0: none"
        ),
    ] = 0.0


@table
class NamedLoad:
    """Table [load.NAME], in any machine file: another wrench on the platform, at a point of it; base axes."""

    point: Annotated[Three, along_axes("length", "where it acts: from P, in platform axes: x, y, z")] = NO_VECTOR
    moment: Moment = NO_VECTOR
    force: Force = NO_VECTOR


STATES = {"free": False, "loaded": True}
"""Words of `state` in the table [load], and whether the machine is then shown at rest under its loads."""

COMMON_TABLES = {
    "tool": Tool,
    "drives": Drives,
    "servo": ServoGains,
    "damping": Damping,
    "cutting": Cutting,
    "load": Load,
    "cables": CableTable,
    "limits": Limits,
}
"""The tables that any machine file may have, by name."""


def table_of_one_drive(path: str, fields: Sequence[str]) -> type:
    """Make the class of the table of a single drive from the fields that are written in it.

    Args:
        path: the path of the table, such as "servo.leg 1".
        fields: names of the fields; the table of all drives, "servo" here, has them as well.
    """
    known = quantities(COMMON_TABLES[path.partition(".")[0]])
    return made_table("DriveTable", {field: Field(known[field]) for field in fields})


FRICTION_OF_JOINTS = ("damping.hinge_friction", "damping.slide_friction")
"""Paths of the Coulomb friction of passive joints."""
DYNAMIC_FIELDS = ("tool.inertia", "tool.payload_inertia", "drives.", "servo.", "damping.", "cutting.")
"""Beginnings of the paths of fields that count only where something moves: in vibrations, motions and lost motion."""


def check_inertia(tables: Mapping[str, Any], origin: str) -> None:
    """Refuse an inertia tensor that no body has, and that of a link without a mass.

    Args:
        tables: the tables of a machine, by dotted name.
        origin: name of the machine in messages.

    Raises:
        InputError: a tensor is impossible; the message names the field.
    """
    for path, numbers in tables.items():
        for name in ("inertia", "payload_inertia"):
            tensor = getattr(numbers, name, None)
            if tensor is None:
                continue
            subject = f'"{origin}": {path}.{name} is {", ".join(f"{entry:g}" for entry in tensor)} kg·m²'
            if not is_tensor_of_body(tensor):
                raise InputError(
                    f"{subject}, which no body has: about any axis it must not be negative, nor more than about two "
                    "axes across it together; check the signs and the order xx, yy, zz, xy, xz, yz."
                )
            if path != "tool" and any(tensor) and not numbers.mass:
                raise InputError(f"{subject}, but {path}.mass is 0; give the link its mass, or leave its inertia out.")


def is_tensor_of_body(tensor: Sequence[float]) -> bool:
    """Whether some body has this inertia: xx, yy, zz, xy, xz, yz about its centre of mass, kg·m².

    With half its trace h, the matrix h 1 - I is the sum of m x x^T over a body, which is positive semidefinite. Its
    pivots are tested, after the rounding of files has been added to its diagonal.
    """
    xx, yy, zz, xy, xz, yz = tensor
    half_trace = 0.5 * (xx + yy + zz) + ROUND_OFF_OF_INERTIA * max(abs(entry) for entry in tensor)
    if half_trace == 0.0:
        return True
    first = half_trace - xx
    if first <= 0.0:
        return False
    second, coupling = half_trace - yy - xy * xy / first, yz + xy * xz / first
    return second > 0.0 and half_trace - zz - xz * xz / first - coupling * coupling / second > 0.0
