"""The results of an analysis as a labelled dataset, from which result files are made. Nothing is computed here."""

import math
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.leg import Spring
from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import springs as springs_of
from kinetostat.machine.parameters import parameters, values
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.setting import frame_of
from kinetostat.units import KINDS

UNITS = {
    "stiffness": ("N·m/rad", "N/rad", "N/m"),
    "compliance": ("rad/(N·m)", "rad/N", "m/N"),
}
"""Units of the entries of K and C: rotation, coupling, translation."""
ROTATIONS = COMPONENTS[:3]
AXES = ("x", "y", "z")

Variable = tuple[tuple[str, ...], Any, dict[str, str]]


def unit_of(matrix: str, row: str, column: str) -> str:
    """Return the unit of an entry of "stiffness" or "compliance" by the names of its row and column."""
    return UNITS[matrix][2 - (row in ROTATIONS) - (column in ROTATIONS)]


def reference_point(analysis: Analysis) -> list[float]:
    """Return the tool point T, or P without a tool, in the base frame, m [3]."""
    if analysis.platform is None:
        raise ValueError("an analysis without a result has no placement")
    position, rotation = analysis.platform
    offset = np.array(analysis.machine.tables["tool"].offset)
    return [float(c) for c in np.array(position) + np.array(rotation) @ offset]


def as_dataset(analysis: Analysis) -> xr.Dataset:
    """Return K, C, contributions, indices and pose with named dimensions; `units` is an attribute of each variable, SI.

    The attributes name the machine with its file, the point and axes to which everything refers, and the program.

    Dimensions: `row` and `column` of K and C, `component` of diagonals, `spring`, `axis`, and `base_axis`. What is not
    finite (K where the machine is rigid, C where it is free) is left out.
    """
    if analysis.platform is None:
        raise ValueError("an analysis without a result cannot be exported")
    machine = analysis.machine
    names = list(analysis.components)
    position, rotation = analysis.platform
    variables: dict[str, Variable] = {}
    for name, matrix in (("stiffness", analysis.stiffness), ("compliance", analysis.compliance)):
        if matrix is not None:
            variables[name] = (("row", "column"), matrix, _attributes(f"Cartesian {name} at T", ", ".join(UNITS[name])))
    variables |= _springs(analysis)
    variables |= _indices(analysis)
    variables["platform_position"] = (("base_axis",), list(position), _attributes("P in the base frame", "m"))
    variables["platform_rotation"] = (
        ("base_axis", "axis"),
        rotation,
        _attributes("platform axes in the base frame", "1"),
    )
    variables["tool_point"] = (("base_axis",), reference_point(analysis), _attributes("T in the base frame", "m"))
    variables |= pose_of(analysis)
    coordinates = {
        "row": names,
        "column": names,
        "component": names,
        "spring": [contribution.spring for contribution in analysis.attribution],
        "part": ("spring", [contribution.part for contribution in analysis.attribution]),
        "spring_unit": ("spring", [_spring_unit(spring) for spring in springs_of(respond(machine).configuration)]),
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
    return xr.Dataset(variables, coordinates, attributes)


def pose_of(analysis: Analysis) -> dict[str, Variable]:
    """Return the coordinates of the pose as scalar variables `pose_...`, SI."""
    numbers = values(analysis.machine)
    variables: dict[str, Variable] = {}
    for parameter in parameters(analysis.machine.family):
        table, _, name = parameter.path.partition(".")
        if table == "pose":
            attributes = _attributes(parameter.quantity.meaning, KINDS[parameter.quantity.kind].unit)
            variables[f"pose_{name}"] = ((), float(numbers[parameter.path]), attributes)
    return variables


def _springs(analysis: Analysis) -> dict[str, Variable]:
    springs = analysis.attribution
    by_matrix = {
        "stiffness_share": ([spring.stiffness_share for spring in springs], "share of the diagonal of K"),
        "compliance_share": ([spring.compliance_share for spring in springs], "share of the diagonal of C"),
    }
    size = (len(springs), len(analysis.components))
    variables: dict[str, Variable] = {
        name: (("spring", "component"), np.array(rows, dtype=float).reshape(size), _attributes(meaning, "1"))
        for name, (rows, meaning) in by_matrix.items()
    }
    stiffness = [spring.stiffness for spring in springs]
    attributes = _attributes("of the spring; infinite if rigid", "N/m, N·m/rad")
    variables["spring_stiffness"] = (("spring",), stiffness, attributes)
    return variables


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
    variables: dict[str, Variable] = {
        name: ((), value, _attributes(meaning, unit))
        for name, (value, meaning, unit) in scalars.items()
        if value is not None and math.isfinite(value)
    }
    for block, principal in ((indices and indices.principal_compliances) or {}).items():
        unit = UNITS["compliance"][0 if block == "rotation" else 2]
        attributes = _attributes(f"principal compliances, {block}", unit)
        variables[f"principal_compliance_{block}"] = ((f"principal_{block}",), list(principal.compliances), attributes)
    return variables


def _attributes(meaning: str, unit: str) -> dict[str, str]:
    return {"long_name": meaning, "units": unit}
