"""The command `forward`: from actuator coordinates to the poses of a machine. No formula lives here."""

import argparse
from typing import TYPE_CHECKING

from kinetostat.commands.common import add_command, give, load_machine, takes_json, takes_machine

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands


def add_forward_command(commands: "Commands") -> None:
    """Add `forward`."""
    command = add_command(
        commands, "forward", _forward, "compute the poses that actuator coordinates give",
        'kinetostat forward hexapod --actuators "leg 1=96 mm, leg 2=95 mm"',
    )  # fmt: skip
    takes_machine(command)
    command.add_argument(
        "--actuators", metavar="NAME=VALUE,...", action="append", default=[],
        help="coordinates by actuator or leg; those not given stay as at the pose; repeatable",
    )  # fmt: skip
    command.add_argument("--starts", type=int, default=100, help="starts of the search (default: 100)")
    command.add_argument(
        "--spread", type=float, default=1.0,
        help="how far from the pose they lie, rad and in units of the machine's length (default: 1)",
    )  # fmt: skip
    takes_json(command)


def _forward(options: argparse.Namespace) -> int:
    from kinetostat.studies.assembly import as_json, forward
    from kinetostat.views.assembly_tables import print_forward

    given = _given(options.actuators)
    answer = forward(load_machine(options), given, options.starts, options.spread)
    return give(
        options,
        bool(answer.poses),
        lambda: as_json(answer),
        lambda console: print_forward(console, answer),
        message=answer.message,
    )


def _given(texts: list[str]) -> dict[str, str]:
    from kinetostat.spec.errors import InputError, shorten

    given: dict[str, str] = {}
    for entry in (entry for text in texts for entry in text.split(",")):
        name, equals, value = (part.strip() for part in entry.partition("="))
        if not equals or not name:
            raise InputError(f'--actuators {shorten(entry)} must be name=value, e.g. --actuators "leg 1=31 cm".')
        if name in given:
            raise InputError(f'--actuators gives "{name}" twice; leave one of its coordinates out.')
        given[name] = value
    return given
