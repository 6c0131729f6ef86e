"""Designs side by side as plain data for `--json`: SI, null where there is no number. Nothing is computed here."""

import math
from typing import Any

from kinetostat.studies.comparison.design_rows import Row
from kinetostat.studies.comparison.designs import Comparison


def as_json(found: Comparison) -> dict[str, Any]:
    """Designs, where they differ, and every number of each."""
    designs = [
        {
            "design": design.label,
            "name": design.machine.name,
            "family": design.machine.family.name,
            "components": list(design.analysis.components),
            "status": design.analysis.status.word,
            "message": design.analysis.message,
            "softest": [{"direction": one.component, "shares": dict(one.shares)} for one in own],
        }
        for design, own in zip(found.designs, found.softest, strict=True)
    ]
    differences = {
        one.path: [
            [_plain(value) for value in row] if own else None
            for own, row in zip(one.parameters, one.values, strict=True)
        ]
        for one in found.differences
    }
    over = None
    if found.ranges:
        counts = [{"answered": answered, "poses": poses} for answered, poses in found.poses]
        over = {"over": list(found.ranges), "designs": counts, "rows": [_row(row) for row in found.over]}
    return {
        "designs": designs,
        "differences": differences,
        "rows": [_row(row) for row in found.rows],
        "grid": over,
    }


def _row(row: Row) -> dict[str, Any]:
    return {
        "group": row.group,
        "name": row.name,
        "units": row.unit,
        "better": str(row.better),
        "values": [_plain(value) for value in row.values],
        "percent": list(row.percents),
        "best": list(row.best),
    }


def _plain(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
