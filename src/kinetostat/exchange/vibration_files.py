"""Write natural vibrations to files: modes as CSV or NetCDF, the state space as a MATLAB file or NetCDF.

The suffix of the file decides between the two. Nothing is computed here.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from kinetostat.exchange.results import origin_of, write_matlab
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.control import StateSpace, state_space
from kinetostat.studies.storage import write_dataset
from kinetostat.studies.vibration import modes
from kinetostat.views.answers import write_form
from kinetostat.views.vibration import VIBRATION

NETCDF = ".nc"


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
        write_dataset(path, state_space_dataset(answer))
    else:
        write_matlab(matlab_variables(answer), path)
    return [path]


def state_space_dataset(answer: StateSpace) -> xr.Dataset:
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
