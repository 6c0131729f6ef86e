"""A workspace as plain data, for `--json`. Nothing is computed here."""

from dataclasses import asdict
from typing import Any

from kinetostat.studies.workspace.volume import METHOD
from kinetostat.studies.workspace.workspace import Workspace


def as_plain_data(found: Workspace) -> dict[str, Any]:
    """Volume, counts and ranges; the nodes themselves are in the NetCDF file."""
    dataset, volume = found.dataset, found.volume
    coordinates = {
        str(dim): {
            "units": dataset[dim].attrs["units"],
            "from": float(dataset[dim].values[0]),
            "to": float(dataset[dim].values[-1]),
            "count": int(dataset.sizes[dim]),
            "inside": list(found.extents[str(dim)]) if str(dim) in found.extents else None,
        }
        for dim in dataset["verdict"].dims
    }
    return {
        "name": dataset.attrs["machine"],
        "coordinates": coordinates,
        "volume": {
            "value": volume.value,
            "standard_error": volume.standard_error,
            "units": volume.unit,
            "share_of_box": volume.share,
            "cells": volume.cells,
            "method": METHOD,
        },
        "nodes": found.counts,
        "connected": found.joined,
        "singularities_divide": found.divided,
        "demands": [asdict(demand) for demand in found.demands],
    }
