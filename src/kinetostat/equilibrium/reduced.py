"""Equilibrium of machines whose loops are cut, over scalars: what machine code does for many poses, and derivatives.

Where loops are cut at rods alone (`cut`), the coordinates of one chain are all the unknowns; the steps of other legs
are those of `legwise`. Machines that cannot be cut, and what is chosen by inequalities, are left to `solving`; so are
poses at which these steps do not end at rest.

Source: theory (44). Units, axes and origin are those of `mechanism`.
"""

import math
from collections.abc import Collection
from typing import Any

import numpy as np

from kinetostat.algebra.scalar import Scalar, inner_product, is_zero, reciprocal, sqrt, total, where
from kinetostat.algebra.solve import Eliminated, Row, definite, elimination
from kinetostat.algebra.symmetric import greatest_eigenvalue
from kinetostat.arrays import Array
from kinetostat.equilibrium.balance import LegTerms, leg_terms, platform_load
from kinetostat.equilibrium.cut import Cut, RodPull, cut, loads_of_rods, pull_of, sum_of_dyads, wrench_of_rods
from kinetostat.equilibrium.legwise import LegwiseTangent
from kinetostat.equilibrium.mechanism import mechanism_of
from kinetostat.equilibrium.numbers import greatest_loads, status_with_load_limits, status_with_rest
from kinetostat.equilibrium.solving import LONGEST_STEP
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Machine
from kinetostat.numerics.motions import Motions, cross, of_scalars, skew_of
from kinetostat.tolerances import AT_REST, UNRESISTED, ZERO_PIVOT

LARGEST_TURN = 0.2
"""Sine of the turn of the platform up to which the series of the arc sine keeps all digits."""
ARC_SINE = (1.0, 1 / 6, 3 / 40, 15 / 336, 105 / 3456, 945 / 42240, 10395 / 599040, 135135 / 9676800)
"""Coefficients of asin(s) / s in powers of s²."""


@dataclass(frozen=True)
class Place:
    """The equations at some coordinates of the carrier.

    Attributes:
        platform: displacement of the platform.
        pulls: pulls of the rods.
        terms: contribution of the carrier to the equations.
        rates: rates of the equations' residuals by the coordinates [coordinates x coordinates].
        elastic: the part of the rates that springs make.
        slack: number of rods that carry nothing.
    """

    platform: Motions
    pulls: tuple[RodPull, ...]
    terms: LegTerms
    rates: Array
    elastic: Array
    slack: Scalar


def place_of(machine: Cut, coordinates: Row) -> Place:
    """Evaluate the equations of a machine whose loops are cut at some coordinates of its carrier."""
    mechanism, carrier = machine.mechanism, machine.carrier
    row, amounts = of_scalars(coordinates), mechanism.undriven_amounts
    placed = carrier.chain.place(row, amounts)
    platform = placed.end
    grows = any(number >= len(mechanism.actuators) for number in carrier.chain.given)
    is_free = not grows and all(is_zero(coordinate) for coordinate in coordinates)
    pulls = [pull_of(rod, None if is_free else platform) for rod in machine.rods]
    hold, fall = wrench_of_rods(pulls, [pull.tangent_weight for pull in pulls])
    load, change = platform_load(mechanism, platform)
    terms = leg_terms(carrier, row, load + hold, amounts, mechanism.gravity, placed)
    twists = terms.rates[0]
    springs = terms.carrying[0][:, None] * np.eye(carrier.size)
    rates = springs + terms.geometric[0] + twists.T @ (fall - change)[0] @ twists
    elastic = springs + twists.T @ sum_of_dyads(pulls, [pull.elastic_weight for pull in pulls]) @ twists
    return Place(
        platform=platform,
        pulls=tuple(pulls),
        terms=terms,
        rates=rates,
        elastic=elastic,
        slack=total([pull.slack for pull in pulls]),
    )


