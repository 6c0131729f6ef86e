"""`compare`: designs side by side. No formula lives here."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import DONE, NO_ANSWER, add_command, print_json, takes_json

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.comparison.designs import Comparison

STEM = "compare"


def add_compare_command(commands: "Commands") -> None:
    """Add `compare`."""
    command = add_command(
        commands, "compare", _compare, "compare designs side by side: differences, stiffness, gains",
        'kinetostat compare zhang-gosselin-4dof "zhang-gosselin-4dof:geometry.base_radius=26 cm;pose.z=66 cm"',
    )  # fmt: skip
    command.add_argument(
        "designs", metavar="DESIGN", nargs="+",
        help='a machine file or a bundled machine, optionally with overrides: "NAME:path=value;path=value"; '
        "all designs are compared with the first",
    )  # fmt: skip
    command.add_argument(
        "--set", metavar="PATH=VALUE", action="append", default=[], dest="settings",
        help="override a field in all designs; repeatable",
    )  # fmt: skip
    command.add_argument(
        "--over", metavar="FIELD=from:to:count", action="append", default=[], dest="ranges",
        help="a coordinate of the pose and its range: compare worst, 95 percent and mean over it as well; repeatable",
    )  # fmt: skip
    command.add_argument("-o", "--output", type=Path, help="folder for the figure (PNG, SVG, PDF) and JSON")
    takes_json(command)


def _compare(options: argparse.Namespace) -> int:
    from kinetostat.studies.comparison.designs import compare, read_design
    from kinetostat.views.progress import progress_bar

    designs = [read_design(text, options.settings) for text in options.designs]
    with progress_bar("computing") as progress:
        found = compare(designs, options.ranges, progress)
    written = _write(found, options.output) if options.output else []
    if options.json:
        from kinetostat.studies.comparison.designs import as_json

        print_json(as_json(found))
    else:
        from kinetostat.views.design_tables import print_comparison
        from kinetostat.views.grid_tables import print_written
        from kinetostat.views.tables import terminal

        console = terminal()
        print_comparison(console, found)
        print_written(console, written)
    return DONE if all(design.answered for design in designs) else NO_ANSWER


def _write(found: "Comparison", folder: Path) -> list[Path]:
    from kinetostat.studies.comparison.designs import as_json
    from kinetostat.studies.storage import write_text
    from kinetostat.views.design_figure import comparison_figure
    from kinetostat.views.figures import save

    written = [folder / f"{STEM}.json"]
    write_text(written[0], json.dumps(as_json(found), ensure_ascii=False, allow_nan=False, indent=1) + "\n")
    return written + save(comparison_figure(found), folder / STEM)
