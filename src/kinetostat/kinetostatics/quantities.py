"""The quantities of maps, sweeps, conditions and objectives: scalars of a response by name, with unit and label.

Source: theory section 10. At the tool point, base axes.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from operator import attrgetter
from typing import Literal, NamedTuple, TypeAlias

from kinetostat.algebra.scalar import Scalar, reciprocal, where
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.algebra.symmetric import POSITIONS, Symmetric6
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.extremes import (
    ROTATIONS,
    TRANSLATIONS,
    actuator_load,
    aspect,
    free_stiffness,
    frobenius_condition,
    greatest_stiffness,
    least_stiffness,
    longest_leg,
    reversal_error,
    shortest_leg,
)
from kinetostat.kinetostatics.feasible import (
    BLOCKS,
    greatest_acceleration,
    greatest_acceleration_along,
    greatest_along,
    greatest_ball,
    greatest_speed,
    greatest_speed_along,
)
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.limits import LIMITS, limits_loads
from kinetostat.machine.machine import Machine
from kinetostat.tolerances import UNMOVED_TOOL

MOST_CABLES = 24
"""Cables of a machine whose tensions are quantities: as many as a machine may have legs."""
MODES = 6
"""Natural frequencies that are quantities, from the lowest."""

CABLES = "cables alone as legs"
"""Parts that a machine must have for tensions to be chosen."""
Better: TypeAlias = Literal["more", "less"] | None


@dataclass(frozen=True)
class MapQuantity:
    """One scalar at one pose.

    Attributes:
        name: name in files and on the command line.
        unit: SI, for people.
        symbol: symbol for axis labels (matplotlib mathematics).
        value: function that takes it from a response; NaN where the machine lacks the part that it is about.
        components: names of those that it is about: the machine must have them.
        better: whether more or less of it is better for a design; None where that depends on the machine.
        needs: what a machine must have for it to mean something; empty if nothing. It is NaN where that is missing.
        loaded: which number of the machine at rest under its loads it needs (`equilibrium.numbers`); empty if none.
        whole: whether it counts, so that its values are whole numbers.
        modal: whether it is about natural vibrations, so that the machine must have masses.
        cut: whether it is about the receptance across a cut, which is computed pose by pose and has no derivatives.
        cables: whether it is about the tensions of cables, or what they can hold; it has no derivatives.
        driven: what of its drives it is about: "load" or "speed", which the file must then limit, "acceleration", for
            which it must limit loads and have masses, or "reversal", for which it must give lost motion; empty if
            nothing.
    """

    name: str
    unit: str
    symbol: str
    value: Callable[[Response], Scalar]
    components: tuple[str, ...] = ()
    better: Better = None
    needs: str = ""
    loaded: str = ""
    whole: bool = False
    modal: bool = False
    cut: bool = False
    cables: bool = False
    driven: str = ""


def _entry(response: Response, matrix_of: Callable[[Response], Symmetric6], i: int, j: int) -> Scalar:
    return matrix_of(response).entry(i, j)


def _compliance_unit(i: int, j: int) -> str:
    rows = "rad" if i in ROTATIONS else "m"
    return f"{rows}/(N·m)" if j in ROTATIONS else f"{rows}/N"


def _stiffness_unit(i: int, j: int) -> str:
    if j in ROTATIONS:
        return "N·m/rad"
    return "N/rad" if i in ROTATIONS else "N/m"


def _symbol(letter: str, *index: str) -> str:
    return rf"${letter}_{{\mathrm{{{','.join(index)}}}}}$"


def _entry_quantities(matrix: str, letter: str, unit: Callable[[int, int], str], better: Better) -> list[MapQuantity]:
    entries = []
    for i, j in POSITIONS:
        names = (COMPONENTS[i],) if i == j else (COMPONENTS[i], COMPONENTS[j])
        # An entry that couples two components may have either sign: neither more nor less of it is better.
        wanted, value = better if i == j else None, partial(_entry, matrix_of=attrgetter(matrix), i=i, j=j)
        name, symbol = "_".join([matrix, *names]), _symbol(letter, *names)
        entries.append(MapQuantity(name, unit(i, j), symbol, value, components=names, better=wanted))
    return entries


def _free_stiffness_quantities() -> list[MapQuantity]:
    entries = []
    for i, component in enumerate(COMPONENTS):
        name, symbol = f"free_stiffness_{component}", rf"$1/C_{{\mathrm{{{component}}}}}$"
        value = partial(free_stiffness, row=i)
        entries.append(MapQuantity(name, _stiffness_unit(i, i), symbol, value, components=(component,), better="more"))
    return entries


def _extreme_quantities() -> list[MapQuantity]:
    blocks = (("translational", "N/m", "t", TRANSLATIONS), ("rotational", "N·m/rad", "r", ROTATIONS))
    entries = []
    for word, unit, letter, block in blocks:
        for end, index, value in (("least", "min", least_stiffness), ("greatest", "max", greatest_stiffness)):
            name, symbol = f"{end}_{word}_stiffness", _symbol("k", letter, index)
            entries.append(MapQuantity(name, unit, symbol, partial(value, block=block), better="more"))
    return entries


def _loaded_number(response: Response, name: str, row: int | None = None) -> Scalar:
    """A number of the loaded state, or a row of it; NaN where it has not been computed."""
    if response.loaded is None or name not in response.loaded:
        return math.nan
    number = response.loaded[name]
    return number if row is None else number[row]


def _displacement(response: Response, row: int) -> Scalar:
    """A displacement under load, without what round-off leaves where nothing moves."""
    amount = _loaded_number(response, "displacement", row)
    return where(amount * amount < UNMOVED_TOOL * UNMOVED_TOOL, 0.0, amount)


def _tangent_free(response: Response, row: int) -> Scalar:
    return reciprocal(_loaded_number(response, "compliance", row))


def _free_frequency(response: Response, row: int) -> Scalar:
    """A natural frequency with relaxed springs; NaN where it has not been computed."""
    return math.nan if response.frequencies is None else response.frequencies[row]


def _frequency_quantities(prefix: str, loaded: str = "") -> list[MapQuantity]:
    entries = []
    for row in range(MODES):
        value = partial(_loaded_number, name=loaded, row=row) if loaded else partial(_free_frequency, row=row)
        index = rf"\mathrm{{t}},{row + 1}" if loaded else str(row + 1)
        name, symbol = f"{prefix}_{row + 1}", f"$f_{{{index}}}$"
        entries.append(MapQuantity(name, "Hz", symbol, value, better="more", loaded=loaded, modal=True))
    return entries


def _least_real_part(response: Response) -> Scalar:
    """The least real part of the receptance across the cut; NaN where it has not been computed."""
    return math.nan if response.softest is None else response.softest


def _stable_width(response: Response) -> Scalar:
    """The width of cut up to which every spindle speed is stable, theory (60); infinite where nothing rings."""
    if response.softest is None:
        return math.nan
    rings = response.softest < 0.0
    width = reciprocal(response.cutting_pressure) * (-0.5 / where(rings, response.softest, -1.0))
    return where(rings, width, math.inf)


def _cut_quantities() -> list[MapQuantity]:
    real, width = r"$\mathrm{min\,Re}\,H$", "stable width of cut"
    return [
        MapQuantity("least_real_receptance", "m/N", real, _least_real_part, better="more", modal=True, cut=True),
        MapQuantity("stable_width", "m", width, _stable_width, better="more", modal=True, cut=True),
    ]


def _cable_number(response: Response, name: str) -> Scalar:
    """A number of cables; NaN where it has not been computed."""
    return math.nan if response.cables is None else response.cables[name]


def _cable_quantities() -> list[MapQuantity]:
    rows: list[tuple[str, str, str, Better]] = [
        *((f"tension_{number}", "N", rf"$\tau_{{{number}}}$", None) for number in range(1, MOST_CABLES + 1)),
        ("least_tension", "N", "least tension", "more"),
        ("greatest_tension", "N", "greatest tension", "less"),
        ("tension_reserve", "N", "reserve of the tensions", "more"),
        ("capacity", "N", "capacity", "more"),
        ("wrench_closure", "1", "wrench closure", "more"),
    ]
    return [
        MapQuantity(name, unit, symbol, partial(_cable_number, name=name), better=better, needs=CABLES, cables=True)
        for name, unit, symbol, better in rows
    ]


def _actuator_quantities() -> list[MapQuantity]:
    entries = []
    for word, unit, sliding in (("force", "N", True), ("moment", "N·m", False)):
        name, value = f"actuator_{word}", partial(actuator_load, sliding=sliding)
        label, needs = f"greatest actuator {word}", LIMITS[f"actuator_{word}"].needs
        entries.append(MapQuantity(name, unit, label, value, better="less", needs=needs))
    return entries


def _wrench_number(response: Response, measure: Callable[..., Scalar], row: slice | int) -> Scalar:
    """A number of the wrenches that drives hold."""
    return measure(response.faces, row, response.configuration.length)


def _speed_number(response: Response, measure: Callable[..., Scalar], row: slice | int) -> Scalar:
    """A number of the speeds that drives allow."""
    return measure(response.transmission, [drive.speed for drive in response.drives], row)


def _acceleration_number(response: Response, measure: Callable[..., Scalar], row: slice | int) -> Scalar:
    """A number of the accelerations that drives allow; NaN where they have not been computed."""
    if response.acceleration_loads is None:
        return math.nan
    return measure(response.acceleration_faces, response.transmission, row)


class _NumberOfDrives(NamedTuple):
    """Numbers that follow from what drives can do: of wrenches, twists or accelerations.

    Attributes:
        driven: as in `MapQuantity`.
        number: function of a response, a measure, and a block or a component.
        least, greatest: measures: the least in all directions of a block, the greatest along a component.
        units, names, words: unit, end of the name and index of the symbol of the least one, of translations and of
            rotations.
    """

    driven: str
    number: Callable[..., Scalar]
    least: Callable[..., Scalar]
    greatest: Callable[..., Scalar]
    units: tuple[str, str]
    names: tuple[str, str]
    words: tuple[str, str]


NUMBERS_OF_DRIVES = {
    "acceleration": _NumberOfDrives(
        driven="acceleration",
        number=_acceleration_number,
        least=greatest_acceleration,
        greatest=greatest_acceleration_along,
        units=("m/s**2", "rad/s**2"),
        names=("acceleration", "angular_acceleration"),
        words=("move", "turn"),
    ),
    "twist": _NumberOfDrives(
        driven="speed",
        number=_speed_number,
        least=greatest_speed,
        greatest=greatest_speed_along,
        units=("m/s", "rad/s"),
        names=("twist_speed", "twist_rate"),
        words=("speed", "rate"),
    ),
    "wrench": _NumberOfDrives(
        driven="load",
        number=_wrench_number,
        least=greatest_ball,
        greatest=greatest_along,
        units=("N", "N·m"),
        names=("wrench_force", "wrench_moment"),
        words=("force", "moment"),
    ),
}


def _drive_quantities() -> list[MapQuantity]:
    """Numbers of drives along each component, and then in all directions of a block."""
    entries = []
    for word, kind in NUMBERS_OF_DRIVES.items():
        for row, name in enumerate(COMPONENTS):
            unit, symbol = kind.units[row in ROTATIONS], _symbol(word[0], name, "max")
            value, full_name = partial(kind.number, measure=kind.greatest, row=row), f"greatest_{word}_{name}"
            entries.append(
                MapQuantity(full_name, unit, symbol, value, components=(name,), better="more", driven=kind.driven)
            )
    for word, kind in NUMBERS_OF_DRIVES.items():
        for place, block in enumerate(("translation", "rotation")):
            name, unit, symbol = kind.names[place], kind.units[place], _symbol(word[0], kind.words[place], "min")
            value = partial(kind.number, measure=kind.least, row=BLOCKS[block])
            entries.append(MapQuantity(f"least_{name}", unit, symbol, value, better="more", driven=kind.driven))
    return entries


def _reversal_quantities() -> list[MapQuantity]:
    """Lost motion of the tool where all drives reverse, by component."""
    entries = []
    for row, name in enumerate(COMPONENTS):
        unit, symbol, value = "rad" if row in ROTATIONS else "m", _symbol("e", name), partial(reversal_error, row=row)
        full_name = f"reversal_error_{name}"
        entries.append(
            MapQuantity(full_name, unit, symbol, value, components=(name,), better="less", driven="reversal")
        )
    return entries


def _loaded_quantities() -> list[MapQuantity]:
    entries = []
    for i, name in enumerate(COMPONENTS):
        shown, motion_unit = rf"\mathrm{{{name}}}", "rad" if i in ROTATIONS else "m"
        motion = partial(_displacement, row=i)
        tangent, free = partial(_loaded_number, name="stiffness", row=i), partial(_tangent_free, row=i)
        stiffness_unit = _stiffness_unit(i, i)
        rows: list[tuple[str, str, str, Callable[[Response], Scalar], Better, str]] = [
            ("displacement", motion_unit, rf"$u_{{{shown}}}$", motion, None, "displacement"),
            ("tangent_stiffness", stiffness_unit, rf"$K_{{t,{shown}}}$", tangent, "more", "stiffness"),
            ("tangent_free_stiffness", stiffness_unit, rf"$1/C_{{t,{shown}}}$", free, "more", "compliance"),
        ]
        for start, unit, symbol, value, better, loaded in rows:
            entries.append(
                MapQuantity(f"{start}_{name}", unit, symbol, value, components=(name,), better=better, loaded=loaded)
            )
    entries += _frequency_quantities("loaded_frequency", "frequency")
    factor, slack, snapped = (partial(_loaded_number, name=name) for name in ("factor", "slack", "snapped"))
    return [
        *sorted(entries, key=lambda entry: entry.name.rpartition("_")[0]),
        MapQuantity("load_factor", "1", "load factor", factor, better="more", loaded="factor"),
        MapQuantity("slack_springs", "1", "slack springs", slack, better="less", loaded="slack", whole=True),
        MapQuantity("snapped", "1", "snapped over", snapped, better="less", loaded="snapped", whole=True),
    ]


_ENTRY_QUANTITIES = (
    *_entry_quantities("compliance", "C", _compliance_unit, "less"),
    *_entry_quantities("stiffness", "K", _stiffness_unit, "more"),
)
ENTRIES = [quantity.name for quantity in _ENTRY_QUANTITIES]
"""Names of the entries of C and then of K, on and above the diagonal, row by row."""
QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        *_ENTRY_QUANTITIES,
        *_free_stiffness_quantities(),
        MapQuantity("singularity_margin", "1", "singularity margin", attrgetter("singularity_margin"), better="more"),
        MapQuantity("mass", "kg", "moving mass", attrgetter("mass"), better="less"),
        MapQuantity("aspect", "1", "aspect", aspect, whole=True),
        *_extreme_quantities(),
        MapQuantity("frobenius_condition", "1", "condition of K (Frobenius)", frobenius_condition, better="less"),
        MapQuantity("shortest_leg", "m", "shortest leg", shortest_leg, needs=LIMITS["shortest_leg"].needs),
        MapQuantity("longest_leg", "m", "longest leg", longest_leg, better="less", needs=LIMITS["longest_leg"].needs),
        *_actuator_quantities(),
        *_drive_quantities(),
        *_reversal_quantities(),
        *_frequency_quantities("frequency"),
        *_cut_quantities(),
        *_loaded_quantities(),
        *_cable_quantities(),
    )
}
"""Every quantity by name: compliance_rx, compliance_rx_z, ..., stiffness_x, ..., singularity_margin, ..."""

CARRYING = ("load", "acceleration")
"""Subjects of quantities for which it counts what drives carry already."""
LOADS_OF_ACTUATORS = ("actuator_force", "actuator_moment")
"""Quantities that are about the machine at rest if it is meant so, and to first order about the free one else."""
OF_THE_PLACE = ("aspect", "mass", "shortest_leg", "longest_leg")
"""Quantities that are known wherever the legs can be placed, whether or not they hold the platform there."""


def rest_numbers(machine: Machine, names: Iterable[str], limited: bool = True) -> set[str]:
    """Return which numbers of the machine at rest (`equilibrium.numbers`) some quantities need; none if they need none.

    Where a machine is meant under its loads, so are the loads of its actuators; and if limits bound these, every pose
    is judged by them, whatever quantity it is asked for.

    Args:
        machine: the machine with its limits, and the state in which it is meant.
        names: names of quantities.
        limited: whether poses are judged by limits; derivatives are not.
    """
    names = list(names)
    wanted = {QUANTITIES[name].loaded for name in names} - {""}
    bounded = limited and limits_loads(machine.tables["limits"])
    carries = bounded or any(name in LOADS_OF_ACTUATORS or QUANTITIES[name].driven in CARRYING for name in names)
    return wanted | {"actuators"} if machine.loaded and carries else wanted


def needs_masses(names: Iterable[str]) -> bool:
    """Whether quantities need what drives carry by accelerations (`motion.machine_at_pose.loads_by_acceleration`)."""
    return any(QUANTITIES[name].driven == "acceleration" for name in names)


def needs_motion(names: Iterable[str]) -> bool:
    """Whether quantities need the rigid parts of a machine in motion (`motion.response`)."""
    return any(QUANTITIES[name].driven in ("acceleration", "reversal") for name in names)


def needs_state(machine: Machine, names: Iterable[str], limited: bool = True) -> bool:
    """Whether quantities need more of a pose than its linear response: a state of rest, masses, or tensions.

    Args:
        machine, names, limited: see `rest_numbers`.
    """
    names = list(names)
    wanted = [QUANTITIES[name] for name in names]
    beyond = any(quantity.modal or quantity.cables for quantity in wanted) or needs_motion(names)
    return beyond or bool(rest_numbers(machine, names, limited))


INDICES: dict[str, Iterable[object]] = {
    group: range(1, count + 1) for group, count in (("tension", MOST_CABLES), ("frequency", MODES))
}
"""Ends of the names in a group whose quantities are numbered; those of other groups end in the name of a component."""
GROUPS = {
    group: tuple(f"{group}_{index}" for index in INDICES.get(group.removeprefix("loaded_"), COMPONENTS))
    for group in (
        *("compliance", "stiffness", "free_stiffness", "greatest_wrench", "greatest_twist", "greatest_acceleration"),
        *("reversal_error", "frequency", "loaded_frequency", "displacement", "tension"),
        *("tangent_stiffness", "tangent_free_stiffness"),
    )
}
"""Names that stand for several quantities: diagonals of C and of K, 1/C_ii, frequencies, and those under load."""


def plain_name(name: str) -> str:
    """Return the name of a quantity in words, such as "stiffness x" or "Frobenius condition"."""
    return name.replace("_", " ").replace("frobenius", "Frobenius")


def group_of(names: Sequence[str]) -> str:
    """The group of which all quantities are, such as "stiffness" where all are entries of K; else nothing."""
    return next((group for group in GROUPS if all(name.startswith(f"{group}_") for name in names)), "")
