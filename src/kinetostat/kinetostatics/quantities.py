"""The quantities of maps, sweeps, conditions and objectives: scalars of a response by name, with unit and label.

Source: theory section 10. At the tool point, base axes.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from operator import attrgetter
from typing import Literal, TypeAlias

from kinetostat.algebra.scalar import Scalar, reciprocal, where
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.algebra.symmetric import POSITIONS
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


def _compliance(response: Response, i: int, j: int) -> Scalar:
    return response.compliance.entry(i, j)


def _stiffness(response: Response, i: int, j: int) -> Scalar:
    return response.stiffness.entry(i, j)


def _compliance_unit(i: int, j: int) -> str:
    rows = "rad" if i in ROTATIONS else "m"
    return f"{rows}/(N·m)" if j in ROTATIONS else f"{rows}/N"


def _stiffness_unit(i: int, j: int) -> str:
    if j in ROTATIONS:
        return "N·m/rad"
    return "N/rad" if i in ROTATIONS else "N/m"


def _entries(
    matrix: str, letter: str, unit: Callable[[int, int], str], value: Callable[..., Scalar], better: Better
) -> list[MapQuantity]:
    entries = []
    for i, j in POSITIONS:
        names = [COMPONENTS[i]] if i == j else [COMPONENTS[i], COMPONENTS[j]]
        symbol = rf"${letter}_{{\mathrm{{{','.join(names)}}}}}$"
        name = "_".join([matrix, *names])
        # An entry that couples two components may have either sign: neither more nor less of it is better.
        wanted = better if i == j else None
        entries.append(MapQuantity(name, unit(i, j), symbol, partial(value, i=i, j=j), tuple(names), wanted))
    return entries


def _free_stiffnesses() -> list[MapQuantity]:
    entries = []
    for i, name in enumerate(COMPONENTS):
        symbol = rf"$1/C_{{\mathrm{{{name}}}}}$"
        value = partial(free_stiffness, row=i)
        entries.append(MapQuantity(f"free_stiffness_{name}", _stiffness_unit(i, i), symbol, value, (name,), "more"))
    return entries


def _extremes() -> list[MapQuantity]:
    blocks = (("translational", "N/m", "t", TRANSLATIONS), ("rotational", "N·m/rad", "r", ROTATIONS))
    entries = []
    for word, unit, letter, block in blocks:
        least, greatest = partial(least_stiffness, block=block), partial(greatest_stiffness, block=block)
        entries.append(
            MapQuantity(f"least_{word}_stiffness", unit, rf"$k_{{\mathrm{{{letter},min}}}}$", least, (), "more")
        )
        entries.append(
            MapQuantity(f"greatest_{word}_stiffness", unit, rf"$k_{{\mathrm{{{letter},max}}}}$", greatest, (), "more")
        )
    return entries


def _under_load(response: Response, what: str, row: int | None = None) -> Scalar:
    """A number of the loaded state; NaN where it has not been computed."""
    if response.loaded is None or what not in response.loaded:
        return float("nan")
    values = response.loaded[what]
    return values if row is None else values[row]


def _displacement(response: Response, row: int) -> Scalar:
    """A displacement under load, without what round-off leaves where nothing moves."""
    amount = _under_load(response, "displacement", row)
    return where(amount * amount < UNMOVED_TOOL * UNMOVED_TOOL, 0.0, amount)


def _tangent_free(response: Response, row: int) -> Scalar:
    return reciprocal(_under_load(response, "compliance", row))


def _free_frequency(response: Response, row: int) -> Scalar:
    """A natural frequency with relaxed springs; NaN where it has not been computed."""
    return float("nan") if response.frequencies is None else response.frequencies[row]


def _frequencies(prefix: str, loaded: str = "") -> list[MapQuantity]:
    entries = []
    for row in range(MODES):
        value = partial(_under_load, what=loaded, row=row) if loaded else partial(_free_frequency, row=row)
        index = rf"\mathrm{{t}},{row + 1}" if loaded else str(row + 1)
        name, symbol = f"{prefix}_{row + 1}", f"$f_{{{index}}}$"
        entries.append(MapQuantity(name, "Hz", symbol, value, (), "more", loaded=loaded, modal=True))
    return entries


def _least_real_part(response: Response) -> Scalar:
    """The least real part of the receptance across the cut; NaN where it has not been computed."""
    return float("nan") if response.softest is None else response.softest


def _stable_width(response: Response) -> Scalar:
    """The width of cut up to which every spindle speed is stable, theory (60); infinite where nothing rings."""
    if response.softest is None:
        return float("nan")
    rings = response.softest < 0.0
    width = reciprocal(response.cutting_pressure) * (-0.5 / where(rings, response.softest, -1.0))
    return where(rings, width, math.inf)


def _of_the_cut() -> list[MapQuantity]:
    real, width = r"$\mathrm{min\,Re}\,H$", "stable width of cut"
    return [
        MapQuantity("least_real_receptance", "m/N", real, _least_real_part, better="more", modal=True, cut=True),
        MapQuantity("stable_width", "m", width, _stable_width, better="more", modal=True, cut=True),
    ]


def _of_cable(response: Response, name: str) -> Scalar:
    """A number of cables; NaN where it has not been computed."""
    return float("nan") if response.cables is None else response.cables[name]


def _of_cables() -> list[MapQuantity]:
    tensions = [(f"tension_{number}", rf"$\tau_{{{number}}}$", None) for number in range(1, MOST_CABLES + 1)]
    others: list[tuple[str, str, Better]] = [
        ("least_tension", "least tension", "more"),
        ("greatest_tension", "greatest tension", "less"),
        ("tension_reserve", "reserve of the tensions", "more"),
        ("capacity", "capacity", "more"),
    ]
    return [
        *(
            MapQuantity(name, "N", symbol, partial(_of_cable, name=name), better=better, needs=CABLES, cables=True)
            for name, symbol, better in (*tensions, *others)
        ),
        MapQuantity(
            "wrench_closure",
            "1",
            "wrench closure",
            partial(_of_cable, name="wrench_closure"),
            better="more",
            needs=CABLES,
            cables=True,
        ),
    ]


def _of_drives() -> list[MapQuantity]:
    """Loads that the drives hold and speeds that they allow: in all directions, and along each component."""
    words = {
        "translation": ("force", "N", "speed", "m/s", ""),
        "rotation": ("moment", "N·m", "rate", "rad/s", "angular_"),
    }
    entries = []
    for block, (load, unit, motion, rate, turning) in words.items():
        ball = partial(_wrench_number, measure=greatest_ball, row=BLOCKS[block])
        quick = partial(_speed_number, measure=greatest_speed, row=BLOCKS[block])
        strong = partial(_acceleration_number, measure=greatest_acceleration, row=BLOCKS[block])
        pairs = (("w", load), ("t", motion), ("a", "turn" if block == "rotation" else "move"))
        symbols = [rf"${letter}_{{\mathrm{{{word},min}}}}$" for letter, word in pairs]
        entries += [
            MapQuantity(f"least_wrench_{load}", unit, symbols[0], ball, better="more", driven="load"),
            MapQuantity(f"least_twist_{motion}", rate, symbols[1], quick, better="more", driven="speed"),
            MapQuantity(
                f"least_{turning}acceleration", f"{rate}**2", symbols[2], strong, better="more", driven="acceleration"
            ),
        ]
    of_wrenches, of_speeds = (
        partial(_wrench_number, measure=greatest_along),
        partial(_speed_number, measure=greatest_speed_along),
    )
    of_accelerations = partial(_acceleration_number, measure=greatest_acceleration_along)
    for row, name in enumerate(COMPONENTS):
        _, unit, _, rate, *_ = words["rotation" if row in ROTATIONS else "translation"]
        for word, value, shown, about in (
            ("wrench", of_wrenches, unit, "load"),
            ("twist", of_speeds, rate, "speed"),
            ("acceleration", of_accelerations, f"{rate}**2", "acceleration"),
        ):
            symbol = rf"${word[0]}_{{\mathrm{{{name},max}}}}$"
            entries.append(
                MapQuantity(
                    f"greatest_{word}_{name}",
                    shown,
                    symbol,
                    partial(value, row=row),
                    (name,),
                    "more",
                    driven=about,
                )
            )
    return sorted(entries, key=lambda entry: entry.name.rpartition("_")[0])


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


def _of_reversal() -> list[MapQuantity]:
    """Lost motion of the tool where all drives reverse, by component."""
    return [
        MapQuantity(
            f"reversal_error_{name}",
            "rad" if row in ROTATIONS else "m",
            rf"$e_{{\mathrm{{{name}}}}}$",
            partial(reversal_error, row=row),
            (name,),
            "less",
            driven="reversal",
        )
        for row, name in enumerate(COMPONENTS)
    ]


def _of_loaded_state() -> list[MapQuantity]:
    entries = []
    for i, name in enumerate(COMPONENTS):
        shown, unit = rf"\mathrm{{{name}}}", "rad" if i in ROTATIONS else "m"
        motion = partial(_displacement, row=i)
        tangent, free = partial(_under_load, what="stiffness", row=i), partial(_tangent_free, row=i)
        stiff, soft = _stiffness_unit(i, i), rf"$1/C_{{t,{shown}}}$"
        entries += [
            MapQuantity(f"displacement_{name}", unit, rf"$u_{{{shown}}}$", motion, (name,), loaded="displacement"),
            MapQuantity(
                f"tangent_stiffness_{name}", stiff, rf"$K_{{t,{shown}}}$", tangent, (name,), "more", loaded="stiffness"
            ),
            MapQuantity(f"tangent_free_stiffness_{name}", stiff, soft, free, (name,), "more", loaded="compliance"),
        ]
    entries += _frequencies("loaded_frequency", "frequency")
    factor, slack, snapped = (partial(_under_load, what=what) for what in ("factor", "slack", "snapped"))
    return [
        *sorted(entries, key=lambda entry: entry.name.rpartition("_")[0]),
        MapQuantity("load_factor", "1", "load factor", factor, better="more", loaded="factor"),
        MapQuantity("slack_springs", "1", "slack springs", slack, better="less", loaded="slack", whole=True),
        MapQuantity("snapped", "1", "snapped over", snapped, better="less", loaded="snapped", whole=True),
    ]


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        *_entries("compliance", "C", _compliance_unit, _compliance, "less"),
        *_entries("stiffness", "K", _stiffness_unit, _stiffness, "more"),
        *_free_stiffnesses(),
        MapQuantity("singularity_margin", "1", "singularity margin", attrgetter("singularity_margin"), better="more"),
        MapQuantity("mass", "kg", "moving mass", attrgetter("mass"), better="less"),
        MapQuantity("aspect", "1", "aspect", aspect, whole=True),
        *_extremes(),
        MapQuantity("frobenius_condition", "1", "condition of K (Frobenius)", frobenius_condition, better="less"),
        MapQuantity("shortest_leg", "m", "shortest leg", shortest_leg, needs=LIMITS["shortest_leg"].needs),
        MapQuantity("longest_leg", "m", "longest leg", longest_leg, better="less", needs=LIMITS["longest_leg"].needs),
        MapQuantity(
            "actuator_force",
            "N",
            "greatest actuator force",
            partial(actuator_load, sliding=True),
            better="less",
            needs=LIMITS["actuator_force"].needs,
        ),
        MapQuantity(
            "actuator_moment",
            "N·m",
            "greatest actuator moment",
            partial(actuator_load, sliding=False),
            better="less",
            needs=LIMITS["actuator_moment"].needs,
        ),
        *_of_drives(),
        *_of_reversal(),
        *_frequencies("frequency"),
        *_of_the_cut(),
        *_of_loaded_state(),
        *_of_cables(),
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
    return beyond or bool(rest_numbers(machine, [quantity.name for quantity in wanted], limited))


GROUPS = {
    "compliance": tuple(f"compliance_{name}" for name in COMPONENTS),
    "stiffness": tuple(f"stiffness_{name}" for name in COMPONENTS),
    "free_stiffness": tuple(f"free_stiffness_{name}" for name in COMPONENTS),
    "greatest_wrench": tuple(f"greatest_wrench_{name}" for name in COMPONENTS),
    "greatest_twist": tuple(f"greatest_twist_{name}" for name in COMPONENTS),
    "greatest_acceleration": tuple(f"greatest_acceleration_{name}" for name in COMPONENTS),
    "reversal_error": tuple(f"reversal_error_{name}" for name in COMPONENTS),
    "frequency": tuple(f"frequency_{number}" for number in range(1, MODES + 1)),
    "loaded_frequency": tuple(f"loaded_frequency_{number}" for number in range(1, MODES + 1)),
    "displacement": tuple(f"displacement_{name}" for name in COMPONENTS),
    "tension": tuple(f"tension_{number}" for number in range(1, MOST_CABLES + 1)),
    "tangent_stiffness": tuple(f"tangent_stiffness_{name}" for name in COMPONENTS),
    "tangent_free_stiffness": tuple(f"tangent_free_stiffness_{name}" for name in COMPONENTS),
}
"""Names that stand for several quantities: diagonals of C and of K, 1/C_ii, frequencies, and those under load."""


def plain_name(name: str) -> str:
    """Return the name of a quantity in words, such as "stiffness x" or "Frobenius condition"."""
    return name.replace("_", " ").replace("frobenius", "Frobenius")


def group_of(names: Sequence[str]) -> str:
    """The group of which all quantities are, such as "stiffness" where all are entries of K; else nothing."""
    return next((group for group in GROUPS if all(name.startswith(f"{group}_") for name in names)), "")
