"""The commands `compare` and `validate`: designs side by side, and a machine beside an engine or a measurement.

No formula lives here.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.asking import show_answer
from kinetostat.commands.common import (
    NO_ANSWER,
    add_command,
    give,
    load_machine,
    no_answer,
    progress_bar,
    takes_figures,
    takes_json,
    takes_machine,
    takes_ranges,
    takes_settings,
    takes_units,
)

if TYPE_CHECKING:
    from rich.console import Console

    from kinetostat.commands.common import Commands
    from kinetostat.machine.machine import Machine


def add_compare_commands(commands: "Commands") -> None:
    """Add `compare` and `validate`."""
    _add_compare(commands)
    _add_validate(commands)


def _add_compare(commands: "Commands") -> None:
    compare = add_command(
        commands, "compare", _compare, "compare designs side by side: differences, stiffness, gains",
        'kinetostat compare zhang-gosselin-4dof "zhang-gosselin-4dof:geometry.base_radius=26 cm;pose.z=66 cm"',
    )  # fmt: skip
    compare.add_argument(
        "designs", metavar="DESIGN", nargs="+",
        help='a machine file or a bundled machine, optionally with overrides: "NAME:path=value;path=value"; '
        "all designs are compared with the first",
    )  # fmt: skip
    takes_settings(compare, "override a field in all designs; repeatable")
    takes_units(compare)
    takes_ranges(
        compare,
        "a coordinate of the pose and its range: compare worst, 95 percent and mean over it as well; repeatable",
    )
    compare.add_argument(
        "--poses", metavar="FILE", type=Path,
        help="a CSV file of poses, as `path` takes it, instead of ranges; forces may be columns, such as force.x [N]",
    )  # fmt: skip
    compare.add_argument(
        "--quantity", metavar="NAME", action="append", default=[], dest="quantities",
        help="a number to compare, by the name of a quantity or group as `sweep` takes it, or built_error, which 95 %% "
        "of the machines within [tolerances] keep; over poses these take the place of compliances; repeatable",
    )  # fmt: skip
    takes_figures(compare, "the figure and JSON")
    takes_json(compare)


def _add_validate(commands: "Commands") -> None:
    validate = add_command(
        commands, "validate", _validate,
        "compare the machine with an independent engine, or with a measured stiffness",
        'kinetostat validate tripteron --pose x="0.4 m" y="0.6 m" --pose z="0.3 m"',
    )  # fmt: skip
    takes_machine(validate)
    validate.add_argument(
        "--pose", metavar="NAME=VALUE", nargs="+", action="append", default=[], dest="poses",
        help="coordinates of the pose to change from those of the file; repeat for several poses",
    )  # fmt: skip
    validate.add_argument("--engine", help="exudyn or pynite (default: the first that is installed)")
    validate.add_argument(
        "--measured", metavar="FILE", type=Path,
        help="compare with a measured stiffness instead: a CSV file with the columns entry (stiffness_z, "
        "compliance_rx_y, free_stiffness_x), value and sigma, or with deflections under loads as `identify` takes them",
    )  # fmt: skip
    validate.add_argument(
        "--fit", metavar="FILE", type=Path, help="fit.json of `identify`, whose values and covariance then count"
    )
    validate.add_argument(
        "--tolerance", metavar="WHAT=VALUE", action="append", default=[], dest="tolerances",
        help="how sure numbers of the machine are, as a line of [tolerances], e.g. --tolerance \"compliances=sigma 10 "
        "%%\"; repeatable",
    )  # fmt: skip
    validate.add_argument(
        "--sigma", metavar="SIZE", default="",
        help="standard deviation of what has none in the file: a share (3 %%), or of deflections a length",
    )  # fmt: skip
    validate.add_argument("--sigma-angle", metavar="ANGLE", default="", help="the same of deflections that are angles")
    takes_figures(validate, "the figure and JSON of --measured")
    takes_json(validate)


def _compare(options: argparse.Namespace) -> int:
    from kinetostat.studies.comparison import compare, read_design

    units = [f"display.units={options.units}"] if options.units else []
    designs = [read_design(text, [*options.settings, *units]) for text in options.designs]
    with progress_bar("computing") as progress:
        result = compare(designs, options.ranges, progress, options.quantities, options.poses)
    return show_answer(options, result)


def _validate(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.analysis import analyze
    from kinetostat.tolerances import AGREED
    from kinetostat.validation.comparison import validate
    from kinetostat.views.data_forms import json_of
    from kinetostat.views.tables import tell
    from kinetostat.views.validation import VALIDATION

    poses = [[f"pose.{setting}" for setting in pose] for pose in options.poses or [[]]]
    lines = [f"tolerances.{line}" for line in options.tolerances]
    machines = [load_machine(options, [*pose, *lines]) for pose in poses]
    _refuse_other_options(options)
    for machine in machines:
        analysis = analyze(machine)
        if analysis.status is not Status.OK:
            return no_answer(analysis.message)
    if options.measured:
        return _validate_measured(options, machines[0])
    validations = [validate(machine, options.engine) for machine in machines]

    def show(console: "Console") -> None:
        for validation in validations:
            tell(console, VALIDATION, validation, full=True)

    agreed = all(validation.difference <= AGREED for validation in validations)
    return give(options, agreed, lambda: [json_of(VALIDATION, validation) for validation in validations], show)


def _refuse_other_options(options: argparse.Namespace) -> None:
    """Refuse options that belong to the other kind of validation."""
    from kinetostat.spec.errors import InputError

    options_of_measured = {
        "--fit": options.fit, "--tolerance": options.tolerances, "--sigma": options.sigma,
        "--sigma-angle": options.sigma_angle, "-o": options.output,
    }  # fmt: skip
    wrong = [name for name, given in options_of_measured.items() if given]
    if wrong and not options.measured:
        raise InputError(f"{wrong[0]} is about a measured stiffness; give its file with --measured, or leave it out.")
    if options.measured and options.engine:
        raise InputError("--engine and --measured are two kinds of validation; give one of them at a time.")
    if options.measured and len(options.poses) > 1:
        raise InputError("a stiffness was measured at one pose; give --pose once, or columns of the pose in the file.")


def _validate_measured(options: argparse.Namespace, machine: "Machine") -> int:
    """Compare a machine with a measured stiffness."""
    from kinetostat.studies.measured_stiffness import validate_measured

    answer = validate_measured(
        machine, options.measured, fit=options.fit, sigma=options.sigma, sigma_angle=options.sigma_angle
    )
    exit_code = show_answer(options, answer)
    return exit_code if answer.agrees else NO_ANSWER
