"""Guidelines as plain data for `--json`: numbers in SI, null where there is none. Nothing is computed here."""

import math
from dataclasses import asdict
from typing import Any

from kinetostat.kinetostatics.elements import Element
from kinetostat.studies.guidelines.guidelines import Guidelines
from kinetostat.studies.guidelines.moves import Move
from kinetostat.studies.guidelines.roles import EXCESS, Roles
from kinetostat.studies.guidelines.sentences import limit_of, statements


def as_json(found: Guidelines) -> dict[str, Any]:
    """Guidelines as nested dictionaries and lists; directions by name."""
    names, here = found.components, found.here
    return {
        "name": found.machine.name,
        "status": found.status.word,
        "message": found.message,
        "components": list(names),
        "rigid_within": EXCESS,
        "compliance_diagonal": [_finite(entry) for entry in found.compliance] or None,
        "elements": [_element(found, here, k, one) for k, one in enumerate(found.found)] if here else [],
        "stiffness_equations": found.equations and {
            name: dict(zip(names, row, strict=True)) for name, row in found.equations.items()
        },
        "parameters": [_move(move, names) for move in found.moves],
        "without_influence": list(found.idle),
        "left_out": dict(found.skipped),
        "statements": [asdict(one) for one in statements(found)],
        "grid": {"over": list(found.ranges), "poses": found.poses[1], "answered": found.poses[0]}
        if found.ranges
        else None,
    }  # fmt: skip


def _element(found: Guidelines, here: Roles, k: int, one: Element) -> dict[str, Any]:
    names, over, servo = found.components, found.everywhere, found.actuator
    limits = (
        dict.fromkeys(names) if one.stiffness is None else _limits(names, one.stiffness, here.rigid[k, :, 0].tolist())
    )
    ratio = servo.stiffness if servo else None
    data: dict[str, Any] = {
        "name": one.name,
        "parts": list(one.parts),
        "actuated": one.actuated,
        "units": one.unit or None,
        "stiffness": "rigid" if one.stiffness == math.inf else one.stiffness,
        "compliance_share": _by_name(names, here.shares[k, :, 0].tolist()),
        "rigid_from_factor": _by_name(names, here.rigid[k, :, 0].tolist()),
        "rigid_from": limits,
        "rigid_from_per_actuator": {name: limit and ratio and limit / ratio for name, limit in limits.items()},
        "doubling_lowers_compliance": _by_name(names, here.gains[k, :, 0].tolist()),
    }
    if over is not None and found.poses[0]:
        data["over_grid"] = {
            "least_share": _by_name(names, over.shares[k].min(axis=1).tolist()),
            "greatest_share": _by_name(names, over.shares[k].max(axis=1).tolist()),
            "rigid_from_factor": _by_name(names, over.rigid[k].max(axis=1).tolist()),
        }
    return data


def _limits(names: tuple[str, ...], stiffness: float, factors: list[float]) -> dict[str, float | None]:
    return _by_name(names, [limit_of(stiffness, factor) for factor in factors])


def _move(move: Move, names: tuple[str, ...]) -> dict[str, Any]:
    data: dict[str, Any] = {
        "path": move.path,
        "one_percent": "0.01 rad" if move.turning else "1 %",
        "stiffer_percent_per_percent": dict(zip(names, move.percents, strict=True)),
    }
    if move.stiffer:
        data["stiffer_at"] = dict(zip(names, move.stiffer, strict=True))
        data["softer_at"] = dict(zip(names, move.softer, strict=True))
    return data


def _by_name(names: tuple[str, ...], row: list[float]) -> dict[str, float | None]:
    return {name: _finite(value) for name, value in zip(names, row, strict=True)}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
