"""Quantities as people write them: their names, conditions on their values, and refusals where a machine has none.

Everything here follows from texts, from the machine's file and from the places of its legs: no stiffness is computed. A
condition compares a quantity with a value, "free_stiffness_z > 20 N/um".
"""

import difflib
import math
import operator
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Mask
from kinetostat.equilibrium.cables import cable_signs
from kinetostat.equilibrium.cut import cut_machine
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.drive_limits import drive_limits, driven_springs
from kinetostat.kinetostatics.quantities import CARRYING, GROUPS, MOST_CABLES, QUANTITIES, needs_masses, rest_numbers
from kinetostat.machine.actuators import values_of_drives
from kinetostat.machine.common_tables import FRICTION_OF_JOINTS
from kinetostat.machine.limits import LIMITS, About, Parts
from kinetostat.machine.loads import moving_masses, platform_is_loaded
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import Parameter, values, with_values
from kinetostat.spec.arguments import as_list
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.renamed import current_name
from kinetostat.units import KINDS, UnitError, parse

TENSIONS = GROUPS["tension"]
"""Quantities that are tensions, cable by cable."""
ACTUATOR_LOADS = tuple(limit.name for limit in LIMITS.values() if limit.about is About.LOAD)
"""Quantities that are loads of actuators, which the table of limits names."""
LOADING_KINDS = ("force", "acceleration", "density", "linear density", "temperature difference", "thermal expansion")
"""Kinds of parameters that may bring in a load which an answer to first order leaves out."""
LOST_MOTION = ("backlash", "angular_backlash", "rotor_friction", "guide_friction", "bearing_friction")
"""Fields of [drives] by which drives lose motion."""
LIMITS_OF_LINEAR_DRIVES = {"load": ("limits.actuator_force", '"2 kN"'), "speed": ("limits.actuator_speed", '"0.5 m/s"')}
"""The fields that limit linear drives, each with an example, by what they limit."""
LIMITS_OF_ROTARY_DRIVES = {
    "load": ("limits.actuator_moment", '"20 N*m"'),
    "speed": ("limits.actuator_turning_speed", '"3 rad/s"'),
}
"""The same of rotary drives."""
COMPARISONS = {"<=": operator.le, ">=": operator.ge, "<": operator.lt, ">": operator.gt}
"""Comparisons of a condition, and their functions."""
CONDITION_FORM = 'write QUANTITY < VALUE or QUANTITY > VALUE, e.g. "free_stiffness_z > 20 N/um"'
"""The end of messages about a text that is not a condition."""
LONGEST_CONDITION = 200
"""Characters of a condition; a longer text is refused unread."""
_CONDITION = re.compile(r"\s*([a-z_]+(?:_\d+)?)\s*(<=|>=|<|>)\s*([^<>=]+?)\s*")
"""A condition: quantity, comparison and value."""
COMPARED_KINDS = (
    "length", "angle", "force", "moment", "mass", "frequency", "speed", "rate", "acceleration", "angular acceleration",
)  # fmt: skip
"""Kinds of quantities beside stiffnesses and compliances, of which several have one unit."""
KIND_OF_UNIT = {
    kind.unit: kind.name
    for kind in KINDS.values()
    if kind.name.endswith(("stiffness", "compliance")) or kind.name in COMPARED_KINDS
}
"""Kind of the value with which a quantity of a unit is compared; values of other units are plain numbers."""


def uncounted_loads(state: MachineState, names: Collection[str], varied: Iterable[tuple[Parameter, Array]] = ()) -> str:
    """Say which loads of a file do not count in quantities of a machine; empty if they all do.

    Quantities of the machine at rest under its loads count all of them, the others only those of which
    `MachineState.left_out` does not speak.

    Args:
        state: state of the machine with its loads.
        names: names of quantities; none for an answer about the free machine.
        varied: parameters that vary, with their values, SI: each may bring in a load that the file does not have.
    """
    if names and all(QUANTITIES[name].loaded for name in names):
        return ""
    loading = [(parameter, row) for parameter, row in varied if parameter.quantity.kind in LOADING_KINDS]
    greatest = {leaf: float(row[np.abs(row).argmax()]) for parameter, row in loading for leaf in parameter.leaves}
    try:
        return (state_of(with_values(state.machine, greatest)) if greatest else state).left_out
    except InputError:  # links get warmer, but no expansion is given: an effect that is unknown cannot be left out
        return state.left_out


