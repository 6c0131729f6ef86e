"""Guidelines in plain sentences, each with the share of the poses of a grid at which it holds.

Each kind of statement has a function, in the order in which D. Zhang and C. M. Gosselin (2002) derive theirs in section
4.2. Nothing is derived here.
"""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.display import number
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.elements import LINKS_TOGETHER, Element
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.guidelines import Guidelines, ParameterEffect, Roles
from kinetostat.tolerances import NO_ROLE

DECIDING_SHARE = 0.01
"""Share of an entry of C from which on an element is named as one that decides it: a lesser one is below the usual
uncertainty of a stiffness."""
RATIO_OF_LIMITS = 10.0
"""Ratio of neighbouring limits of rigidity above which directions get a limit each. Within it the greatest serves
for all: twice as much would ask for parts that are needlessly stiff, half would write a clause for nearly every
direction."""
LEAST_EFFECT = 0.005
"""Percent per percent below which a sentence says that a parameter has no effect: some hundredth of a usual effect."""
MOST_PARAMETERS = 8
"""Parameters that have a sentence, those with the largest effect: more sentences nobody reads; the table has all."""
WHOLE_PERCENTS = 9.5
"""Percent from which a share is written without a decimal, so that it has two digits."""
WITHOUT_NOUN = ("proximal", "distal", "upper", "lower", "inner", "outer")
"""Labels of links that need the word "links" in a sentence."""


@dataclass(frozen=True)
class Statement:
    """A guideline.

    Attributes:
        topic: "compliance", "weakest", "rigid" or "design".
        text: one sentence or two.
        holds: share of the poses of the grid at which it is true, 0 to 1; None without a grid.
    """

    topic: str
    text: str
    holds: float | None


def statements(answer: Guidelines) -> list[Statement]:
    """Write all guidelines at the pose of the file, with the share of the grid over which they hold if there is one."""
    if answer.roles is None:
        return []
    return [
        *_sources_of_compliance(answer, answer.roles),
        *_weakest_elements(answer, answer.roles),
        *_limits_of_rigidity(answer, answer.roles),
        *_effects_of_parameters(answer),
    ]


def _sources_of_compliance(answer: Guidelines, roles: Roles) -> Iterator[Statement]:
    """Statements on the elements from which the compliance of each direction comes; alike directions share one."""
    basic, over_grid = _elements_without_parts(answer), answer.roles_over_grid
    groups: dict[tuple[bytes, float | None], list[int]] = {}
    for i in _compliant_directions(roles):
        mask = roles.shares[basic, i] >= DECIDING_SHARE
        holds = None if over_grid is None else _share_of_poses((over_grid.shares[basic, i] >= DECIDING_SHARE) == mask)
        groups.setdefault((mask.tobytes(), holds), []).append(i)
    for (_, holds), directions in groups.items():
        shares = roles.shares[basic][:, directions, 0]
        deciding = [
            f"{_name_in_sentence(answer, k)} ({_percents(row.min(), row.max())})"
            for k, row in zip(basic, shares, strict=True)
            if row.max() >= DECIDING_SHARE
        ]
        silent = [_name_in_sentence(answer, k) for k, row in zip(basic, shares, strict=True) if row.max() <= NO_ROLE]
        aside = f", not from {_enumeration(silent, 'or')}" if silent else ""
        text = f"{_directions_in_words(answer, directions)} the compliance comes from {_enumeration(deciding)}{aside}."
        yield Statement("compliance", _with_capital(text), holds)
    for word, extreme in (("rigid", 0.0), ("free", math.inf)):
        directions = [i for i, c in enumerate(answer.compliance_diagonal) if c == extreme]
        if directions:
            yield Statement("compliance", f"The platform is {word} {_directions_in_words(answer, directions)}.", None)


def _weakest_elements(answer: Guidelines, roles: Roles) -> Iterator[Statement]:
    """The element whose doubling gains most, direction by direction."""
    basic, over_grid = _elements_without_parts(answer), answer.roles_over_grid
    if not basic:
        return
    best, gains = _most_gaining(roles.gains[basic])[:, 0], roles.gains[basic, :, 0]
    for k in dict.fromkeys(best[_compliant_directions(roles)].tolist()):
        directions = [i for i in _compliant_directions(roles) if best[i] == k]
        row, plural = gains[k, directions], _is_plural(answer.elements[basic[k]])
        text = (
            f"{_directions_in_words(answer, directions)} {_name_in_sentence(answer, basic[k])} "
            f"{'are' if plural else 'is'} weakest: doubling {'their' if plural else 'its'} stiffness would cut the "
            f"compliance by {_percents(row.min(), row.max())}."
        )
        holds = None if over_grid is None else _share_of_poses(_most_gaining(over_grid.gains[basic])[directions] == k)
        yield Statement("weakest", _with_capital(text), holds)


