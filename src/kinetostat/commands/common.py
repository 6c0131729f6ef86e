"""What commands share: exit codes, common options, how machines are read and answers printed. Knows no command."""

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeAlias

    from kinetostat.machine.machine import Machine

    Commands: TypeAlias = argparse._SubParsersAction["Parser"]

DONE, NO_ANSWER, BAD_INPUT, STOPPED = 0, 1, 2, 130
"""Exit codes; the last is that of shells for what Ctrl-C has ended."""

QUANTITIES = (
    "compliance, stiffness or free_stiffness (all entries of the diagonal; the free stiffness is 1/C_ii, which a tool "
    "feels; default: {default}); a single entry such as compliance_rx, stiffness_x_z, free_stiffness_z; "
    "least_translational_stiffness, greatest_translational_stiffness, least_rotational_stiffness, "
    "greatest_rotational_stiffness, frobenius_condition (of K), singularity_margin (0: singular, 1: best), "
    "aspect (1 or -1; the sign changes at singularities), shortest_leg, longest_leg, actuator_force, "
    "actuator_moment (the greatest under [load]), mass (of all moving parts); repeatable"
)
"""Of what sweeps, maps and sensitivities are."""
MACHINE = "a machine file, or the name of a bundled machine (see `kinetostat list`)"


class Parser(argparse.ArgumentParser):
    """An argument parser that reports mistakes in one readable paragraph."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is, exit code 2."""
        self.exit(BAD_INPUT, f"{self.prog}: {message}. Help: {self.prog} --help\n")


def add_command(commands: "Commands", name: str, run: object, text: str, example: str) -> Parser:
    """Add a command: its name, the function that runs it, one line about it, and an example."""
    command = commands.add_parser(
        name,
        help=text,
        description=f"{text[0].upper()}{text[1:]}.",
        epilog=f"example:\n  {example}\n",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.set_defaults(run=run)
    return command


def takes_machine(command: Parser, what: str = MACHINE) -> None:
    """Give a command the machine and `--set`."""
    command.add_argument("machine", metavar="MACHINE", help=what)
    command.add_argument(
        "--set", metavar="PATH=VALUE", action="append", default=[], dest="settings",
        help='override a field, e.g. --set geometry.base_radius="26 cm"; repeatable',
    )  # fmt: skip


def takes_quantities(command: Parser, default: str) -> None:
    """Give a command `--quantity`."""
    command.add_argument(
        "--quantity", metavar="NAME", action="append", dest="quantities", help=QUANTITIES.format(default=default)
    )


def takes_json(command: Parser) -> None:
    """Give a command `--json`."""
    command.add_argument("--json", action="store_true", help="print the result as JSON and nothing else")


def load_machine(options: argparse.Namespace, more: "Sequence[str]" = ()) -> "Machine":
    """The machine that the options name, with their overrides and then more of them.

    Raises:
        InputError: no such machine, or a mistake in the file or an override.
    """
    from kinetostat.machine.loading import STUDY, bundled, load
    from kinetostat.spec.document import exists
    from kinetostat.spec.errors import InputError

    if options.machine not in bundled() and not exists(Path(options.machine)):
        from kinetostat.studies.bundled import bundled_studies

        if options.machine in bundled_studies():
            raise InputError(f'"{options.machine}" {STUDY}')
    return load(options.machine, [*options.settings, *more])


def print_json(data: object) -> None:
    """Print plain data."""
    print(json.dumps(data, ensure_ascii=False, allow_nan=False, indent=1))


def give(
    options: argparse.Namespace,
    answered: bool,
    message: str,
    as_data: "Callable[[], object]",
    show: "Callable[[], None]",
) -> int:
    """Give an answer, as data with `--json`, else as `show` prints it, or why there is none; returns the exit code."""
    if options.json:
        print_json(as_data())
        return DONE if answered else NO_ANSWER
    if not answered:
        return no_answer(message)
    show()
    return DONE


def no_answer(message: str) -> int:
    """Say why there is no answer; returns the exit code."""
    print(f"kinetostat: {message}", file=sys.stderr)
    return NO_ANSWER


def stopped(message: str) -> int:
    """Say what remains of a command that was stopped; returns the exit code."""
    print(f"\nkinetostat: stopped; {message}", file=sys.stderr)
    return STOPPED
