"""The commands `sweep` and `map`: grids of poses or parameters, in memory or in a study folder.

No formula lives here.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    add_command,
    give,
    list_written,
    load_machine,
    note_damage,
    progress_bar,
    quantities_of,
    stopped,
    takes_figures,
    takes_json,
    takes_loaded,
    takes_machine,
    takes_quantities,
    write_figures,
)
from kinetostat.views.options import DISPLACED, VARIED

if TYPE_CHECKING:
    import xarray as xr

    from kinetostat.commands.common import Commands
    from kinetostat.engine.chunks import Crew
    from kinetostat.studies.grid import GridQuestion

MOST_WORKERS = 1024


def add_grid_commands(commands: "Commands") -> None:
    """Add `sweep` and `map`."""
    sweep = add_command(
        commands, "sweep", _sweep, "compute quantities along one parameter: table, curves and NetCDF",
        'kinetostat sweep zhang-gosselin-4dof --vary "stiffness.passive_links=1e3:1e10:8:log" --quantity compliance',
    )  # fmt: skip
    sweep.add_argument(
        "--vary", metavar=VARIED, required=True, action="append", dest="ranges", help="parameter to vary"
    )
    sweep.set_defaults(default_quantity="stiffness")
    mapping = add_command(
        commands, "map", _map, "compute quantities over two to six parameters: contour maps and NetCDF",
        'kinetostat map zhang-gosselin-4dof --over "x=-2 cm:2 cm:41" --over "z=66 cm:70 cm:41" -o maps',
    )  # fmt: skip
    mapping.add_argument(
        "--over", metavar=VARIED, required=True, action="append", dest="ranges", help="an axis of the map"
    )
    mapping.set_defaults(default_quantity="compliance")
    mapping.add_argument(
        "--carrying", action="store_true",
        help="instead of quantities: which legs carry under load and which are slack, as regions of the map",
    )  # fmt: skip
    for command in (sweep, mapping):
        takes_machine(command)
        takes_quantities(command, command.get_default("default_quantity"))
        takes_loaded(command, DISPLACED)
        takes_figures(command, "NetCDF and figures")
        command.add_argument(
            "--resume", action="store_true",
            help="for grids of over 5 million points: continue the one in the output folder, and refuse if there "
            "is none; without this option the command continues or begins",
        )  # fmt: skip
        where = command.add_mutually_exclusive_group()
        where.add_argument("--workers", metavar="N", type=_workers, help="compute in N processes on this machine")
        where.add_argument("--cluster", metavar="ADDRESS", help="compute on a Dask cluster, e.g. tcp://10.0.0.1:8786")
        takes_json(command)


def _workers(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text[:9]) <= MOST_WORKERS:
        raise argparse.ArgumentTypeError(f"{text} is not a number of processes; give 1 to {MOST_WORKERS}")
    return int(text)


def _sweep(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import InputError

    if len(options.ranges) > 1:
        raise InputError("sweep varies one parameter; for two or more use `kinetostat map --over ... --over ...`.")
    return _grid(options, "sweep")


def _map(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import InputError

    if len(options.ranges) < 2:
        raise InputError("map needs two --over ranges or more; for one parameter use `kinetostat sweep --vary ...`.")
    return _carrying(options) if options.carrying else _grid(options, "map")


def _carrying(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.carrying import as_dataset, as_json, carrying_legs
    from kinetostat.studies.storage import write_dataset
    from kinetostat.views.carrying_views import carrying_figures, print_carrying

    if options.quantities or options.workers or options.cluster or options.resume:
        raise InputError(
            "--carrying shows which legs carry, not a quantity, and computes in this process; leave out --quantity, "
            "--workers, --cluster and --resume."
        )
    machine = load_machine(options)
    with progress_bar("computing") as progress:
        answer = carrying_legs(machine, options.ranges, progress)
    written = []
    if options.output:
        written.append(options.output / "carrying.nc")
        write_dataset(written[0], as_dataset(answer))
        written += write_figures(options, dict(zip(["carrying"], carrying_figures(answer).values(), strict=False)))
    return give(
        options, bool(answer.sets), lambda: as_json(answer), lambda console: print_carrying(console, answer), written
    )


def _grid(options: argparse.Namespace, stem: str) -> int:
    from kinetostat.studies.grid import grid_question

    machine = load_machine(options)
    quantities = quantities_of(options, machine, options.default_quantity)
    question = grid_question(machine, options.ranges, quantities)
    if options.output and not question.fits_memory:
        return _stored(options, question, stem)
    return _in_memory(options, question, stem)


def _crew(options: argparse.Namespace) -> "Crew":
    from kinetostat.engine.chunks import Crew

    return Crew(options.workers, options.cluster)


def _in_memory(options: argparse.Namespace, question: "GridQuestion", stem: str) -> int:
    from kinetostat.engine.chunks import compute_with
    from kinetostat.studies.grid import answer

    if options.output:
        _check_folder(options.output, options.resume)
    with compute_with(_crew(options)) as compute, progress_bar("computing") as progress:
        dataset = answer(question, progress, compute)
    written = _write(options, dataset, stem) if options.output else []

    from kinetostat.studies.grid import as_json
    from kinetostat.views.grid_tables import print_dataset

    names = [str(name) for name in dataset.data_vars if name != "status"]
    answered = bool((dataset["status"] == 0).any())
    return give(
        options,
        answered,
        lambda: as_json(dataset),
        lambda console: print_dataset(console, dataset, names),
        written,
    )


def _check_folder(folder: Path, resume: bool) -> None:
    """Refuse to write a small grid over a long study."""
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.study_folder import holds_study

    if holds_study(folder):
        raise InputError(f'"{folder}" holds the study of a larger grid; choose another folder with -o.')
    if resume:
        raise InputError("a grid that is kept in memory is computed at once and cannot be resumed; leave out --resume.")


def _write(options: argparse.Namespace, dataset: "xr.Dataset", stem: str) -> list[Path]:
    from kinetostat.studies.storage import write_dataset

    written = [options.output / f"{stem}.nc"]
    write_dataset(written[0], dataset)
    return written + _draw(options, dataset, stem, dataset.attrs["machine"])


def _draw(options: argparse.Namespace, dataset: "xr.Dataset", stem: str, title: str) -> list[Path]:
    """Draw a grid of one or two dimensions; return the files."""
    dims = len(dataset["status"].dims)
    if dims > 2:
        return []
    from kinetostat.views.figures import contour_maps, curves

    draw, names = curves if dims == 1 else contour_maps, [str(name) for name in dataset.data_vars if name != "status"]
    return write_figures(options, {stem: lambda: draw(dataset, names, title)})


def _stored(options: argparse.Namespace, question: "GridQuestion", stem: str) -> int:
    from kinetostat.engine.chunks import compute_with
    from kinetostat.studies.storage import differing
    from kinetostat.studies.stored_grid import answer_into

    changed = differing(options.output)
    try:
        with compute_with(_crew(options)) as compute, progress_bar("computing") as progress:
            stored = answer_into(question, options.output, stem, progress, compute, options.resume)
    except KeyboardInterrupt:
        return stopped(f"the results so far are in {options.output}; the same command continues from there.")
    note_damage(options.output, stored.repaired, stored.unchecked, changed)
    from kinetostat.studies.stored_grid import summary_json
    from kinetostat.studies.study_folder import HISTORY, QUESTION
    from kinetostat.views.grid_tables import print_stored

    drawn = [] if options.json or len(question.dims) > 2 else _draw_thinned(options, stored.path)
    list_written(options.output, [options.output / name for name in (QUESTION, HISTORY)])
    return give(
        options,
        bool(stored.tally.answered),
        lambda: summary_json(stored),
        lambda console: print_stored(console, stored),
        [stored.path, *drawn],
    )


def _draw_thinned(options: argparse.Namespace, path: Path) -> list[Path]:
    """Draw a large grid of one or two dimensions, thinned to as many points as paper can show."""
    from kinetostat.studies.result_file import thinned_dataset

    dataset = thinned_dataset(path)
    return _draw(options, dataset, path.stem, f"{dataset.attrs['machine']} (thinned)")
