"""Results as files: an analysis as NetCDF, CSV and MATLAB, the modes, and the state space. Nothing is computed here.

An analysis is first a labelled dataset, of which NetCDF and CSV are made. The suffix of a file of modes or of the state
space decides between two forms.
"""

import math
import re
from collections.abc import Iterator, Sequence
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.io import savemat

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.exchange.formats import platform_of, reference_point
from kinetostat.machine.leg import Spring
from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import Machine, frame_of
from kinetostat.machine.machine import springs as springs_of
from kinetostat.machine.parameters import parameters, values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.control import StateSpace, state_space
from kinetostat.studies.storage import replacing, write_dataset, write_text
from kinetostat.studies.vibration import modes
from kinetostat.units import KINDS
from kinetostat.views.answers import write_form
from kinetostat.views.data_forms import csv_text, no_formula
from kinetostat.views.vibration import VIBRATION

MATRIX_UNITS = {
    "stiffness": ("N·m/rad", "N/rad", "N/m"),
    "compliance": ("rad/(N·m)", "rad/N", "m/N"),
}
"""Units of the entries of K and C by the number of translations, 0 to 2, among row and column."""
ROTATIONS = COMPONENTS[:3]
AXES = ("x", "y", "z")
CSV_HEADER = ("quantity", "row", "column", "value", "unit")
HEAD_ATTRIBUTES = ("machine", "family", "frame", "kinetostat")
"""Attributes at the top of a CSV file: a line "about" each, their values in the columns of names."""
NETCDF = ".nc"
LONGEST_MATLAB_NAME = 63
"""Most characters of a name in MATLAB (`namelengthmax`)."""

Variable = tuple[tuple[str, ...], Any, dict[str, str]]
"""Dimensions, values and attributes of a variable, as xarray takes them."""


def write_netcdf(analysis: Analysis, path: Path) -> list[Path]:
    """Write the results as NetCDF-4."""
    write_dataset(path, as_dataset(analysis))
    return [path]


def write_csv(analysis: Analysis, path: Path) -> list[Path]:
    """Write the results as CSV, one number a line: its names, all its digits and its unit; NaN is left empty."""
    dataset = as_dataset(analysis)
    rows = [("about", key, no_formula(str(dataset.attrs[key])), "", "") for key in HEAD_ATTRIBUTES]
    for quantity, row, column, value in _entries_of(dataset):
        shown = "" if math.isnan(value) else repr(value)
        rows.append((quantity, no_formula(row), no_formula(column), shown, _unit_of(dataset, quantity, row, column)))
    write_text(path, csv_text(CSV_HEADER, rows))
    return [path]


def write_mat(analysis: Analysis, path: Path) -> list[Path]:
    """Write K, C, pose and reference point as a MATLAB file (level 5)."""
    return _write_matlab(_matlab_results(analysis), path)


def write_modes(analysis: Analysis, path: Path) -> list[Path]:
    """Write the modes of the machine as `modes -o` does: as NetCDF if the suffix says so, otherwise as CSV.

    Raises:
        InputError: nothing has a mass, or the pose has no vibrations.
    """
    vibration = modes(analysis.state)
    if not vibration.modes:
        raise InputError(f"{analysis.machine.name} has no modes to write: {vibration.message}")
    write_form(VIBRATION, vibration, "nc" if path.suffix.lower() == NETCDF else "csv", path)
    return [path]


