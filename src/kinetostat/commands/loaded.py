"""Commands about machines under load: `analyze --loaded` and `command`. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    NO_ANSWER,
    add_command,
    give,
    load_machine,
    takes_json,
    takes_machine,
    verdicts_of,
)

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.machine.machine import Machine


def analyze_loaded(options: argparse.Namespace, machine: "Machine") -> int:
    """Answer `analyze` about the machine under its loads and return the exit code.

    Raises:
        InputError: options that only the unloaded machine has.
    """
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.under_load import as_json, under_load
    from kinetostat.views.loaded_tables import print_loaded

    if options.along or options.axes != "base":
        which = "--loaded" if options.loaded else 'state = "loaded" in [load]'
        raise InputError(
            f"{which} gives results in base axes only; leave --along and --axes out, or add --set load.state=free."
        )
    state, verdicts = under_load(machine), verdicts_of(machine)
    code = give(
        options,
        bool(state.displacement),
        lambda: as_json(state, verdicts),
        lambda console: print_loaded(console, state, verdicts),
        message=state.message,
    )
    return code if all(verdict.met for verdict in verdicts) else NO_ANSWER


def add_command_command(commands: "Commands") -> None:
    """Add `command`."""
    command = add_command(
        commands, "command", _command, "compute where actuators must stand to bring a loaded tool to its pose",
        "kinetostat command hexapod poses.csv --set 'load.force=[0, 0, \"-400 N\"]' -o commands.csv",
    )  # fmt: skip
    takes_machine(command)
    command.add_argument(
        "poses", metavar="POSES", type=Path, nargs="?",
        help="a CSV file of wanted poses, as `path` takes it (default: the pose of the machine)",
    )  # fmt: skip
    command.add_argument("-o", "--output", metavar="FILE", type=Path, help="write the commands as CSV")
    takes_json(command)


def _command(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import choice
    from kinetostat.studies.command import as_csv, as_json, command
    from kinetostat.studies.storage import write_text
    from kinetostat.views.loaded_tables import print_command

    written = [] if options.output is None else [options.output]
    for path in written:
        choice(path.suffix.lower(), (".csv",), f'the suffix of "{path}"')
    answer = command(load_machine(options), options.poses)
    for path in written:
        write_text(path, as_csv(answer))
    return give(
        options, bool(answer.settled.any()), lambda: as_json(answer), lambda c: print_command(c, answer), written
    )
