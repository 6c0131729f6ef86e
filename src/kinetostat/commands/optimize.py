"""The commands `optimize` and `pareto`: better designs of a machine. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    add_command,
    drawings_of,
    give,
    judge_requirements,
    note_damage,
    search_bar,
    takes_figures,
    takes_json,
    takes_settings,
    takes_units,
    write_figures,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from kinetostat.commands.common import Commands
    from kinetostat.studies.optimisation.result import Result

STUDY_HELP = "a study file, the name of a bundled study (see `kinetostat list`), or the folder of a study to continue"


def add_optimize_commands(commands: "Commands") -> None:
    """Add `optimize` and `pareto`."""
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


def _optimize(options: argparse.Namespace) -> int:
    return _show(options, _search(options))


def _pareto(options: argparse.Namespace) -> int:
    return _show(options, _search(options, least=2), ("name", "status", "message", "evaluations", "front"))


def _search(options: argparse.Namespace, least: int = 1) -> "Result":
    """Search with a progress bar, and keep the search in the folder of `-o` if one is named."""
    from kinetostat.spec.document import exists
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.optimisation.problem import load_problem
    from kinetostat.studies.optimisation.search import optimize, stored_problem
    from kinetostat.studies.storage import differing
    from kinetostat.studies.study_folder import holds_study

    folder = Path(options.study)
    if exists(folder) and holds_study(folder):
        if options.settings or options.output:
            raise InputError(f'"{folder}" holds a study together with its settings; leave out --set and -o.')
        problem, options.output = stored_problem(folder), folder
    else:
        problem = load_problem(options.study, options.settings)
    if options.resume and options.output is None:
        raise InputError("--resume continues the search in a folder; name the folder with -o.")
    if len(problem.objectives) < least:
        raise InputError("a Pareto front needs two objectives or more; for one, use `kinetostat optimize`.")
    options.changed = differing(options.output) if options.output else []
    with search_bar("searching") as update:
        return optimize(
            problem,
            options.output,
            lambda done, total, best: update(done, total, _words(best) if done < total else EXPLAINING),
            options.resume,
        )


EXPLAINING = "is done, the best design is being explained"


def _words(best: float | None) -> str:
    return "" if best is None else f"(best {best:.8g})"


def _show(options: argparse.Namespace, result: "Result", keys: "Sequence[str]" = ()) -> int:
    """Write the files of a result, and print it; of its JSON only some keys where any are named."""
    from kinetostat.views.data_forms import json_of
    from kinetostat.views.optimisation import RESULT, write_result
    from kinetostat.views.tables import tell

    result = result.in_units(options.units) if options.units else result
    written = []
    if options.output:
        log = result.log
        repaired = "nothing but its history" if log.cleaned else ""
        repaired = f"{log.repaired:,} of {len(log.steps):,} steps" if log.repaired else repaired
        note_damage(options.output, repaired, log.unchecked, options.changed)
        written = write_result(result, options.output) + write_figures(options, drawings_of(RESULT, result))

    def as_data() -> object:
        data = json_of(RESULT, result)
        return {key: data.get(key) for key in keys} if keys else data

    code = give(options, result.solved, as_data, lambda console: tell(console, RESULT, result), written, result.message)
    return judge_requirements(result.machine, printing=not options.json) if result.solved else code
