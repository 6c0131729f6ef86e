"""`workspace`: where a machine can work, how much that is, and what lies in the way. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    DONE,
    NO_ANSWER,
    add_command,
    load_machine,
    print_json,
    takes_json,
    takes_machine,
)

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.workspace.workspace import Workspace

STEM = "workspace"


def add_workspace_command(commands: "Commands") -> None:
    """Add `workspace`."""
    command = add_command(
        commands, "workspace", _workspace, "compute where the machine can work: volume, limits, pictures",
        'kinetostat workspace hexapod --set "limits.longest_leg=20 cm" --over "x=-8 cm:8 cm:41" '
        '--over "y=-8 cm:8 cm:41" --over "z=10 cm:25 cm:41" --where "free_stiffness_z > 20 N/um" -o out',
    )  # fmt: skip
    takes_machine(command)
    command.add_argument(
        "--over", metavar="FIELD=from:to:count", required=True, action="append", dest="ranges",
        help="a coordinate of the pose and its range; give two to six",
    )  # fmt: skip
    command.add_argument(
        "--where", metavar="CONDITION", action="append", default=[], dest="conditions",
        help='a condition that a pose must meet, e.g. "free_stiffness_z > 20 N/um"; repeatable, all must be met',
    )  # fmt: skip
    command.add_argument("--seed", type=_seed, default=0, help="seed of the random points for the volume (default: 0)")
    command.add_argument("-o", "--output", type=Path, help="folder for NetCDF and pictures (PNG, SVG, PDF)")
    takes_json(command)


def _seed(text: str) -> int:
    if not text.isdecimal() or len(text) > 9:
        raise argparse.ArgumentTypeError(f"{text} is not a seed; give a whole number of at most nine digits")
    return int(text)


def _workspace(options: argparse.Namespace) -> int:
    from kinetostat.studies.workspace.workspace import workspace
    from kinetostat.views.progress import progress_bar

    machine = load_machine(options)
    with progress_bar("computing") as progress:
        found = workspace(machine, options.ranges, options.conditions, progress, options.seed)
    written = _write(found, options.output) if options.output else []
    if options.json:
        from kinetostat.studies.workspace.workspace import as_json

        print_json(as_json(found))
    else:
        from kinetostat.views.grid_tables import print_written
        from kinetostat.views.tables import terminal
        from kinetostat.views.workspace_tables import print_workspace

        print_workspace(terminal(), found)
        print_written(terminal(), written)
    return DONE if found.found else NO_ANSWER


def _write(found: "Workspace", folder: Path) -> list[Path]:
    from kinetostat.studies.storage import write_dataset
    from kinetostat.views.figures import save
    from kinetostat.views.workspace_figures import pictures

    written = [folder / f"{STEM}.nc"]
    write_dataset(written[0], found.dataset)
    drawn = pictures(found.dataset, found.verdicts, found.conditions, found.dataset.attrs["machine"])
    return written + [path for name, figure in drawn.items() for path in save(figure, folder / f"{STEM}{name}")]
