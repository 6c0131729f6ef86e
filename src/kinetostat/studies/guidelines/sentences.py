"""Guidelines in plain sentences, each with the share of the poses of a grid at which it holds. Nothing is derived here.

One kind of statement is one function, in the order of the paper's section 4.2.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetostat.kinetostatics.elements import LINKS_TOGETHER, Element
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.guidelines.guidelines import Guidelines
from kinetostat.studies.guidelines.moves import Move
from kinetostat.studies.guidelines.roles import EXCESS, ROUNDING, Array, Roles
from kinetostat.studies.plain_data import as_answer, stiffness_of_spring

MATTERS = 0.01
"""Share of an entry of C from which an element is named as one that decides it."""
APART = 10.0
"""Ratio of limits of rigidity from which directions are told apart."""
LEAST = 0.005
"""Percent per percent below which a sentence says that nothing happens."""
MOST_MOVES = 8
"""Parameters of which a sentence is made."""


@dataclass(frozen=True)
class Statement:
    """A guideline.

    Attributes:
        topic: "yields", "weakest", "rigid" or "design".
        text: one sentence.
        holds: share of the poses of the grid at which it is true, 0 to 1; None without a grid.
    """

    topic: str
    text: str
    holds: float | None


def statements(found: Guidelines) -> list[Statement]:
    """All guidelines, at the pose of the file and, where there is a grid, with how far they hold over it."""
    if found.here is None:
        return []
    return [
        *_what_yields(found, found.here),
        *_weakest(found, found.here),
        *_counts_as_rigid(found, found.here),
        *_design(found),
    ]


def _what_yields(found: Guidelines, here: Roles) -> Iterator[Statement]:
    """Which directions depend on which elements: directions of which the same is true together."""
    single, over = _single(found), _over(found)
    groups: dict[tuple[bytes, float | None], list[int]] = {}
    for i in _yielding(here):
        mask = here.shares[single, i] >= MATTERS
        true = None if over is None else _share_of((over.shares[single, i] >= MATTERS) == mask)
        groups.setdefault((mask.tobytes(), true), []).append(i)
    for (_, true), directions in groups.items():
        shares = here.shares[single][:, directions, 0]
        deciding = [
            f"{found.found[k].name} ({_percents(own.min(), own.max())})"
            for k, own in zip(single, shares, strict=True)
            if own.max() >= MATTERS
        ]
        silent = [found.found[k].name for k, own in zip(single, shares, strict=True) if own.max() <= ROUNDING]
        aside = f", not by {_listed(silent, 'or')}" if silent else ""
        verb = "yields" if len(directions) == 1 else "yield"
        yield Statement("yields", f"{_named(found, directions)} {verb} by {_listed(deciding)}{aside}.", true)
    rigid = [i for i, c in enumerate(found.compliance) if c == 0.0]
    if rigid:
        yield Statement("yields", f"Nothing yields in {_named(found, rigid)}.", None)
    free = [i for i, c in enumerate(found.compliance) if c == math.inf]
    if free:
        yield Statement("yields", f"Nothing holds the platform in {_named(found, free)}.", None)


def _weakest(found: Guidelines, here: Roles) -> Iterator[Statement]:
    """The element whose doubling gains most, direction by direction."""
    single, over = _single(found), _over(found)
    best, gains = _first(here.gains[single])[:, 0], here.gains[single, :, 0]
    for k in dict.fromkeys(best[_yielding(here)].tolist()):
        directions = [i for i in _yielding(here) if best[i] == k]
        own = gains[k, directions]
        text = (
            f"Weakest {_where(found, directions)} is {found.found[single[k]].name}: twice as stiff, it lowers the "
            f"compliance by {_percents(own.min(), own.max())}."
        )
        true = None if over is None else _share_of(_first(over.gains[single])[directions] == k)
        yield Statement("weakest", text, true)


def _counts_as_rigid(found: Guidelines, here: Roles) -> Iterator[Statement]:
    """From which stiffness on an element may be taken as rigid: directions that ask for much the same together."""
    for k, element in enumerate(found.found):
        factors = {i: float(here.rigid[k, i, 0]) for i in _yielding(here) if here.rigid[k, i, 0] > 0.0}
        if element.actuated or not factors:
            continue
        said = []
        for directions in _clusters(factors):
            most = max(factors[i] for i in directions)
            where = _where(found, directions)
            said.append(
                f"{where} from {_stiffness(element, most)} on"
                if most < math.inf
                else f"never {where}, where nothing else yields"
            )
        finite = [factor for factor in factors.values() if factor < math.inf]
        against = _against_actuators(found, element, max(finite)) if finite else ""
        counts = (
            f"{element.name[0].upper()}{element.name[1:]} {'count' if element.name == LINKS_TOGETHER else 'counts'}"
        )
        text = f"{counts} as rigid {'; '.join(said)}.{against}{_at_worst(found, k, list(factors))}"
        yield Statement("rigid", text, None)


def _clusters(factors: Mapping[int, float]) -> list[list[int]]:
    """Directions by rising factor, in groups that lie more than a power of ten apart."""
    groups: list[list[int]] = []
    for i in sorted(factors, key=lambda i: factors[i]):
        if groups and factors[i] <= APART * factors[groups[-1][-1]]:
            groups[-1].append(i)
        else:
            groups.append([i])
    return [sorted(group) for group in groups]


def _at_worst(found: Guidelines, k: int, directions: Sequence[int]) -> str:
    """The limit that is enough at every pose of the grid, in those directions in which there is one."""
    over = _over(found)
    if over is None:
        return ""
    most = {i: float(over.rigid[k, i].max()) for i in directions}
    finite = [i for i in directions if most[i] < math.inf]
    if not finite:
        return ""
    limit = _stiffness(found.found[k], max(most[i] for i in finite))
    return f" At every pose of the grid {_where(found, finite)} from {limit} on."


def _design(found: Guidelines) -> Iterator[Statement]:
    """Which parameter moves which direction which way."""
    for move in found.moves[:MOST_MOVES]:
        directions = [(i, p) for i, p in enumerate(move.percents) if p is not None]
        rising = sorted(((i, p) for i, p in directions if p > LEAST), key=lambda pair: -pair[1])
        falling = sorted(((i, p) for i, p in directions if p < -LEAST), key=lambda pair: pair[1])
        none = [found.components[i] for i, p in directions if abs(p) <= LEAST]
        said = [
            f"{word} in {', '.join(f'{found.components[i]} {p:+.2g}' for i, p in pairs)}"
            for word, pairs in (("stiffer", rising), ("softer", falling))
            if pairs
        ]
        aside = f"; nothing in {', '.join(none)}" if none else ""
        more = f"{'0.01 rad more' if move.turning else 'More'} {with_leg(found.machine, move.path)}"
        yield Statement("design", f"{more}: {'; '.join(said)}{aside}.", _same_signs(found, move))


def _same_signs(found: Guidelines, move: Move) -> float | None:
    """The least share of the poses at which the signs of the file's pose hold, over the directions that are felt."""
    if found.everywhere is None or not move.stiffer:
        return None
    shares = [
        move.stiffer[i] if p > 0.0 else move.softer[i]
        for i, p in enumerate(move.percents)
        if p is not None and abs(p) > LEAST
    ]
    return min(shares, default=None)


