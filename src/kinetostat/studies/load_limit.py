"""In sentences: up to which share of its loads a machine stands, and how it gives way there. Nothing is solved here."""

from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.limit import Limit
from kinetostat.equilibrium.tangent import Stability
from kinetostat.kinematics.singularity import describe

ADVICE = "Reduce the load, stiffen what moves, or preload what only pulls."


def moving_legs(equations: Balance, judged: Stability) -> list[str]:
    """The legs that move most when a state gives way."""
    legs = zip(equations.mechanism.legs, judged.legs, strict=True)
    return [leg.name for leg, size in legs if size > 0.5 * max(judged.legs)]


def slack_legs(equations: Balance) -> list[str]:
    """The legs in which a spring could carry loads of the other sign only, and carries nothing."""
    pairs = zip(equations.mechanism.legs, equations.legs, strict=True)
    return [leg.name for leg, terms in pairs if ((leg.sign != 0.0) & (terms.carrying[0] == 0.0)).any()]


def how_it_gives_way(limit: Limit | None) -> str:
    """Say up to which share of its loads a machine stands, by which motion it gives way, and what is slack then.

    Args:
        limit: of the machine; None if it stands under no share of its loads.
    """
    if limit is None:
        return "It stands under no share of it either."
    mode = describe((limit.judged.mode * limit.balance.mechanism.twist_units[0]).tolist(), ("rad", "m"))
    slack, legs = slack_legs(limit.balance), moving_legs(limit.balance, limit.judged)
    known = limit.judged.mode.any()
    by = f", and then gives way by a motion like {mode} at the tool, most of all in {', '.join(legs)}" if known else ""
    what = f" Slack there: {', '.join(slack)}." if slack else ""
    least = "at least " if limit.least else ""
    return f"It stands up to {least}{limit.share:.3g} times this load{by}.{what}"