def resolve_quantities(
    names: Sequence[str], components: Sequence[str] = COMPONENTS, cables: int = MOST_CABLES
) -> list[str]:
    """Names of quantities, with groups replaced by their members and repetitions dropped.

    Args:
        names: names of quantities or groups.
        components: components that the machine has: rx ry rz x y z, or rz x y of a planar one.
        cables: number of cables that it has, so that "tension" stands for so many.

    Raises:
        InputError: an unknown name, or one of a component that the machine does not have.
    """
    groups = _groups(tuple(components), cables)
    resolved: list[str] = []
    for name in (current_name(given, "quantity") for given in as_list(names)):
        if name not in GROUPS and not (name in QUANTITIES and _exists(name, components)):
            raise InputError(_no_quantity(name, groups, components))
        resolved += groups.get(name, [name])
    return list(dict.fromkeys(resolved))


@cache
def _groups(components: tuple[str, ...], cables: int) -> dict[str, list[str]]:
    """The members of each group that a machine of these components and so many cables has."""
    return {
        group: [name for name in members if _exists(name, components) and name not in TENSIONS[cables:]]
        for group, members in GROUPS.items()
    }


def cable_count(machine: Machine) -> int:
    """Count the cables of a machine; the most that there can be if legs are no cables, which is refused elsewhere."""
    return len(cable_signs(machine)) or MOST_CABLES


def _no_quantity(name: str, groups: Mapping[str, Sequence[str]], components: Sequence[str]) -> str:
    """Say that there is no such quantity, and name the one that was probably meant, or all."""
    members = [member for group in groups.values() for member in group]
    others = [other for other, quantity in QUANTITIES.items() if not quantity.components and other not in members]
    matrix, _, entry = name.partition("_")
    swapped = "_".join([matrix, *reversed(entry.split("_"))])  # compliance_x_ry is written compliance_ry_x
    if swapped != name and swapped in QUANTITIES and _exists(swapped, components):
        near = [swapped]
    else:
        near = difflib.get_close_matches(name, [*groups, *members, *others], 1)
    if near:
        return f'"{name}" is not a quantity; did you mean {near[0]}?'
    first, last = components[0], components[-1]
    return (
        f'"{name}" is not a quantity; choose a group ({", ".join(groups)}), one of its members such as '
        f"compliance_{first} or frequency_1, an entry such as compliance_{first}_{last}, or one of {', '.join(others)}."
    )


def _exists(name: str, components: Sequence[str]) -> bool:
    """Whether all components that a quantity is about exist."""
    return all(part in components for part in QUANTITIES[name].components)


@dataclass(frozen=True)
class PoseCondition:
    """A quantity compared with a value.

    Attributes:
        text: the condition as written, with single spaces.
        quantity: name of the quantity.
        comparison: "<", "<=", ">" or ">=".
        value: the value with which it is compared, SI.
    """

    text: str
    quantity: str
    comparison: str
    value: float

    @property
    def wants_more(self) -> bool:
        """Whether greater values are better: the comparison is > or >=."""
        return self.comparison.startswith(">")

    def holds(self, values: Array) -> Mask:
        """Tell at which points the quantity, given in SI, meets the condition; where it is NaN, it does not."""
        return np.asarray(COMPARISONS[self.comparison](values, self.value))


def parse_condition(text: str, components: Sequence[str]) -> PoseCondition:
    """Read a condition from text.

    Args:
        text: "QUANTITY < VALUE".
        components: components that the machine has.

    Raises:
        InputError: not of that form, an unknown quantity, or a value of another kind.
    """
    match = _CONDITION.fullmatch(text) if len(text) <= LONGEST_CONDITION else None
    if match is None:
        raise InputError(f"{shorten(text)} is not a condition; {CONDITION_FORM}.")
    quantity, comparison, written = match.groups()
    name = current_name(quantity, "quantity")
    if name in GROUPS:
        raise InputError(f'"{name}" stands for several quantities; name one of {", ".join(GROUPS[name])}.')
    resolve_quantities([name], components)
    value = value_of(QUANTITIES[name].unit, written, f"the condition on {name}")
    return PoseCondition(f"{name} {comparison} {written}", name, comparison, value)


