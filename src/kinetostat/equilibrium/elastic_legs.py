"""Legs as rows of screw motions with springs and masses. How they are read off a machine is in `leg_reader`.

Nothing is solved here. Units, axes and origin are those of `mechanism`.

Source: theory (35).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from kinetostat.algebra.scalar import is_zero
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import Chain
from kinetostat.machine.leg import Spring
from kinetostat.tolerances import DEPENDENT

FEW_POSES = 64
"""Number of poses up to which legs of one form are evaluated together; more fill the processor's cache alone."""


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
        return replace(self, **{name: getattr(self, name)[rows] for name in _ARRAYS_OF_MASSES})

    def of(self, numbers: Sequence[int]) -> "Masses":
        """Some of the masses, by their numbers; halves of bars become masses by themselves."""
        return Masses(
            names=tuple(self.names[n] for n in numbers),
            carried=tuple(self.carried[n] for n in numbers),
            pairs=(),
            **{name: getattr(self, name)[:, numbers] for name in _ARRAYS_OF_MASSES},
        )


_ARRAYS_OF_MASSES = ("point", "mass", "uncoupled", "inertia")
"""All fields of `Masses` that have the poses first, and the masses next: they are cut and joined together."""
NO_MASSES = Masses(
    names=(),
    carried=(),
    pairs=(),
    point=np.zeros((1, 0, 3)),
    mass=np.zeros((1, 0)),
    uncoupled=np.zeros((1, 0)),
    inertia=np.zeros((1, 0, 6)),
)
"""The masses of a body without any, at a single pose."""


def masses_of_one_body(masses: Sequence[Masses]) -> Masses:
    """Return several masses as those of a single body."""
    names = tuple(name for part in masses for name in part.names)
    arrays = {name: np.concatenate([getattr(p, name) for p in masses], axis=1) for name in _ARRAYS_OF_MASSES}
    return Masses(names=names, carried=(0,) * len(names), pairs=(), **arrays)


@dataclass(frozen=True)
class RodEnds:
    """Ends of a leg that only carries a force between two joint centres and has its masses there.

    Attributes:
        near, far: the centre nearer to the base and the one nearer to the platform, in the free state [n x 3].
    """

    near: Array
    far: Array

    def at(self, rows: Integers) -> "RodEnds":
        """The ends at some of n poses [rows]."""
        return RodEnds(self.near[rows], self.far[rows])


@dataclass(frozen=True)
class FreeSpin:
    """A link that is free to spin about the line between the centres of two ball joints.

    Attributes:
        first: number of the first of the three coordinates that turn about the first centre.
        span: the way from this centre to the other one in the free state [n x 3].
    """

    first: int
    span: Array

    def at(self, rows: Integers) -> "FreeSpin":
        """The link at some of n poses [rows]."""
        return FreeSpin(self.first, self.span[rows])


@dataclass(frozen=True)
class ElasticLeg:
    """A leg as a row of screw motions with its springs, masses and friction.

    Attributes:
        name: name of the leg.
        chain: its motions in the free state; given amounts are those of the machine's actuators, then the growths of
            its links.
        springs: the spring of each coordinate [coordinates]; None of a passive one.
        stiffness: the stiffness of each coordinate, 0 of a passive one [n x coordinates].
        preload: load of each where it is zero [n x coordinates].
        sign: sign of the loads that each can carry, 0 for both [coordinates].
        idle: a basis of motions of the passive coordinates that move nothing [n x coordinates x coordinates], with
            columns of zeros.
        masses: masses that it carries.
        rotors: inertia that the drives add to each coordinate, in the unit of masses times length, squared for a turn
            [n x coordinates].
        dampers: viscous friction of each coordinate, in units of force per velocity [n x coordinates].
        motion_counts: entry k is the number of its motions before the end of element k, counted from 1; before the
            first element for k = 0.
        rod: its ends, if it is a rod.
        spin: its link that spins, if it has one.
    """

    name: str
    chain: Chain
    springs: tuple[Spring | None, ...]
    stiffness: Array
    preload: Array
    sign: Array
    idle: Array
    masses: Masses
    rotors: Array
    dampers: Array
    motion_counts: tuple[int, ...] = ()
    rod: RodEnds | None = None
    spin: FreeSpin | None = None

    @property
    def size(self) -> int:
        """Number of its coordinates."""
        return len(self.springs)

    @property
    def hinged(self) -> Mask:
        """Whether each coordinate is a flexure hinge, which pulls back to the home pose [coordinates]."""
        are_hinges = [spring is not None and not is_zero(spring.return_stiffness) for spring in self.springs]
        return np.array(are_hinges, dtype=bool)

    def at(self, rows: Integers) -> "ElasticLeg":
        """The leg at some of n poses [rows]."""
        return replace(
            self,
            chain=self.chain.at(rows),
            masses=self.masses.at(rows),
            rod=self.rod and self.rod.at(rows),
            spin=self.spin and self.spin.at(rows),
            **{name: getattr(self, name)[rows] for name in _ARRAYS_OF_LEG},
        )


