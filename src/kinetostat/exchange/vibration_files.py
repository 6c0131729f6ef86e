"""Files of natural vibrations: modes as CSV or NetCDF, the state space as a MATLAB file or NetCDF. Computes nothing.

The suffix of the file decides which of the two it is.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.exchange.results import ROTATIONS, origin_of, write_lines, write_matlab
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.state_space import StateSpace, state_space
from kinetostat.studies.storage import write_dataset
from kinetostat.studies.vibration import Vibration, modes

NETCDF = ".nc"
UNITS = {
    "modal_mass": ("kg m^2", "kg"),
    "modal_stiffness": ("N m/rad", "N/m"),
    "shape": ("rad/(kg^0.5 m)", "kg^-0.5"),
}
"""Units of what has one for turning and one for sliding."""


def write_modes(analysis: Analysis, path: Path) -> list[Path]:
    """Write the modes of the machine, as NetCDF if the suffix says so, otherwise as CSV with a number a line.

    Raises:
        InputError: nothing has a mass, or the pose has no vibrations.
    """
    vibration = modes(analysis.machine)
    if not vibration.modes:
        raise InputError(f"{analysis.machine.name} has no modes to write: {vibration.message}")
    dataset = modes_dataset(vibration)
    if path.suffix.lower() == NETCDF:
        write_dataset(path, dataset)
    else:
        write_lines(path, dataset, partial(_unit, dataset))
    return [path]


def _unit(dataset: xr.Dataset, name: str, row: str, column: str) -> str:
    if name not in UNITS:
        return str(dataset[name].attrs["units"])
    along = column or str(dataset["direction"].sel(mode=int(row)).values)
    return UNITS[name][along not in ROTATIONS]


def modes_dataset(vibration: Vibration) -> xr.Dataset:
    """Return modes with named dimensions; `units` is an attribute of each variable, SI.

    Dimensions: `mode`, `component` of twists, `base_axis`, `spring` and `part`.
    """
    rows = vibration.modes
    springs, parts = ([*dict.fromkeys(name for m in rows for name in shares(m))] for shares in (_strain, _kinetic))
    variables: dict[str, Any] = {
        name: (("mode",), [getattr(mode, field) for mode in rows], {"long_name": meaning, "units": unit})
        for name, field, meaning, unit in (
            ("frequency", "frequency", "natural frequency", "Hz"),
            ("damping_ratio", "ratio", "of the mode, all damping counted", "1"),
            ("modal_mass", "modal_mass", "of the component `direction` of the tool", ", ".join(UNITS["modal_mass"])),
            ("modal_stiffness", "modal_stiffness", "of the same component", ", ".join(UNITS["modal_stiffness"])),
        )
    }
    meaning = {"long_name": "motion of the tool point, of a modal mass of 1 kg", "units": ", ".join(UNITS["shape"])}
    variables["shape"] = (("mode", "component"), [mode.tool for mode in rows], meaning)
    meaning = {"long_name": "share of the moving mass that answers when the base shakes", "units": "1"}
    variables["effective_mass"] = (("mode", "base_axis"), [mode.effective_mass for mode in rows], meaning)
    for name, dim, labels, shares in (
        ("strain_energy", "spring", springs, _strain),
        ("kinetic_energy", "part", parts, _kinetic),
    ):
        meaning = {"long_name": f"share of the {name.replace('_', ' ')}", "units": "1"}
        variables[name] = (("mode", dim), [[shares(m).get(label, 0.0) for label in labels] for m in rows], meaning)
    coordinates = {
        "mode": np.arange(1, len(rows) + 1),
        "component": list(vibration.components),
        "base_axis": ["x", "y", "z"],
        "spring": springs,
        "part": parts,
        "direction": ("mode", [mode.direction for mode in rows]),
    }
    about = origin_of(vibration.machine) | {"loaded": int(vibration.loaded), "damping_assumed": int(vibration.assumed)}
    return xr.Dataset(variables, coordinates, about)


def _strain(mode: Any) -> Any:
    return mode.strain


def _kinetic(mode: Any) -> Any:
    return mode.kinetic


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
        write_dataset(path, state_space_dataset(answer))
    else:
        write_matlab(matlab_variables(answer), path)
    return [path]


def state_space_dataset(answer: StateSpace) -> xr.Dataset:
    """Return A, B, C and D with the names of states, inputs and outputs; `rate` are the rates of the states."""
    equations, states = answer.equations, list(answer.equations.states)
    units = {"units": "SI, of the output per input"}
    damping = {"long_name": "damping ratio", "units": "1"}
    return xr.Dataset(
        {
            "A": (("rate", "state"), equations.a, {"units": "1/s"}),
            "B": (("rate", "input"), equations.b, {"units": "SI, of the rate per input"}),
            "C": (("output", "state"), equations.c, {"units": "SI, of the output per state"}),
            "D": (("output", "input"), equations.d, units),
            "frequency": (("mode",), list(answer.frequencies), {"long_name": "natural frequency", "units": "Hz"}),
            "damping_ratio": (("mode",), list(answer.ratios), damping),
        },
        {
            "rate": states,
            "state": states,
            "input": [port.name for port in answer.inputs],
            "output": [port.name for port in answer.outputs],
            "input_unit": ("input", [port.unit for port in answer.inputs]),
            "output_unit": ("output", [port.unit for port in answer.outputs]),
        },
        origin_of(answer.machine) | {"damping_assumed": int(answer.assumed)},
    )


def matlab_variables(answer: StateSpace) -> dict[str, Any]:
    """Return the variables of a MATLAB file: `ss(A, B, C, D)` makes a system of them."""
    equations = answer.equations
    return {
        "name": answer.machine.name,
        "A": equations.a,
        "B": equations.b,
        "C": equations.c,
        "D": equations.d,
        "states": np.array(equations.states, dtype=object),
        "inputs": np.array([port.name for port in answer.inputs], dtype=object),
        "outputs": np.array([port.name for port in answer.outputs], dtype=object),
        "input_units": np.array([port.unit for port in answer.inputs], dtype=object),
        "output_units": np.array([port.unit for port in answer.outputs], dtype=object),
        "frequencies": np.array(answer.frequencies),
        "damping_ratios": np.array(answer.ratios),
        "damping_assumed": answer.assumed,
    }