def value_of(unit: str, written: float | str | None, where: str) -> float:
    """Read the value, SI, with which a quantity of some unit is compared; `where` it is written goes into messages.

    Raises:
        InputError: it is of another kind, or not finite.
    """
    try:
        if unit in KIND_OF_UNIT:
            return _finite(parse(written, KIND_OF_UNIT[unit]))
        return _finite(float(written if written is not None else math.nan))
    except UnitError as error:
        raise InputError(f"in {where}, {shorten(written)}: {error}.") from None
    except ValueError:
        raise InputError(f"in {where}, {shorten(written)} must be a plain number, e.g. 0.05.") from None


def _finite(value: float) -> float:
    """The value, unless it is infinite or not a number.

    Raises:
        UnitError: it is.
    """
    if not np.isfinite(value):
        raise UnitError('no condition can ask for "rigid"; give a large value')
    return value


def usual_quantities(machine: Machine, usual: str) -> list[str]:
    """Return what is shown where nobody names a quantity: the usual one, or how far a loaded machine moves."""
    return ["displacement" if machine.loaded else usual]


def without_derivatives(machine: Machine, names: Sequence[str], varied: Sequence[str] = ()) -> str | None:
    """The first quantity of cables, of cuts or of the loaded machine that has no derivatives; None if all have.

    Args:
        machine: the machine with its loads.
        names: names of quantities.
        varied: leaf paths of parameters that vary.
    """
    names_of_quantities = [name for name in names if name in QUANTITIES]
    for name in names_of_quantities:
        if QUANTITIES[name].cut or QUANTITIES[name].cables:
            return name
    loaded = [name for name in names_of_quantities if rest_numbers(machine, [name], limited=False)]
    machine_cut = cut_machine(machine, varied) if loaded else None
    return None if machine_cut is not None and not machine_cut.legs else next(iter(loaded), None)


def refuse_without_derivatives(machine: Machine, names: Sequence[str], varied: Sequence[str] = ()) -> None:
    """Refuse derivatives of quantities that have none; arguments as for `without_derivatives`.

    Raises:
        InputError: names the first such quantity, and says why it has none.
    """
    name = without_derivatives(machine, names, varied)
    if name is None:
        return
    if QUANTITIES[name].cables:
        reason = f'"{name}" has no derivatives: which tensions are at their bounds changes from pose to pose'
    elif QUANTITIES[name].cut:
        reason = f'"{name}" has no derivatives: its frequency is looked for at each pose'
    else:
        reason = (
            f'"{name}" of {machine.name} has no derivatives: those of a loaded machine are known where at most a '
            "single leg is more than a rod between two joints and no tensions are to be chosen"
        )
    raise InputError(
        f"{reason}; look at it in a sweep or map, or search without derivatives, optimizer.method = genetic."
    )


def refuse_absent(state: MachineState, names: Sequence[str], varied: Sequence[Parameter] = ()) -> None:
    """Refuse quantities that have no value for a machine, whatever its pose.

    Args:
        state: state of the machine as its file has it.
        names: names of quantities.
        varied: parameters that take other values than the file's.

    Raises:
        InputError: names the quantity, and what the machine lacks or its file must say.
    """
    machine = state.machine
    weighing = [name for name in names if name == "mass" or QUANTITIES[name].modal or needs_masses([name])]
    if weighing and not any(KINDS[parameter.quantity.kind].heavy for parameter in varied):
        refuse_unknown_mass(machine, weighing[0], state.configuration)
    _refuse_unknown_cut(machine, names, [parameter.path for parameter in varied])
    _refuse_without_cables(machine, names)
    _refuse_unlimited_drives(state, names, varied)
    wanted = [name for name in names if QUANTITIES[name].needs and not QUANTITIES[name].cables]
    if not wanted:
        return
    placed = state.configuration
    driven = [(spring, 0.0) for spring in driven_springs(placed)]
    parts = Parts(placed.legs, placed.platform.rotation.z, machine.family.planar, actuators=driven)
    for name in wanted:
        if next(iter(LIMITS[name].measure(parts)), None) is None:
            raise InputError(
                f'"{name}" has no meaning here: {machine.name} lacks {QUANTITIES[name].needs}; leave it out.'
            )
    loaded = platform_is_loaded(machine) or any(parameter.path.startswith("load.") for parameter in varied)
    for name in ACTUATOR_LOADS:
        if name in names and not loaded:
            raise InputError(
                f'"{name}" is not known: the file of {machine.name} gives no load; add a table [load], '
                'e.g. force = ["0 N", "0 N", "-500 N"].'
            )


