"""The command `budget`: the error of the tool that tolerances allow, and what it is made of. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    DONE,
    add_command,
    direction,
    give,
    load_machine,
    progress_bar,
    takes_figures,
    takes_json,
    takes_machine,
    takes_ranges,
    write_figures,
)

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.machine.machine import Machine
    from kinetostat.studies.budget.budget import Budget


def add_budget_command(commands: "Commands") -> None:
    """Add `budget`."""
    command = add_command(
        commands, "budget", _budget, "compute the error of the tool that tolerances allow, and what it is made of",
        'kinetostat budget hexapod --tolerance "joints=0.05 mm" --tolerance "zeros=0.02 mm" -o out',
    )  # fmt: skip
    takes_machine(command)
    command.add_argument(
        "poses", metavar="POSES", type=Path, nargs="?",
        help="a CSV file of poses, as `path` takes it (default: the pose of the machine)",
    )  # fmt: skip
    command.add_argument(
        "--tolerance", metavar="WHAT=VALUE", action="append", default=[], dest="tolerances",
        help="a line as in the table [tolerances] of the machine file, after those of the file: joints, zeros, gains, "
        "clearances, compliances, or a path in which * stands for anything; VALUE is plus and minus (0.05 mm), a "
        "standard deviation (sigma 0.02 mm), or a class (IT7 at 300 mm, ISO 2768-m at 300 mm); repeatable",
    )  # fmt: skip
    takes_ranges(command, "a coordinate of the pose and its range: the error over a sweep or a map; repeatable")
    command.add_argument(
        "--along", metavar="X,Y,Z", type=direction,
        help="also the error of the tool point along this direction, by which contributions are then ranked",
    )  # fmt: skip
    command.add_argument(
        "--samples", metavar="N", type=_count, default=0,
        help="machines that are drawn to first order (default: 131072, or 4096 if there are several poses)",
    )  # fmt: skip
    command.add_argument(
        "--exact", metavar="N", type=_count, default=0, help="machines that are solved exactly, to compare with"
    )
    command.add_argument(
        "--allocate", metavar="LENGTH", help='also the tolerances of least cost for this error, e.g. "0.05 mm"'
    )
    command.add_argument(
        "--by", choices=("rss", "worst"), default="rss",
        help="what must keep it: the root of the sum of squares (default), or the worst case",
    )  # fmt: skip
    command.add_argument("--seed", type=_count, default=0, help="seed of the random machines (default: 0)")
    command.add_argument("--list", action="store_true", help="only list every number that may be off, with its path")
    command.add_argument("--full", action="store_true", help="list all contributions and parasitic components")
    takes_figures(command, "the figures, JSON, CSV and NetCDF")
    takes_json(command)


def _count(text: str) -> int:
    if not text.isdecimal() or len(text) > 9:
        raise argparse.ArgumentTypeError(f"{text} is not a number; give a whole number of at most nine digits")
    return int(text)


def _budget(options: argparse.Namespace) -> int:
    from kinetostat.studies.budget.budget import budget
    from kinetostat.studies.budget.data import as_json
    from kinetostat.views.budget_tables import print_budget

    machine = load_machine(options, [f"tolerances.{line}" for line in options.tolerances])
    if options.list:
        return _list(machine)
    with progress_bar("computing") as progress:
        result = budget(
            machine, options.poses, options.ranges, None, options.along or (), options.samples, options.exact,
            options.allocate, options.by, options.seed, progress,
        )  # fmt: skip
    written = _write(options, result) if options.output else []
    return give(
        options,
        True,
        lambda: as_json(result),
        lambda console: print_budget(console, result, options.full),
        written,
    )


def _list(machine: "Machine") -> int:
    from kinetostat.accuracy.model import error_model
    from kinetostat.views.budget_tables import print_errors
    from kinetostat.views.tables import terminal

    print_errors(terminal(), error_model(machine, {}, 1).errors, machine.tolerances)
    return DONE


def _write(options: argparse.Namespace, result: "Budget") -> list[Path]:
    from kinetostat.studies.budget.data import as_dataset, as_json, contributions_csv, poses_csv
    from kinetostat.studies.storage import write_dataset, write_json, write_text
    from kinetostat.views.budget_figures import budget_figures

    folder = options.output
    written = [folder / "budget.json", folder / "contributions.csv"]
    write_json(written[0], as_json(result))
    write_text(written[1], contributions_csv(result))
    if len(result.status) > 1:
        written += [folder / "poses.csv", folder / "budget.nc"]
        write_text(written[2], poses_csv(result))
        write_dataset(written[3], as_dataset(result))
    drawings = {f"budget-{name}": draw for name, draw in budget_figures(result).items()}
    return written + write_figures(options, drawings)
