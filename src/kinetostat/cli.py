"""The command line: words to questions, answers to the terminal and to files. No formula lives here.

Imports are late on purpose: `kinetostat --help` must not wait for libraries that only some commands need.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from kinetostat.commands.common import (
    BAD_INPUT,
    DONE,
    NO_ANSWER,
    Parser,
    add_command,
    load_machine,
    no_answer,
    print_json,
    stopped,
    takes_json,
    takes_machine,
)
from kinetostat.commands.compare import add_compare_command
from kinetostat.commands.doctor import add_doctor_command
from kinetostat.commands.export import add_export_command
from kinetostat.commands.grid import add_grid_commands
from kinetostat.commands.guidelines import add_guidelines_command
from kinetostat.commands.optimize import add_optimize_commands
from kinetostat.commands.report import add_report_command
from kinetostat.commands.sensitivity import add_sensitivity_command
from kinetostat.commands.studio import add_studio_command
from kinetostat.commands.workspace import add_workspace_command

EXAMPLES = """examples:
  kinetostat list
  kinetostat analyze zhang-gosselin-4dof
  kinetostat analyze zhang-gosselin-4dof --set stiffness.passive_links=rigid --json
  kinetostat sweep   zhang-gosselin-4dof --vary "stiffness.passive_links=1e3:1e10:8:log"
  kinetostat map     zhang-gosselin-4dof --over "x=-2 cm:2 cm:41" --over "z=66 cm:70 cm:41" -o maps
  kinetostat optimize zhang-gosselin-2002 -o better
  kinetostat validate tripteron
  kinetostat report tripteron -o report.html
  kinetostat reproduce
  kinetostat doctor

