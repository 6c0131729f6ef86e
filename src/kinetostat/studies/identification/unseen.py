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
NEW_SHARE = 0.1
"""Share of a combination that named ones must leave of it, so that it has a name of its own."""
SAME_SHARE = 1e-6
"""Relative difference below which two unknowns take part in combinations alike."""
LEAST_NAMED_PART = 0.05
"""Share of the largest part of a combination below which a part is not named."""
COMMON_MOTIONS = [("turn", "about", axis) for axis in "xyz"] + [("shift", "along", axis) for axis in "xyz"]
"""Words for the motions of a body, in the order of the components of twists."""
HIDDEN_BY_OTHERS = 1e-6
"""Relative singular value below which other motions hide each other already, and are not taken to hide one more."""
SAME_AS_FRAMES = 1e-10
"""Relative singular value below which motions of the base and of the target do the same to the tool."""
NO_PART = 1e-9
"""Share of the largest part of a combination below which a part is round-off."""


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
    unnamed = basis - _projection(basis, named)
    directions, strength, _ = np.linalg.svd(unnamed, full_matrices=False)  # strengths are near 1, or near 0 if named
    others = sparse(directions[:, strength > 0.5]).T
    return result + [_combination(_sentence(each, observed), each, observed, twists, sizes) for each in others]


def _new(combination: Array, named: list[Array]) -> bool:
    """Whether a combination is more than a mix of those that have names."""
    unnamed = combination - _projection(combination[:, None], named)[:, 0]
    return bool(np.linalg.norm(unnamed) > NEW_SHARE * np.linalg.norm(combination))


def _projection(combinations: Array, named: list[Array]) -> Array:
    """The parts of combinations, as columns, that lie in the span of named ones."""
    if not named:
        return np.zeros_like(combinations)
    basis, _ = np.linalg.qr(np.stack(named, axis=1))
    return np.asarray(basis @ (basis.T @ combinations))


def sparse(combinations: Array) -> Array:
    """The same span with each column 1 where all others are 0: at the unknowns that take most part in it.

    Unknowns that do so alike, as those of equal legs, are taken in their order, so that round-off decides nothing.
    """
    remaining, pivots = combinations.copy(), []
    for _ in range(combinations.shape[1]):
        sizes = np.linalg.norm(remaining, axis=1)
        pivots.append(int(np.argmax(sizes > (1.0 - SAME_SHARE) * sizes.max())))
        row = remaining[pivots[-1]] / sizes[pivots[-1]]
        remaining = remaining - np.outer(remaining @ row, row)
    return np.asarray(combinations @ np.linalg.inv(combinations[pivots]))


def _common(observed: Observation, sizes: Array, basis: Array) -> Iterator[tuple[str, Array]]:
    """Common motions that may hide each other, with what they are in unknowns, in plausible sizes."""
    base, platform = (_common_motions(observed, sizes, at_end) for at_end in (False, True))
    frame, target = _place_motions(observed, sizes, FRAME_UNKNOWNS), _place_motions(observed, sizes, TARGET_UNKNOWNS)
    for number, (what, preposition, axis) in enumerate(COMMON_MOTIONS):
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
    share, *_ = np.linalg.lstsq(seen, candidate - basis @ (basis.T @ candidate), rcond=HIDDEN_BY_OTHERS)
    return np.asarray(candidate - block @ share)


def _common_motions(observed: Observation, sizes: Array, at_end: bool) -> dict[int, Array]:
    """The unknowns that move all legs together on the base, or on the platform, by the number of the motion."""
    result = {}
    for number, unit in enumerate(np.eye(6)):
        centre = observed.model.rows.point if at_end else np.zeros(3)
        twist = unit + np.concatenate([np.zeros(3), np.cross(centre, unit[:3])])
        legs = range(len(observed.model.rows.legs))
        amounts = [_unknowns_of_leg(observed, leg, -twist if at_end else twist, at_end) for leg in legs]
        together = sum((each for each in amounts if each is not None), np.zeros(len(sizes)))
        if together.any() and not any(each is None for each in amounts):
            result[number] = together / sizes
    return result


def _unknowns_of_leg(observed: Observation, leg: int, twist: Array, at_end: bool) -> Array | None:
    """The unknowns of a leg that do what a motion of its whole beginning or end does; None if they cannot, SI."""
    rows, sources = observed.model.rows, observed.model.sources
    row, result = rows.legs[leg], np.zeros(len(observed.error_numbers))
    places = random_coordinates(row, rows.length)
    motion = (NO_ERROR, (Insertion(leg, len(row.twists) if at_end else 0, twist),))
    goal = effects(row, rows, [motion], places)[:, 0]
    if np.abs(goal).max(initial=0.0) < SEEN_BY_LEG / rows.length:
        return result
    machine = [(n, place) for n, place in enumerate(observed.error_numbers) if 0 <= place < len(sources)]
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
            result[number] = np.zeros(len(sizes))
            result[number][known.index(path)] = 1.0 / sizes[known.index(path)]
    return result


def _sentence(combination: Array, observed: Observation) -> str:
    """Name the largest parts of a combination."""
    shares = combination / np.abs(combination).max()
    order = [int(i) for i in np.argsort(-np.abs(combination)) if abs(shares[i]) > LEAST_NAMED_PART]
    parts = [f"{shares[i]:+.2g} × {observed.unknowns[i].words}" for i in order[:MOST_NAMED_PARTS]]
    more = f" and {len(order) - MOST_NAMED_PARTS} more" if len(order) > MOST_NAMED_PARTS else ""
    if len(order) == 1:
        return f"The {observed.unknowns[order[0]].words} changes nothing that was measured."
    return f"Only other combinations than this one are seen: {', '.join(parts)}{more}."


def _combination(words: str, combination: Array, observed: Observation, twists: Array, sizes: Array) -> Unseen:
    """Describe a combination, scaled so that its largest part is a plausible size."""
    values = combination / np.abs(combination).max() * sizes
    least = NO_PART * np.abs(values).max()
    parts = {u.path: float(v) for u, v in zip(observed.unknowns, values, strict=True) if abs(v) > least}
    motions = twists @ values
    remaining = motions - _undone_by_frames(motions, observed)
    tool, inside = (float(np.linalg.norm(each[:, 3:], axis=1).max()) for each in (motions, remaining))
    return Unseen(words, parts, tool, inside if inside > ROUND_OFF_OF_MOTION * tool else 0.0)


def _undone_by_frames(moved: Array, observed: Observation) -> Array:
    """The part of motions of the tool that motions of the base and of the target can make [n x 6]."""
    count, tool = len(moved), observed.model.drawn.tool
    columns = []
    for turning, moving in product((0.0, 1.0), np.eye(3)):
        axis = np.broadcast_to(moving, (count, 3))
        still = np.zeros((count, 3))
        columns.append(np.concatenate([axis, cross(axis, tool)] if turning else [still, axis], axis=1).ravel())
        arm = np.einsum("nij,j->ni", observed.model.drawn.axes, moving)
        columns.append(np.concatenate([arm, still] if turning else [still, arm], axis=1).ravel())
    unit = np.tile([observed.model.length] * 3 + [1.0] * 3, count)
    matrix = np.stack(columns, axis=1) * unit[:, None]
    share = np.linalg.lstsq(matrix, moved.ravel() * unit, rcond=SAME_AS_FRAMES)[0]
    return np.asarray((matrix @ share / unit).reshape(count, 6))
