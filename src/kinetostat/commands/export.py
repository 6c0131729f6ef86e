"""`export`: the machine, or its results at a pose, in the format of another program. No formula lives here."""

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import DONE, add_command, load_machine, no_answer, takes_machine

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands

FORMATS = "mjcf, urdf, glb, step, csv, netcdf, mat, nastran, abaqus or ansys"


def add_export_command(commands: "Commands") -> None:
    """Add `export`."""
    command = add_command(
        commands, "export", _export, "write the machine or its results for other programs",
        "kinetostat export tripteron --to mjcf -o tripteron.xml",
    )  # fmt: skip
    takes_machine(command)
    command.add_argument("--to", metavar="FORMAT", help=f"{FORMATS} (default: given by the suffix of the file)")
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="the file (default: the name of the machine)"
    )


def _export(options: argparse.Namespace) -> int:
    from kinetostat.exchange.formats import choose
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.analysis import analyze
    from kinetostat.views.grid_tables import print_written
    from kinetostat.views.tables import terminal

    chosen = choose(options.to, options.output)
    found = analyze(load_machine(options))
    if found.status is not Status.OK:
        return no_answer(found.message)
    stem = re.sub(r"[^\w.-]+", "-", Path(options.machine).stem if options.output is None else "").strip("-")
    written = chosen.write(found, options.output or Path(f"{stem}{chosen.suffix}"))
    print_written(terminal(), written)
    return DONE