def _single(found: Guidelines) -> list[int]:
    """Places of the elements that are no sums of others."""
    taken: set[int] = set()
    single = []
    for k, element in enumerate(found.found):
        if not taken.issuperset(element.springs):
            single.append(k)
        taken.update(element.springs)
    return single


def _yielding(roles: Roles) -> list[int]:
    """Places of the directions that yield and are held."""
    return [i for i in range(roles.shares.shape[1]) if np.isfinite(roles.shares[:, i, 0]).all()]


def _over(found: Guidelines) -> Roles | None:
    """Roles over the grid, if there is one with any answer."""
    return found.everywhere if found.everywhere is not None and found.poses[0] else None


def _share_of(true: npt.NDArray[np.bool_]) -> float:
    """Share of the poses at which all rows [rows x poses] are true."""
    return float(true.all(axis=0).mean())


def _first(gains: Array) -> npt.NDArray[np.int64]:
    """Which element gains most [components x poses], the first of those that gain alike."""
    return np.asarray(np.nan_to_num(gains).round(6).argmax(axis=0))


def _percents(least: float, most: float) -> str:
    low, high = f"{100 * least:.3g}", f"{100 * most:.3g}"
    return f"{high}\N{NO-BREAK SPACE}%" if low == high else f"{low} to {high}\N{NO-BREAK SPACE}%"


