"""`guidelines`: what a design depends on, in sentences, tables and figures. No formula lives here."""

import argparse
import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import add_command, give, load_machine, takes_json, takes_machine

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.guidelines.guidelines import Guidelines

STEM = "guidelines"


def add_guidelines_command(commands: "Commands") -> None:
    """Add `guidelines`."""
    command = add_command(
        commands, "guidelines", _guidelines, "show what stiffness depends on, what counts as rigid, what to change",
        'kinetostat guidelines zhang-gosselin-4dof --over "x=-2 cm:2 cm:11" --over "z=66 cm:70 cm:11" -o out',
    )  # fmt: skip
    takes_machine(command)
    command.add_argument(
        "--over", metavar="FIELD=from:to:count", action="append", default=[], dest="ranges",
        help="a coordinate of the pose and its range: count at how many poses the guidelines hold; repeatable",
    )  # fmt: skip
    command.add_argument(
        "--full", action="store_true", help="show every parameter, and sentences about the most important ones"
    )
    command.add_argument("-o", "--output", type=Path, help="folder for the figures (PNG, SVG, PDF) and JSON")
    takes_json(command)


def _guidelines(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.guidelines.guidelines import guidelines
    from kinetostat.studies.guidelines.sentences import as_json
    from kinetostat.views.progress import progress_bar

    machine = load_machine(options)
    with progress_bar("computing") as progress:
        found = guidelines(machine, options.ranges, progress)
    answered = found.status is Status.OK
    written = _write(found, options.output) if options.output and answered else []
    shown = partial(_show, found, options.full, written)
    return give(options, answered, found.message, lambda: as_json(found), shown)


def _show(found: "Guidelines", full: bool, written: list[Path]) -> None:
    from kinetostat.views.grid_tables import print_written
    from kinetostat.views.guideline_tables import print_guidelines
    from kinetostat.views.tables import terminal

    console = terminal()
    print_guidelines(console, found, full)
    print_written(console, written)


def _write(found: "Guidelines", folder: Path) -> list[Path]:
    from kinetostat.studies.guidelines.sentences import as_json
    from kinetostat.studies.storage import write_text
    from kinetostat.views.figures import save
    from kinetostat.views.guideline_figures import guideline_figures

    written = [folder / f"{STEM}.json"]
    write_text(written[0], json.dumps(as_json(found), ensure_ascii=False, allow_nan=False, indent=1) + "\n")
    drawn = guideline_figures(found)
    return written + [path for name, figure in drawn.items() for path in save(figure, folder / f"{STEM}-{name}")]
