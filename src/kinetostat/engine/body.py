"""What a program computes at each point: inputs and results in a traced graph. Neither compiled nor run here."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from kinetostat.engine.trace import Operand, Traced

Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.int8]


@dataclass(frozen=True)
class Body:
    """What is computed at each point.

    Attributes:
        fixed: inputs that are the same at all points.
        columns: inputs that vary.
        results: nodes, or numbers where a result depends on nothing.
        code: a small integer beside the results: a node or a number.
    """

    fixed: Sequence[Traced]
    columns: Sequence[Traced]
    results: Sequence[Operand]
    code: Operand


class Runnable(Protocol):
    """A body that can be evaluated."""

    def run(self, fixed: Array, columns: Sequence[Array], results: Array, codes: Codes) -> None:
        """Evaluate points.

        Args:
            fixed: values of the fixed inputs.
            columns: values of the others [points], each contiguous.
            results: where results go [results x points]; rows may lie apart, the points of a row may not.
            codes: where the codes go [points].
        """
