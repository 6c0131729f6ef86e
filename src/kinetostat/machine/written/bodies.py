"""Whether the joints of each leg lead from the base to the platform, body by body, and what to do where they do not.

Names of bodies other than base and platform are known within their leg only. The same name elsewhere may be a slip or a
body that two legs share, which cannot be written: messages then say so, and never advise what would be another machine.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from kinetostat.machine.written.plan import BASE, PLATFORM, JointPlan
from kinetostat.spec.errors import InputError

SHARED = (
    "A body that carries two legs cannot be written: each leg leads from the base to the platform by joints and bodies "
    "of its own. Two equal parallel bars on one body are one leg with a parallelogram; other branches are not possible"
)


def check_chain(leg: str, joints: tuple[JointPlan, ...], legs: Mapping[str, Any], where: str) -> None:
    """Refuse joints that do not lead from the base to the platform.

    Args:
        leg: name of the leg.
        joints: of it.
        legs: all legs as written, by name, with everything in them by name.
        where: names file and leg in messages.

    Raises:
        InputError: with the joint, what cannot be written, and what to write instead.
    """
    at, seen = BASE, {BASE}
    for i, joint in enumerate(joints):
        near, far = joint.joins
        here = f'{where}, joint "{joint.name}"'
        if near != at:
            before = f'joint "{joints[i - 1].name}" ends at "{at}"' if i else 'a leg starts at "base"'
            raise InputError(
                f'{here} starts at "{near}", but {before}: the chain is disconnected. '
                + (_branching(near) if near in seen else _elsewhere(near, leg, legs, at, f'["{at}", "{far}"]'))
            )
        if far in seen or (far == PLATFORM and i < len(joints) - 1):
            raise InputError(
                f'{here} leads to "{far}" too early; a leg passes each body once and ends at the platform. Of loops '
                "within a leg only a parallelogram can be written, which is one joint."
            )
        at, seen = far, {*seen, far}
    if at != PLATFORM:
        raise InputError(
            f'{where} does not reach the platform: its last joint "{joints[-1].name}" ends at "{at}". '
            + _elsewhere(at, leg, legs, PLATFORM, f'["{joints[-1].joins[0]}", "platform"]')
            + " The platform is one body: one whose parts move against each other cannot be written."
        )


def _elsewhere(body: str, leg: str, legs: Mapping[str, Any], expected: str, joins: str) -> str:
    """Advice about a body that stands in the place of another one."""
    owner = next((other for other in legs if other != leg and body in _bodies(legs[other])), None)
    between = f'"{body}" and "{expected}"' if expected == PLATFORM else f'"{expected}" and "{body}"'
    missing = f'If leg "{leg}" has a "{body}" of its own, add the joints between {between}.'
    if owner is not None:
        return f'"{body}" is a body of leg "{owner}". {SHARED}. {missing}'
    return f'If "{body}" is a slip for "{expected}", write joins = {joins}; otherwise add the joints between {between}.'


def _branching(body: str) -> str:
    return f'The leg has left "{body}" already, and a leg does not branch. {SHARED}.'


def _bodies(leg: Mapping[str, Any]) -> Iterable[object]:
    """The bodies of a leg as written, without base and platform."""
    lists = [part.get("joins") for part in leg.values() if isinstance(part, dict)]
    return [body for row in lists if isinstance(row, list) for body in row if body not in (BASE, PLATFORM)]
