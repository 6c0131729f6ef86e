"""`doctor`: whether this installation is sound, and what to do where it is not. No formula lives here.

Checks are printed as they are made, by Rich alone: the tables of `views` need libraries that may be broken here.
Imports are inside of the functions, so that a broken library fails its own check and not the command.
"""

import argparse
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from kinetostat.commands.common import DONE, NO_ANSWER, add_command, print_json, takes_json

if TYPE_CHECKING:
    from rich.console import Console

    from kinetostat.commands.common import Commands
    from kinetostat.studies.diagnosis import InstallationCheck

KNOWN_MACHINE = "zhang-gosselin-4dof"
"""The paper's machine, whose picture is drawn to see whether drawing works."""
SOUNDNESS_MARKS = {"sound": ("✓", "green"), "absent": ("–", "bright_black"), "failed": ("✗", "bold red")}
"""Mark and style of a check by its state."""
NAME_WIDTH = 14
"""Characters for the name of what is checked: most have fewer, and a longer one ends in an ellipsis."""


def add_doctor_command(commands: "Commands") -> None:
    """Add `doctor`."""
    command = add_command(
        commands, "doctor", _doctor, "check the installation: versions, extras, processor, known numbers",
        "kinetostat doctor --json",
    )  # fmt: skip
    takes_json(command)


def _doctor(options: argparse.Namespace) -> int:
    from kinetostat.studies.diagnosis import as_json, healthy

    if options.json:
        checks = [*_checks()]
        print_json(as_json(checks))
    else:
        from rich.console import Console

        checks = print_checks(Console(markup=False, emoji=False), _checks())
    return DONE if healthy(checks) else NO_ANSWER


def _checks() -> "Iterator[InstallationCheck]":
    """Make all checks: packages and extras, the computer, known numbers computed again, pictures and folders."""
    from kinetostat.studies.diagnosis import (
        InstallationCheck,
        Soundness,
        check_of,
        diagnose,
        machine_checks,
        reinstall,
        software_checks,
    )

    yield from diagnose({"software": software_checks, "machine": machine_checks, "self-test": _known_numbers})
    yield check_of("self-test", "pictures", _picture_size, reinstall("matplotlib"))
    yield check_of("places", "cache", _program_folder, "chmod 700 the folder, if it is yours")
    yield InstallationCheck("places", "configuration", Soundness.ABSENT, "none: files and options say everything")
    yield check_of("places", "studio", _state_folder, reinstall("kinetostat"))


def _known_numbers() -> "Iterator[InstallationCheck]":
    """Return the self-test, whose module needs every library: where one is broken, it does not load."""
    from kinetostat.studies.self_test import checks

    yield from checks()


def _program_folder() -> str:
    from kinetostat.engine.program_files import SharedFolderError, disk_usage, usual_folder
    from kinetostat.studies.diagnosis import UnsoundError

    folder = usual_folder()
    if folder is None:
        return "none: compiled programs live in memory only"
    try:
        size = disk_usage()
    except SharedFolderError as error:
        raise UnsoundError(str(error)) from None
    except FileNotFoundError:
        return f"{folder}: compiled programs (none yet)"
    return f"{folder}: {size / 1e6:.1f} MB of compiled programs"


def _state_folder() -> str:
    from kinetostat.studio.design.state_folder import usual_state

    folder = usual_state()
    return f"{folder}: searches and favourites of the design tab{'' if folder.is_dir() else ' (none yet)'}"


def _picture_size() -> str:
    """Draw the paper's machine, and return the size of the picture."""
    from io import BytesIO

    from kinetostat.machine.loading import load
    from kinetostat.views.drawing import three_views

    stream = BytesIO()
    machine = load(KNOWN_MACHINE)
    three_views(machine, machine.name).savefig(stream)
    return f"the paper's machine drawn, {stream.tell() / 1000:.0f} kB"


def print_checks(console: "Console", checks: "Iterable[InstallationCheck]") -> "list[InstallationCheck]":
    """Print checks under their headings, with what to do about failures, then the verdict; returns the checks."""
    from rich.table import Table
    from rich.text import Text

    printed: list[InstallationCheck] = []
    for check in checks:
        if not printed or printed[-1].group != check.group:
            console.print(Text(("\n" if printed else "") + check.group.capitalize(), "bold"))
        printed.append(check)
        mark, style = SOUNDNESS_MARKS[check.state]
        line = Table.grid(padding=(0, 2, 0, 0))
        for width in (1, NAME_WIDTH, None):
            line.add_column(width=width, overflow="fold" if width is None else "ellipsis")
        line.add_row(Text(mark, style), check.name, Text(check.detail, "" if check.is_sound else style))
        if check.fix:
            line.add_row("", "", Text(f"→ {check.fix}", "cyan"))
        console.print(line)
    failures = [check.name for check in printed if check.is_failed]
    if failures:
        console.print(Text.assemble(("\nTo repair:", "bold red"), f" {', '.join(failures)}."))
    else:
        sound = " Everything needed is installed; the self-test gives the known numbers."
        console.print(Text.assemble(("\nSound.", "bold green"), sound))
    return printed
