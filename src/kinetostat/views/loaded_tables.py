"""A machine under load as tables on a terminal: the answer first, then springs and stiffness. Nothing is computed."""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.scalar import reciprocal
from kinetostat.display import DASH, Display, number
from kinetostat.studies.under_load import LoadedState, SpringState
from kinetostat.units import component_units, load_unit, motion_unit
from kinetostat.views.analysis_tables import entry_unit, softest_sentence, stiffness_sentence
from kinetostat.views.question import Lines
from kinetostat.views.tables import FittedTable, numeric_table

KINDS_OF_LOADS = ((False, "force"), (True, "moment"))
"""Whether an actuator turns, and the kind of its load."""
MOST_LISTED_SPRINGS = 12
"""Springs that have a row each: a machine with more has many alike, which are told by kind."""
NOTHING_LOADS = "[load] has no force, no moment and no preload, and no mass under gravity"
SIGNS = (
    "A load is positive where it pulls: of an actuator, cable or link, where it pulls its ends together. Of a bearing "
    "or flexure it is positive along the axis that the file gives, so that mirrored copies of a leg differ in sign."
)
"""Meaning of the signs of loads, which stands beside their tables."""


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


def loaded_lines(state: LoadedState) -> Lines:
    """Say what a machine at rest does under its loads: stiffness, softest direction, sag, actuators, stability.

    Args:
        state: a state of rest.
    """
    display, names = state.machine.display, state.components
    if not state.loaded:
        yield "Loads", f"Nothing loads the machine: {NOTHING_LOADS}."
    if state.compliance is not None:
        felt = stiffness_sentence(names, [row[i] for i, row in enumerate(state.compliance)], display)
        yield "Stiffness", f"{felt} (against further loads, at the loaded {state.machine.reference}, base axes)."
    if state.softest:
        yield "Softest", softest_sentence(state.softest, display)
    if state.loaded:
        yield "Sag", sag_sentence(state)
        yield "Actuators", actuator_sentence(state)
        yield "Stability", stability_of(state)


def sag_sentence(state: LoadedState) -> str:
    """Say how far the loads move and turn the tool."""
    show = state.machine.display.show_deflection
    moved, turned = map(show, state.tool_motion, ("m", "rad"))
    return f"The loads move the {state.machine.reference} by {moved} and turn it by {turned}."


def actuator_sentence(state: LoadedState) -> str:
    """Say which actuators carry most, and how much of their limits they use."""
    show, parts = state.machine.display.show, []
    for turns, kind in KINDS_OF_LOADS:
        driven = [spring for spring in actuator_springs(state) if spring.turning is turns]
        if driven:
            most = max(driven, key=lambda spring: abs(spring.load))
            direction = "" if turns or not most.load else ", which pulls" if most.load > 0.0 else ", which pushes"
            size = show(abs(most.load), load_unit(turns))
            parts.append(f"the greatest {kind} of an actuator is {size} ({most.name}{direction})")
    if not parts:
        return ""
    text, use = "; ".join(parts), state.limit_use
    if use is None:
        use_text = "the file limits no load of actuators"
    else:
        use_text = f"{number(100.0 * use, digits=3)} % of its limit" + (", which it passes" if use > 1.0 else "")
    return f"{text[0].upper()}{text[1:]}; {use_text}."


def actuator_springs(state: LoadedState) -> list[SpringState]:
    """Return the spring of each actuator: the first of those in series, because all of these carry the same load."""
    first: dict[tuple[str, bool], SpringState] = {}
    for spring in state.springs:
        if spring.actuated:
            first.setdefault((spring.leg, spring.turning), spring)
    return list(first.values())


def displacement_table(state: LoadedState, display: Display) -> FittedTable:
    """Return the displacement of the tool under its loads, beside that of linear equations."""
    units = component_units(state.components)
    scales = dict.fromkeys(display.deflection(unit).unit for unit in units)
    table = numeric_table(f"Displacement of the tool point ({', '.join(scales)})", "", state.components)
    for what, values in (("under load", state.displacement), ("to first order", state.linear)):
        if values is not None:
            shown = (display.show_deflection(v, unit).split()[0] for v, unit in zip(values, units, strict=True))
            table.add_row(what, *shown)
    return table