def _limits_of_rigidity(answer: Guidelines, roles: Roles) -> Iterator[Statement]:
    """The stiffness from which on each element may be taken as rigid; directions with similar limits share one."""
    for k, element in enumerate(answer.elements):
        factors = {i: float(roles.rigid[k, i, 0]) for i in _compliant_directions(roles) if roles.rigid[k, i, 0] > 0.0}
        if element.actuated or not factors:
            continue
        clauses = []
        for directions in _clusters(factors):
            most = max(factors[i] for i in directions)
            where = _directions_in_words(answer, directions)
            clauses.append(
                f"{where} from {_limit_in_words(answer, element, most)} on"
                if most < math.inf
                else f"never {where}, where nothing else is compliant"
            )
        finite = [factor for factor in factors.values() if factor < math.inf]
        against = _against_actuators(answer, element, max(finite)) if finite else ""
        counts = f"{_with_capital(_name_in_sentence(answer, k))} {'count' if _is_plural(element) else 'counts'}"
        text = f"{counts} as rigid {'; '.join(clauses)}.{against}{_limit_over_grid(answer, k, list(factors))}"
        yield Statement("rigid", text, None)


def _clusters(factors: Mapping[int, float]) -> list[list[int]]:
    """Directions by rising factor, in groups that lie more than `RATIO_OF_LIMITS` apart; a chain is one group."""
    groups: list[list[int]] = []
    for i in sorted(factors, key=lambda i: factors[i]):
        if groups and factors[i] <= RATIO_OF_LIMITS * factors[groups[-1][-1]]:
            groups[-1].append(i)
        else:
            groups.append([i])
    return [sorted(group) for group in groups]


def _limit_over_grid(answer: Guidelines, k: int, directions: Sequence[int]) -> str:
    """A sentence on the limit that is enough at every pose of the grid, in those directions in which there is one."""
    over_grid = answer.roles_over_grid
    if over_grid is None:
        return ""
    most = {i: float(over_grid.rigid[k, i].max()) for i in directions}
    finite = [i for i in directions if most[i] < math.inf]
    if not finite:
        return ""
    limit = _limit_in_words(answer, answer.elements[k], max(most[i] for i in finite))
    return f" At every pose of the grid {_directions_in_words(answer, finite)} from {limit} on."


def _effects_of_parameters(answer: Guidelines) -> Iterator[Statement]:
    """Statements on the directions that each parameter stiffens or softens."""
    for effect in answer.parameters[:MOST_PARAMETERS]:
        directions = [(i, p) for i, p in enumerate(effect.percents) if not math.isnan(p)]
        rising = sorted(((i, p) for i, p in directions if p > LEAST_EFFECT), key=lambda pair: -pair[1])
        falling = sorted(((i, p) for i, p in directions if p < -LEAST_EFFECT), key=lambda pair: pair[1])
        none = [answer.components[i] for i, p in directions if abs(p) <= LEAST_EFFECT]
        clauses = [
            f"{word} in {', '.join(_signed_percent(answer.components[i], p) for i, p in pairs)}"
            for word, pairs in (("stiffer", rising), ("softer", falling))
            if pairs
        ]
        aside = f"; no effect in {', '.join(none)}" if none else ""
        name = with_leg(answer.machine, effect.path)
        change = f"Turning {name} by 0.01 rad" if effect.turning else f"Increasing {name}"
        yield Statement("design", f"{change}: {'; '.join(clauses)}{aside}.", share_with_same_signs(effect))


def share_with_same_signs(effect: ParameterEffect) -> float | None:
    """The least share of the poses of a grid at which a parameter stiffens, or softens, a direction as it does here.

    None without a grid, or if the parameter has no effect on any direction here.
    """
    if not effect.stiffer:
        return None
    shares = [
        effect.stiffer[i] if p > 0.0 else effect.softer[i]
        for i, p in enumerate(effect.percents)
        if abs(p) > LEAST_EFFECT
    ]
    return min(shares, default=None)


