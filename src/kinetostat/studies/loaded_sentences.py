"""A machine under its loads in sentences: what is special about its rest, why it has none, and how it gives way."""

import math
from collections.abc import Sequence

from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.limit import LoadLimit
from kinetostat.equilibrium.links import Strut
from kinetostat.equilibrium.state import MachineState
from kinetostat.equilibrium.tangent import Stability
from kinetostat.kinematics.mobility import describe
from kinetostat.machine.machine import Machine

ADVICE = "Reduce the load, stiffen what moves, or preload what only pulls."


def about_rest(state: MachineState, judged: Stability, slack: Sequence[str]) -> str:
    """Say what is special about a state of rest.

    Args:
        state: of the machine that is at rest.
        judged: what the springs make of it.
        slack: names of legs in which a spring carries nothing.
    """
    sentences = [*_about_stability(judged, state.limit)]
    if slack:
        sentences.append(f"Slack, so that they carry nothing: {', '.join(slack)}.")
    bent = sorted((strut for strut in state.struts if strut.bends_away), key=lambda strut: strut.factor)
    if bent:
        sentences.append(_bends_away(state.machine, bent[0], len(bent) - 1))
    return " ".join(sentences) or "At rest and stable."


def _about_stability(judged: Stability, limit: LoadLimit | None) -> list[str]:
    """That the machine is not stable, or has passed a state in which it was not, and how it gives way there."""
    if not judged.stable:
        stands = how_it_gives_way(limit)
        return [f"The machine is not stable under this load: the least disturbance moves it away. {stands} {ADVICE}"]
    if limit is None or limit.share == 1.0 or limit.least:
        return []
    return [f"The machine has snapped over to another state on the way. {how_it_gives_way(limit)}"]


def _bends_away(machine: Machine, strut: Strut, others: int) -> str:
    """That a strut is pressed with more than Euler's load, which the springs do not know, and so many others too."""
    show, more = machine.display.show, f" (and {others} more)" if others else ""
    return (
        f"Strut {strut.name} bends away{more}: it is pressed with {show(strut.compression, 'N')}, and Euler's load of "
        f"a column of {show(strut.length, 'm')} between two hinges is {show(strut.euler_load, 'N')}. Make it shorter "
        "or its cross-section stiffer."
    )


def why_no_rest(machine: Machine, limit: LoadLimit | None) -> str:
    """Say that a machine comes to no rest under its loads, and under which share of them it stood last."""
    return f"{machine.name} comes to no rest under this load. {how_it_gives_way(limit)} {ADVICE}"


def why_no_tensions(machine: Machine) -> str:
    """Say that no tensions within the bounds of [load] hold the load."""
    load, show = machine.tables["load"], machine.display.show
    least = 0.0 if math.isinf(load.min_tension) else load.min_tension
    upper = "or more" if math.isinf(load.max_tension) else f"to {show(load.max_tension, 'N')}"
    return (
        f"No tensions of {show(least, 'N')} {upper} hold this load at the pose of {machine.name}; change the bounds "
        "load.min_tension and load.max_tension, the load, or the pose."
    )


def how_it_gives_way(limit: LoadLimit | None) -> str:
    """Say up to which share of its loads a machine stands, by which motion it gives way, and what is slack then.

    Args:
        limit: of the machine; None if no share of its loads was found under which it stands.
    """
    if limit is None:
        return "No share of it was found under which it stands."
    mode = describe((limit.judged.mode * limit.balance.mechanism.twist_units[0]).tolist(), ("rad", "m"))
    slack, legs = _slack_legs(limit.balance), moving_legs(limit.balance, limit.judged)
    known = limit.judged.mode.any()
    by = f", and then gives way by a motion like {mode} at the tool, most of all in {', '.join(legs)}" if known else ""
    what = f" Slack there: {', '.join(slack)}." if slack else ""
    least = "at least " if limit.least else ""
    return f"It stands up to {least}{limit.share:.3g} times this load{by}.{what}"


def moving_legs(equations: Balance, judged: Stability) -> list[str]:
    """The legs that move most when a state gives way."""
    legs = zip(equations.mechanism.legs, judged.legs, strict=True)
    return [leg.name for leg, size in legs if size > 0.5 * max(judged.legs)]


def _slack_legs(equations: Balance) -> list[str]:
    """The legs in which a spring could carry loads of the other sign only, and carries nothing."""
    pairs = zip(equations.mechanism.legs, equations.legs, strict=True)
    return [leg.name for leg, terms in pairs if ((leg.sign != 0.0) & (terms.carrying[0] == 0.0)).any()]