def named_leg_springs(state: LoadedState) -> list[tuple[str, SpringState]]:
    """Name what carries each leg: its actuator by the name of the leg, or by its own where a leg has several."""
    shown = [spring for spring in state.springs if spring.actuated] or list(state.springs)
    count = Counter(spring.leg for spring in shown)
    return [(spring.leg if count[spring.leg] == 1 else spring.name, spring) for spring in shown]


def tangent_table(state: LoadedState, free: Sequence[float] = (), stiff: Sequence[float] = ()) -> FittedTable | None:
    """Return the stiffness to further loads in each direction, beside that of the machine without loads.

    Args:
        state: a state of rest; None is returned where its stiffness is not finite.
        free: diagonal of 1/C without loads, SI; left out if empty.
        stiff: diagonal of K without loads, SI.
    """
    if state.tangent is None or state.compliance is None:
        return None
    display, names = state.machine.display, state.components
    columns = {
        "1/C under load": [reciprocal(entry) for entry in np.diag(state.compliance).tolist()],
        "1/C free state": list(free),
        "K under load": np.diag(state.tangent).tolist(),
        "of springs": [] if state.elastic is None else np.diag(state.elastic).tolist(),
        "K free state": list(stiff),
    }
    columns = {head: values for head, values in columns.items() if values}
    table = numeric_table("Stiffness to further loads", "", list(columns))
    for i, name in enumerate(names):
        unit = entry_unit("stiffness", name, name)
        cells = (display.number(values[i], unit, "rigid") for values in columns.values())
        table.add_row(display.scale(unit).label(name), *cells)
    return table


def springs_or_kinds_table(state: LoadedState, display: Display, full: bool = False) -> FittedTable:
    """Return the table of the springs: each by itself where they are few or `full`, else by kind."""
    few = len(state.springs) <= MOST_LISTED_SPRINGS
    return spring_table(state, display) if few or full else _kinds_table(state, display)


def _kinds_table(state: LoadedState, display: Display) -> FittedTable:
    """Least and greatest load and greatest deformation of the springs of each kind, and how many are slack."""
    kinds: dict[tuple[str, bool], list[SpringState]] = {}
    for spring in state.springs:
        kinds.setdefault((spring.name.removeprefix(f"{spring.leg} "), spring.turning), []).append(spring)
    table = numeric_table("Springs by kind", "spring", ["least load", "greatest load", "deformation", "slack"])
    for (kind, turning), members in kinds.items():
        loads = [spring.load for spring in members]
        ends = (display.show(end, load_unit(turning)) for end in (min(loads), max(loads)))
        most = max((spring.deformation for spring in members), key=abs)
        name = f"{kind} ×{len(members)}" if len(members) > 1 else members[0].name
        slack = sum(spring.slack for spring in members)
        deformation = display.show_deflection(most, motion_unit(turning))
        table.add_row(name, *ends, deformation, str(slack) if slack else DASH)
    return table


def spring_table(state: LoadedState, display: Display) -> FittedTable:
    """Return the load, deformation and state of every spring."""
    table = numeric_table("Springs", "spring", ["load", "deformation", "state"])
    for spring in state.springs:
        load = display.show(spring.load, load_unit(spring.turning))
        amount = display.show_deflection(spring.deformation, motion_unit(spring.turning))
        table.add_row(spring.name, load, amount, "slack" if spring.slack else "carries")
    return table


def strut_table(state: LoadedState, display: Display) -> FittedTable:
    """Return the compression of each strut, and the load at which it would buckle."""
    table = numeric_table("Struts: columns between two hinges", "strut", ["compression", "Euler's load", "reserve"])
    for strut in state.struts:
        reserve = DASH if math.isinf(strut.factor) else f"{number(strut.factor)} x"
        table.add_row(strut.name, display.show(strut.compression, "N"), display.show(strut.euler_load, "N"), reserve)
    return table
