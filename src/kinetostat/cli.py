"""The command line: words to questions, answers to the terminal and to files. No formula lives here.

Imports are late on purpose: `kinetostat --help` must not wait for libraries that only some commands need.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    import xarray as xr

    from kinetostat.machine.machine import Machine

DONE, NO_ANSWER, BAD_INPUT = 0, 1, 2
"""Exit codes."""

MACHINE = "a machine file, or the name of a bundled machine (see `kinetostat list`)"

EXAMPLES = """examples:
  kinetostat list
  kinetostat analyze zhang-gosselin-4dof
  kinetostat analyze zhang-gosselin-4dof --set stiffness.passive_links=rigid --json
  kinetostat sweep   zhang-gosselin-4dof --vary "stiffness.passive_links=1e3:1e10:8:log"
  kinetostat map     zhang-gosselin-4dof --over "x=-2 cm:2 cm:41" --over "z=66 cm:70 cm:41" -o maps
  kinetostat validate tripteron
  kinetostat reproduce
"""


class Parser(argparse.ArgumentParser):
    """An argument parser that reports mistakes in one readable paragraph."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is, exit code 2."""
        self.exit(BAD_INPUT, f"{self.prog}: {message}. Help: {self.prog} --help\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0 done; 1 the question has no answer (infeasible pose, singular, a figure that differs); 2 bad input.
    """
    options = _parser().parse_args(arguments)
    from kinetostat.spec.errors import InputError

    try:
        return int(options.run(options))
    except InputError as error:
        print(f"kinetostat: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("\nkinetostat: stopped; files that were already written are complete.", file=sys.stderr)
        return NO_ANSWER
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE


def _parser() -> Parser:
    parser = Parser(
        prog="kinetostat",
        description="Stiffness of parallel kinematic machines: how stiff, where weak, and why.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and stop")
    parser.set_defaults(run=_version_or_help, parser=parser)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", parser_class=Parser)
    _add(commands, "list", _list, "bundled machines and families", "kinetostat list")
    new = _add(commands, "new", _new, "print a commented machine file", "kinetostat new passive-leg-4dof > mine.toml")
    new.add_argument("family", metavar="FAMILY", help="a family, see `kinetostat list`")
    schema = _add(
        commands,
        "schema",
        _schema,
        "print the JSON Schema of a file",
        "kinetostat schema machine > machine.schema.json",
    )
    schema.add_argument("what", choices=["machine"], help="kind of file")
    _machine(_add(commands, "check", _check, "read a machine and show what it says", "kinetostat check mine.toml"))
    analyze = _add(
        commands, "analyze", _analyze, "K, C, attribution and indices at a pose",
        'kinetostat analyze mine.toml --set pose.x="5 mm" --json',
    )  # fmt: skip
    _machine(analyze)
    analyze.add_argument(
        "--axes", choices=["base", "platform"], default="base", help="in which everything is given (default: base)"
    )
    analyze.add_argument(
        "--along", metavar="X,Y,Z", action="append", default=[], type=_direction,
        help="stiffness along (force) and about (moment) a direction; repeatable",
    )  # fmt: skip
    analyze.add_argument("--full", action="store_true", help="eigenscrews and every single spring as well")
    _json(analyze)
    validate = _add(
        commands, "validate", _validate, "the same machine in an engine that is not ours, side by side",
        'kinetostat validate tripteron --pose x="0.4 m" y="0.6 m" --pose z="0.3 m"',
    )  # fmt: skip
    _machine(validate)
    validate.add_argument(
        "--pose", metavar="NAME=VALUE", nargs="+", action="append", default=[], dest="poses",
        help="coordinates of a pose that differ from the file's; repeat for several poses",
    )  # fmt: skip
    validate.add_argument("--engine", help="exudyn or pynite (default: the first that is installed)")
    _json(validate)
    _add_grid_commands(commands)
    reproduce = _add(
        commands, "reproduce", _reproduce, "every table, equation and figure of the paper, printed beside computed",
        "kinetostat reproduce -o reproduce",
    )  # fmt: skip
    reproduce.add_argument("-o", "--output", type=Path, default=Path("reproduce"), help="folder (default: reproduce)")
    _json(reproduce)
    return parser


def _add_grid_commands(commands: "argparse._SubParsersAction[Parser]") -> None:
    vary = "FIELD=from:to:count[:log]"
    sweep = _add(
        commands, "sweep", _sweep, "quantities along one parameter, as table, curves and NetCDF",
        'kinetostat sweep zhang-gosselin-4dof --vary "stiffness.passive_links=1e3:1e10:8:log" --quantity compliance',
    )  # fmt: skip
    sweep.add_argument("--vary", metavar=vary, required=True, action="append", dest="ranges", help="parameter to vary")
    sweep.set_defaults(default_quantity="stiffness")
    mapping = _add(
        commands, "map", _map, "quantities over two or more parameters, as contour maps and NetCDF",
        'kinetostat map zhang-gosselin-4dof --over "x=-2 cm:2 cm:41" --over "z=66 cm:70 cm:41" -o maps',
    )  # fmt: skip
    mapping.add_argument(
        "--over", metavar=vary, required=True, action="append", dest="ranges", help="an axis of the map"
    )
    mapping.set_defaults(default_quantity="compliance")
    for command in (sweep, mapping):
        _machine(command)
        command.add_argument(
            "--quantity", metavar="NAME", action="append", dest="quantities",
            help="compliance, stiffness (their six diagonal entries), compliance_rx, ..., compliance_rx_z, regularity",
        )  # fmt: skip
        command.add_argument("-o", "--output", type=Path, help="folder for NetCDF and figures (PNG, SVG, PDF)")
        _json(command)


def _add(commands: "argparse._SubParsersAction[Parser]", name: str, run: object, text: str, example: str) -> Parser:
    command = commands.add_parser(
        name,
        help=text,
        description=f"{text[0].upper()}{text[1:]}.",
        epilog=f"example:\n  {example}\n",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.set_defaults(run=run)
    return command


def _machine(command: Parser) -> None:
    command.add_argument("machine", metavar="MACHINE", help=MACHINE)
    command.add_argument(
        "--set", metavar="PATH=VALUE", action="append", default=[], dest="settings",
        help='override a field, e.g. --set geometry.base_radius="26 cm"; repeatable',
    )  # fmt: skip


def _direction(text: str) -> tuple[float, ...]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is no direction; give three numbers, e.g. 0,0,1") from None
    return x, y, z


def _json(command: Parser) -> None:
    command.add_argument("--json", action="store_true", help="machine-readable output on stdout and nothing else")


def _load(options: argparse.Namespace) -> "Machine":
    from kinetostat.machine.loading import load

    return load(options.machine, options.settings)


def _print_json(data: object) -> None:
    print(json.dumps(data, ensure_ascii=False, allow_nan=False, indent=1))


def _version_or_help(options: argparse.Namespace) -> int:
    if options.version:
        from importlib.metadata import version

        print(f"kinetostat {version('kinetostat')}")
    else:
        options.parser.print_help()
    return DONE


def _list(options: argparse.Namespace) -> int:
    from kinetostat.machine.loading import bundled, load
    from kinetostat.views.tables import print_machines, terminal

    names = list(bundled())
    print_machines(terminal(), [load(name) for name in names], names)
    return DONE


def _new(options: argparse.Namespace) -> int:
    from kinetostat.machine.loading import template

    print(template(options.family), end="")
    return DONE


def _schema(options: argparse.Namespace) -> int:
    from kinetostat.machine.loading import machine_schema

    _print_json(machine_schema())
    return DONE


def _check(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.analysis import analyze
    from kinetostat.views.tables import print_machine, terminal

    machine = _load(options)
    print_machine(terminal(), machine)
    found = analyze(machine)
    return _no_answer(found.message) if found.status is not Status.OK else DONE


def _analyze(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.analysis import analyze
    from kinetostat.studies.analysis_data import as_json

    found = analyze(_load(options), options.axes)
    answered = found.status is Status.OK
    along = [found.along(direction) for direction in options.along] if answered else []
    if options.json:
        _print_json(as_json(found, along))
        return DONE if found.status is Status.OK else NO_ANSWER
    if found.status is not Status.OK:
        return _no_answer(found.message)
    from kinetostat.views.analysis_tables import print_analysis
    from kinetostat.views.tables import terminal

    print_analysis(terminal(), found, along, options.full)
    return DONE


def _validate(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.machine.loading import load
    from kinetostat.studies.analysis import analyze
    from kinetostat.validation.comparison import AGREED, as_json, validate
    from kinetostat.views.tables import terminal
    from kinetostat.views.validation_tables import print_validation

    poses = [[f"pose.{setting}" for setting in pose] for pose in options.poses or [[]]]
    machines = [load(options.machine, [*options.settings, *pose]) for pose in poses]
    for machine in machines:
        answer = analyze(machine)
        if answer.status is not Status.OK:
            return _no_answer(answer.message)
    found = [validate(machine, options.engine) for machine in machines]
    if options.json:
        _print_json([as_json(validation) for validation in found])
    else:
        for validation in found:
            print_validation(terminal(), validation, AGREED)
    return DONE if all(validation.difference <= AGREED for validation in found) else NO_ANSWER


def _no_answer(message: str) -> int:
    print(f"kinetostat: {message}", file=sys.stderr)
    return NO_ANSWER


def _sweep(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import InputError

    if len(options.ranges) > 1:
        raise InputError("sweep varies one parameter; for two or more use `kinetostat map --over ... --over ...`.")
    return _grid(options, "sweep")


def _map(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import InputError

    if len(options.ranges) < 2:
        raise InputError("map needs two --over ranges or more; for one parameter use `kinetostat sweep --vary ...`.")
    return _grid(options, "map")


def _grid(options: argparse.Namespace, stem: str) -> int:
    from kinetostat.studies.grid import evaluate_grid
    from kinetostat.views.progress import progress_bar

    names = options.quantities or [options.default_quantity]
    with progress_bar("computing") as progress:
        dataset = evaluate_grid(_load(options), options.ranges, names, progress)
    written = _write_grid(dataset, options.output, stem) if options.output else []
    _show_grid(dataset, options.json, written)
    return DONE if bool((dataset["status"] == 0).any()) else NO_ANSWER


def _write_grid(dataset: "xr.Dataset", folder: Path, stem: str) -> list[Path]:
    from kinetostat.studies.storage import write_dataset

    written = [folder / f"{stem}.nc"]
    write_dataset(written[0], dataset)
    shown = [str(name) for name in dataset.data_vars if name != "status"]
    dims = len(dataset["status"].dims)
    if dims <= 2:
        from kinetostat.views.figures import contour_maps, curves, save

        draw = curves if dims == 1 else contour_maps
        written += save(draw(dataset, shown, dataset.attrs["machine"]), folder / stem)
    return written


def _show_grid(dataset: "xr.Dataset", as_json: bool, written: Sequence[Path]) -> None:
    if as_json:
        from kinetostat.studies.grid import as_plain_data

        _print_json(as_plain_data(dataset))
        return
    from kinetostat.views.grid_tables import print_dataset
    from kinetostat.views.tables import terminal

    console = terminal()
    print_dataset(console, dataset, [str(name) for name in dataset.data_vars if name != "status"])
    for path in written:
        console.print(f"wrote {path}", highlight=False)


def _reproduce(options: argparse.Namespace) -> int:
    from kinetostat.studies.paper.reproduction import reproduce
    from kinetostat.views.paper import print_summary, write_all
    from kinetostat.views.progress import progress_bar

    with progress_bar("reproducing") as progress:
        found = reproduce(progress)
        written = write_all(found, options.output)
    if options.json:
        _print_json(found.as_json())
    else:
        print_summary(found, written)
    return DONE if found.explained else NO_ANSWER
