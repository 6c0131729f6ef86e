"""The results of an analysis as a labelled dataset, and as NetCDF. Nothing is computed here."""

import math
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.leg import Spring
from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import springs
from kinetostat.machine.parameters import parameters, values
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.setting import frame_of
from kinetostat.studies.storage import write_dataset
from kinetostat.units import KINDS

UNITS = {
    "stiffness": ("N·m/rad", "N/rad", "N/m"),
    "compliance": ("rad/(N·m)", "rad/N", "m/N"),
}
"""Of the entries of K and C: rotation, coupling, translation."""
ROTATIONS = COMPONENTS[:3]
AXES = ("x", "y", "z")

Variable = tuple[tuple[str, ...], Any, dict[str, str]]


def unit_of(matrix: str, row: str, column: str) -> str:
    """The unit of an entry of "stiffness" or "compliance", by the names of its row and column."""
    return UNITS[matrix][2 - (row in ROTATIONS) - (column in ROTATIONS)]


def reference_point(analysis: Analysis) -> list[float]:
    """The tool point T, or P without a tool, in the base frame, m [3]."""
    if analysis.platform is None:
        raise ValueError("an analysis without an answer has no placement")
    position, rotation = analysis.platform
    offset = np.array(analysis.machine.tables["tool"].offset)
    return [float(c) for c in np.array(position) + np.array(rotation) @ offset]


def as_dataset(analysis: Analysis) -> xr.Dataset:
    """K, C, shares, indices and pose with named dimensions; `units` in the attributes of each variable, SI.

    The attributes say of which machine, with its file, to which point and axes they refer, and who computed them.

    Dimensions: `row` and `column` of K and C, `component` of diagonals, `spring`, `axis`, and `base_axis`. What is not
    finite (K where the machine is rigid, C where it is free) is left out.
    """
    if analysis.platform is None:
        raise ValueError("an analysis without an answer has no results")
    machine = analysis.machine
    names = list(analysis.components)
    position, rotation = analysis.platform
    found: dict[str, Variable] = {}
    for name, matrix in (("stiffness", analysis.stiffness), ("compliance", analysis.compliance)):
        if matrix is not None:
            found[name] = (("row", "column"), matrix, _said(f"Cartesian {name} at T", ", ".join(UNITS[name])))
    found |= _springs(analysis)
    found |= _indices(analysis)
    found["platform_position"] = (("base_axis",), list(position), _said("P in the base frame", "m"))
    found["platform_rotation"] = (("base_axis", "axis"), rotation, _said("platform axes in the base frame", "1"))
    found["tool_point"] = (("base_axis",), reference_point(analysis), _said("T in the base frame", "m"))
    found |= pose_of(analysis)
    coordinates = {
        "row": names,
        "column": names,
        "component": names,
        "spring": [contribution.spring for contribution in analysis.attribution],
        "part": ("spring", [contribution.part for contribution in analysis.attribution]),
        "spring_unit": ("spring", [_spring_unit(spring) for spring in springs(respond(machine).configuration)]),
        "axis": list(AXES),
        "base_axis": list(AXES),
    }
    attributes = {
        "machine": machine.name,
        "family": machine.family.name,
        "status": analysis.status.word,
        "message": analysis.message,
        "axes": analysis.axes,
        "frame": frame_of(machine, analysis.axes),
        "machine_file": as_toml(machine),
        "kinetostat": version("kinetostat"),
        "order": " ".join(names),
    }
    return xr.Dataset(found, coordinates, attributes)


def pose_of(analysis: Analysis) -> dict[str, Variable]:
    """The coordinates of the pose as scalar variables `pose_...`, SI."""
    held = values(analysis.machine)
    found: dict[str, Variable] = {}
    for parameter in parameters(analysis.machine.family):
        section, _, name = parameter.path.partition(".")
        if section == "pose":
            told = _said(parameter.quantity.meaning, KINDS[parameter.quantity.kind].unit)
            found[f"pose_{name}"] = ((), float(held[parameter.path]), told)
    return found


def _springs(analysis: Analysis) -> dict[str, Variable]:
    shares = analysis.attribution
    by_matrix = {
        "stiffness_share": ([one.stiffness_share for one in shares], "share of the diagonal of K"),
        "compliance_share": ([one.compliance_share for one in shares], "share of the diagonal of C"),
    }
    size = (len(shares), len(analysis.components))
    found: dict[str, Variable] = {
        name: (("spring", "component"), np.array(rows, dtype=float).reshape(size), _said(meaning, "1"))
        for name, (rows, meaning) in by_matrix.items()
    }
    stiffness = [one.stiffness for one in shares]
    found["spring_stiffness"] = (("spring",), stiffness, _said("of the spring; infinite if rigid", "N/m, N·m/rad"))
    return found


def _spring_unit(spring: Spring) -> str:
    return "N/m" if spring.joint.point is None else "N·m/rad"


def _indices(analysis: Analysis) -> dict[str, Variable]:
    """Scalars of the pose that have a number, and the principal compliances."""
    indices = analysis.indices
    scalars = {
        "wrench_condition": (analysis.wrench_condition, "condition of W, of the leg wrenches", "1"),
        "jacobian_condition": (analysis.jacobian_condition, "condition of the actuators' Jacobian", "1"),
        "stiffness_condition": (
            indices.stiffness_condition if indices else None,
            "condition of K, by its extreme eigenvalues",
            "1",
        ),
        "characteristic_length": (
            analysis.characteristic_length,
            "by which rotations are compared with translations",
            "m",
        ),
        "moving_mass": (analysis.moving_mass, "of what moves, as far as it is known", "kg"),
    }
    found: dict[str, Variable] = {
        name: ((), value, _said(meaning, unit))
        for name, (value, meaning, unit) in scalars.items()
        if value is not None and math.isfinite(value)
    }
    for block, principal in ((indices and indices.principal_compliances) or {}).items():
        unit = UNITS["compliance"][0 if block == "rotation" else 2]
        told = _said(f"principal compliances, {block}", unit)
        found[f"principal_compliance_{block}"] = ((f"principal_{block}",), list(principal.compliances), told)
    return found


def _said(meaning: str, unit: str) -> dict[str, str]:
    return {"long_name": meaning, "units": unit}


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the results as NetCDF-4."""
    write_dataset(path, as_dataset(analysis))
    return [path]
