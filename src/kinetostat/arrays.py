"""Types of NumPy arrays, by what their entries are; shapes stand in docstrings.

No function lives here.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Codes = npt.NDArray[np.integer[Any]]
"""Statuses, in as many bytes as the computation takes for them."""
Complex = npt.NDArray[np.complex128]
Float32s = npt.NDArray[np.float32]
"""Single precision, which is enough for pictures."""
AnyArray = npt.NDArray[Any]
