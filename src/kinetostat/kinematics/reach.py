"""Can the legs close at a pose, and if not, why. Screws and singularities are elsewhere.

Source: theory section 4 for links that meet, theory (23) for legs of three revolutes.
"""

from kinetostat.algebra.scalar import Scalar, smaller
from kinetostat.machine.machine import Closure, Configuration


def clearance(closure: Closure) -> Scalar:
    """How far the leg is from its nearest limit, m; negative where it cannot close."""
    return smaller(closure.longest - closure.span, closure.span - closure.shortest)


def within_reach(configuration: Configuration) -> Scalar:
    """Whether every leg closes."""
    result: Scalar = True
    for closure in configuration.closures:
        result = (clearance(closure) >= 0.0) & result
    return result


def why_out_of_reach(configuration: Configuration) -> str:
    """One sentence for each leg that does not close, with its figures in m and the way out."""
    sentences = []
    for closure in configuration.closures:
        if clearance(closure) >= 0.0:
            continue
        far = closure.span > closure.longest
        limit = f"at most {closure.longest:.6g} m" if far else f"at least {closure.shortest:.6g} m"
        advice = "move the platform nearer or lengthen" if far else "move the platform away or make more equal"
        sentences.append(
            f"The {closure.leg} would have to span {closure.span:.6g} m, but its links bridge {limit}; "
            f"{advice} its links."
        )
    return " ".join(sentences)
