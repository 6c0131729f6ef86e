"""Error of the tool by independent errors: to first order, worst case, and percentiles of drawn machines.

Everything here is about measures: rows of numbers that are linear in the twist of the tool, and lengths of some rows.

Source: theory (50) and (52).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from kinetostat.arrays import Array
from kinetostat.studies.budget.inputs import Inputs

SHARE = 95.0
"""Percent of all machines that the usual error covers."""
STARTS, FEW_STARTS = 200, 24
"""Directions from which the worst case of a length is searched: at a single pose, and at each of many."""
ROUNDS = 100
"""Steps of that search, which nearly always ends after ten."""


@dataclass(frozen=True)
class Measures:
    """Numbers of a twist that people ask for.

    Attributes:
        rows: of the linear ones by name, applied to a twist (rad, m) [6] or other ones at each pose [n x 6].
        lengths: of some of these rows together, by name.
        units: "rad" or "m" by name.
    """

    rows: Mapping[str, Array]
    lengths: Mapping[str, tuple[str, ...]]
    units: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Of all, rows first."""
        return (*self.rows, *self.lengths)

    def applied(self, twists: Array) -> Array:
        """The linear measures of twists at n poses [n x 6 x q] -> [n x rows x q]."""
        count = len(twists)
        matrix = np.stack([np.broadcast_to(row, (count, 6)) for row in self.rows.values()], axis=1)
        return np.asarray(matrix @ twists)

    def places(self, name: str) -> list[int]:
        """The numbers of the rows that a measure is made of."""
        known = list(self.rows)
        return [known.index(row) for row in self.lengths.get(name, (name,))]

    def sizes(self, rows: Array) -> Array:
        """All measures as sizes from values of the linear ones [... x rows] -> [... x measures]."""
        lengths = [np.linalg.norm(rows[..., self.places(name)], axis=-1) for name in self.lengths]
        return np.concatenate([np.abs(rows), *(length[..., None] for length in lengths)], axis=-1)


@dataclass(frozen=True)
class Spread:
    """The error of the tool at n poses: a column for each measure.

    Attributes:
        mean: the error of the average machine, as a size [n x measures].
        rms: root of the mean square over all machines [n x measures].
        rss: the root of the sum of squares of what each limit does by itself [n x measures].
        worst: the largest error that the limits allow [n x measures].
        usual: what 95 % of all machines keep within [n x measures].
        everywhere: what 95 % of all machines keep within at all these poses [measures].
    """

    mean: Array
    rms: Array
    rss: Array
    worst: Array
    usual: Array
    everywhere: Array


def first_order(inputs: Inputs, measures: Measures) -> tuple[Array, Array, Array, Array]:
    """Mean, root of the mean square, root sum of squares and worst case of each measure [n x measures], theory (50).

    Args:
        inputs: variables and what they do.
        measures: that are asked for.
    """
    rows = measures.applied(inputs.columns)
    shift = measures.applied(inputs.shift[:, :, None])[:, :, 0]
    squares, limits, mean = [], [], measures.sizes(shift)
    for name in measures.names:
        places = measures.places(name)
        squares.append((rows[:, places] ** 2 @ inputs.variance).sum(axis=1))
        limits.append((rows[:, places] ** 2).sum(axis=(1, 2)))
    worst = [_worst(rows[:, measures.places(name)], shift[:, measures.places(name)], inputs) for name in measures.names]
    rms = np.sqrt(mean**2 + np.stack(squares, axis=1))
    return mean, rms, mean + np.sqrt(np.stack(limits, axis=1)), np.stack(worst, axis=1)


def _worst(rows: Array, shift: Array, inputs: Inputs) -> Array:
    """The largest length that limits allow [n], theory (52): over all directions, the sum of all that reaches there.

    Args:
        rows: what each variable does [n x k x q].
        shift: what is there without them [n x k].
        inputs: says which variables belong together.
    """
    alone = np.array([block[0] for block in inputs.together if len(block) == 1], dtype=int)
    joined = [block for block in inputs.together if len(block) > 1]
    count, size, _ = rows.shape
    if size == 1:
        reach = np.abs(rows[:, 0, alone]).sum(axis=1) + np.abs(shift[:, 0])
        return np.asarray(reach + sum(np.linalg.norm(rows[:, 0, block], axis=1) for block in joined))
    ways = np.random.default_rng(0).standard_normal((STARTS if count == 1 else FEW_STARTS, size))
    ways = np.broadcast_to(ways / np.linalg.norm(ways, axis=1)[:, None], (count, *ways.shape))
    most = np.zeros(count)
    for _ in range(ROUNDS):
        # The machine that reaches farthest along a direction lies in a direction of its own, which is tried next:
        # its length never falls.
        far = np.sign(ways @ rows[:, :, alone]) @ np.swapaxes(rows[:, :, alone], 1, 2)
        for block in joined:
            reach = ways @ rows[:, :, block]
            reach = reach / np.maximum(np.linalg.norm(reach, axis=2, keepdims=True), 1e-300)
            far = far + reach @ np.swapaxes(rows[:, :, block], 1, 2)
        far = far + np.sign(np.einsum("nsk,nk->ns", ways, shift))[:, :, None] * shift[:, None]
        lengths = np.linalg.norm(far, axis=2)
        ways = far / np.maximum(lengths, 1e-300)[:, :, None]
        longest = lengths.max(axis=1)
        if (longest <= most * (1.0 + 1e-12)).all():
            break
        most = np.maximum(most, longest)
    return most


def spread_of(inputs: Inputs, measures: Measures, machines: Iterable[Array]) -> tuple[Spread, Array]:
    """The error of the tool to first order, with percentiles of drawn machines.

    Args:
        inputs: variables and what they do at n poses.
        measures: that are asked for.
        machines: values of the variables, slab by slab [slab x q].

    Returns:
        The errors, and of each machine its largest one over all poses [machines x measures].
    """
    rows, shift = measures.applied(inputs.columns), measures.applied(inputs.shift[:, :, None])[:, :, 0]
    count, size, _ = rows.shape
    flat = rows.reshape(count * size, -1).T
    drawn = np.concatenate([measures.sizes((slab @ flat).reshape(len(slab), count, size) + shift) for slab in machines])
    mean, rms, rss, worst = first_order(inputs, measures)
    usual, largest = np.percentile(drawn, SHARE, axis=0), drawn.max(axis=1)
    return Spread(mean, rms, rss, worst, usual, np.percentile(largest, SHARE, axis=0)), largest


def squares_of(inputs: Inputs, measures: Measures) -> Array:
    """The variance that each part brings to each measure, summed over the poses [measures x parts], theory (50)."""
    rows = measures.applied(inputs.columns)
    each = np.einsum("nkq,q->kq", rows**2, inputs.variance)
    parts = np.zeros((len(each), len(inputs.parts)))
    np.add.at(parts.T, inputs.owner, each.T)
    return np.stack([parts[measures.places(name)].sum(axis=0) for name in measures.names])


def shares(squares: Array) -> Array:
    """Squares as shares that add up to 1 in each row; 0 where there is nothing to share."""
    whole = squares.sum(axis=1, keepdims=True)
    return np.divide(squares, whole, out=np.zeros_like(squares), where=whole > 0.0)
