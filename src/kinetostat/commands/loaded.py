"""Commands about machines under load: `analyze --loaded`. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    NO_ANSWER,
    give,
    verdicts_of,
    write_figures,
)

if TYPE_CHECKING:
    from kinetostat.machine.machine import Machine
    from kinetostat.studies.under_load import LoadedState


def analyze_loaded(options: argparse.Namespace, machine: "Machine") -> int:
    """Answer `analyze` about the machine under its loads and return the exit code.

    Raises:
        InputError: options that only the unloaded machine has.
    """
    from kinetostat.equilibrium.solving import Rest
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.under_load import as_json, under_load
    from kinetostat.views.loaded_tables import print_loaded

    if options.along or options.axes != "base":
        which = "--loaded" if options.loaded else 'state = "loaded" in [load]'
        raise InputError(
            f"{which} gives results in base axes only; leave --along and --axes out, or add --set load.state=free."
        )
    state, verdicts = under_load(machine), verdicts_of(machine)
    code = give(
        options,
        bool(state.displacement),
        lambda: as_json(state, verdicts),
        lambda console: print_loaded(console, state, verdicts),
        _drawn(options, state),
        message=state.message,
    )
    kept = state.rest is not Rest.JOINT_LIMIT and all(verdict.met for verdict in verdicts)
    return code if kept else NO_ANSWER


def _drawn(options: argparse.Namespace, state: "LoadedState") -> list[Path]:
    """Write the figures of a loaded machine, if a folder is given and it is at rest."""
    if not options.output:
        return []
    from kinetostat.views.loaded_figures import loaded_figures

    return write_figures(options, {name.replace(" ", "-"): draw for name, draw in loaded_figures(state).items()})
