"""An analysis as plain data for `--json`: numbers in SI, infinite and missing ones null. Nothing is computed here."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from kinetostat.machine.parameters import values
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.indices import Along, Indices
from kinetostat.studies.loads import LoadCase


def as_json(analysis: Analysis, along: Sequence[Along] = ()) -> dict[str, Any]:
    """The analysis, and stiffnesses along directions, as nested dictionaries and lists."""
    machine = analysis.machine
    pose = {path.removeprefix("pose."): value for path, value in values(machine).items() if path.startswith("pose.")}
    position, rotation = analysis.platform or (None, None)
    return {
        "name": machine.name,
        "family": machine.family.name,
        "order": list(analysis.components),
        "axes": analysis.axes,
        "pose": pose,
        "status": analysis.status.word,
        "message": analysis.message,
        "platform": {"position": position and list(position), "rotation": rotation},
        "tool_offset": list(machine.tables["tool"].offset),
        "stiffness": analysis.stiffness,
        "compliance": analysis.compliance,
        "stiffness_diagonal": [_finite(entry) for entry in analysis.stiffness_diagonal] or None,
        "compliance_diagonal": [_finite(entry) for entry in analysis.compliance_diagonal] or None,
        "rank": analysis.rank,
        "rigid": list(analysis.rigid),
        "free": list(analysis.free),
        "wrench_condition": analysis.wrench_condition,
        "jacobian_condition": analysis.jacobian_condition and _finite(analysis.jacobian_condition),
        "characteristic_length": analysis.length,
        **_indices(analysis.indices),
        "along": [_lists({key: _known(value) for key, value in asdict(one).items()}) for one in along],
        "mobility": _mobility(analysis),
        "internal_loads": analysis.internal and _lists(asdict(analysis.internal)),
        "load": analysis.load and _load(analysis.load),
        "moving_mass": analysis.mass,
        "masses": {one.name: one.mass and float(one.mass) for one in analysis.masses},
        "attribution": [
            {
                "spring": share.name,
                "part": share.part,
                "stiffness": "rigid" if math.isinf(share.stiffness) else share.stiffness,
                "compliance_share": list(share.compliance),
                "stiffness_share": list(share.stiffness_share),
            }
            for share in analysis.shares
        ],
    }


def _indices(indices: Indices | None) -> dict[str, Any]:
    if indices is None:
        return {"principal_compliances": None}
    found = (indices.principal or {}).items()
    principal = {name: {"values": one.compliances, "directions": one.directions} for name, one in found}
    kinds = {"free": indices.free, "guided": indices.guided}
    return {
        "principal_compliances": principal or None,
        "principal_stiffnesses": {
            kind: {
                block: {"values": [_finite(k) for k in one.stiffnesses], "directions": one.directions}
                for block, one in (blocks or {}).items()
            }
            for kind, blocks in kinds.items()
        },
        "stiffness_condition": _finite(indices.condition),
        "centres": indices.centres,
        "eigenscrews": [{key: _known(value) for key, value in asdict(screw).items()} for screw in indices.eigenscrews],
    }


def _mobility(analysis: Analysis) -> dict[str, Any] | None:
    found = analysis.mobility
    if found is None:
        return None
    return {
        "full_cycle": found.full_cycle,
        "here": found.here.platform,
        "legs": list(found.here.legs),
        "idle": found.here.idle,
        "redundant_constraints": found.here.redundant,
        "actuators": found.actuators,
        "kind": str(found.kind),
        "locked_legs": list(found.lost),
        "free_twists": [list(twist) for twist in found.twists],
        "leg_distance": found.leg_distance,
        "platform_distance": found.platform_distance,
    }


def _load(load: LoadCase) -> dict[str, Any]:
    return {
        "wrench": list(load.wrench),
        "deflection": [_finite(c) for c in load.deflection],
        "springs": [{**asdict(spring), "deformation": _finite(spring.deformation)} for spring in load.springs],
        "reactions": [
            {
                "leg": reaction.leg,
                "joint": reaction.joint,
                "point": [float(c) for c in reaction.point.components()],
                "wrench": [float(c) for c in reaction.wrench.components()],
            }
            for reaction in load.reactions
        ],
    }


def _lists(data: dict[str, Any]) -> dict[str, Any]:
    """Lists for tuples, as JSON has them."""
    return {key: list(value) if isinstance(value, tuple) else value for key, value in data.items()}


def _known(value: Any) -> Any:
    return _finite(value) if isinstance(value, float) else value


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
