"""Elastic elements: springs that a designer changes together, and what C becomes when one of them is stiffened.

Formulas are over any scalar: one pose, or many as arrays. What they mean for a design is a study's business.

Source: theory (10) and (33), eqs. 33-38. C and K are at the response's reference point, base axes.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kinetostat.algebra.scalar import Scalar, reciprocal
from kinetostat.algebra.symmetric import SIZE, Symmetric6
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import compliance_of, stiffness_coefficients, weighted_sum
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Configuration
from kinetostat.tolerances import ROUND_OFF_OF_COMPLIANCE, ROUND_OFF_OF_ELEMENT

SOFTEST = 1e12
"""Factor on compliances beyond which an element counts as not there: its share of any stiffness is then round-off."""
LINKS_TOGETHER = "links together"
"""Name of all elements but the actuators, as one."""
MOST_SECANTS = 12
"""Most steps of the search for the limit of rigidity: they converge faster than by halving, two to eight are needed."""
LAST_STEP = 1e-12
"""Share of a factor below which a step of that search is its last: the next one would be round-off."""


@dataclass(frozen=True)
class Element:
    """Springs that belong together: a joint or link, or one in each of several legs that are alike.

    Attributes:
        name: name for people, e.g. "actuator".
        parts: names of the joints and links.
        springs: their places in the order of all springs of the machine.
        actuated: whether they are actuators.
        unit: unit of their stiffness; empty where one part has several springs.
        stiffness: stiffness of each, SI; None where they differ or one part has several springs.
    """

    name: str
    parts: tuple[str, ...]
    springs: tuple[int, ...]
    actuated: bool
    unit: str
    stiffness: float | None


class _NumberedSpring(NamedTuple):
    """A spring with its place in the order of all springs of the machine."""

    number: int
    spring: Spring


def elements(configuration: Configuration) -> list[Element]:
    """The elastic elements of a machine, actuators first.

    Springs that are free carry nothing and belong to no element; nor do parts of several springs that are all rigid.
    Parts are alike if they have the same kind and units and are in legs whose parts have the same kinds.
    """
    groups: dict[Hashable, dict[str, list[_NumberedSpring]]] = {}
    number = 0
    for leg in configuration.legs:
        springs_of_part: dict[str, list[_NumberedSpring]] = {}
        for spring in leg.springs:
            if spring.stiffness != 0.0:
                springs_of_part.setdefault(spring.part_name, []).append(_NumberedSpring(number, spring))
            number += 1
        kinds_in_leg = tuple((springs[0].spring.kind, len(springs)) for springs in springs_of_part.values())
        for part, springs in springs_of_part.items():
            if len(springs) > 1 and all(spring.stiffness == math.inf for _, spring in springs):
                continue
            first, units = springs[0].spring, tuple(_unit(spring) for _, spring in springs)
            groups.setdefault((first.kind, units, first.actuated, kinds_in_leg), {})[part] = springs
    return sorted((_element(parts) for parts in groups.values()), key=lambda element: not element.actuated)


def with_links_together(single: Sequence[Element]) -> list[Element]:
    """The elements; where several of them are not actuators, and others are, also one of all that are not."""
    links = [element for element in single if not element.actuated]
    if len(links) < 2 or len(links) == len(single):
        return list(single)
    parts = tuple(part for element in links for part in element.parts)
    springs = tuple(place for element in links for place in element.springs)
    units, values = {element.unit for element in links}, {element.stiffness for element in links}
    are_alike = len(units) == len(values) == 1
    unit, stiffness = (units.pop(), values.pop()) if are_alike else ("", None)
    return [*single, Element(LINKS_TOGETHER, parts, springs, actuated=False, unit=unit, stiffness=stiffness)]


def _element(parts: Mapping[str, Sequence[_NumberedSpring]]) -> Element:
    """The element of parts that are alike, by name."""
    springs = [spring for numbered in parts.values() for _, spring in numbered]
    one_spring_each = len(springs) == len(parts)
    stiffnesses = {float(spring.stiffness) for spring in springs}
    return Element(
        name=f"{springs[0].kind} ×{len(parts)}" if len(parts) > 1 else next(iter(parts)),
        parts=tuple(parts),
        springs=tuple(number for numbered in parts.values() for number, _ in numbered),
        actuated=springs[0].actuated,
        unit=_unit(springs[0]) if one_spring_each else "",
        stiffness=stiffnesses.pop() if one_spring_each and len(stiffnesses) == 1 else None,
    )


def _unit(spring: Spring) -> str:
    return "N/m" if spring.joint.point is None else "N·m/rad"


def element_share(response: Response, element: Element) -> list[Scalar]:
    """The part of an element in the six diagonal entries of C: the sum of s_e xi_e^2 over its springs, SI.

    A rigid one that stands alone is taken with a compliance of 1 (SI): what it would add per unit of it.
    """
    statics = response.statics
    shares = [(statics.flexibility[place], weight) for place, weight in _weights(response, element).items()]
    return list(weighted_sum(shares, reciprocal(statics.length)).diagonal())


def diagonal_with(response: Response, element: Element, factor: Scalar) -> list[Scalar]:
    """The six diagonal entries of C once the compliances of an element are multiplied by a factor >= 0; 0 is rigid."""
    weights, number, legs = _weights(response, element), 0, []
    for leg in response.legs:
        places = range(number, number + len(leg.compliance))
        compliance = [weights[i] * factor if i in weights else s for i, s in zip(places, leg.compliance, strict=True)]
        legs.append(replace(leg, compliance=tuple(compliance)))
        number += len(leg.compliance)
    return list(compliance_of(legs, response.statics.length, response.guide).diagonal())


def rigid_from(response: Response, element: Element, excess: float) -> Array:
    """Factor by which the compliances of an element may be multiplied so that it only just counts as rigid.

    That is where an entry of the diagonal of C exceeds the one with the element rigid by the share `excess` of it. C is
    affine in compliances where the machine is isostatic; otherwise it is solved for. 0 where nothing else deflects,
    infinity where even the softest element adds less.

    Args:
        response: response of the machine at one pose, or at several as arrays.
        element: the element whose springs are changed together.
        excess: e.g. 0.01.

    Returns:
        The factor for each component at each pose [6 x poses].
    """
    with np.errstate(all="ignore"):
        rest = without_rounding(diagonal_with(response, element, 0.0), response)
        shares = without_rounding(element_share(response, element), response)
        rest = np.where(rest > ROUND_OFF_OF_ELEMENT * shares, rest, 0.0)
        if is_isostatic(response):
            return np.where(shares > 0.0, excess * rest / shares, math.inf)
        return _factor_for(response, element, rest, excess * rest)


def without_rounding(entries: Sequence[Scalar], response: Response) -> Array:
    """Diagonal entries of C at one pose or at many [6 x poses], 0 where they are only round-off beside the others."""
    rows = np.stack(np.broadcast_arrays(*(np.atleast_1d(np.asarray(entry, dtype=float)) for entry in entries)))
    length = np.broadcast_to(np.asarray(response.statics.length, dtype=float), rows.shape[1:])
    sizes = rows / np.stack([np.ones_like(length)] * 3 + [length * length] * 3)
    largest = np.where(np.isfinite(sizes), sizes, 0.0).max(axis=0)
    return np.where(sizes > ROUND_OFF_OF_COMPLIANCE * largest, rows, np.where(np.isnan(rows), math.nan, 0.0))


def is_isostatic(response: Response) -> bool:
    """Whether the legs carry six wrenches, so that statics alone says how they share a load."""
    return sum(len(numbers) for numbers in response.statics.sharing) + len(response.guide) == SIZE


def stiffness_equations(response: Response, parts: Sequence[Element]) -> dict[str, Symmetric6] | None:
    """K as a sum over elements: of each, the matrix that its stiffness multiplies; eqs. 33-38, all entries.

    None where there is no such sum: where springs of a leg are in series, a part has several, or an element has several
    stiffnesses.
    """
    square = all(len(leg.loads) == len(leg.wrenches) for leg in response.legs)
    if not square or any(element.stiffness is None for element in parts):
        return None
    dyads = stiffness_coefficients(response.statics)
    return {element.name: Symmetric6.sum_of([dyads[i] for i in element.springs]) for element in parts}


def _weights(response: Response, element: Element) -> dict[int, Scalar]:
    """The compliances of the springs of an element by their numbers; 1 (SI) for each spring of a rigid one."""
    compliance = response.statics.compliance
    return {i: 1.0 if element.stiffness == math.inf else compliance[i] for i in element.springs}


def _factor_for(response: Response, element: Element, rest: Array, excess: Array) -> Array:
    """The factor at which each entry of the diagonal of C exceeds `rest` by `excess`, both [6 x poses].

    Secants of 1/excess over 1/factor: a line where one internal load is undecided, concave where there are several.
    """

    def excess_with(factor: Array) -> Array:
        entries = diagonal_with(response, element, factor)
        return np.stack([np.broadcast_to(entry, rest.shape)[i] for i, entry in enumerate(entries)]) - rest

    # The unknown x is 1/factor, and y(x) = 1/excess shall be `wanted`; at x = 1 is the present machine.
    wanted = 1.0 / excess
    x_before = excess_with(np.ones_like(rest)) / excess
    y_before = 1.0 / excess_with(1.0 / x_before)
    x = x_before * wanted / y_before
    for _ in range(MOST_SECANTS):
        y = 1.0 / excess_with(1.0 / x)
        slope = (y - y_before) / (x - x_before)
        step = np.where(np.isfinite(slope) & (slope > 0.0), (wanted - y) / slope, 0.0)
        is_last = not (np.abs(step) > LAST_STEP * x).any()
        x_before, y_before, x = x, y, np.where(x + step > 0.0, x + step, 0.5 * x)
        if is_last:
            break
    is_unreached = excess_with(np.full_like(rest, SOFTEST)) <= excess
    return np.where(rest > 0.0, np.where(is_unreached, math.inf, 1.0 / x), 0.0)
