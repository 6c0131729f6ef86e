"""Attribution: how much each spring contributes to the stiffness and the compliance of the platform at one pose.

The formulas are in `kinetostatics.assembly`; tables and bars of the contributions are in `views` and `studio`.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Protocol, TypeAlias, TypeVar

import numpy as np

from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.assembly import Statics, compliance_shares, stiffness_shares
from kinetostat.kinetostatics.extremes import ROTATIONS, TRANSLATIONS
from kinetostat.kinetostatics.indices import PrincipalStiffness
from kinetostat.machine.leg import Spring
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.tolerances import EQUAL_STIFFNESSES

DECIMALS_OF_SHARES = 9
"""Decimals in which shares are compared: equal parts differ by round-off alone, and keep their order."""
MOST_NAMED = 3
"""Parts that are named as those that contribute most: a sentence with more is no longer read."""
LEAST_NAMED_SHARE = 0.05
"""Share from which a part is named: to stiffen a lesser one gains next to nothing."""
LEAST_SHARE_TOGETHER = 0.6
"""Share that the named parts must have together, well more than half; otherwise kinds of parts are named."""

Key = TypeVar("Key")
Shares: TypeAlias = tuple[tuple[str, float], ...]
"""Names of parts and their shares, the greatest share first."""


@former_names(name="spring", compliance="compliance_share")
@dataclass(frozen=True, eq=False)
class Contribution(ImmutableAnswer):
    """The contribution of one spring to the diagonal entries of C and K.

    Attributes:
        spring: name of the spring.
        part: the joint or link that it stands for.
        stiffness: its stiffness, N/m or N·m/rad; infinity if rigid.
        compliance_share: its share of each diagonal entry of C, 0 to 1, or NaN where the entry is zero or infinite [n].
        stiffness_share: its share of each diagonal entry of K, likewise [n].
    """

    spring: str
    part: str
    stiffness: float
    compliance_share: Array
    stiffness_share: Array


def contributions(
    springs: Sequence[Spring], statics: Statics, stiffness: Symmetric6, compliance: Symmetric6, kept: tuple[int, ...]
) -> tuple[Contribution, ...]:
    """Compute what each spring contributes to K and C.

    Args:
        springs: all springs of the machine, in the order of the statics.
        statics: the statics by which they share loads, in the axes of K and C.
        stiffness, compliance: K and C.
        kept: the components that the machine has, as indices into rx ry rz x y z.
    """
    parts = zip(springs, compliance_shares(statics), stiffness_shares(statics), strict=True)
    return tuple(
        Contribution(
            spring=spring.name,
            part=spring.part or spring.name,
            stiffness=spring.stiffness,
            compliance_share=_ratios(of_compliance, compliance, kept),
            stiffness_share=_ratios(of_stiffness, stiffness, kept),
        )
        for spring, of_compliance, of_stiffness in parts
    )


def _ratios(part: Symmetric6, whole: Symmetric6, kept: tuple[int, ...]) -> Array:
    """Shares of a part in the diagonal of the whole, in those components that the machine has [n]."""
    pairs = [(part.entry(i, i), whole.entry(i, i)) for i in kept]
    return np.array([float(share / entry) if 0.0 < entry < math.inf else math.nan for share, entry in pairs])


def by_part(attribution: Sequence[Contribution]) -> dict[str, list[Contribution]]:
    """Group the contributions of springs by the joint or link that they stand for."""
    parts: dict[str, list[Contribution]] = {}
    for contribution in attribution:
        parts.setdefault(contribution.part, []).append(contribution)
    return parts


class WithGreatest(Protocol):
    """An effect on several directions or indices."""

    @property
    def greatest(self) -> float:
        """Size of the greatest of them."""


Effect = TypeVar("Effect", bound=WithGreatest)


@dataclass(frozen=True, eq=False)
class Softest(ImmutableAnswer):
    """The direction in which a force, or a moment, meets the least stiffness, and what makes it soft.

    Attributes:
        stiffness: the least stiffness, N/m or N·m/rad, with all other motions free; 0 where nothing resists.
        directions: unit vectors that span all directions with this stiffness, axes of K and C [1 to 3 x 3].
        shares: each part and its share of the compliance there, the greatest share first; empty where stiffness is 0.
        kinds: the same for all parts of one kind together, such as "actuator ×6".
    """

    stiffness: float
    directions: Array
    shares: Shares
    kinds: Shares = ()


def softest(block: PrincipalStiffness, name: str, springs: Sequence[Spring], statics: Statics) -> Softest | None:
    """Attribute the compliance in the softest direction of a block of C to the parts of the machine.

    Where several directions are equally soft, the shares are those of their sum, which does not depend on the choice
    of directions among them.

    Args:
        block: principal stiffnesses, with the motions of the other block free.
        name: "rotation" or "translation".
        springs, statics: as for `contributions`.

    Returns:
        None where the whole block is rigid.
    """
    least = float(block.stiffnesses[0])
    if math.isinf(least):
        return None
    pairs = zip(block.stiffnesses, block.directions, strict=True)
    directions = np.array([unit for k, unit in pairs if math.isclose(k, least, rel_tol=EQUAL_STIFFNESSES)])
    if least == 0.0:
        return Softest(least, directions, ())
    rows = ROTATIONS if name == "rotation" else TRANSLATIONS
    amounts: dict[str, float] = {}
    for spring, share in zip(springs, compliance_shares(statics), strict=True):
        entries = [(float(share.entry(i, j)), i % 3, j % 3) for i in rows for j in rows]
        if not all(math.isfinite(entry) for entry, _, _ in entries):
            return Softest(0.0, directions, ())  # a free spring lets it go: what round-off has left is no stiffness
        amount = sum(entry * unit[i] * unit[j] for unit in directions for entry, i, j in entries)
        # The compliance in each of these directions is 1 / least, so this is the spring's share of their sum.
        amounts[spring.name] = amount * least / len(directions)
    return Softest(least, directions, *parts_and_kinds(springs, amounts))


def parts_and_kinds(springs: Sequence[Spring], shares: Mapping[str, float]) -> tuple[Shares, Shares]:
    """Add up shares of springs by part, and by kind of part, such as "actuator ×6".

    Args:
        springs: the machine's springs.
        shares: shares by the name of a spring; a name that is not a spring's is a part and a kind of its own.
    """
    parts: dict[str, float] = {}
    kinds: dict[str, dict[str, float]] = {}
    springs_by_name = {spring.name: spring for spring in springs}
    for name, share in shares.items():
        spring = springs_by_name.get(name)
        part, kind = (name, name) if spring is None else (spring.part_name, spring.kind)
        parts[part] = parts.get(part, 0.0) + share
        kinds.setdefault(kind, {})[part] = 0.0
    together = {
        f"{kind} ×{len(members)}" if len(members) > 1 else next(iter(members)): sum(parts[part] for part in members)
        for kind, members in kinds.items()
    }
    return ranking_of(parts), ranking_of(together)


def ranking_of(shares: Mapping[Key, float]) -> tuple[tuple[Key, float], ...]:
    """Sort shares, the greatest first; those that are equal but for round-off keep their order."""
    return tuple(sorted(shares.items(), key=lambda item: -round(item[1], DECIMALS_OF_SHARES)))


def strongest_first(effects: Sequence[Effect]) -> list[Effect]:
    """Sort effects by the size of the greatest of each; those that are equal but for round-off keep their order."""
    return [effects[place] for place, _ in ranking_of({place: item.greatest for place, item in enumerate(effects)})]


def largest_contributors(parts: Shares, kinds: Shares) -> str:
    """Name the parts that contribute most, in percent; where many parts share, the kinds of parts.

    Args:
        parts: each part and its share.
        kinds: the same for all parts of one kind together.

    Returns:
        Nothing where no share is large enough to be named.
    """
    shares = parts if sum(share for _, share in parts[:MOST_NAMED]) >= LEAST_SHARE_TOGETHER else kinds
    named = [(name, 100.0 * share) for name, share in shares[:MOST_NAMED] if share >= LEAST_NAMED_SHARE]
    return ", ".join(f"{name} {percent:.0f}\N{NO-BREAK SPACE}%" for name, percent in named)
