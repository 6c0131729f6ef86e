"""Combinations of unknowns that no measured pose sees, in plain words, and how far they move the tool.

Common motions of all base joints, of all platform joints, of the measuring frame and of the target are looked for
first, because they are what cannot be told apart as a rule. What remains is named by its largest parts.

Source: theory (66).
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from kinetostat.accuracy.errors import Insertion, MachineError, effects
from kinetostat.accuracy.rows import random_coordinates
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.numerics.motions import cross
from kinetostat.studies.identification.fit import Fit
from kinetostat.studies.identification.observation import FRAME_UNKNOWNS, TARGET_UNKNOWNS, Observation
from kinetostat.tolerances import SEEN_BY_LEG

SEEN_SHARE = 0.02
"""Share of a combination that may be seen although it counts as unseen: it is named at the drawn machine, and the fit
is some thousandths away from there."""
MOST_NAMED_PARTS = 5
"""Parts of a combination that are named."""
SAME_EFFECT = 1e-5
"""Share of the effect of a motion that errors of the leg may leave out and yet stand for it."""
NO_ERROR = MachineError("", "", "", "", "")
ROUND_OFF_OF_MOTION = 1e-7
"""Share of a motion of the tool below which what is left of it is round-off."""
SAME_SHARE = 1e-6
"""Relative difference below which two unknowns take part in combinations alike."""
LEAST_NAMED_PART = 0.05
"""Share of the largest part of a combination below which a part is not named."""
WAYS = [("turn", "about", axis) for axis in "xyz"] + [("shift", "along", axis) for axis in "xyz"]


@dataclass(frozen=True)
class Unseen:
    """A combination of unknowns that changes nothing that was measured.

    Attributes:
        words: for people, a sentence.
        parts: of the combination by path, SI, so that its largest one is a plausible size.
        tool: how far it moves the tool at most over the poses, in the base frame, m.
        inside: how far at most if the base and the target may be placed elsewhere: what another frame does not undo, m.
    """

    words: str
    parts: dict[str, float]
    tool: float
    inside: float


def unseen_of(observed: Observation, fit: Fit, sizes: Array) -> list[Unseen]:
    """Name the combinations that a fit does not see.

    Args:
        observed: the measurements beside the model.
        fit: to them.
        sizes: plausible size of each unknown, SI [unknowns].
    """
    basis, result = fit.unseen_combinations, []
    if not basis.shape[1]:
        return []
    twists = observed.twists(observed.model.rates(values=observed.errors(fit.values)))
    named: list[Array] = []
    for words, candidate in _common(observed, sizes, basis):
        inside = basis @ (basis.T @ candidate)
        if np.linalg.norm(candidate - inside) < SEEN_SHARE * np.linalg.norm(candidate) and _new(inside, named):
            named.append(inside)
            result.append(_combination(words, candidate, observed, twists, sizes))
    rest = basis - _projection(basis, named)
    left, strength, _ = np.linalg.svd(rest, full_matrices=False)
    ways = sparse(left[:, strength > 0.5]).T
    return result + [_combination(_sentence(way, observed), way, observed, twists, sizes) for way in ways]


def _new(way: Array, named: list[Array]) -> bool:
    rest = way - _projection(way[:, None], named)[:, 0]
    return bool(np.linalg.norm(rest) > 0.1 * np.linalg.norm(way))


def _projection(ways: Array, named: list[Array]) -> Array:
    """The parts of combinations, as columns, that lie in the span of named ones."""
    if not named:
        return np.zeros_like(ways)
    basis, _ = np.linalg.qr(np.stack(named, axis=1))
    return np.asarray(basis @ (basis.T @ ways))


def sparse(ways: Array) -> Array:
    """The same span with each column 1 where all others are 0: at the unknowns that take most part in it.

    Unknowns that do so alike, as those of equal legs, are taken in their order, so that round-off decides nothing.
    """
    rest, places = ways.copy(), []
    for _ in range(ways.shape[1]):
        sizes = np.linalg.norm(rest, axis=1)
        places.append(int(np.argmax(sizes > (1.0 - SAME_SHARE) * sizes.max())))
        way = rest[places[-1]] / sizes[places[-1]]
        rest = rest - np.outer(rest @ way, way)
    return np.asarray(ways @ np.linalg.inv(ways[places]))


def _common(observed: Observation, sizes: Array, basis: Array) -> Iterator[tuple[str, Array]]:
    """Common motions that may hide each other, with what they are in unknowns, in plausible sizes."""
    base, platform = (_common_motions(observed, sizes, at_end) for at_end in (False, True))
    frame, target = _place_motions(observed, sizes, FRAME_UNKNOWNS), _place_motions(observed, sizes, TARGET_UNKNOWNS)
    for number, (what, preposition, axis) in enumerate(WAYS):
        on_base = f"a common {what} of all base joints {preposition} {axis}"
        on_platform = f"a common {what} of all platform joints {preposition} {axis}"
        for group, name, places, other in (
            (base, on_base, frame, "the measuring frame"),
            (platform, on_platform, target, "the target on the platform"),
        ):
            if number in group:
                yield f"{_first(name)} changes nothing that was measured.", group[number]
                words = f"{_first(name)} cannot be told from another place of {other}."
                yield words, _with_best(group[number], places, basis)
        if number in base and platform:
            every = [*platform.values(), *frame.values(), *target.values()]
            words = f"{_first(on_base)} cannot be told from one of all platform joints."
            yield words, _with_best(base[number], dict(enumerate(every)), basis)
        if number in frame:
            words = (
                f"A {what} of the measuring frame {preposition} {axis} cannot be told from another place of the target."
            )
            yield words, _with_best(frame[number], target, basis)


def _first(text: str) -> str:
    return text[0].upper() + text[1:]


def _with_best(candidate: Array, others: dict[int, Array], basis: Array) -> Array:
    """A combination with those amounts of others that hide it best."""
    if not others:
        return candidate
    block = np.stack(list(others.values()), axis=1)
    seen = block - basis @ (basis.T @ block)
    share, *_ = np.linalg.lstsq(seen, candidate - basis @ (basis.T @ candidate), rcond=1e-6)
    return np.asarray(candidate - block @ share)


def _common_motions(observed: Observation, sizes: Array, at_end: bool) -> dict[int, Array]:
    """The unknowns that move all legs together on the base, or on the platform, by the number of the motion."""
    result = {}
    for number, unit in enumerate(np.eye(6)):
        centre = observed.model.rows.point if at_end else np.zeros(3)
        twist = unit + np.concatenate([np.zeros(3), np.cross(centre, unit[:3])])
        moved: Array | None = np.zeros(len(sizes))
        for leg in range(len(observed.model.rows.legs)):
            share = _of_leg(observed, leg, -twist if at_end else twist, at_end)
            moved = None if moved is None or share is None else moved + share
        if moved is not None and moved.any():
            result[number] = moved / sizes
    return result


def _of_leg(observed: Observation, leg: int, twist: Array, at_end: bool) -> Array | None:
    """The unknowns of a leg that do what a motion of its whole beginning or end does; None if they cannot, SI."""
    rows, sources = observed.model.rows, observed.model.sources
    row, result = rows.legs[leg], np.zeros(len(observed.chosen))
    places = random_coordinates(row, rows.length)
    motion = (NO_ERROR, (Insertion(leg, len(row.twists) if at_end else 0, twist),))
    goal = effects(row, rows, [motion], places)[:, 0]
    if np.abs(goal).max(initial=0.0) < SEEN_BY_LEG / rows.length:
        return result
    machine = [(n, place) for n, place in enumerate(observed.chosen) if 0 <= place < len(sources)]
    mine = [(n, sources[place]) for n, place in machine if {i.leg for i in sources[place][1]} == {leg}]
    if not mine:
        return None
    columns = effects(row, rows, [source for _, source in mine], places)
    scale = np.linalg.norm(columns, axis=0)
    share, *_ = np.linalg.lstsq(columns / scale, goal, rcond=SEEN_BY_LEG)
    if np.linalg.norm(columns / scale @ share - goal) > SAME_EFFECT * np.linalg.norm(goal):
        return None
    result[[n for n, _ in mine]] = share / scale
    return result


def _place_motions(observed: Observation, sizes: Array, paths: tuple[str, ...]) -> dict[int, Array]:
    """The unknowns of the measuring frame or the target, by the number of the motion."""
    known = [unknown.path for unknown in observed.unknowns]
    result = {}
    for number, path in enumerate(paths):
        if path in known:
            way = np.zeros(len(sizes))
            way[known.index(path)] = 1.0 / sizes[known.index(path)]
            result[number] = way
    return result


def _sentence(way: Array, observed: Observation) -> str:
    """Name the largest parts of a combination."""
    order = [int(i) for i in np.argsort(-np.abs(way)) if abs(way[i]) > LEAST_NAMED_PART * np.abs(way).max()]
    parts = [f"{way[i] / np.abs(way).max():+.2g} × {observed.unknowns[i].words}" for i in order[:MOST_NAMED_PARTS]]
    more = f" and {len(order) - MOST_NAMED_PARTS} more" if len(order) > MOST_NAMED_PARTS else ""
    if len(order) == 1:
        return f"The {observed.unknowns[order[0]].words} changes nothing that was measured."
    return f"Only other combinations than this one are seen: {', '.join(parts)}{more}."


def _combination(words: str, way: Array, observed: Observation, twists: Array, sizes: Array) -> Unseen:
    values = way / np.abs(way).max() * sizes
    moved = twists @ values
    parts = {
        u.path: float(v) for u, v in zip(observed.unknowns, values, strict=True) if abs(v) > 1e-9 * np.abs(values).max()
    }
    left = moved - _undone_by_frames(moved, observed)
    tool, inside = (float(np.linalg.norm(each[:, 3:], axis=1).max()) for each in (moved, left))
    return Unseen(words, parts, tool, inside if inside > ROUND_OFF_OF_MOTION * tool else 0.0)


def _undone_by_frames(moved: Array, observed: Observation) -> Array:
    """The part of motions of the tool that motions of the base and of the target can make [n x 6]."""
    count, tool = len(moved), observed.model.drawn.tool
    ways = []
    for turning, moving in product((0.0, 1.0), np.eye(3)):
        axis = np.broadcast_to(moving, (count, 3))
        still = np.zeros((count, 3))
        ways.append(np.concatenate([axis, cross(axis, tool)] if turning else [still, axis], axis=1).ravel())
        arm = np.einsum("nij,j->ni", observed.model.drawn.axes, moving)
        ways.append(np.concatenate([arm, still] if turning else [still, arm], axis=1).ravel())
    unit = np.tile([observed.model.length] * 3 + [1.0] * 3, count)
    columns = np.stack(ways, axis=1) * unit[:, None]
    share = np.linalg.lstsq(columns, moved.ravel() * unit, rcond=1e-10)[0]
    return np.asarray((columns @ share / unit).reshape(count, 6))
