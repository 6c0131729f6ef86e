"""Commands about machines under load: `analyze --loaded` and `command`. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    NO_ANSWER,
    add_command,
    give,
    load_machine,
    progress_bar,
    takes_json,
    takes_machine,
    verdicts_of,
    write_figures,
)

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.machine.machine import Machine
    from kinetostat.studies.under_load import LoadedState


def analyze_loaded(options: argparse.Namespace, machine: "Machine") -> int:
    """Answer `analyze` about the machine under its loads and return the exit code.

    Raises:
        InputError: options that only the unloaded machine has.
    """
    from kinetostat.equilibrium.solving import Rest
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
        _drawn(options, state),
        message=state.message,
    )
    kept = state.rest is not Rest.JOINT_LIMIT and all(verdict.met for verdict in verdicts)
    return code if kept else NO_ANSWER


def _drawn(options: argparse.Namespace, state: "LoadedState") -> list[Path]:
    """Write the figures of a loaded machine, if a folder is given and it is at rest."""
    if not options.output:
        return []
    from kinetostat.views.loaded_figures import loaded_figures

    return write_figures(options, {name.replace(" ", "-"): draw for name, draw in loaded_figures(state).items()})


def add_command_command(commands: "Commands") -> None:
    """Add `command`."""
    command = add_command(
        commands, "command", _command, "compute where actuators must stand to bring a loaded tool to its pose",
        "kinetostat command hexapod --set 'load.gravity=[0, 0, \"-9.81 m/s**2\"]' --set tool.mass=\"20 kg\" "
        '--over "gravity_angle=0 deg:90 deg:7" -o corrections.csv',
    )  # fmt: skip
    takes_machine(command)
    command.add_argument(
        "poses", metavar="POSES", type=Path, nargs="?",
        help="a CSV file of wanted poses, as `path` takes it (default: the pose of the machine)",
    )  # fmt: skip
    command.add_argument(
        "--over", metavar="FIELD=from:to:count", action="append", default=[], dest="ranges",
        help="an axis of a table of corrections: a coordinate of the pose, gravity_angle, or any other field, as `map` "
        "takes it; repeatable",
    )  # fmt: skip
    command.add_argument(
        "--tolerance", metavar="LENGTH",
        help='error at the tool that the law of the corrections may have, e.g. "0.1 um" (default: a thousandth of the '
        "error without corrections)",
    )  # fmt: skip
    command.add_argument(
        "--fit", metavar="FOLDER", type=Path,
        help="folder of `identify -o` in which MACHINE lies: coordinates are then those that the controller counts, "
        "with the zeros and gains that were found",
    )  # fmt: skip
    command.add_argument(
        "-o", "--output", metavar="FILE", type=Path, help="write the commands, and the corrections of a table, as CSV"
    )
    takes_json(command)


def _command(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import InputError, choice
    from kinetostat.studies.commanding import as_csv, as_json, command
    from kinetostat.studies.storage import write_text
    from kinetostat.views.loaded_tables import print_command

    written = [] if options.output is None else [options.output]
    for path in written:
        choice(path.suffix.lower(), (".csv",), f'the suffix of "{path}"')
    if options.ranges:
        if options.fit is not None:
            raise InputError("--fit is about commands at poses; leave out --over, and give a file of poses.")
        return _corrections(options, written)
    if options.tolerance is not None:
        raise InputError("--tolerance is about the law of a table of corrections; give its axes with --over.")
    answer = command(load_machine(options), options.poses, options.fit)
    for path in written:
        write_text(path, as_csv(answer))
    return give(
        options, bool(answer.settled.any()), lambda: as_json(answer), lambda c: print_command(c, answer), written
    )


def _corrections(options: argparse.Namespace, written: list[Path]) -> int:
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.commanding import as_csv
    from kinetostat.studies.corrections import as_json, correction_table
    from kinetostat.studies.storage import write_text
    from kinetostat.views.correction_tables import print_corrections

    if options.poses is not None:
        raise InputError("the poses come from a file or from --over, not from both; leave one of them out.")
    with progress_bar("computing") as progress:
        table = correction_table(load_machine(options), options.ranges, options.tolerance, progress)
    for path in written:
        write_text(path, as_csv(table.command, corrections=True))
    return give(options, True, lambda: as_json(table), lambda console: print_corrections(console, table), written)
