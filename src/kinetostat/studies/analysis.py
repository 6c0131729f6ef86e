"""The first question: how stiff is this machine at this pose, and why. One pose; nothing is compiled."""

import math
from dataclasses import dataclass, replace
from typing import Any

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.algebra.vector import Vector
from kinetostat.kinematics.reach import why_out_of_reach
from kinetostat.kinematics.singularity import conditioning, describe, independent, why_singular
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.assembly import Statics, compliance_matrix, stiffness_matrix
from kinetostat.kinetostatics.attribution import compliance_shares, stiffness_shares
from kinetostat.kinetostatics.indices import Principal, principal_compliances
from kinetostat.kinetostatics.leg import AnyScrew
from kinetostat.kinetostatics.response import SINGULAR, Response, respond
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Machine, springs
from kinetostat.machine.parameters import values

Rows = list[list[float]]

NEGLIGIBLE = 1e-13
"""Share of a screw's size below which one of its components is rounding."""
INDEPENDENT = 1e-9
"""Relative size of a singular value below which the motions of springs are dependent."""


@dataclass(frozen=True)
class SpringShare:
    """What one spring does to the platform.

    Attributes:
        name: of the spring.
        stiffness: N/m or N·m/rad; infinity if rigid.
        compliance: its share of the six diagonal entries of C, 0 to 1, or None where there is nothing to share.
        stiffness_share: likewise of K.
    """

    name: str
    stiffness: float
    compliance: tuple[float | None, ...]
    stiffness_share: tuple[float | None, ...]


@dataclass(frozen=True)
class Analysis:
    """The answer at one pose; matrices at P in base axes, order rx ry rz x y z, SI.

    Attributes:
        machine: what was analysed.
        status: of the pose; all that follows is None or empty unless it is OK.
        message: one readable paragraph.
        stiffness: K [6 x 6], None where a direction is rigid (K has no finite value there).
        compliance: C [6 x 6], None where a direction is free.
        stiffness_diagonal, compliance_diagonal: the six entries, infinity where rigid or free.
        rank: of C, or of K where a direction is free.
        rigid, free: names of the springs with infinite and with zero stiffness.
        shares: attribution, spring by spring.
        principal: principal compliances by block, None where a direction is free.
        condition: ratio of the extreme singular values of W, moments divided by the characteristic length.
        length: that length, m.
    """

    machine: Machine
    status: Status
    message: str
    stiffness: Rows | None = None
    compliance: Rows | None = None
    stiffness_diagonal: tuple[float, ...] = ()
    compliance_diagonal: tuple[float, ...] = ()
    rank: int | None = None
    rigid: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    shares: tuple[SpringShare, ...] = ()
    principal: dict[str, Principal] | None = None
    condition: float | None = None
    length: float | None = None


def analyze(machine: Machine) -> Analysis:
    """K, C, attribution, indices and singularity of a machine at its pose.

    A pose that cannot be reached or is singular is an answer too: see `status` and `message`.
    """
    response = respond(machine)
    status = Status(response.status)
    if status is not Status.OK:
        return Analysis(machine, status, _why(status, response))
    held = springs(response.configuration)
    rigid = tuple(spring.name for spring in held if math.isinf(spring.stiffness))
    free = tuple(spring.name for spring in held if spring.stiffness == 0.0)
    statics = without_rounding(response.statics)
    stiffness, compliance = stiffness_matrix(statics), compliance_matrix(statics)
    yielding = all(math.isfinite(entry) for entry in stiffness.diagonal())
    length = float(response.configuration.length)
    extremes = conditioning(response.legs, length)
    return Analysis(
        machine,
        status,
        _message(response, rigid, free, yielding),
        stiffness=stiffness.rows() if yielding else None,
        compliance=None if free else compliance.rows(),
        stiffness_diagonal=stiffness.diagonal(),
        compliance_diagonal=compliance.diagonal(),
        rank=_rank(statics, bool(free)),
        rigid=rigid,
        free=free,
        shares=_shares(held, statics, stiffness, compliance),
        principal=None if free else principal_compliances(compliance),
        condition=float(extremes[0] / extremes[-1]),
        length=length,
    )


def without_rounding(statics: Statics) -> Statics:
    """The same statics with exact zeros where a screw's component is but rounding beside its others."""
    length = statics.length
    flexibility = tuple(_rounded(twist, 1.0 / length) for twist in statics.flexibility)
    resistance = tuple(_rounded(wrench, length) for wrench in statics.resistance)
    return replace(statics, flexibility=flexibility, resistance=resistance)


