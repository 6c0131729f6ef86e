"""Legs with small errors closed on the platform, at many poses, by Newton's method.

An error displaces what follows it in its leg by a small screw motion. Actuators are held; passive joints take up what
they can, and the wrenches that each leg can carry decide what the platform makes of the rest. Arrays have the poses
first [n]; screws are at the base origin in base axes, SI, unless said otherwise.

Source: theory (45) to (48).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from kinetostat.accuracy.rows import HomeRows, LegRow, random_coordinates
from kinetostat.accuracy.wrenches import (
    Errors,
    Screws,
    at_points,
    by_leg,
    in_lengths,
    independent_columns,
    legs_in_place,
    like_rows,
)
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import closing_gap
from kinetostat.numerics.iteration import Steps, largest, newton, with_rows
from kinetostat.numerics.motions import Motions, exponential, logarithm

CLOSED_STEP = 1e-8
"""Motion of the last step of Newton's method, rad or in units of the machine's length: the next one would be about its
square, or a thousandth of it where legs share a misfit."""
LONGEST_STAGE = 0.2
"""Farthest way of a stage, rad or in units of the machine's length, where fewer than all stages do."""
NEARLY_CLOSED_STEP = 1e-2
"""The same on the way there, where the next stage starts from."""
MOST_CLOSING_STEPS = 40
"""Most steps of Newton's method: errors are small, so that a few suffice where there is a solution."""
MOST_STAGES = 8
"""Steps on the way from the home place to a pose."""


def coordinates_toward(row: LegRow, target: Motions, length: float, errors: Mapping[int, Array] | None = None) -> Array:
    """Coordinates with which a leg takes the platform to a displacement, or near it [n x coordinates], rad or m.

    All of its coordinates move, actuators too, by least-norm steps along a screw motion from the home place.
    """
    whole, chain, given = logarithm(target), row.chain, errors or {}
    units = np.where(row.slides, length, 1.0)
    chosen = independent_columns(in_lengths(chain.rates(chain.place(random_coordinates(row, length))), length, axis=1))
    far = float(np.abs(in_lengths(whole, length)).max(initial=0.0, where=np.isfinite(whole)))
    stages = min(max(int(np.ceil(far / LONGEST_STAGE)), 1), MOST_STAGES)
    coordinates = np.zeros((len(whole), row.size))
    for stage in range(1, stages + 1):
        goal, last = exponential(whole * (stage / stages)), stage == stages

        def equations(joints: Array, poses: Integers, goal: Motions = goal) -> tuple[Array, Steps]:
            at = chain.place(joints, errors=errors_at(given, poses))
            gap = in_lengths(closing_gap(goal.at(poses), at.end), length)
            rates = in_lengths(chain.rates(at), length, axis=1) * units
            return largest(gap), lambda going: Screws(rates, chosen).steps(gap)[going]

        coordinates = newton(
            equations,
            coordinates,
            len(whole),
            move=lambda joints, step: joints + step * units,
            most_steps=MOST_CLOSING_STEPS if last else 3,
            step_goal=CLOSED_STEP if last else NEARLY_CLOSED_STEP,
        ).value
    return coordinates


def errors_at(errors: Mapping[int, Array], poses: Integers) -> dict[int, Array]:
    """The errors of a leg at some poses; those that are the same everywhere stay as they are."""
    return {behind: error if len(error) == 1 else error[poses] for behind, error in errors.items()}


@dataclass(frozen=True)
class ClosedLegs:
    """Places of the legs of a machine with errors that close on its platform, at n poses.

    Attributes:
        platform: displacement of the platform from its home place.
        coordinates: of the joints of each leg [n x coordinates].
        settled: where Newton's method has arrived [n].
    """

    platform: Motions
    coordinates: tuple[Array, ...]
    settled: Mask

    def at(self, poses: Integers) -> "ClosedLegs":
        """The legs at some of the poses."""
        return ClosedLegs(self.platform.at(poses), tuple(q[poses] for q in self.coordinates), self.settled[poses])

    def with_part(self, poses: Integers, part: "ClosedLegs") -> "ClosedLegs":
        """The legs with those at some of the poses in their places."""
        pairs = zip(self.coordinates, part.coordinates, strict=True)
        coordinates = tuple(with_rows(q, poses, values) for q, values in pairs)
        return ClosedLegs(self.platform.with_part(poses, part.platform), coordinates, self.settled)


def closed_legs(
    rows: HomeRows,
    start: ClosedLegs,
    errors: Errors,
    tool_home: Array,
    chosen: Sequence[tuple[int, ...]],
    soft: Sequence[Array],
) -> ClosedLegs:
    """Close the legs with their errors while their actuators stand still: Newton's method, theory (48).

    Args:
        rows: the machine at its home place.
        start: joint coordinates, with the actuators where they stand, and the platform nearby.
        errors: the errors of each leg.
        tool_home: the tool point at the home place, m [3].
        chosen: see `like_rows`.
        soft: see `holding`.
    """
    length, legs, count = rows.length, rows.legs, len(start.settled)
    groups = like_rows(rows, chosen, count)

    def equations(there: ClosedLegs, poses: Integers) -> tuple[Array, Steps]:
        given = [errors_at(error, poses) for error in errors]
        tool = _tool_at(there.platform, tool_home)
        at = legs_in_place(rows, groups, there.coordinates, given, tool, [compliance[poses] for compliance in soft])
        again = [np.tile(np.arange(len(poses)), len(group.numbers)) for group in groups]
        gaps = [
            -in_lengths(at_points(closing_gap(there.platform.at(pose), place.end), tool[pose]), length)
            for pose, place in zip(again, at.places, strict=True)
        ]
        misfits = by_leg(groups, gaps)
        parts = (at.holding.twist(i, misfit[:, None])[:, 0] for i, misfit in enumerate(misfits))
        twist = sum(parts, np.zeros((len(poses), 6)))
        joints = [
            screws.steps(twist[pose] - gap)[:, : len(group.row.free_coordinates)]
            for group, pose, screws, gap in zip(groups, again, at.free, gaps, strict=True)
        ]
        step = np.concatenate([twist, *by_leg(groups, joints)], axis=1)
        return largest(np.concatenate(misfits, axis=1)), lambda going: step[going]

    def move(there: ClosedLegs, step: Array) -> ClosedLegs:
        twist, *joints = np.split(step, np.cumsum([6, *(len(row.free_coordinates) for row in legs[:-1])]), axis=1)
        back = np.concatenate([twist[:, :3], twist[:, 3:] * length], axis=1)
        platform = exponential(at_points(back, -_tool_at(there.platform, tool_home))) @ there.platform
        coordinates = [q.copy() for q in there.coordinates]
        for row, values, change in zip(legs, coordinates, joints, strict=True):
            values[:, list(row.free_coordinates)] += change * _units(row, length)
        return ClosedLegs(platform, tuple(coordinates), there.settled)

    end = newton(equations, start, count, move=move, most_steps=MOST_CLOSING_STEPS, step_goal=CLOSED_STEP)
    return replace(end.value, settled=end.converged)


def _units(row: LegRow, length: float) -> Array:
    """The units of its free coordinates, 1 rad or the machine's length, m."""
    return np.array([length if row.slides[place] else 1.0 for place in row.free_coordinates])


def _tool_at(platform: Motions, tool_home: Array) -> Array:
    return platform.point(np.broadcast_to(tool_home, (len(platform.translation), 3)))
