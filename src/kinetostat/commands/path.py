"""The command `path`: quantities at the poses of a file, as a table, a file and a picture. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    DISPLACED,
    add_command,
    give,
    load_machine,
    progress_bar,
    quantities_of,
    takes_json,
    takes_loaded,
    takes_machine,
    takes_quantities,
)

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.evaluation import PoseAnswers

PICTURES = (".png", ".svg", ".pdf")


def add_path_command(commands: "Commands") -> None:
    """Add `path`."""
    path = add_command(
        commands, "path", _path, "compute quantities at the poses of a CSV file: table, CSV and picture",
        "kinetostat path hexapod poses.csv -o stiffness.csv -o stiffness.png",
    )  # fmt: skip
    takes_machine(path)
    path.add_argument(
        "poses", metavar="POSES", type=Path,
        help="a CSV file: a line of fields with their units, such as x [mm], z [mm], and below it a line for each pose",
    )  # fmt: skip
    takes_quantities(path, "free_stiffness")
    takes_loaded(path, DISPLACED)
    path.add_argument(
        "-o", "--output", metavar="FILE", type=Path, action="append", default=[],
        help="write a table (.csv, .json, .nc) or a picture along the path (.png, .svg, .pdf); repeatable",
    )  # fmt: skip
    takes_json(path)


def _path(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import choice
    from kinetostat.studies.evaluation import answers_at, as_json
    from kinetostat.studies.poses import read_poses
    from kinetostat.views.path_tables import print_path

    for path in options.output:
        choice(path.suffix.lower(), (*_WRITERS, *PICTURES), f'the suffix of "{path}"')
    machine = load_machine(options)
    poses = read_poses(machine, options.poses)
    with progress_bar("computing") as progress:
        answers = answers_at(machine, poses, quantities_of(options, machine, "free_stiffness"), progress)
    for path in options.output:
        _WRITERS.get(path.suffix.lower(), _draw)(path, answers)
    return give(
        options,
        bool((answers.status == 0).any()),
        lambda: as_json(answers),
        lambda console: print_path(console, answers),
        options.output,
    )


def _write_csv(path: Path, answers: "PoseAnswers") -> None:
    from kinetostat.studies.evaluation import as_csv
    from kinetostat.studies.storage import write_text

    write_text(path, as_csv(answers))


def _write_json(path: Path, answers: "PoseAnswers") -> None:
    from kinetostat.studies.evaluation import as_json
    from kinetostat.studies.storage import write_json

    write_json(path, as_json(answers))


def _write_dataset(path: Path, answers: "PoseAnswers") -> None:
    from kinetostat.studies.datasets import as_dataset
    from kinetostat.studies.storage import write_dataset

    write_dataset(path, as_dataset(answers))


def _draw(path: Path, answers: "PoseAnswers") -> None:
    from kinetostat.views.figures import save_figure
    from kinetostat.views.path_figure import path_figure

    save_figure(path_figure(answers), path)


_WRITERS = {".csv": _write_csv, ".json": _write_json, ".nc": _write_dataset}
