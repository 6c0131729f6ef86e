"""The line with which each table of measurements begins: when and on what it was made."""

import os
import platform
from datetime import date
from importlib.util import cache_from_source
from pathlib import Path

import numpy as np

import kinetostat
from kinetostat.engine.batch import available_cores
from kinetostat.studies.diagnosis import processor


def conditions() -> str:
    """Date, processor, cores, versions, and whether Python's bytecode was there."""
    source = Path(kinetostat.__file__)
    bytecode = "present" if Path(cache_from_source(str(source))).exists() else "absent"
    return (
        f"Measured on {date.today()}: {processor()}, {available_cores()} of {os.cpu_count()} cores; "
        f"Python {platform.python_version()}, NumPy {np.__version__}; bytecode {bytecode}."
    )
