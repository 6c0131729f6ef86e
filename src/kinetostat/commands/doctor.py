"""`doctor`: whether this installation is sound, and what to do where it is not. No formula lives here."""

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING

from kinetostat.commands.common import DONE, NO_ANSWER, add_command, print_json, takes_json

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.diagnosis.diagnosis import Check


def add_doctor_command(commands: "Commands") -> None:
    """Add `doctor`."""
    command = add_command(
        commands, "doctor", _doctor, "check the installation: versions, extras, processor, known numbers",
        "kinetostat doctor --json",
    )  # fmt: skip
    takes_json(command)


def _doctor(options: argparse.Namespace) -> int:
    from kinetostat.studies.diagnosis.diagnosis import as_json, healthy

    if options.json:
        checks = [*_checks()]
        print_json(as_json(checks))
    else:
        from rich.console import Console

        from kinetostat.views.diagnosis_tables import print_checks, print_verdict

        console = Console(markup=False, emoji=False)
        checks = print_checks(console, _checks())
        print_verdict(console, checks)
    return DONE if healthy(checks) else NO_ANSWER


def _checks() -> "Iterator[Check]":
    """Make all checks, also those of pictures and the studio, which `studies.diagnosis` must not import."""
    from kinetostat.studies.diagnosis.diagnosis import Check, State, diagnose, reinstall, tried

    yield from diagnose()
    yield tried("self-test", "pictures", _drawn, reinstall("matplotlib"))
    yield Check("places", "cache", State.ABSENT, "none: compiled programs live in memory only")
    yield Check("places", "configuration", State.ABSENT, "none: files and options say everything")
    yield tried("places", "studio", _state_folder, reinstall("kinetostat"))


def _state_folder() -> str:
    from kinetostat.studio.design.state_folder import usual_state

    folder = usual_state()
    return f"{folder}: searches and favourites of the design tab{'' if folder.is_dir() else ' (none yet)'}"


def _drawn() -> str:
    """The paper's machine as a picture."""
    from io import BytesIO

    from kinetostat.machine.loading import load
    from kinetostat.views.drawing import three_views

    stream = BytesIO()
    machine = load("zhang-gosselin-4dof")
    three_views(machine, machine.name).savefig(stream)
    return f"the paper's machine drawn, {stream.tell() / 1000:.0f} kB"
