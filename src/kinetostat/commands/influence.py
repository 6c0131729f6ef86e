"""The commands `sensitivity` and `guidelines`, which tell what parameters decide the stiffness. No formula lives here.

Studies and views are imported when a command runs, so that `kinetostat --help` need not load NumPy.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    add_command,
    give,
    load_machine,
    progress_bar,
    takes_figures,
    takes_json,
    takes_machine,
    takes_quantities,
    takes_ranges,
    write_figures,
)

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.guidelines import Guidelines
    from kinetostat.studies.sensitivity import Sensitivity


def add_influence_commands(commands: "Commands") -> None:
    """Add the commands `sensitivity` and `guidelines` to the command line."""
    command = add_command(
        commands, "sensitivity", _sensitivity, "rank the parameters by their effect on the stiffness at a pose",
        "kinetostat sensitivity zhang-gosselin-4dof --quantity compliance_z -o sensitivity",
    )  # fmt: skip
    takes_machine(command)
    takes_quantities(command, "compliance")
    takes_figures(command, "the figure and JSON")
    takes_json(command)
    command = add_command(
        commands, "guidelines", _guidelines, "show what stiffness depends on, what counts as rigid, what to change",
        'kinetostat guidelines zhang-gosselin-4dof --over "x=-2 cm:2 cm:11" --over "z=66 cm:70 cm:11" -o out',
    )  # fmt: skip
    takes_machine(command)
    takes_ranges(
        command, "a coordinate of the pose and its range: count at how many poses the guidelines hold; repeatable"
    )
    command.add_argument(
        "--full", action="store_true", help="show every parameter, and sentences about the most important ones"
    )
    takes_figures(command, "the figures and JSON")
    takes_json(command)


def _sensitivity(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.sensitivity import as_json, sensitivity
    from kinetostat.views.influence_tables import print_sensitivity

    result = sensitivity(load_machine(options), options.quantities or ["compliance"])
    answered = result.status is Status.OK
    written = _write_sensitivity(options, result) if options.output and answered else []
    return give(
        options,
        answered,
        lambda: as_json(result),
        lambda console: print_sensitivity(console, result),
        written,
        result.message,
    )


def _write_sensitivity(options: argparse.Namespace, result: "Sensitivity") -> list[Path]:
    from kinetostat.studies.sensitivity import as_json
    from kinetostat.studies.storage import write_json
    from kinetostat.views.influence_figures import sensitivity_figures

    written = [options.output / "sensitivity.json"]
    write_json(written[0], as_json(result))
    drawings = dict(zip(["sensitivity"], sensitivity_figures(result).values(), strict=False))
    return written + write_figures(options, drawings)


def _guidelines(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.guideline_sentences import as_json
    from kinetostat.studies.guidelines import guidelines
    from kinetostat.views.influence_tables import print_guidelines

    machine = load_machine(options)
    with progress_bar("computing") as progress:
        result = guidelines(machine, options.ranges, progress)
    answered = result.status is Status.OK
    written = _write_guidelines(options, result) if options.output and answered else []
    return give(
        options,
        answered,
        lambda: as_json(result),
        lambda console: print_guidelines(console, result, options.full),
        written,
        result.message,
    )


def _write_guidelines(options: argparse.Namespace, result: "Guidelines") -> list[Path]:
    from kinetostat.studies.guideline_sentences import as_json
    from kinetostat.studies.storage import write_json
    from kinetostat.views.influence_figures import guideline_figures

    written = [options.output / "guidelines.json"]
    write_json(written[0], as_json(result))
    drawings = {f"guidelines-{name}": draw for name, draw in guideline_figures(result).items()}
    return written + write_figures(options, drawings)
