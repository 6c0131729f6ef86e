"""A machine under load as tables on a terminal: the answer first, then springs and stiffness. Nothing is computed."""

import math
from collections import Counter
from collections.abc import Sequence

from kinetostat.algebra.scalar import reciprocal
from kinetostat.display import DASH, Display, number
from kinetostat.studies.under_load import LoadedState, SpringState
from kinetostat.views.analysis_tables import entry_unit
from kinetostat.views.fitted_table import FittedTable
from kinetostat.views.tables import numeric_table


def stability_of(state: LoadedState) -> str:
    """Say how far the load may grow, for the springs and for the struts."""
    first = min(state.struts, key=lambda strut: strut.factor, default=None)
    if first is None or math.isinf(first.factor):
        return _stability_of_springs(state.factor)
    bends = f"Strut {first.name} bends away at about {number(first.factor, digits=3)} times this load."
    return f"{bends} {_stability_of_springs(state.factor)}"


def _stability_of_springs(factor: float | None) -> str:
    if factor is None:
        return "The springs alone hold nothing here: weight and tension do."
    if math.isinf(factor):
        return "No growth of this load makes the springs unstable."
    if factor < 1.0:
        return f"The springs are unstable beyond {number(factor)} times this load."
    return f"The load may grow to {number(factor)} times its size until the springs become unstable."


def displacement_table(state: LoadedState, display: Display) -> FittedTable:
    """How far the load moves the tool, and what linear equations say."""
    units = ["rad" if name.startswith("r") else "m" for name in state.components]
    scales = dict.fromkeys(display.deflection(unit).unit for unit in units)
    table = numeric_table(f"Displacement of the tool point ({', '.join(scales)})", "", state.components)
    for what, values in (("under load", state.displacement), ("to first order", state.linear)):
        if values is not None:
            shown = (display.show_deflection(v, unit).split()[0] for v, unit in zip(values, units, strict=True))
            table.add_row(what, *shown)
    return table


def leg_loads(state: LoadedState) -> list[tuple[str, SpringState]]:
    """Name what carries each leg: its actuator by the name of the leg, or by its own where a leg has several."""
    shown = [spring for spring in state.springs if spring.actuated] or list(state.springs)
    count = Counter(spring.leg for spring in shown)
    return [(spring.leg if count[spring.leg] == 1 else spring.name, spring) for spring in shown]


def tangent_table(state: LoadedState, free: Sequence[float] = (), stiff: Sequence[float] = ()) -> FittedTable | None:
    """The stiffness to further loads in each direction, beside that of the machine without loads.

    Args:
        state: at rest; None is returned where its stiffness is not finite.
        free: diagonal of 1/C without loads, SI; left out if empty.
        stiff: diagonal of K without loads, SI.
    """
    if state.tangent is None or state.compliance is None:
        return None
    display, names = state.machine.display, state.components
    columns = {
        "1/C under load": [reciprocal(state.compliance[i][i]) for i in range(len(names))],
        "1/C free state": list(free),
        "K under load": [state.tangent[i][i] for i in range(len(names))],
        "of springs": [] if state.elastic is None else [state.elastic[i][i] for i in range(len(names))],
        "K free state": list(stiff),
    }
    columns = {head: values for head, values in columns.items() if values}
    table = numeric_table("Stiffness to further loads", "", list(columns))
    for i, name in enumerate(names):
        unit = entry_unit("stiffness", name, name)
        cells = (display.number(values[i], unit, "rigid") for values in columns.values())
        table.add_row(display.scale(unit).label(name), *cells)
    return table


def spring_table(state: LoadedState, display: Display) -> FittedTable:
    """Load, deformation and state of every spring."""
    table = numeric_table("Springs", "spring", ["load", "deformation", "state"])
    for spring in state.springs:
        load = display.show(spring.load, "N·m" if spring.turning else "N")
        amount = display.show_deflection(spring.deformation, "rad" if spring.turning else "m")
        table.add_row(spring.name, load, amount, "slack" if spring.slack else "carries")
    return table


def strut_table(state: LoadedState, display: Display) -> FittedTable:
    """What presses each strut, and at which load it would bend away."""
    table = numeric_table("Struts: columns between two hinges", "strut", ["compression", "Euler's load", "reserve"])
    for strut in state.struts:
        reserve = DASH if math.isinf(strut.factor) else f"{number(strut.factor)} x"
        table.add_row(strut.name, display.show(strut.compression, "N"), display.show(strut.euler_load, "N"), reserve)
    return table