def _refuse_without_lost_motion(state: MachineState, name: str, varied: Sequence[Parameter]) -> None:
    """Refuse a reversal error of a machine whose file gives neither play of drives nor friction."""
    numbers_of_lost_motion = [
        (path, value)
        for path, value in values(state.machine).items()
        if path in FRICTION_OF_JOINTS or (path.startswith("drives.") and path.rpartition(".")[2] in LOST_MOTION)
    ]
    changed = {leaf for parameter in varied for leaf in parameter.leaves}
    if not any(value or path in changed for path, value in numbers_of_lost_motion):
        raise InputError(
            f'"{name}" is not known: the file of {state.machine.name} gives no lost motion, neither play nor friction; '
            'write backlash = "5 um" (angular_backlash of rotary drives), say, in the table [drives].'
        )


def _refuse_unlimited_drives(state: MachineState, names: Sequence[str], varied: Sequence[Parameter]) -> None:
    """Refuse quantities about what drives can do where the file of a machine limits none of them."""
    driven, chosen = [name for name in names if QUANTITIES[name].driven], [parameter.path for parameter in varied]
    given = values(state.machine) if driven else {}
    for name in driven:
        limited = QUANTITIES[name].driven
        if limited == "reversal":
            _refuse_without_lost_motion(state, name, varied)
            continue
        drives = drive_limits(state.machine, state.configuration)
        limited = "load" if limited in CARRYING else limited
        are_linear = {drive.spring.joint.point is None for drive in drives}
        tables = [LIMITS_OF_LINEAR_DRIVES] * (True in are_linear) + [LIMITS_OF_ROTARY_DRIVES] * (False in are_linear)
        fields = dict(table[limited] for table in tables)
        bounded = limited == "load" and any(np.isfinite(drive.lower) for drive in drives)
        if not bounded and all(field not in chosen and np.isinf(given[field]) for field in fields):
            examples = " and ".join(f"{field} = {example}" for field, example in fields.items()) or "an actuator"
            raise InputError(
                f'"{name}" is not known: nothing limits the {limited} of the drives of {state.machine.name}; write '
                f"{examples}, say."
            )


def refuse_unknown_mass(machine: Machine, what: str, configuration: Configuration) -> None:
    """Refuse what needs masses where the machine has none.

    Args:
        machine: the machine as its file has it.
        what: the quantity or command that needs them, as people wrote it.
        configuration: the machine placed at its pose.

    Raises:
        InputError: says what to give.
    """
    masses = moving_masses(machine, configuration)
    tool = machine.tables["tool"]
    others = [tool.payload, *values_of_drives(machine, "drives.rotor_inertia"), *tool.inertia, *tool.payload_inertia]
    has_inertia = what != "mass" and any(others)
    if all(part.mass is None for part in masses) and not has_inertia:
        raise InputError(
            f'"{what}" is not known: the file of {machine.name} does not say what it weighs; give links a '
            'cross-section with a density or material, or its table [tool] mass = "12 kg".'
        )


def _refuse_without_cables(machine: Machine, names: Sequence[str]) -> None:
    """Refuse quantities of cables where legs are anything else, and tensions of cables that are not there."""
    wanted = [name for name in names if QUANTITIES[name].cables]
    if not wanted:
        return
    count = len(cable_signs(machine))
    if not count:
        raise InputError(
            f'"{wanted[0]}" has no meaning here: {machine.name} lacks {QUANTITIES[wanted[0]].needs}, each written with '
            'type = "cable"; leave it out.'
        )
    beyond = [name for name in wanted if name in TENSIONS[count:]]
    if beyond:
        raise InputError(
            f'"{beyond[0]}" is not known: {machine.name} has {count} cables, tension_1 to tension_{count}.'
        )


def _refuse_unknown_cut(machine: Machine, names: Sequence[str], varied: Sequence[str]) -> None:
    """Refuse quantities of a cut of which the file says too little."""
    wanted = [name for name in names if QUANTITIES[name].cut]
    if not wanted:
        return
    table = machine.tables["cutting"]
    if not any(table.direction) and not any(path.startswith("cutting.direction") for path in varied):
        raise InputError(
            f'"{wanted[0]}" is not known: nothing says the direction across the cut; write direction = [1, 0, 0], say, '
            f"in the table [cutting] of {machine.name}."
        )
    if "stable_width" in wanted and not table.pressure and "cutting.pressure" not in varied:
        raise InputError(
            '"stable_width" is not known: nothing says the cutting force per area of the chip; write pressure = '
            f'"2000 N/mm**2", say, in the table [cutting] of {machine.name}.'
        )