def reduced_machine(machine: Machine, response: Response, joints: Joints | None) -> "Reduced":
    """The equations of a machine that `cut` can cut, with numbers of any kind.

    Args:
        machine: the machine with its loads.
        response: its response without them.
        joints: coordinates that close its legs, if it is written leg by leg.
    """
    machine_cut = cut(mechanism_of(machine, response.configuration, joints, None))
    if machine_cut is None:
        raise ValueError("loops that cannot be cut have no equations over scalars")
    return Reduced(machine, machine_cut, machine.family.components)


@dataclass(frozen=True)
class Reduced:
    """Equilibrium of a machine in the coordinates of its carrier.

    Attributes:
        machine: the machine.
        cut: the machine with its loops cut.
        components: the components of twists that it has.
    """

    machine: Machine
    cut: Cut
    components: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of unknowns, see `Cut.unknown_places`."""
        return self.cut.unknown_places.count

    def start(self) -> tuple[Row, Scalar]:
        """The coordinates after the first steps from the free state, and the square of the last one's size, as `step`.

        The first one is linear and takes few operations; where loops are cut at rods, so does another one.
        """
        if self.cut.legs:
            return self.chord_step([0.0] * self.size)
        return self.step(self.step([0.0] * self.size)[0])

    def step(self, coordinates: Row) -> tuple[Row, Scalar]:
        """The coordinates after a step of Newton's method, and the square of its size; NaN where it is too long."""
        return _after(coordinates, self.tangent(coordinates))

    def chord_step(self, coordinates: Row) -> tuple[Row, Scalar]:
        """The same by the chord method, of a machine whose legs close loops; see `LegwiseTangent`."""
        return _after(coordinates, LegwiseTangent(self.cut, coordinates, chord=True))

    def tangent(self, coordinates: Row) -> "Tangent | LegwiseTangent":
        """The machine's resistance at some coordinates."""
        if self.cut.legs:
            return LegwiseTangent(self.cut, coordinates)
        return Tangent(self.cut, place_of(self.cut, coordinates))

    def numbers(
        self, coordinates: Row, wanted: Collection[str], response: Response, names: Collection[str]
    ) -> tuple[dict[str, Any], Scalar]:
        """The numbers of the loaded state, see `numbers.loaded_numbers`.

        Args:
            coordinates: the coordinates of the state, up to a last step.
            wanted: which of the numbers are needed.
            response: the response of the pose without loads.
            names: names of all quantities of the question, those of the free machine among them.

        Returns:
            The numbers by name, with the coordinates after this step and the square of its size as "after"; and the
            status of the pose: NOT_CONVERGED where this is not surely a stable state of rest.
        """
        tangent, mechanism = self.tangent(coordinates), self.cut.mechanism
        displacement, turns_little = _displacement(tangent.platform, tangent.twist)
        after, square = _after(coordinates, tangent)
        sure = (square < AT_REST**2) & tangent.stable & turns_little
        compliance, units = tangent.compliance(), mechanism.compliance_units[0]
        result: dict[str, Any] = {
            "slack": tangent.slack,
            "after": [*after, square],
            "displacement": [a * b for a, b in zip(displacement, mechanism.twist_units[0], strict=True)],
            "compliance": [compliance[i][i] * units[i, i] for i in range(6)],
        }
        if "stiffness" in wanted:
            result["stiffness"], stiffness_is_sure = self._stiffness_diagonal(tangent, compliance, units)
            sure = sure & stiffness_is_sure
        if "factor" in wanted and isinstance(tangent, Tangent):
            result["factor"], factor_is_sure = tangent.factor()
            sure = sure & factor_is_sure
        at_rest: Scalar = int(Status.OK)
        if "actuators" in wanted:
            loads = tangent.actuator_loads()
            load_by_name = {spring.name: load for spring, load in loads}
            result |= greatest_loads(loads)
            result["drive_loads"] = [load_by_name[spring.name] for spring in mechanism.driven]
            at_rest = status_with_load_limits(self.machine, response, loads, at_rest)
        code = where(sure, at_rest, int(Status.NOT_CONVERGED))
        status = where(response.place_status > Status.OK + 0.5, response.place_status, code)
        return result, status_with_rest(self.machine, names, response.status, status)

    def _stiffness_diagonal(
        self, tangent: "Tangent | LegwiseTangent", compliance: list[Row], units: Array
    ) -> tuple[Row, Scalar]:
        """The diagonal of K at the tool [6], and whether it is sure: infinite if rigid parts hold a component."""
        moving = [component for component in self.components if not is_zero(compliance[component][component])]
        rows = [[compliance[i][j] for j in moving] for i in moving]
        invert = _inverse_diagonal if isinstance(tangent, Tangent) else _free_inverse_diagonal
        diagonal, sure = invert(rows, tangent.rank)
        stiffness = dict.fromkeys(self.components, math.inf)
        stiffness |= {i: k * reciprocal(units[i, i]) for i, k in zip(moving, diagonal, strict=True)}
        return [stiffness.get(component, math.nan) for component in range(6)], sure


