"""Combinations of unknowns that no measured pose sees, in plain words, and how far they move the tool.

Common motions of all base joints, of all platform joints, of the measuring frame and of the target are tried first,
because as a rule they are what cannot be told apart. What remains is named by its largest parts. A combination is a
column of amounts, each in the plausible size of its unknown.

Source: theory (66).
"""

from collections.abc import Iterator, Sequence

import numpy as np

from kinetostat.accuracy.errors import Insertion, effects
from kinetostat.accuracy.rows import random_coordinates
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.numerics.motions import cross
from kinetostat.studies.identification.fit import Fit
from kinetostat.studies.identification.observation import FRAME_UNKNOWNS, TARGET_UNKNOWNS, Observation
from kinetostat.tolerances import SEEN_BY_LEG

SEEN_SHARE = 0.02
"""Share of a common motion that may be seen although it counts as unseen. Its amounts are those of the drawn machine;
the fit is some thousandths away from there."""
NEW_SHARE = 0.1
"""Share of a combination that named ones must leave of it, so that it has a name of its own."""
MOST_NAMED_PARTS = 5
"""Greatest number of parts of a combination that its sentence names."""
LEAST_NAMED_PART = 0.05
"""Share of the largest part of a combination below which a part is not named."""
SAME_EFFECT = 1e-5
"""Share of the effect of a motion that errors of a leg may leave out and yet stand for it: where they can make the
motion, round-off leaves out 1e-13."""
SAME_SHARE = 1e-6
"""Relative difference below which two unknowns take part in combinations alike."""
HIDDEN_BY_OTHERS = 1e-6
"""Relative singular value below which motions already hide each other; they are then not used to hide one more."""
SAME_AS_FRAMES = 1e-10
"""Relative singular value below which motions of the base and of the target do the same to the tool."""
ROUND_OFF_OF_MOTION = 1e-7
"""Share of a motion of the tool below which what is left of it is round-off."""
NO_PART = 1e-9
"""Share of the largest part of a combination below which a part is round-off."""
COMMON_MOTIONS = [("turn", "about", axis) for axis in "xyz"] + [("shift", "along", axis) for axis in "xyz"]
"""Words for the motions of a body, in the order of the components of twists."""


@dataclass(frozen=True)
class Unseen:
    """A combination of unknowns that changes nothing that was measured, so large that its largest part is plausible.

    Attributes:
        words: a sentence for people.
        parts: its amount of each unknown by path, SI.
        tool: greatest distance over the poses by which it moves the tool in the base frame, m.
        inside: the same distance where base and target may be placed elsewhere: what another frame does not undo, m.
    """

    words: str
    parts: dict[str, float]
    tool: float
    inside: float


def unseen_of(observed: Observation, fit: Fit, sizes: Array) -> list[Unseen]:
    """Name the combinations that a fit does not see.

    Args:
        observed: the measurements beside the model.
        fit: the fit to them.
        sizes: plausible size of each unknown, SI [unknowns].
    """
    basis = fit.unseen_combinations
    if not basis.shape[1]:
        return []
    named: list[Array] = []
    with_words: list[tuple[str, Array]] = []
    for words, candidate in _common_combinations(observed, sizes, basis):
        unseen = basis @ (basis.T @ candidate)
        if np.linalg.norm(candidate - unseen) < SEEN_SHARE * np.linalg.norm(candidate) and _is_new(unseen, named):
            named.append(unseen)
            with_words.append((words, candidate))
    unnamed = basis - _projection(basis, named)
    # Strengths are near 1, or near 0 where a direction is a mix of named ones.
    directions, strengths, _ = np.linalg.svd(unnamed, full_matrices=False)
    with_words += [(_sentence(other, observed), other) for other in sparse(directions[:, strengths > 0.5]).T]
    twists = observed.twists(observed.model.rates(values=observed.errors(fit.values)))
    return [_unseen_combination(words, each, observed, twists, sizes) for words, each in with_words]