def _rounded(screw: AnyScrew, length: float) -> AnyScrew:
    """The screw without components that rounding alone explains, translations compared through `length`."""
    sizes = [abs(c) * scale for c, scale in zip(screw.components(), [1.0] * 3 + [length] * 3, strict=True)]
    kept = [c if size > NEGLIGIBLE * max(sizes) else 0.0 for c, size in zip(screw.components(), sizes, strict=True)]
    return type(screw)(Vector(*kept[:3]), Vector(*kept[3:]))


def as_json(analysis: Analysis) -> dict[str, Any]:
    """The analysis as plain data for `--json`: infinite and missing numbers are null."""
    machine = analysis.machine
    pose = {path.removeprefix("pose."): value for path, value in values(machine).items() if path.startswith("pose.")}
    return {
        "name": machine.name,
        "family": machine.family.name,
        "order": list(COMPONENTS),
        "pose": pose,
        "status": analysis.status.word,
        "message": analysis.message,
        "stiffness": analysis.stiffness,
        "compliance": analysis.compliance,
        "stiffness_diagonal": [_finite(entry) for entry in analysis.stiffness_diagonal] or None,
        "compliance_diagonal": [_finite(entry) for entry in analysis.compliance_diagonal] or None,
        "rank": analysis.rank,
        "rigid": list(analysis.rigid),
        "free": list(analysis.free),
        "condition": analysis.condition,
        "characteristic_length": analysis.length,
        "principal_compliances": {
            block: {"values": found.compliances, "directions": found.directions}
            for block, found in (analysis.principal or {}).items()
        }
        or None,
        "attribution": [
            {
                "spring": share.name,
                "stiffness": "rigid" if math.isinf(share.stiffness) else share.stiffness,
                "compliance_share": list(share.compliance),
                "stiffness_share": list(share.stiffness_share),
            }
            for share in analysis.shares
        ],
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None


def _why(status: Status, response: Response) -> str:
    configuration = response.configuration
    if status is Status.OUT_OF_REACH:
        return why_out_of_reach(configuration)
    names = [leg.name for leg in configuration.legs]
    return f"The pose is singular. {why_singular(names, response.legs, configuration.length, SINGULAR)}"


def _rank(statics: Statics, free: bool) -> int:
    """Rank of C, or of K where a spring is free; independent of how much the springs differ."""
    if free:
        held = [wrench for k, wrench in zip(statics.stiffness, statics.resistance, strict=True) if k > 0.0]
        return independent(held, statics.length, INDEPENDENT)
    motions = [twist for s, twist in zip(statics.compliance, statics.flexibility, strict=True) if s > 0.0]
    return independent(motions, 1.0 / statics.length, INDEPENDENT)


def _message(response: Response, rigid: tuple[str, ...], free: tuple[str, ...], yielding: bool) -> str:
    sentences = []
    if not yielding and not rigid:
        sentences.append("A leg carries a load here that none of its springs feels: K is infinite against it, C exact.")
    if rigid:
        sentences.append(f"Rigid: {', '.join(rigid)}; K is infinite in the directions that they hold, C is exact.")
    held = springs(response.configuration)
    for spring, twist in zip(held, response.statics.flexibility, strict=True):
        if spring.name in free:
            per = "m" if spring.joint.point is None else "rad"
            motion = describe([float(c) for c in twist.components()], (f"rad/{per}", f"m/{per}"))
            sentences.append(f"Free: {spring.name} has no stiffness, so that the platform moves freely by {motion}.")
    return " ".join(sentences) or Status.OK.sentence


def _shares(
    held: list[Spring], statics: Statics, stiffness: Symmetric6, compliance: Symmetric6
) -> tuple[SpringShare, ...]:
    parts = zip(compliance_shares(statics), stiffness_shares(statics), held, strict=True)
    return tuple(
        SpringShare(spring.name, spring.stiffness, _ratio(soft, compliance), _ratio(stiff, stiffness))
        for soft, stiff, spring in parts
    )


def _ratio(part: Symmetric6, whole: Symmetric6) -> tuple[float | None, ...]:
    pairs = zip(part.diagonal(), whole.diagonal(), strict=True)
    return tuple(p / w if 0.0 < w < math.inf else None for p, w in pairs)
