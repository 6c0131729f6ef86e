"""`sensitivity`: which parameters decide how stiff a machine is. No formula lives here."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import add_command, give, load_machine, takes_json, takes_machine, takes_quantities

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.sensitivity import Sensitivity


def add_sensitivity_command(commands: "Commands") -> None:
    """Add `sensitivity`."""
    command = add_command(
        commands, "sensitivity", _sensitivity, "rank the parameters by their effect on the stiffness at a pose",
        "kinetostat sensitivity zhang-gosselin-4dof --quantity compliance_z -o sensitivity",
    )  # fmt: skip
    takes_machine(command)
    takes_quantities(command, "compliance")
    command.add_argument("-o", "--output", type=Path, help="folder for the figure (PNG, SVG, PDF) and JSON")
    takes_json(command)


def _sensitivity(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.sensitivity import as_json, sensitivity

    answer = sensitivity(load_machine(options), options.quantities or ["compliance"])
    answered = answer.status is Status.OK
    written = _write(answer, options.output) if options.output and answered else []
    return give(options, answered, answer.message, lambda: as_json(answer), lambda: _show(answer, written))


def _show(answer: "Sensitivity", written: list[Path]) -> None:
    from kinetostat.views.grid_tables import print_written
    from kinetostat.views.sensitivity_tables import print_sensitivity
    from kinetostat.views.tables import terminal

    console = terminal()
    print_sensitivity(console, answer)
    print_written(console, written)


def _write(answer: "Sensitivity", folder: Path) -> list[Path]:
    from kinetostat.studies.sensitivity import as_json
    from kinetostat.studies.storage import write_text
    from kinetostat.views.figures import save
    from kinetostat.views.sensitivity_figure import sensitivity_figure

    written = [folder / "sensitivity.json"]
    write_text(written[0], json.dumps(as_json(answer), ensure_ascii=False, allow_nan=False, indent=1) + "\n")
    return written + (save(sensitivity_figure(answer), folder / "sensitivity") if answer.influences else [])