def _is_new(combination: Array, named: list[Array]) -> bool:
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
    """Combinations with the same span, each of which is 1 at one unknown where all others are 0 [unknowns x k].

    These are the unknowns that take most part in the span. Of several that do so alike, such as those of equal legs,
    the first is taken, so that round-off decides nothing.

    Args:
        combinations: combinations as columns [unknowns x k].
    """
    remaining, unknowns = combinations.copy(), []
    for _ in range(combinations.shape[1]):
        parts = np.linalg.norm(remaining, axis=1)
        unknowns.append(int(np.argmax(parts > (1.0 - SAME_SHARE) * parts.max())))
        direction = remaining[unknowns[-1]] / parts[unknowns[-1]]
        remaining = remaining - np.outer(remaining @ direction, direction)
    return np.asarray(combinations @ np.linalg.inv(combinations[unknowns]))


def _common_combinations(observed: Observation, sizes: Array, basis: Array) -> Iterator[tuple[str, Array]]:
    """Common motions, alone and with what may hide them, each with a sentence that holds if it is not seen.

    Args:
        observed: the measurements beside the model.
        sizes: plausible size of each unknown, SI [unknowns].
        basis: the combinations that are not seen, as columns [unknowns x k].
    """
    base, platform = (_common_motions(observed, sizes, at_end=end) for end in (False, True))
    frame, target = _place_motions(observed, sizes, FRAME_UNKNOWNS), _place_motions(observed, sizes, TARGET_UNKNOWNS)
    for number, (motion, preposition, axis) in enumerate(COMMON_MOTIONS):
        of_base = f"A common {motion} of all base joints {preposition} {axis}"
        of_platform = f"A common {motion} of all platform joints {preposition} {axis}"
        for motions, name, places, place in (
            (base, of_base, frame, "the measuring frame"),
            (platform, of_platform, target, "the target on the platform"),
        ):
            if number in motions:
                yield f"{name} changes nothing that was measured.", motions[number]
                words = f"{name} cannot be told from another place of {place}."
                yield words, _hidden_by(motions[number], [*places.values()], basis)
        if number in base and platform:
            others = [*platform.values(), *frame.values(), *target.values()]
            yield f"{of_base} cannot be told from one of all platform joints.", _hidden_by(base[number], others, basis)
        if number in frame:
            of_frame = f"A {motion} of the measuring frame {preposition} {axis}"
            words = f"{of_frame} cannot be told from another place of the target."
            yield words, _hidden_by(frame[number], [*target.values()], basis)


def _hidden_by(combination: Array, others: Sequence[Array], basis: Array) -> Array:
    """A combination less those amounts of others that leave the least of it to be seen [unknowns]."""
    if not others:
        return combination
    columns = np.stack(others, axis=1)
    seen, seen_columns = (each - basis @ (basis.T @ each) for each in (combination, columns))
    amounts, *_ = np.linalg.lstsq(seen_columns, seen, rcond=HIDDEN_BY_OTHERS)
    return np.asarray(combination - columns @ amounts)


def _common_motions(observed: Observation, sizes: Array, at_end: bool) -> dict[int, Array]:
    """Combinations that move all base joints together, by the number of the motion; at the end, all platform joints.

    Base joints turn about the origin of the base, platform joints about the tool point. A motion is left out if the
    unknowns of some leg cannot make it.
    """
    motions = {}
    centre = observed.model.rows.point if at_end else np.zeros(3)
    for number, unit in enumerate(np.eye(6)):
        twist = unit + np.concatenate([np.zeros(3), np.cross(centre, unit[:3])])
        # A leg whose end moves with the platform does as one whose beginning moves the other way.
        twist = -twist if at_end else twist
        by_leg = [_values_of_leg(observed, leg, twist, at_end) for leg in range(len(observed.model.rows.legs))]
        feasible = [values for values in by_leg if values is not None]
        together = sum(feasible, np.zeros(len(sizes)))
        if together.any() and len(feasible) == len(by_leg):
            motions[number] = together / sizes
    return motions


