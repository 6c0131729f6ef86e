"""A leg as a row of screw motions from base to platform, and the gap by which it misses the platform.

A motion belongs to a coordinate of the leg, as joints and springs have them, or to an amount that is given, as that of
an actuator. Errors are motions of size zero in the drawn leg: small displacements that stand between the others. Loads,
masses and names belong to those who read a chain (`equilibrium`, `accuracy`). Nothing is solved here.

Source: theory (35), (38) and (45). Screws are at one origin, in axes of the base.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from kinetostat.algebra.scalar import Scalar
from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint
from kinetostat.machine.link import Parallelogram
from kinetostat.numerics.motions import Motions, each_about, each_along, each_twist, exponential, logarithm, still


@dataclass(frozen=True)
class PlacedChain:
    """A chain somewhere, at n poses.

    Attributes:
        before: before[k] is the displacement of what the first k motions carry, without the errors that stand behind
            these [motions + 1].
        end: displacement of the platform's end.
        screws: the screws of each motion in its place [n x motions x 6].
    """

    before: tuple[Motions, ...]
    end: Motions
    screws: Array


@dataclass(frozen=True)
class Chain:
    """A leg as a row of screw motions.

    Attributes:
        twists: unit twist of each motion where the leg is drawn [n x motions x 6]; n is 1 where it is the same at all
            poses, and the number of legs where the poses of several legs that are alike stand one after another.
        coordinate: number of the coordinate that each motion follows [motions]; -1 where its amount is given.
        given: number of the given amount that each motion follows [motions]; -1 where a coordinate moves it.
        size: number of coordinates.
    """

    twists: Array
    coordinate: tuple[int, ...]
    given: tuple[int, ...]
    size: int

    @cached_property
    def follows(self) -> Array:
        """1 where a motion follows a coordinate, else 0 [motions x coordinates]."""
        return _matches(self.coordinate, self.size)

    def follows_given(self, count: int) -> Array:
        """Return 1 where a motion follows one of so many given amounts, else 0 [motions x count]."""
        return _matches(self.given, count)

    def at(self, rows: Integers) -> "Chain":
        """Return the chain at some of its poses."""
        return replace(self, twists=self.twists[rows])

    def place(
        self, coordinates: Array, amounts: Array | None = None, errors: Mapping[int, Array] | None = None
    ) -> PlacedChain:
        """Move the chain, theory (35) and (45).

        Args:
            coordinates: the coordinates of its joints and springs [n x coordinates].
            amounts: all given amounts of the machine [n x amounts].
            errors: small screw motions [n x 6], [1 x 6] or [legs x 6], by the number of motions behind which they
                stand.
        """
        count = len(coordinates)
        error_motions = _motions_of(errors or {}, count)
        motion, before, with_error = still(count), [], []
        for number, step in enumerate(self._steps(coordinates, amounts)):
            before.append(motion)
            motion = motion @ error_motions[number] if number in error_motions else motion
            with_error.append(motion)
            motion = motion @ step if number or 0 in error_motions else step  # nothing stands before the first
        before.append(motion)
        screws = each_twist(with_error, _repeat(self.twists, count)) if with_error else np.zeros((count, 0, 6))
        end = motion @ error_motions[len(with_error)] if len(with_error) in error_motions else motion
        return PlacedChain(tuple(before), end, screws)

    def _steps(self, coordinates: Array, amounts: Array | None) -> list[Motions]:
        """The displacement by each motion alone."""
        if not self.coordinate:
            return []
        if amounts is None:
            return each_about(self.twists, coordinates[:, self.coordinate])
        sources = zip(self.coordinate, self.given, strict=True)
        columns = [amounts[:, given] if coordinate < 0 else coordinates[:, coordinate] for coordinate, given in sources]
        return each_along(self.twists, np.stack(columns, axis=1))

    def rates(self, placed: PlacedChain) -> Array:
        """Return the twist of the end per unit of each coordinate [n x 6 x coordinates]."""
        return np.asarray(np.swapaxes(placed.screws, 1, 2) @ self.follows)


def bar_turns(bars: Parallelogram) -> tuple[Joint, Joint, Scalar]:
    """Return the turns that are the motion of a parallelogram, and how far they turn per metre of it, rad/m.

    What it carries turns about the near side, and back by as much about the far one.
    """
    near, far = (Joint(bars.normal, point) for point in (bars.near, bars.far))
    return near, far, 1.0 / (bars.far - bars.near).norm()


def _matches(numbers: tuple[int, ...], count: int) -> Array:
    """Return 1 where a number is that of the column, else 0 [numbers x count]; -1 matches none."""
    return (np.array(numbers, dtype=int)[:, None] == np.arange(count)).astype(float)


def _repeat(values: Array, count: int) -> Array:
    """Values of several legs for all poses of each [count x ...]; one that serves all poses is left alone."""
    return values if len(values) in (1, count) else np.repeat(values, count // len(values), axis=0)


def _motions_of(errors: Mapping[int, Array], count: int) -> dict[int, Motions]:
    """The displacements by small screw motions, all of them in one step."""
    if not errors:
        return {}
    all_motions = exponential(np.concatenate(list(errors.values())))
    ends = np.cumsum([len(error) for error in errors.values()]).tolist()
    places = zip(errors, [0, *ends], ends, strict=False)
    return {
        number: Motions(_repeat(all_motions.rotation[a:b], count), _repeat(all_motions.translation[a:b], count))
        for number, a, b in places
    }


def closing_gap(platform: Motions, end: Motions) -> Array:
    """Return the screw motion from the end of a leg to the platform [n x 6]: 0 where the leg closes.

    A twist of the platform adds to it, and the rates of the end (`Chain.rates`) reduce it, both exactly where it is 0.

    Source: theory (38) and (48).
    """
    return logarithm(platform @ end.inverse())
