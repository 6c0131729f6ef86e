"""Masses that a body of the machine carries: at points, as straight bars, with inertia. Nothing is solved here.

Units, axes and origin are those of `mechanism`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass


@dataclass(frozen=True)
class Weight:
    """A mass at a point.

    Attributes:
        name: name of the part to which it belongs.
        carried: number of the leg's screw motions that carry it; not used of the platform.
        point: its place in the free state, m.
        mass: its mass, kg.
        inertia: inertia about the point, base axes: xx, yy, zz, xy, xz, yz, kg·m²; zero if empty.
        bar: whether it is half of a uniform straight bar, whose other half is its neighbour in a list.
    """

    name: str
    carried: int
    point: Vector
    mass: Scalar
    inertia: Sequence[Scalar] = ()
    bar: bool = False


@dataclass(frozen=True)
class Masses:
    """Point masses that move with a body, and bars as two of them.

    A uniform bar is two halves at its ends, which have its weight and its momentum. Its kinetic energy is that of a
    third of the bar at each end, and of a sixth that couples both ends.

    Attributes:
        names: names of the parts to which they belong [m].
        carried: number of the leg's screw motions that carry each [m]; not used of the platform.
        pairs: numbers of the two halves of each bar.
        point: their places in the free state [n x m x 3].
        mass: the mass in units of force per m/s² [n x m].
        uncoupled: the part of each mass whose kinetic energy is its own [n x m].
        inertia: about each point in the free state, in the same unit times the square of the machine's length
            [n x m x 6]: xx, yy, zz, xy, xz, yz.
    """

    names: tuple[str, ...]
    carried: tuple[int, ...]
    pairs: tuple[tuple[int, int], ...]
    point: Array
    mass: Array
    uncoupled: Array
    inertia: Array

    def at(self, rows: Integers) -> "Masses":
        """The masses at some of n poses [rows]."""
        return replace(self, **{name: getattr(self, name)[rows] for name in ("point", "mass", "uncoupled", "inertia")})

    def of(self, numbers: Sequence[int]) -> "Masses":
        """Some of the masses, of bars whose other halves are at rest."""
        parts = {name: getattr(self, name)[:, numbers] for name in ("point", "mass", "uncoupled", "inertia")}
        names, carried = (tuple(self.names[n] for n in numbers), tuple(self.carried[n] for n in numbers))
        return Masses(names, carried, (), **parts)


def masses_of_one_body(masses: Sequence[Masses]) -> Masses:
    """Return several masses as those of a single body; none if there are none, of a single pose."""
    if not masses:
        return Masses((), (), (), np.zeros((1, 0, 3)), *(np.zeros((1, 0)),) * 2, np.zeros((1, 0, 6)))
    names = tuple(name for part in masses for name in part.names)
    parts = [np.concatenate([getattr(p, a) for p in masses], axis=1) for a in ("point", "mass", "uncoupled", "inertia")]
    return Masses(names, (0,) * len(names), (), *parts)
