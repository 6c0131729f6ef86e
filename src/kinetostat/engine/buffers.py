"""Memory for the inputs and results of a function at some points, prepared so that a call costs no more than the code.

A call on arrays takes ten times as long as one pose itself: shapes are compared, memory is found for the results. Here
all that is done once. Nothing is computed here that `Function` does not compute.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import Function
from kinetostat.engine.machine_code import Program
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.kinematics.status import Status


class Buffers:
    """Inputs of a function at a number of points, its results there, and the call that fills the one from the others.

    Each thread needs buffers of its own.

    Attributes:
        inputs: values of the inputs, SI [inputs x points]; write them in place.
        results: numbers of the function [rows x points], as of the last call.
        status: `Status` codes [points], as of the last call.
    """

    def __init__(self, function: Function, places: Sequence[int], start: Sequence[float], count: int) -> None:
        """Prepare memory.

        Args:
            function: the function.
            places: of each parameter of the function the row of `inputs` that has its values.
            start: values of the inputs to begin with.
            count: number of points.
        """
        direct, self._function, self._count = function.direct, function, count
        program = direct.program if direct and isinstance(direct.program, Program) else None
        room = max(count, program.lanes) if program else count
        whole, every = np.repeat(np.asarray(start, dtype=float)[:, None], room, axis=1), np.empty((function.rows, room))
        self._codes = bytearray(room)
        codes = np.frombuffer(self._codes, dtype=np.int8)
        self.inputs, self.results, self.status = whole[:, :count], every[:, :count], codes[:count]
        rows = dict(zip(function.paths, places, strict=True))
        self._columns = {path: self.inputs[row] for path, row in rows.items()}
        self._angles: list[Array] = []
        self._run = None
        if direct and program:
            turning = sorted({rows[path] for path in direct.form.turning})
            self._angles = [whole[first:end].reshape(-1) for first, end in _in_a_row(turning)]
            self._run = program.call_on(direct.fixed, [whole[rows[path]] for path in direct.form.varying], every, codes)

    def __call__(self) -> Array:
        """Evaluate the function at `inputs`; gives `results`, the same array at every call."""
        if self._run is None:
            self._evaluate()
            return self.results
        for row in self._angles:
            if not row.dot(row) <= LARGEST_ANGLE**2:  # some may be beyond what traced cosines take
                self._evaluate()
                return self.results
        self._run()
        if self._codes.find(NOT_CONVERGED, 0, self._count) >= 0:
            self._evaluate()
        return self.results

    def _evaluate(self) -> None:
        """Evaluate by the function's own fill, which knows other ways where the program ends without joints."""
        self._function.fill(self._columns, self.results, self.status)


def _in_a_row(numbers: Sequence[int]) -> list[tuple[int, int]]:
    """Begin and end of each run of consecutive numbers."""
    first = [k for k in numbers if k - 1 not in numbers]
    return list(zip(first, [k + 1 for k in numbers if k + 1 not in numbers], strict=True))


NOT_CONVERGED = int(Status.NOT_CONVERGED)
