"""The numbers that the page offers as sliders: which there are, in which panel, over which range.

Positions of a slider become SI values and back; the sliders themselves are elements of the page. The factor by which
the deflected shape is exaggerated has a slider as well, although the machine has no such number.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

from kinetostat.equilibrium.cables import cable_signs
from kinetostat.frozen import dataclass
from kinetostat.machine.common_tables import DYNAMIC_FIELDS
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import AXES, VECTORS, Parameter, parameters, values
from kinetostat.spec.document import parse
from kinetostat.spec.errors import InputError, shorten
from kinetostat.studio.wording import label, table_of
from kinetostat.units import KINDS

CONTROL_PANELS = ("Pose", "Geometry", "Stiffness", "Mass", "Load")
"""Panels of the controls, in the order of their tabs."""
SLIDER_STEPS = 1000
"""Positions of a slider: more than it has pixels."""
LENGTH_SHARE = 0.75
"""Range of a length about its value, in units of the machine's length in the pose, of the value itself elsewhere."""
ANGLE_RANGES = {"pose": math.radians(40.0), "geometry": math.radians(30.0), "load": math.pi}
"""Range of an angle about its value, rad."""
STIFFNESS_FACTOR = 1e3
"""Factor by which a stiffness varies about its value, up and down: from a rubber to a rigid part."""
USUAL_STIFFNESS = 1e6
"""Middle of the range of a stiffness that is rigid or free, SI: between soft bearings and stiff links."""
OTHER_FACTOR = 10.0
"""Factor by which any other number varies about its value, up and down: a decade each way."""
LARGEST_LOAD = {"force": 1000.0, "moment": 100.0, "acceleration": 9.81}
"""Ends of the range of a load that is zero: N, N·m, m/s²."""
OF_MASSES = (*DYNAMIC_FIELDS, "tool.mass", "tool.centre_of_mass", "tool.payload")
"""Beginnings of the fields in the panel Mass, which also has all fields whose kind is an amount of matter."""
LARGEST_MASS = 1000.0
"""Upper end of the range of a mass that is zero, in kg per square of the machine's length: 10 kg for one of 10 cm."""
SLENDERNESS = 10.0
"""Lengths of the machine over which such a mass would be spread as that of links: those of six legs and some more."""
LARGEST_OTHERS = {
    "drives.rotor_inertia": 1e-4,
    "drives.lead": 0.02,
    "drives.ratio": 100.0,
    "drives.rotor_damping": 0.01,
    "damping.ratio": 0.1,
    "damping.per_mass": 50.0,
    "damping.per_stiffness": 1e-4,
    "damping.hinges": 1.0,
    "damping.slides": 1000.0,
    "cutting.pressure": 4e9,
}
"""Upper ends of the ranges of other numbers of vibrations that are zero, SI."""
PRODUCTS_OF_INERTIA = ("xy", "xz", "yz")
"""Entries of an inertia that may be negative."""
HEADROOM = 3.0
"""Upper end of the range of such a number that is not zero, in units of itself, so that it lies well within."""
OF_LOADED_STATES = (
    "load.gravity",
    "load.gravity_angle",
    "load.gravity_axis",
    "load.min_tension",
    "load.max_tension",
    *(f"{table}." for table in ("bending_rigidity", "expansion", "temperature_rise")),
)
"""Fields that change nothing unless the machine is shown under its loads: they are offered only then."""
LEAST_SHARE = 0.02
"""Lower end of a number that must be positive, as a share of the upper end: the slider comes near zero and stays
above."""
DERIVED_FIELDS = ("axis", "first_axis", "second_axis")
"""Fields of a joint that may follow from another joint: `axis = "ball"` points to the ball joint."""
AUTO = "auto"
"""Word that leaves the choice of the exaggeration, the factor by which the deflected shape is drawn, to the page."""
FACTOR_DECADES = (-3, 9)
"""Powers of ten between which the factor lies: shapes smaller than they are, and picometres as centimetres."""
ROUND_FACTORS = (1.0, 2.0, 5.0)
"""Factors within a power of ten: about equal steps to the eye."""
FACTOR_STEPS = len(ROUND_FACTORS) * (FACTOR_DECADES[1] - FACTOR_DECADES[0])
"""Positions of the slider: 1, 2 and 5 times every power of ten."""