def _after(coordinates: Row, tangent: "Tangent | LegwiseTangent") -> tuple[Row, Scalar]:
    """The coordinates after Newton's step, and the square of its size; NaN where it is too long."""
    square = total([part * part for part in tangent.motion])
    near = square < LONGEST_STEP**2
    return [where(near, a + b, math.nan) for a, b in zip(coordinates, tangent.step, strict=True)], square


class Tangent:
    """Resistance of a machine at a place, and Newton's step from there; `LegwiseTangent` has the same attributes.

    Attributes:
        step: changes of all unknowns.
        motion: those of them that are motions, by which the size of the step is judged.
        rank: the greatest rank that the compliance can have.
        platform: displacement of the platform at the place.
        slack: number of rods that carry nothing.
    """

    def __init__(self, machine: Cut, place: Place) -> None:
        self.place, self.mechanism, self.carrier, self.rods = place, machine.mechanism, machine.carrier, machine.rods
        self._symmetric = all(is_zero(part) for part in machine.mechanism.wrench[0, :3].tolist())
        self._factors = elimination(place.rates.tolist(), self._symmetric)
        self.step: Row = self._factors.solve((-place.terms.residual[0]).tolist())
        self.motion, self.rank, self.platform, self.slack = self.step, len(self.step), place.platform, place.slack

    @property
    def twist(self) -> Row:
        """The step of the platform, at the origin."""
        return np.einsum("nck,nk->nc", self.place.terms.rates, of_scalars(self.step))[0].tolist()

    @property
    def stable(self) -> Scalar:
        """Whether the tangent stiffness is positive definite by a margin."""
        if self._symmetric:
            return definite(self._factors, self.place.rates.tolist())
        rows = (0.5 * (self.place.rates + self.place.rates.T)).tolist()
        return definite(elimination(rows), rows)

    def actuator_loads(self) -> list[tuple[Spring, Scalar]]:
        """Return each actuator with its load after the step (N or N·m), positive where it pulls the actuator open."""
        mechanism, carrier, terms = self.mechanism, self.carrier, self.place.terms
        force = mechanism.force[0]
        loads = loads_of_rods(self.rods, self.place.pulls, self.twist, force)
        for number, spring in enumerate(carrier.springs):
            if spring is not None and spring.actuated:
                load = terms.loads[0, number] + terms.carrying[0, number] * self.step[number]
                turning = spring.joint.point is not None
                loads.append((spring, load * (force * mechanism.length[0] if turning else force)))
        return loads

    def compliance(self) -> list[Row]:
        """C at the loaded tool point [6][6], 0 where it is round-off."""
        back = np.eye(6, dtype=object)[None]
        back[:, 3:, :3] = -skew_of(self.place.platform.translation)
        rows = (back @ self.place.terms.rates)[0].tolist()
        if self._symmetric:
            left = [self._factors.forward(row) for row in rows]
            right = [[a * b for a, b in zip(row, self._factors.shrink, strict=True)] for row in left]
        else:
            left, right = rows, [self._factors.solve(row) for row in rows]
        compliance = [[inner_product(row, column) for column in right] for row in left]
        return [[_without_round_off(0.5 * (compliance[i][j] + compliance[j][i])) for j in range(6)] for i in range(6)]

    def factor(self) -> tuple[Scalar, Scalar]:
        """The factor by which the load may grow until the state gives way, and whether springs alone hold the machine.

        The load takes from the stiffness of the springs, in whose units the greatest share is an eigenvalue.
        """
        elastic, rates = self.place.elastic, self.place.rates
        half = elimination((0.5 * (elastic + elastic.T)).tolist())
        greatest = greatest_eigenvalue(relative(half, elastic - 0.5 * (rates + rates.T)))
        grows = greatest > UNRESISTED
        return where(grows, 1.0 / where(grows, greatest, 1.0), math.inf), definite(half, elastic.tolist())