def write_state_space(
    analysis: Analysis, path: Path, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> list[Path]:
    """Write A, B, C and D, as NetCDF if the suffix says so, otherwise as a MATLAB file (level 5).

    Args:
        analysis: the analysis of the machine.
        path: the path of the file.
        inputs, outputs: see `state_space`.

    Raises:
        InputError: a name is unknown, nothing has a mass, or the pose has no vibrations.
    """
    answer = state_space(analysis.machine, inputs, outputs)
    if path.suffix.lower() == NETCDF:
        write_dataset(path, _state_space_dataset(answer))
        return [path]
    return _write_matlab(_matlab_state_space(answer), path)


def as_dataset(analysis: Analysis) -> xr.Dataset:
    """Return K, C, contributions, indices and pose with named dimensions; `units` is an attribute of each variable, SI.

    The attributes name the machine with its file, the point and axes to which everything refers, and the program.

    Dimensions: `row` and `column` of K and C, `component` of diagonals, `spring`, `axis`, and `base_axis`. What is not
    finite (K where the machine is rigid, C where it is free) is left out.
    """
    point, names = reference_point(analysis), list(analysis.components)
    position, rotation = platform_of(analysis)
    variables: dict[str, Variable] = {}
    for name, matrix in (("stiffness", analysis.stiffness), ("compliance", analysis.compliance)):
        if matrix is not None:
            attributes = _attributes(f"Cartesian {name} at T", ", ".join(MATRIX_UNITS[name]))
            variables[name] = (("row", "column"), matrix, attributes)
    variables |= _spring_variables(analysis)
    variables |= _index_variables(analysis)
    variables["platform_position"] = (("base_axis",), list(position), _attributes("P in the base frame", "m"))
    axes = _attributes("platform axes in the base frame", "1")
    variables["platform_rotation"] = (("base_axis", "axis"), rotation, axes)
    variables["tool_point"] = (("base_axis",), point, _attributes("T in the base frame", "m"))
    variables |= _pose_variables(analysis)
    pairs = zip(analysis.attribution, springs_of(analysis.state.configuration), strict=True)
    coordinates = {
        "row": names,
        "column": names,
        "component": names,
        "spring": [contribution.spring for contribution in analysis.attribution],
        "part": ("spring", [contribution.part for contribution in analysis.attribution]),
        "spring_unit": ("spring", [_spring_unit(spring) for _, spring in pairs]),
        "axis": list(AXES),
        "base_axis": list(AXES),
    }
    answer = {"status": analysis.status.word, "message": analysis.message, "axes": analysis.axes}
    about = {**_origin_of(analysis.machine, analysis.axes), **answer, "order": " ".join(names)}
    return xr.Dataset(variables, coordinates, about)


def _origin_of(machine: Machine, axes: str = "base") -> dict[str, Any]:
    """Return attributes of a dataset: the machine with its file, the frame of the numbers, and the program."""
    return {
        "machine": machine.name,
        "family": machine.family.name,
        "frame": frame_of(machine, axes),
        "machine_file": as_toml(machine),
        "kinetostat": version("kinetostat"),
    }


def _pose_variables(analysis: Analysis) -> dict[str, Variable]:
    """Return the coordinates of the pose as scalar variables `pose_...`, SI."""
    numbers = values(analysis.machine)
    variables: dict[str, Variable] = {}
    for parameter in parameters(analysis.machine.family):
        table, _, name = parameter.path.partition(".")
        if table == "pose":
            attributes = _attributes(parameter.quantity.meaning, KINDS[parameter.quantity.kind].unit)
            variables[f"pose_{name}"] = ((), float(numbers[parameter.path]), attributes)
    return variables


def _spring_variables(analysis: Analysis) -> dict[str, Variable]:
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
    attributes = _attributes("stiffness of the spring; infinite if rigid", "N/m, N·m/rad")
    variables["spring_stiffness"] = (("spring",), stiffness, attributes)
    return variables


def _spring_unit(spring: Spring) -> str:
    return "N/m" if spring.joint.point is None else "N·m/rad"


def _index_variables(analysis: Analysis) -> dict[str, Variable]:
    """Return the scalars of the pose that have a number, and the principal compliances."""
    indices, length = analysis.indices, analysis.characteristic_length
    condition = indices.stiffness_condition if indices else None
    scalars = {
        "wrench_condition": (analysis.wrench_condition, "condition of W, the leg wrenches", "1"),
        "jacobian_condition": (analysis.jacobian_condition, "condition of the actuators' Jacobian", "1"),
        "stiffness_condition": (condition, "condition of K, by its extreme eigenvalues", "1"),
        "characteristic_length": (length, "length that makes rotations comparable with translations", "m"),
        "moving_mass": (analysis.moving_mass, "mass of the moving parts, as far as known", "kg"),
    }
    variables: dict[str, Variable] = {
        name: ((), value, _attributes(meaning, unit))
        for name, (value, meaning, unit) in scalars.items()
        if value is not None and math.isfinite(value)
    }
    for block, principal in ((indices and indices.principal_compliances) or {}).items():
        unit = MATRIX_UNITS["compliance"][0 if block == "rotation" else 2]
        attributes = _attributes(f"principal compliances, {block}", unit)
        variables[f"principal_compliance_{block}"] = ((f"principal_{block}",), list(principal.compliances), attributes)
    return variables


def _attributes(meaning: str, unit: str) -> dict[str, str]:
    return {"long_name": meaning, "units": unit}


def _entries_of(dataset: xr.Dataset) -> Iterator[tuple[str, str, str, float]]:
    """Give every number of a dataset: quantity, label of its row, label of its column, value."""
    for name, variable in dataset.data_vars.items():
        sizes = variable.sizes
        for place in product(*(range(size) for size in sizes.values())):
            labels = [_label(dataset, str(dim), i) for dim, i in zip(sizes, place, strict=True)]
            row, column = (*labels, "", "")[:2]
            yield str(name), row, column, float(variable.values[place])


def _label(dataset: xr.Dataset, dim: str, i: int) -> str:
    """Return the label of a place along a dimension, or its number."""
    return str(dataset[dim].values[i]) if dim in dataset.coords else str(i + 1)


def _unit_of(dataset: xr.Dataset, name: str, row: str, column: str) -> str:
    if name in MATRIX_UNITS:
        translations = sum(label not in ROTATIONS for label in (row, column))
        return MATRIX_UNITS[name][translations]
    if name == "spring_stiffness":
        return str(dataset["spring_unit"].sel(spring=row).values)
    return str(dataset[name].attrs["units"])


def _write_matlab(variables: dict[str, Any], path: Path) -> list[Path]:
    """Write variables as a MATLAB file (level 5)."""
    with replacing(path) as temporary:
        savemat(temporary, variables, appendmat=False, long_field_names=True, oned_as="column")
    return [path]


def _matlab_results(analysis: Analysis) -> dict[str, Any]:
    """Return the variables of a MATLAB file and their `units`; K and C are [] where they are not finite."""
    point, (position, rotation) = reference_point(analysis), platform_of(analysis)
    pose = {_matlab_name(name.removeprefix("pose_")): variable for name, variable in _pose_variables(analysis).items()}
    no_matrix = np.zeros((0, 0))
    return {
        "name": analysis.machine.name,
        "K": no_matrix if analysis.stiffness is None else analysis.stiffness,
        "C": no_matrix if analysis.compliance is None else analysis.compliance,
        "order": np.array(analysis.components, dtype=object),
        "axes": analysis.axes,
        "reference_point": np.array([point]).T,
        "platform_position": np.array([position]).T,
        "platform_rotation": np.array(rotation),
        "pose": {name: float(value) for name, (_, value, _) in pose.items()},
        "units": {
            "K": ", ".join(MATRIX_UNITS["stiffness"]),
            "C": ", ".join(MATRIX_UNITS["compliance"]),
            "reference_point": "m, base frame",
            "platform_position": "m, base frame",
            "platform_rotation": "1, platform axes in the base frame",
            "pose": {name: attributes["units"] for name, (_, _, attributes) in pose.items()},
        },
    }


def _matlab_name(text: str) -> str:
    """Return a name that MATLAB takes for a field: letters, digits and underscores, a letter first."""
    return re.sub(r"\W", "_", text if text[:1].isalpha() else f"x{text}", flags=re.ASCII)[:LONGEST_MATLAB_NAME]


def _state_space_dataset(answer: StateSpace) -> xr.Dataset:
    """Return A, B, C and D with the names of states, inputs and outputs; `rate` has rates of the states."""
    equations, states = answer.equations, list(answer.equations.states)
    return xr.Dataset(
        {
            "A": (("rate", "state"), equations.a, {"units": "1/s"}),
            "B": (("rate", "input"), equations.b, {"units": "SI, of the rate per input"}),
            "C": (("output", "state"), equations.c, {"units": "SI, of the output per state"}),
            "D": (("output", "input"), equations.d, {"units": "SI, of the output per input"}),
            "frequency": (("mode",), list(answer.frequencies), {"long_name": "natural frequency", "units": "Hz"}),
            "damping_ratio": (("mode",), list(answer.ratios), {"long_name": "damping ratio", "units": "1"}),
        },
        {
            "rate": states,
            "state": states,
            "input": [port.name for port in answer.inputs],
            "output": [port.name for port in answer.outputs],
            "input_unit": ("input", [port.unit for port in answer.inputs]),
            "output_unit": ("output", [port.unit for port in answer.outputs]),
        },
        _origin_of(answer.machine) | {"damping_assumed": int(answer.assumed)},
    )


def _matlab_state_space(answer: StateSpace) -> dict[str, Any]:
    """Return the variables of a MATLAB file: `ss(A, B, C, D)` makes a system of them."""
    equations = answer.equations
    words = {
        "states": equations.states,
        "inputs": [port.name for port in answer.inputs],
        "outputs": [port.name for port in answer.outputs],
        "input_units": [port.unit for port in answer.inputs],
        "output_units": [port.unit for port in answer.outputs],
    }
    return {
        "name": answer.machine.name,
        "A": equations.a,
        "B": equations.b,
        "C": equations.c,
        "D": equations.d,
        **{name: np.array(row, dtype=object) for name, row in words.items()},
        "frequencies": np.array(answer.frequencies),
        "damping_ratios": np.array(answer.ratios),
        "damping_assumed": answer.assumed,
    }