def _stiffness(element: Element, factor: float) -> str:
    """A limit as a stiffness with its unit, and as a multiple of the present one."""
    if element.stiffness is None:
        return f"{factor:.3g} times its present stiffness"
    now = "" if element.stiffness == math.inf else f" ({factor:.3g} times now)"
    return f"{limit_of(element.stiffness, factor):.4g} {element.unit}{now}"


def _against_actuators(found: Guidelines, element: Element, factor: float) -> str:
    """The limit as a ratio to the stiffness of an actuator, with the unit of that ratio."""
    servo = found.actuator
    if servo is None or servo.stiffness is None or element.stiffness is None:
        return ""
    ratio = limit_of(element.stiffness, factor) / servo.stiffness
    unit = "times" if servo.unit == element.unit else f"{element.unit} per {servo.unit} of"
    return f" The greatest is {ratio:.3g} {unit} an actuator."


def limit_of(stiffness: float, factor: float) -> float:
    """The stiffness from which on an element counts as rigid, SI; of one that is rigid now, factors are per 1 SI."""
    return factor if stiffness == math.inf else stiffness * factor


def _named(found: Guidelines, directions: Sequence[int]) -> str:
    return ", ".join(found.components[i] for i in directions)


def _where(found: Guidelines, directions: Sequence[int]) -> str:
    return "in every direction" if len(directions) == len(found.components) else f"in {_named(found, directions)}"


def _listed(words: Sequence[str], last: str = "and") -> str:
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def as_json(found: Guidelines) -> dict[str, Any]:
    """Guidelines as plain data, their sentences among them; directions by name."""
    names, here = found.components, found.here
    by_direction = partial(_by_direction, names)
    return as_answer(
        {
            "name": found.machine.name,
            "status": found.status.word,
            "message": found.message,
            "components": names,
            "rigid_within": EXCESS,
            "compliance_diagonal": found.compliance or None,
            "elements": [_element_json(found, here, k) for k in range(len(found.found))] if here else [],
            "stiffness_equations": found.equations
            and {name: by_direction(row) for name, row in found.equations.items()},
            "parameters": [_move_json(move, names) for move in found.moves],
            "without_influence": found.idle,
            "left_out": dict(found.skipped),
            "statements": statements(found),
            "grid": {"over": found.ranges, "poses": found.poses[1], "answered": found.poses[0]}
            if found.ranges
            else None,
        }
    )


def _by_direction(names: Sequence[str], row: Any) -> dict[str, Any]:
    return dict(zip(names, row, strict=True))


def _element_json(found: Guidelines, here: Roles, k: int) -> dict[str, Any]:
    element, over, actuator = found.found[k], _over(found), found.actuator
    by_direction = partial(_by_direction, found.components)
    limits = [None if element.stiffness is None else limit_of(element.stiffness, f) for f in here.rigid[k, :, 0]]
    ratio = actuator.stiffness if actuator else None
    data: dict[str, Any] = {
        "name": element.name,
        "parts": element.parts,
        "actuated": element.actuated,
        "units": element.unit or None,
        "stiffness": stiffness_of_spring(element.stiffness),
        "compliance_share": by_direction(here.shares[k, :, 0]),
        "rigid_from_factor": by_direction(here.rigid[k, :, 0]),
        "rigid_from": by_direction(limits),
        "rigid_from_per_actuator": by_direction([limit and ratio and limit / ratio for limit in limits]),
        "doubling_lowers_compliance": by_direction(here.gains[k, :, 0]),
    }
    if over is not None:
        data["over_grid"] = {
            "least_share": by_direction(over.shares[k].min(axis=1)),
            "greatest_share": by_direction(over.shares[k].max(axis=1)),
            "rigid_from_factor": by_direction(over.rigid[k].max(axis=1)),
        }
    return data


def _move_json(move: Move, names: Sequence[str]) -> dict[str, Any]:
    data: dict[str, Any] = {
        "path": move.path,
        "one_percent": "0.01 rad" if move.turning else "1 %",
        "stiffer_percent_per_percent": _by_direction(names, move.percents),
    }
    if move.stiffer:
        data["stiffer_at"] = _by_direction(names, move.stiffer)
        data["softer_at"] = _by_direction(names, move.softer)
    return data