def _elements_without_parts(answer: Guidelines) -> list[int]:
    """Numbers of the elements that are not made of others."""
    springs_before: set[int] = set()
    basic = []
    for k, element in enumerate(answer.elements):
        if not springs_before.issuperset(element.springs):
            basic.append(k)
        springs_before.update(element.springs)
    return basic


def _compliant_directions(roles: Roles) -> list[int]:
    """Numbers of the directions that are neither rigid nor free; none where the machine has no elements."""
    return [i for i in range(roles.shares.shape[1]) if len(roles.shares) and np.isfinite(roles.shares[:, i, 0]).all()]


def _share_of_poses(is_true: Mask) -> float:
    """Share of the poses at which all rows [rows x poses] are true."""
    return float(is_true.all(axis=0).mean())


def _most_gaining(gains: Array) -> Integers:
    """The number of the element that gains most [components x poses]; the first one if several gain alike."""
    return np.asarray(np.nan_to_num(gains).round(6).argmax(axis=0))


def _signed_percent(name: str, percent: float) -> str:
    return f"{name} {percent:+.2g}\N{NO-BREAK SPACE}%"


def _percents(least: float, most: float) -> str:
    low, high = (f"{100 * x:.0f}" if 100 * x >= WHOLE_PERCENTS else f"{100 * x:.2g}" for x in (least, most))
    return f"{high}\N{NO-BREAK SPACE}%" if low == high else f"{low} to {high}\N{NO-BREAK SPACE}%"


def _limit_in_words(answer: Guidelines, element: Element, factor: float) -> str:
    """A limit as a stiffness with its unit, and as a multiple of the present one."""
    if element.stiffness is None:
        return f"{factor:.3g} times {'their' if _is_plural(element) else 'its'} present stiffness"
    now = "" if element.stiffness == math.inf else f" ({factor:.3g} times now)"
    return f"{answer.machine.display.show(limit_of(element.stiffness, factor), element.unit)}{now}"


def _against_actuators(answer: Guidelines, element: Element, factor: float) -> str:
    """A sentence on the limit as a ratio to the stiffness of an actuator, with the unit of that ratio."""
    actuator = answer.actuator
    if actuator is None or actuator.stiffness is None or element.stiffness is None:
        return ""
    scales = [answer.machine.display.scale(part.unit) for part in (element, actuator)]
    ratio = limit_of(element.stiffness, factor) * scales[0].factor / (actuator.stiffness * scales[1].factor)
    unit = "times" if actuator.unit == element.unit else f"{scales[0].unit} per {scales[1].unit} of"
    return f" The largest of these is {number(ratio, digits=3)} {unit} an actuator."


def limit_of(stiffness: float, factor: float) -> float:
    """The stiffness from which on an element counts as rigid, SI; of one that is rigid now, the factor itself."""
    return factor if stiffness == math.inf else stiffness * factor


def _is_plural(element: Element) -> bool:
    """Whether an element has several parts; a sentence about it is then in the plural."""
    return len(element.parts) > 1


def _name_in_sentence(answer: Guidelines, k: int) -> str:
    """An element as a sentence names it: "the actuators", "passive link 1", "all links together"."""
    element = answer.elements[k]
    if element.name == LINKS_TOGETHER:
        return "all links together"
    if not _is_plural(element):
        return element.name
    label = element.name.partition(" ×")[0]
    ending = "" if label.endswith("s") else "es" if label.endswith(("ch", "sh", "x")) else "s"
    noun = f"{label} links" if label in WITHOUT_NOUN else f"{label}{ending}"
    alike = [other for other in answer.elements if other.name.partition(" ×")[0] == label]
    return f"the {noun}" if len(alike) == 1 else f"the {len(element.parts)} {noun}"


def _directions_in_words(answer: Guidelines, directions: Sequence[int]) -> str:
    """Directions as a sentence names them: "about x and z", "along y", "in every direction"."""
    if len(directions) == len(answer.components) > 1:
        return "in every direction"
    names = [answer.components[i] for i in directions]
    about, along = [name[1:] for name in names if len(name) == 2], [name for name in names if len(name) == 1]
    return " and ".join([f"{word} {_enumeration(axes)}" for word, axes in (("about", about), ("along", along)) if axes])


def _enumeration(words: Sequence[str], last: str = "and") -> str:
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _with_capital(text: str) -> str:
    return text[0].upper() + text[1:]