def _displacement(platform: Motions, twist: Row) -> tuple[Row, Scalar]:
    """Rotation vector and displacement of the tool point after a step, and whether the turn is small enough."""
    step, rotation, shift = of_scalars(twist)[0], platform.rotation[0], platform.translation[0]
    sines = [0.5 * (rotation[i, j] - rotation[j, i]) for i, j in ((2, 1), (0, 2), (1, 0))]
    square, ratio = total([s * s for s in sines]), 0.0
    for coefficient in reversed(ARC_SINE):
        ratio = ratio * square + coefficient
    rotation_vector = [sine * ratio + part for sine, part in zip(sines, step[:3], strict=True)]
    return [*rotation_vector, *(shift + step[3:] + cross(step[:3], shift))], square < LARGEST_TURN**2


def _without_round_off(compliance: Scalar) -> Scalar:
    return where(abs(compliance) < UNRESISTED, 0.0, compliance)


def relative(factors: Eliminated, matrix: Array) -> list[Row]:
    """L^-1 A L^-T of a symmetric matrix A, with the factors of a positive definite one, L L^T."""
    once = [factors.forward(row) for row in matrix.tolist()]
    twice = [factors.forward(row) for row in np.array(once, dtype=object).T.tolist()]
    roots = [sqrt(abs(shrink)) for shrink in factors.shrink]
    size = range(len(roots))
    return [[roots[i] * twice[i][j] * roots[j] for j in size] for i in size]


def _inverse_diagonal(rows: list[Row], rank: int) -> tuple[Row, Scalar]:
    """The diagonal of the inverse of a symmetric matrix, infinite if its rank is less, and whether it is sure."""
    if rank < len(rows):
        return [math.inf] * len(rows), True
    factors = elimination(rows)
    units = np.eye(len(rows)).tolist()
    solved = [factors.forward(unit) for unit in units]
    diagonal = [total([a * a * b for a, b in zip(row, factors.shrink, strict=True)]) for row in solved]
    return diagonal, definite(factors, rows)


def _free_inverse_diagonal(rows: list[Row], most: int) -> tuple[Row, Scalar]:
    """The diagonal of the inverse where numbers, not the form, say which components are rigid, without compliance.

    Args:
        rows: the rows of the matrix.
        most: the greatest rank that the matrix can have; all is rigid where more components than that move.
    """
    size = range(len(rows))
    fixed = [rows[i][i] < ZERO_PIVOT for i in size]
    moving: Scalar = total([where(is_fixed, 0.0, 1.0) for is_fixed in fixed])
    rigid = [where(moving > most + 0.5, 1.0, where(is_fixed, 1.0, 0.0)) > 0.5 for is_fixed in fixed]
    separated = [
        [where(rigid[i], float(i == j), where(rigid[j], float(i == j), rows[i][j])) for j in size] for i in size
    ]
    diagonal, sure = _inverse_diagonal(separated, len(rows))
    return [where(is_rigid, math.inf, k) for is_rigid, k in zip(rigid, diagonal, strict=True)], sure