def _values_of_leg(observed: Observation, leg: int, twist: Array, at_end: bool) -> Array | None:
    """Values of the unknowns that do what a motion of the beginning or the end of a leg does, SI [unknowns].

    They are found by the effects on the platform with actuators held, at random coordinates of the leg.

    Args:
        observed: the measurements beside the model.
        leg: number of the leg.
        twist: twist of the motion, base frame [6].
        at_end: whether the end of the leg moves, at the platform.

    Returns:
        The values, zero if the leg does not notice the motion; None if its unknowns cannot make it.
    """
    rows, sources = observed.model.rows, observed.model.sources
    row, values = rows.legs[leg], np.zeros(len(observed.error_numbers))
    coordinates = random_coordinates(row, rows.length)
    motion = Insertion(leg, len(row.twists) if at_end else 0, twist)
    effect = effects(row, rows, [[motion]], coordinates)[:, 0]
    if np.abs(effect).max(initial=0.0) < SEEN_BY_LEG / rows.length:
        return values
    # Compliances have numbers behind those of the sources; ties, the frame and the target have -1.
    numbers = {n: number for n, number in enumerate(observed.error_numbers) if 0 <= number < len(sources)}
    insertions = {n: sources[number].insertions for n, number in numbers.items()}
    of_leg = {n: group for n, group in insertions.items() if {insertion.leg for insertion in group} == {leg}}
    if not of_leg:
        return None
    columns = effects(row, rows, [*of_leg.values()], coordinates)
    scale = np.linalg.norm(columns, axis=0)
    amounts, *_ = np.linalg.lstsq(columns / scale, effect, rcond=SEEN_BY_LEG)
    if np.linalg.norm(columns / scale @ amounts - effect) > SAME_EFFECT * np.linalg.norm(effect):
        return None
    values[[*of_leg]] = amounts / scale
    return values


def _place_motions(observed: Observation, sizes: Array, paths: tuple[str, ...]) -> dict[int, Array]:
    """Combinations that move the measuring frame or the target alone, by the number of the motion."""
    units = np.diag(1.0 / sizes)
    columns = {unknown.path: units[n] for n, unknown in enumerate(observed.unknowns)}
    return {number: columns[path] for number, path in enumerate(paths) if path in columns}


def _sentence(combination: Array, observed: Observation) -> str:
    """Name the largest parts of a combination."""
    shares = combination / np.abs(combination).max()
    largest_first = [int(i) for i in np.argsort(-np.abs(combination)) if abs(shares[i]) > LEAST_NAMED_PART]
    if len(largest_first) == 1:
        return f"The {observed.unknowns[largest_first[0]].words} changes nothing that was measured."
    parts = [f"{shares[i]:+.2g} × {observed.unknowns[i].words}" for i in largest_first[:MOST_NAMED_PARTS]]
    others = len(largest_first) - MOST_NAMED_PARTS
    more = f" and {others} more" if others > 0 else ""
    return f"Only other combinations than this one are seen: {', '.join(parts)}{more}."


def _unseen_combination(words: str, combination: Array, observed: Observation, twists: Array, sizes: Array) -> Unseen:
    """Describe a combination, scaled so that its largest part is a plausible size.

    Args:
        words: its sentence.
        combination: its amounts in plausible sizes [unknowns].
        observed: the measurements beside the model.
        twists: twists of the tool per unit of each unknown, base axes [n x 6 x unknowns].
        sizes: plausible size of each unknown, SI [unknowns].
    """
    values = combination / np.abs(combination).max() * sizes
    least = NO_PART * np.abs(values).max()
    parts = {u.path: float(v) for u, v in zip(observed.unknowns, values, strict=True) if abs(v) > least}
    motions = twists @ values
    remaining = motions - _made_by_frames(motions, observed)
    tool, inside = (float(np.linalg.norm(each[:, 3:], axis=1).max()) for each in (motions, remaining))
    return Unseen(words=words, parts=parts, tool=tool, inside=inside if inside > ROUND_OFF_OF_MOTION * tool else 0.0)


def _made_by_frames(motions: Array, observed: Observation) -> Array:
    """The part of small motions of the tool that motions of the base and of the target can make [n x 6]."""
    count, tool = len(motions), observed.model.drawn.tool
    no_motion = np.zeros((count, 3))
    axes = [(np.broadcast_to(axis, (count, 3)), observed.model.drawn.axes @ axis) for axis in np.eye(3)]
    shifts = [parts for of_base, of_target in axes for parts in ([no_motion, of_base], [no_motion, of_target])]
    turns = [
        parts for of_base, of_target in axes for parts in ([of_base, cross(of_base, tool)], [of_target, no_motion])
    ]
    units = np.tile([observed.model.length] * 3 + [1.0] * 3, count)
    matrix = np.stack([np.concatenate(parts, axis=1).ravel() for parts in shifts + turns], axis=1) * units[:, None]
    amounts = np.linalg.lstsq(matrix, motions.ravel() * units, rcond=SAME_AS_FRAMES)[0]
    return np.asarray((matrix @ amounts / units).reshape(count, 6))
