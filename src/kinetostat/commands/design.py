"""The commands of comparison and design: `validate`, `compare`, `optimize` and `pareto`. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.asking import show_answer
from kinetostat.commands.common import (
    NO_ANSWER,
    add_command,
    drawings_of,
    judge_requirements,
    load_machine,
    no_answer,
    note_damage,
    print_result,
    progress_bar,
    takes_figures,
    takes_json,
    takes_machine,
    takes_ranges,
    takes_settings,
    takes_units,
    write_figures,
)
from kinetostat.spec.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from kinetostat.commands.common import Commands
    from kinetostat.machine.machine import Machine
    from kinetostat.studies.optimisation.problem import Problem
    from kinetostat.studies.optimisation.result import Result

STUDY_HELP = "a study file, the name of a bundled study (see `kinetostat list`), or the folder of a study to continue"
EXPLAINING = "is done, the best design is being explained"
"""Words after "searching" once all designs have been computed."""
KEYS_OF_FRONT = ("name", "status", "message", "evaluations", "front")
"""Keys of the result that `pareto --json` prints: those of the front, because no single design is the best."""


def add_design_commands(commands: "Commands") -> None:
    """Add the four commands."""
    _add_compare(commands)
    _add_validate(commands)
    _add_searches(commands)


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


def _add_searches(commands: "Commands") -> None:
    optimize = add_command(
        commands, "optimize", _optimize, "search for the best design that a study file describes",
        "kinetostat optimize zhang-gosselin-2002 --set optimizer.seed=3 -o better",
    )  # fmt: skip
    pareto = add_command(
        commands, "pareto", _pareto, "compute the Pareto front of a study with several objectives",
        "kinetostat pareto zhang-gosselin-front -o front",
    )  # fmt: skip
    for command in (optimize, pareto):
        command.add_argument("study", metavar="STUDY", help=STUDY_HELP)
        takes_settings(
            command,
            'override a field of the study, e.g. --set optimizer.seed=3, --set variables.0.to="15 cm"; repeatable',
        )
        takes_units(command)
        takes_figures(command, "the result, its figures and all designs; a stopped search continues there")
        command.add_argument(
            "--resume", action="store_true", help="continue the search in the folder, and refuse if there is none"
        )
        takes_json(command)


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
    from kinetostat.views.tables import print_answer
    from kinetostat.views.validation import VALIDATION

    _refuse_other_options(options)
    poses = [[f"pose.{setting}" for setting in pose] for pose in options.poses or [[]]]
    tolerances = [f"tolerances.{line}" for line in options.tolerances]
    machines = [load_machine(options, [*pose, *tolerances]) for pose in poses]
    for machine in machines:
        analysis = analyze(machine)
        if analysis.status is not Status.OK:
            return no_answer(analysis.message)
    if options.measured:
        return _validate_measured(options, machines[0])
    validations = [validate(machine, options.engine) for machine in machines]

    def show(console: "Console") -> None:
        for validation in validations:
            print_answer(console, VALIDATION, validation, full=True)

    agreed = all(validation.difference <= AGREED for validation in validations)
    return print_result(options, agreed, lambda: [json_of(VALIDATION, validation) for validation in validations], show)


def _refuse_other_options(options: argparse.Namespace) -> None:
    """Refuse options of a measured stiffness without one, and options beside a measured stiffness that it lacks."""
    options_of_measured = {
        "--fit": options.fit, "--tolerance": options.tolerances, "--sigma": options.sigma,
        "--sigma-angle": options.sigma_angle, "-o": options.output,
    }  # fmt: skip
    if not options.measured:
        if name := next((name for name, value in options_of_measured.items() if value), ""):
            raise InputError(f"{name} is about a measured stiffness; give its file with --measured, or leave it out.")
        return
    if options.engine:
        raise InputError("--engine and --measured are two kinds of validation; give one of them at a time.")
    if len(options.poses) > 1:
        raise InputError("a stiffness was measured at one pose; give --pose once, or columns of the pose in the file.")


def _validate_measured(options: argparse.Namespace, machine: "Machine") -> int:
    """Compare a machine with a measured stiffness."""
    from kinetostat.studies.measured_stiffness import validate_measured

    answer = validate_measured(
        machine, options.measured, fit=options.fit, sigma=options.sigma, sigma_angle=options.sigma_angle
    )
    exit_code = show_answer(options, answer)
    return exit_code if answer.agrees else NO_ANSWER


def _optimize(options: argparse.Namespace) -> int:
    return _search(options, _problem_of(options))


def _pareto(options: argparse.Namespace) -> int:
    problem = _problem_of(options)
    if len(problem.objectives) < 2:
        raise InputError("a Pareto front needs two objectives or more; for one, use `kinetostat optimize`.")
    return _search(options, problem, KEYS_OF_FRONT)


def _problem_of(options: argparse.Namespace) -> "Problem":
    """Return the problem of the study; if STUDY is the folder of a search, `options.output` becomes this folder."""
    from kinetostat.spec.document import exists
    from kinetostat.studies.optimisation.problem import load_problem
    from kinetostat.studies.optimisation.search import stored_problem
    from kinetostat.studies.study_folder import holds_study

    folder = Path(options.study)
    if exists(folder) and holds_study(folder):
        if options.settings or options.output:
            raise InputError(f'"{folder}" holds a study together with its settings; leave out --set and -o.')
        options.output = folder
        return stored_problem(folder)
    problem = load_problem(options.study, options.settings)
    if options.resume and options.output is None:
        raise InputError("--resume continues the search in a folder; name the folder with -o.")
    return problem


def _search(options: argparse.Namespace, problem: "Problem", keys: "Sequence[str]" = ()) -> int:
    """Search for the best design, in a folder if there is one, and show the result; return the exit code.

    Args:
        options: the options of the command; `output` is the folder.
        problem: the problem to solve.
        keys: the only keys of its JSON that are printed; all if empty.
    """
    from kinetostat.studies.storage import differing

    changed = differing(options.output) if options.output else []  # before the search writes there
    return _show_result(options, search_with_bar(problem, options.output, options.resume), changed, keys)


def search_with_bar(problem: "Problem", folder: Path | None, resume: bool = False) -> "Result":
    """Search for the best design of a study, with a bar that says how good the best one is so far.

    Args:
        problem: the study.
        folder: keeps the search, and continues one that it holds; None to keep nothing.
        resume: whether a folder that holds no search is refused.
    """
    from kinetostat.studies.optimisation.search import optimize

    with progress_bar("searching") as progress:

        def show_best(done: int, total: int, best: float | None) -> None:
            words = "" if best is None else f"(best {best:.8g})"
            progress(done, total, words if done < total else EXPLAINING)

        return optimize(problem, folder, show_best, resume)


def _show_result(options: argparse.Namespace, result: "Result", changed: "Sequence[str]", keys: "Sequence[str]") -> int:
    """Write the files of a result, print it, and judge the requirements of its machine; return the exit code.

    Args:
        options: the options of the command.
        result: the result of the search.
        changed: names of files in its folder that were damaged.
        keys: the only keys of its JSON that are printed; all if empty.
    """
    from kinetostat.views.data_forms import json_of
    from kinetostat.views.optimisation import RESULT, write_result
    from kinetostat.views.tables import print_answer

    result = result.in_units(options.units) if options.units else result
    written = []
    if options.output:
        log = result.log
        if log.repaired:
            repaired = f"{log.repaired:,} of {len(log.steps):,} steps"
        else:
            repaired = "nothing but its history" if log.cleaned else ""
        note_damage(options.output, repaired, log.unchecked, changed)
        written = write_result(result, options.output) + write_figures(options, drawings_of(RESULT, result))

    def as_data() -> object:
        data = json_of(RESULT, result)
        return {key: data.get(key) for key in keys} if keys else data

    exit_code = print_result(
        options, result.solved, as_data, lambda console: print_answer(console, RESULT, result), written, result.message
    )
    return judge_requirements(result.machine, printing=not options.json) if result.solved else exit_code
