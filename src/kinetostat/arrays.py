"""Types of NumPy arrays by their entries; shapes stand in docstrings. Names are short, because signatures repeat them.

No function lives here.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Codes = npt.NDArray[np.integer[Any]]
"""Codes of `Status`. Their width is open: compiled programs write int8, the analysis of a pose what NumPy chooses."""
Complex = npt.NDArray[np.complex128]
Float32s = npt.NDArray[np.float32]
"""Single precision, which is enough for pictures."""
AnyArray = npt.NDArray[Any]
"""An array of any entries: data that are only stored, copied or written."""