@dataclass(frozen=True)
class Control:
    """A number of the machine, or a field whose entries move together.

    Attributes:
        parameter: the number that it sets.
        panel: one of `CONTROL_PANELS`.
        group: heading within the panel.
        low, high: ends of its slider, SI; equal where there is none.
        logarithmic: whether positions are spaced by a constant factor; of a stiffness the
            first is 0 and the last is "rigid".
    """

    parameter: Parameter
    panel: str
    group: str
    low: float
    high: float
    logarithmic: bool

    @property
    def path(self) -> str:
        return self.parameter.path

    @property
    def label(self) -> str:
        return label(self.parameter)

    @property
    def of_loads(self) -> bool:
        """Whether it matters only to the machine under its loads."""
        return self.path.startswith(OF_LOADED_STATES)

    @property
    def joined(self) -> bool:
        """Whether it moves entries together that a file gives apart, so that its path alone names none of them."""
        return self.parameter.quantity.apart and len(self.parameter.leaves) > 1

    @property
    def slides(self) -> bool:
        """Whether it has a slider; limits of actuators and joints are typed only."""
        return self.low < self.high

    def value_at(self, position: int) -> float:
        """Return the SI value at a position from 0 to `SLIDER_STEPS`."""
        share = min(max(position, 0), SLIDER_STEPS) / SLIDER_STEPS
        if not self.logarithmic:
            return self.low + (self.high - self.low) * share
        quantity = self.parameter.quantity
        if quantity.stiff and (share == 1.0 or (share == 0.0 and not quantity.positive)):
            return math.inf if share else 0.0
        return float(f"{self.low * (self.high / self.low) ** share:.4g}")

    def position_of(self, value: float) -> int:
        """Return the position nearest to a value."""
        if not self.slides:
            return 0
        if not self.logarithmic:
            share = (value - self.low) / (self.high - self.low)
        elif 0.0 < value < math.inf:
            share = math.log(value / self.low) / math.log(self.high / self.low)
        else:
            share = float(value > 0.0)
        return round(SLIDER_STEPS * min(max(share, 0.0), 1.0))


def controls(machine: Machine, length: float) -> tuple[Control, ...]:
    """Return all controls of a machine, in the order of its file.

    Args:
        machine: the machine about whose present numbers the ranges lie.
        length: its characteristic length, m.
    """
    present, derived = values(machine), _derived_fields(machine)
    offered = (_control(parameter, present, length) for parameter in _offered_parameters(machine, present))
    # What the file derives has no slider: it would undo the derivation. It can still be typed.
    return tuple(
        replace(control, low=0.0, high=0.0) if control.path.rpartition(".")[0] in derived else control
        for control in offered
    )


def _derived_fields(machine: Machine) -> set[str]:
    """Return the axes of joints that a file leg by leg does not write: they follow from where other joints are."""
    if machine.family.chains is None or machine.written is None:
        return set()
    legs = parse(machine.written.text, machine.name).get("legs", [])
    written = {
        f"legs.{leg.get('name')}.{joint.get('name')}.{field}"
        for leg in (legs if isinstance(legs, list) else [])
        if isinstance(leg, dict)
        for joint in leg.get("joints", [])
        if isinstance(joint, dict)
        for field, value in joint.items()
        if isinstance(value, list)
    }
    fields = {parameter.path for parameter in parameters(machine.family) if parameter.path.startswith("legs.")}
    return {path for path in fields if path.rpartition(".")[2] in DERIVED_FIELDS and path not in written}


def _offered_parameters(machine: Machine, present: dict[str, float]) -> Iterator[Parameter]:
    """Offer every number, and a field of several as one control where its entries are alike in kind and value.

    Of an inertia the three moments move together: no body has a moment about one axis alone.
    """
    for parameter in parameters(machine.family):
        if parameter.path.startswith("cables.") and not cable_signs(machine):
            continue
        is_inertia = parameter.quantity.kind == "inertia" and len(parameter.leaves) > 1
        joined = replace(parameter, leaves=parameter.leaves[: len(AXES)]) if is_inertia else parameter
        are_alike = len({present[leaf] for leaf in joined.leaves}) == 1
        is_vector = joined.path.split(".")[-1] in VECTORS
        if len(joined.leaves) == 1 or (not is_vector and (are_alike or joined.quantity.stiff)):
            yield joined