exit codes: 0 done, 1 the question has no answer, 2 bad input, 130 stopped by Ctrl-C
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0 done; 1 the question has no answer (infeasible pose, singular, a figure that differs); 2 bad input; 130
        stopped by Ctrl-C.
    """
    options = _parser().parse_args(arguments)
    from kinetostat.spec.errors import InputError

    try:
        return int(options.run(options))
    except InputError as error:
        print(f"kinetostat: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return stopped("files that had been written are complete.")
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE


def _parser() -> Parser:
    parser = Parser(
        prog="kinetostat",
        description="Compute how stiff a parallel kinematic machine is, where it is weak, and why.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and stop")
    parser.set_defaults(run=_version_or_help, parser=parser)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", parser_class=Parser)
    add_command(commands, "list", _list, "list bundled machines, bundled studies and families", "kinetostat list")
    new = add_command(
        commands, "new", _new, "print a commented machine or study file", "kinetostat new passive-leg-4dof > mine.toml"
    )
    source = new.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "family",
        metavar="FAMILY",
        nargs="?",
        help="a family (see `kinetostat list`), or the word study for a study file",
    )
    source.add_argument(
        "--from",
        metavar="FILE",
        type=Path,
        dest="urdf",
        help="convert a URDF with closed loops into a machine written leg by leg",
    )
    schema = add_command(
        commands,
        "schema",
        _schema,
        "print the JSON Schema of machine or study files",
        "kinetostat schema machine > machine.schema.json",
    )
    schema.add_argument("what", choices=["machine", "study"], help="kind of file")
    check = add_command(
        commands, "check", _check, "read a machine or study file and show its values", "kinetostat check mine.toml"
    )
    takes_machine(check, "a machine or study file, or the name of a bundled one (see `kinetostat list`)")
    analyze = add_command(
        commands, "analyze", _analyze, "compute stiffness, compliance, attribution and indices at a pose",
        'kinetostat analyze mine.toml --set pose.x="5 mm" --json',
    )  # fmt: skip
    takes_machine(analyze)
    analyze.add_argument(
        "--axes",
        choices=["base", "platform"],
        default="base",
        help="axes of the results (default: base)",
    )
    analyze.add_argument(
        "--along", metavar="X,Y,Z", action="append", default=[], type=_direction,
        help="also give the stiffness along (force) and about (moment) this direction; repeatable",
    )  # fmt: skip
    analyze.add_argument("--full", action="store_true", help="also show eigenscrews and every single spring")
    takes_json(analyze)
    validate = add_command(
        commands, "validate", _validate, "compare the machine with an independent engine",
        'kinetostat validate tripteron --pose x="0.4 m" y="0.6 m" --pose z="0.3 m"',
    )  # fmt: skip
    takes_machine(validate)
    validate.add_argument(
        "--pose", metavar="NAME=VALUE", nargs="+", action="append", default=[], dest="poses",
        help="coordinates of the pose to change from those of the file; repeat for several poses",
    )  # fmt: skip
    validate.add_argument("--engine", help="exudyn or pynite (default: the first that is installed)")
    takes_json(validate)
    add_grid_commands(commands)
    add_workspace_command(commands)
    add_sensitivity_command(commands)
    add_guidelines_command(commands)
    add_compare_command(commands)
    add_optimize_commands(commands)
    add_export_command(commands)
    add_report_command(commands)
    add_studio_command(commands)
    reproduce = add_command(
        commands, "reproduce", _reproduce, "recompute every table, equation and figure of the paper and compare",
        "kinetostat reproduce -o reproduce",
    )  # fmt: skip
    reproduce.add_argument("-o", "--output", type=Path, default=Path("reproduce"), help="folder (default: reproduce)")
    takes_json(reproduce)
    add_doctor_command(commands)
    return parser


def _direction(text: str) -> tuple[float, ...]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not a direction; give three numbers, e.g. 0,0,1") from None
    return x, y, z


def _version_or_help(options: argparse.Namespace) -> int:
    if options.version:
        from importlib.metadata import version

        print(f"kinetostat {version('kinetostat')}")
    else:
        options.parser.print_help()
    return DONE


def _list(options: argparse.Namespace) -> int:
    from kinetostat.machine.loading import bundled, load
    from kinetostat.studies.bundled import bundled_studies, study_of
    from kinetostat.views.tables import print_machines, print_studies, terminal

    names = list(bundled())
    print_machines(terminal(), [load(name) for name in names], names)
    print_studies(terminal(), {name: study_of(name) for name in bundled_studies()})
    return DONE


def _new(options: argparse.Namespace) -> int:
    if options.urdf is not None:
        from kinetostat.exchange.urdf_import import machine_text

        print(machine_text(options.urdf), end="")
        return DONE
    from kinetostat.machine.loading import template
    from kinetostat.studies.bundled import study_template

    print(study_template() if options.family == "study" else template(options.family), end="")
    return DONE


def _schema(options: argparse.Namespace) -> int:
    from kinetostat.machine.loading import machine_schema
    from kinetostat.spec.study import study_schema

    print_json(study_schema() if options.what == "study" else machine_schema())
    return DONE


def _check(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.analysis import analyze
    from kinetostat.studies.bundled import is_study
    from kinetostat.views.tables import print_machine, terminal

    if is_study(options.machine):
        return _check_study(options)
    machine = load_machine(options)
    print_machine(terminal(), machine)
    found = analyze(machine)
    return no_answer(found.message) if found.status is not Status.OK else DONE


def _check_study(options: argparse.Namespace) -> int:
    from kinetostat.studies.optimisation.problem import load_problem
    from kinetostat.views.study_tables import print_study
    from kinetostat.views.tables import terminal

    print_study(terminal(), load_problem(options.machine, options.settings))
    return DONE


def _analyze(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.analysis import analyze, as_json

    found = analyze(load_machine(options), options.axes)
    answered = found.status is Status.OK
    along = [found.along(direction) for direction in options.along] if answered else []
    if options.json:
        print_json(as_json(found, along))
        return DONE if found.status is Status.OK else NO_ANSWER
    if found.status is not Status.OK:
        return no_answer(found.message)
    from kinetostat.views.analysis_tables import print_analysis
    from kinetostat.views.tables import terminal

    print_analysis(terminal(), found, along, options.full)
    return DONE


def _validate(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.analysis import analyze
    from kinetostat.validation.comparison import AGREED, as_json, validate
    from kinetostat.views.tables import terminal
    from kinetostat.views.validation_tables import print_validation

    poses = [[f"pose.{setting}" for setting in pose] for pose in options.poses or [[]]]
    machines = [load_machine(options, pose) for pose in poses]
    for machine in machines:
        answer = analyze(machine)
        if answer.status is not Status.OK:
            return no_answer(answer.message)
    found = [validate(machine, options.engine) for machine in machines]
    if options.json:
        print_json([as_json(validation) for validation in found])
    else:
        for validation in found:
            print_validation(terminal(), validation, AGREED)
    return DONE if all(validation.difference <= AGREED for validation in found) else NO_ANSWER


def _reproduce(options: argparse.Namespace) -> int:
    from kinetostat.studies.paper.reproduction import reproduce
    from kinetostat.views.paper import print_summary, write_all
    from kinetostat.views.progress import progress_bar

    with progress_bar("reproducing") as progress:
        found = reproduce(progress)
        written = write_all(found, options.output)
    if options.json:
        print_json(found.as_json())
    else:
        print_summary(found, written)
    return DONE if found.explained else NO_ANSWER