_ARRAYS_OF_LEG = ("stiffness", "preload", "idle", "rotors", "dampers")
"""All fields of `ElasticLeg` that are arrays with the poses first: they are cut and joined together."""


@dataclass(frozen=True)
class LikeLegs:
    """Legs of one form as a single leg: all poses of the first of them, then all of the second, and so on.

    At a few poses, time goes into calls of NumPy more than into numbers: six legs take little longer than one.

    Attributes:
        numbers: numbers of the legs.
        leg: the leg at all these poses; its given amounts are numbered by themselves.
        given: number among the machine's given amounts of each of its own [legs x amounts].
    """

    numbers: tuple[int, ...]
    leg: ElasticLeg
    given: Integers


def like_legs(legs: Sequence[ElasticLeg]) -> list[LikeLegs]:
    """Put the legs of one form together: those whose motions, coordinates, signs and places of masses are the same.

    At many poses each leg is left by itself.
    """
    groups: dict[_LegForm, list[int]] = {}
    amounts = [tuple(dict.fromkeys(number for number in leg.chain.given if number >= 0)) for leg in legs]
    for number, (leg, own_amounts) in enumerate(zip(legs, amounts, strict=True)):
        form = _LegForm(
            given=tuple(own_amounts.index(amount) if amount >= 0 else amount for amount in leg.chain.given),
            alone=number if len(leg.stiffness) > FEW_POSES else None,
            coordinate=leg.chain.coordinate,
            shape=leg.chain.twists.shape,
            signs=leg.sign.tobytes(),
            carried=leg.masses.carried,
        )
        groups.setdefault(form, []).append(number)
    return [
        LikeLegs(
            numbers=tuple(numbers),
            leg=_side_by_side([legs[number] for number in numbers], form.given),
            given=np.array([amounts[number] for number in numbers], dtype=np.int64),
        )
        for form, numbers in groups.items()
    ]


class _LegForm(NamedTuple):
    """All that legs which are evaluated together have in common; the leg's own amounts are numbered from 0 in `given`.

    `alone` is the number of a leg that is left by itself, else None; `shape` is that of the twists of its chain.
    """

    given: tuple[int, ...]
    alone: int | None
    coordinate: tuple[int, ...]
    shape: tuple[int, ...]
    signs: bytes
    carried: tuple[int, ...]


def _side_by_side(legs: Sequence[ElasticLeg], given: tuple[int, ...]) -> ElasticLeg:
    """The springs and masses of legs of one form with the poses of one leg after those of the other."""

    def join(parts: Sequence[Any], *names: str) -> dict[str, Any]:
        return {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}

    first, masses = legs[0], [leg.masses for leg in legs]
    return replace(
        first,
        chain=replace(first.chain, given=given, **join([leg.chain for leg in legs], "twists")),
        masses=replace(masses[0], **join(masses, *_ARRAYS_OF_MASSES)),
        rod=None,
        spin=None,
        **join(legs, *_ARRAYS_OF_LEG),
    )


def idle_motions(rates: Array, springs: Sequence[Spring | None]) -> Array:
    """Motions of the passive coordinates that leave the leg's end where it is, to first order [n x c x c].

    They are those of a state: where loads have moved a leg, a strut spins about another line than in the free state.

    Args:
        rates: twist of the leg's end per unit of each coordinate [n x 6 x c].
        springs: the spring of each coordinate; None of a passive one.
    """
    passive = [number for number, spring in enumerate(springs) if spring is None]
    result = np.zeros((len(rates), len(springs), len(springs)))
    if not passive:
        return result
    # Where a pose has no place, nothing is idle.
    moving = np.where(np.isfinite(rates), rates, 0.0)[:, :, passive]
    _, sizes, motions = np.linalg.svd(moving, full_matrices=True)
    all_sizes = np.zeros((len(rates), len(passive)))
    all_sizes[:, : sizes.shape[1]] = sizes
    idle = motions * (all_sizes < DEPENDENT)[:, :, None]
    result[:, passive, : len(passive)] = idle.mT
    return result