def _control(parameter: Parameter, present: dict[str, float], length: float) -> Control:
    panel, quantity, value = _panel_of(parameter), parameter.quantity, present[parameter.leaves[0]]
    largest_from_zero = _largest_from_zero(parameter, length) if panel == "Mass" else None
    logarithmic = False
    if quantity.unset is not None:
        low = high = 0.0  # a limit that may be missing has no range
    elif largest_from_zero is not None:
        low, high = _range_of_mass(parameter, HEADROOM * abs(value) or largest_from_zero)
    else:
        low, high, logarithmic = _range_about(parameter, value, length)
        if quantity.positive and not quantity.stiff:
            low = max(low, LEAST_SHARE * high, quantity.least)
        high = min(high, quantity.most)
    return Control(
        parameter=parameter, panel=panel, group=table_of(parameter), low=low, high=high, logarithmic=logarithmic
    )


def _range_of_mass(parameter: Parameter, high: float) -> tuple[float, float]:
    """Return the ends of the slider of an amount of matter with this upper end; it begins at zero if it may be zero."""
    if parameter.quantity.kind == "inertia" and label(parameter).endswith(PRODUCTS_OF_INERTIA):
        return -high, high
    return LEAST_SHARE * high if parameter.quantity.positive else 0.0, high


def _panel_of(parameter: Parameter) -> str:
    table = parameter.path.split(".")[0]
    if parameter.path.startswith(OF_MASSES) or KINDS[parameter.quantity.kind].heavy:
        return "Mass"
    if table in ("load", "tool", "limits", "cables") or parameter.path.startswith(OF_LOADED_STATES):
        return "Load"
    if parameter.quantity.stiff:
        return "Stiffness"
    return "Pose" if table == "pose" else "Geometry"


def _range_about(parameter: Parameter, value: float, length: float) -> tuple[float, float, bool]:
    """Return the ends of a slider about a value, and whether it is logarithmic."""
    kind, table = parameter.quantity.kind, parameter.path.split(".")[0]
    if parameter.quantity.stiff:
        middle = value if 0.0 < value < math.inf else USUAL_STIFFNESS
        return middle / STIFFNESS_FACTOR, middle * STIFFNESS_FACTOR, True
    if kind == "angle":
        around = ANGLE_RANGES.get(table, ANGLE_RANGES["geometry"])
        return value - around, value + around, False
    if kind == "length":
        around = LENGTH_SHARE * (length if table == "pose" or value == 0.0 else abs(value))
        return value - around, value + around, False
    if kind in LARGEST_LOAD:
        most = max(LARGEST_LOAD[kind], 2.0 * abs(value))
        return -most, most, False
    if kind == "direction":
        most = max(1.0, abs(value))
        return -most, most, False
    return value / OTHER_FACTOR, value * OTHER_FACTOR, True


def _largest_from_zero(parameter: Parameter, length: float) -> float | None:
    """Return the upper end of the slider of a number that is zero; None for what has a range as any other number."""
    mass = LARGEST_MASS * length**2
    kinds = {"mass": mass, "inertia": mass * length**2, "linear density": mass / (SLENDERNESS * length)}
    return LARGEST_OTHERS.get(parameter.path, kinds.get(parameter.quantity.kind))


def factor_at(position: int) -> float:
    """Return the exaggeration at a position from 0 to `FACTOR_STEPS`."""
    decades, step = divmod(min(max(position, 0), FACTOR_STEPS), len(ROUND_FACTORS))
    return float(f"{ROUND_FACTORS[step]:g}e{FACTOR_DECADES[0] + decades}")


def factor_position(factor: float) -> int:
    """Return the position whose exaggeration is nearest, by ratio."""
    return min(range(FACTOR_STEPS + 1), key=lambda position: abs(math.log(factor_at(position) / factor)))


def read_factor(text: str) -> float | None:
    """Return the exaggeration that was typed; None for the page's choice.

    Raises:
        InputError: it is not a number in range.
    """
    typed = text.strip().lstrip("×x").strip()
    if typed == AUTO or not typed or typed.endswith(f"({AUTO})"):
        return None
    least, most = (10.0**power for power in FACTOR_DECADES)
    try:
        factor = float(typed.replace(",", ""))
    except ValueError:
        factor = math.nan
    if not least <= factor <= most:
        raise InputError(
            f"the exaggeration is {shorten(text)}; it must be a number from {least:g} to {most:g}, or {AUTO}."
        )
    return factor


def factor_text(factor: float, automatic: bool) -> str:
    """Return an exaggeration as the page shows it; `automatic` if the page chose it."""
    return f"{factor:,.6g}" + (f" ({AUTO})" if automatic else "")
