"""Sweeps and maps: quantities of a machine over a grid of any of its parameters, as a labelled dataset."""

from collections.abc import Sequence
from importlib.metadata import version
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.batch import Progress, evaluate, silent
from kinetostat.engine.points import Axis, Grid
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import GROUPS, QUANTITIES
from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import find
from kinetostat.spec.errors import InputError
from kinetostat.spec.ranges import parse_range
from kinetostat.units import KINDS

MOST_POINTS = 5_000_000
"""Points of one grid: a dozen quantities of them fit in half a gigabyte."""


def evaluate_grid(
    machine: Machine,
    ranges: Sequence[str],
    quantities: Sequence[str],
    progress: Progress = silent,
) -> xr.Dataset:
    """Quantities over all combinations of some ranges.

    Args:
        machine: gives all parameters that do not vary.
        ranges: one axis each, "FIELD=from:to:count[:log]"; a field with several entries varies them together.
        quantities: names of quantities or groups.
        progress: told how far the work is.

    Returns:
        One variable per quantity and `status`, over dimensions named by the fields' paths; units in `attrs`.
        Quantities are NaN where the status is not ok (0).

    Raises:
        InputError: an unknown field or quantity, a bad range, a field twice, or too many points.
    """
    wanted = [parse_range(text) for text in ranges]
    chosen = [find(machine.family, one.field) for one in wanted]
    taken = [leaf for parameter in chosen for leaf in parameter.leaves]
    for leaf in taken:
        if taken.count(leaf) > 1:
            raise InputError(f"{leaf} is varied twice; give each field one range.")
    count = prod(one.count for one in wanted)
    if count > MOST_POINTS:
        raise InputError(f"the grid has {count:,} points; at most {MOST_POINTS:,} are allowed: lower the counts.")
    pairs = list(zip(wanted, chosen, strict=True))
    grid = Grid([Axis(parameter.leaves, one.values(parameter.quantity)) for one, parameter in pairs])
    names = resolve_quantities(quantities, machine.family.component_names)
    found = evaluate(machine, grid, names, progress)
    dims = [parameter.path for parameter in chosen]
    content: dict[str, Any] = {name: (dims, found.values[name].reshape(grid.shape), _about(name)) for name in names}
    content["status"] = (dims, found.status.reshape(grid.shape), _ABOUT_STATUS)
    coordinates = {}
    for axis, (one, parameter) in zip(grid.axes, pairs, strict=True):
        kind = KINDS[parameter.quantity.kind]
        about = {"units": kind.unit, "long_name": parameter.quantity.meaning, "kind": kind.name}
        coordinates[parameter.path] = (parameter.path, axis.values, {**about, "log": int(one.logarithmic)})
    origin = {"machine": machine.name, "machine_file": as_toml(machine), "kinetostat": version("kinetostat")}
    return xr.Dataset(content, coordinates, {**origin, "frame": "base axes at the platform point P"})


def resolve_quantities(names: Sequence[str], components: Sequence[str] = COMPONENTS) -> list[str]:
    """Names of quantities, with groups replaced by their members and repetitions dropped.

    Args:
        names: of quantities or groups.
        components: that the machine has: rx ry rz x y z, or rz x y of a planar one.

    Raises:
        InputError: an unknown name, or one of a component that the machine does not have.
    """
    groups = {group: [name for name in members if _exists(name, components)] for group, members in GROUPS.items()}
    found: list[str] = []
    for name in names:
        if name not in GROUPS and not (name in QUANTITIES and _exists(name, components)):
            known = ", ".join([*GROUPS, *(n for group in groups.values() for n in group), "regularity"])
            example = f"compliance_{components[0]}_{components[-1]}"
            raise InputError(f'"{name}" is not a quantity; choose from {known}, or an entry such as {example}.')
        found += groups.get(name, [name])
    return list(dict.fromkeys(found))


def _exists(name: str, components: Sequence[str]) -> bool:
    """Whether all components that a quantity is about exist."""
    return all(part in components for part in name.split("_")[1:])


def failures(dataset: xr.Dataset) -> dict[Status, int]:
    """How many points have each status other than OK."""
    codes, counts = np.unique(dataset["status"].values, return_counts=True)
    return {Status(int(code)): int(n) for code, n in zip(codes, counts, strict=True) if code != Status.OK}


def _about(name: str) -> dict[str, str]:
    quantity = QUANTITIES[name]
    return {"units": quantity.unit, "symbol": quantity.symbol}


_ABOUT_STATUS = {
    "flag_values": [int(status) for status in Status],
    "flag_meanings": " ".join(status.word for status in Status),
}


def as_plain_data(dataset: xr.Dataset) -> dict[str, Any]:
    """A dataset as plain data for `--json`: coordinates, nested lists; null where there is no finite value."""
    coordinates = {
        str(dim): {"units": dataset[dim].attrs["units"], "values": dataset[dim].values.tolist()}
        for dim in dataset["status"].dims
    }
    variables = {
        str(name): {"units": data.attrs["units"], "values": _finite_lists(data.values)}
        for name, data in dataset.data_vars.items()
        if name != "status"
    }
    words = np.array([status.word for status in Status])[dataset["status"].values]
    return {
        "name": dataset.attrs["machine"],
        "coordinates": coordinates,
        "variables": variables,
        "status": words.tolist(),
    }


def _finite_lists(values: npt.NDArray[np.float64]) -> Any:
    written: npt.NDArray[Any] = values.astype(object)
    written[~np.isfinite(values)] = None
    return written.tolist()
