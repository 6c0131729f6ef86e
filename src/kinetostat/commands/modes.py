"""The command `modes`: where a machine rings, and how its tool feels a varying force. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    add_command,
    direction,
    give,
    load_machine,
    takes_figures,
    takes_json,
    takes_loaded,
    takes_machine,
    write_figures,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from kinetostat.commands.common import Commands
    from kinetostat.studies.vibration import Vibration


def add_modes_command(commands: "Commands") -> None:
    """Add `modes`."""
    command = add_command(
        commands, "modes", _modes, "compute natural frequencies and modes, and the receptance of the tool",
        'kinetostat modes hexapod --set tool.mass="12 kg" -o modes',
    )  # fmt: skip
    takes_machine(command)
    takes_loaded(command, "vibrations about the state of rest under the loads, with tensions and weights")
    command.add_argument(
        "--along",
        metavar="X,Y,Z",
        type=direction,
        help="direction in which the tool is pushed, for the response (default: that of [cutting], else x, y and z)",
    )
    command.add_argument(
        "--cutting-pressure", metavar="PRESSURE",
        help='cutting force per area of the chip, e.g. "2000 N/mm**2": tells the width of cut that stays stable in the '
        "direction of --along",
    )  # fmt: skip
    command.add_argument(
        "--from", metavar="FREQUENCY", dest="lowest",
        help='lowest frequency of the response, e.g. "10 Hz" (default: a fifth of the first mode)',
    )  # fmt: skip
    command.add_argument(
        "--to", metavar="FREQUENCY", dest="highest",
        help='highest frequency of the response, e.g. "500 Hz" (default: above the sixth mode)',
    )  # fmt: skip
    takes_figures(command, "modes.csv, response.nc and the figures")
    takes_json(command)


def _modes(options: argparse.Namespace) -> int:
    from kinetostat.spec.errors import InputError
    from kinetostat.spec.fields import positive
    from kinetostat.studies.vibration import as_json, modes
    from kinetostat.views.vibration_tables import print_vibration

    pressure, lowest, highest = (
        None if value is None else positive(value, kind, option)
        for value, kind, option in (
            (options.cutting_pressure, "cutting pressure", "--cutting-pressure"),
            (options.lowest, "frequency", "--from"),
            (options.highest, "frequency", "--to"),
        )
    )
    if options.along and not any(options.along):
        raise InputError("--along is 0,0,0, which points nowhere; give three numbers that are not all 0, e.g. 0,0,1.")
    if lowest is not None and highest is not None and lowest >= highest:
        raise InputError(f"--from is {lowest:g} Hz, not below --to, {highest:g} Hz; exchange them.")
    machine = load_machine(options)
    cutting = machine.tables["cutting"]
    along = options.along or (cutting.direction if any(cutting.direction) else ())
    if pressure is not None and not along:
        raise InputError("--cutting-pressure needs the direction across the cut; add --along, e.g. --along 1,0,0.")
    answer = modes(machine)
    written = _written(options, answer, along, lowest, highest) if options.output and answer.modes else []
    return give(
        options,
        bool(answer.modes),
        lambda: as_json(answer),
        lambda console: print_vibration(console, answer, along, pressure or cutting.pressure or None),
        written,
        message=answer.message,
    )


def _written(
    options: argparse.Namespace,
    answer: "Vibration",
    along: "Sequence[float]",
    lowest: float | None,
    highest: float | None,
) -> list[Path]:
    from kinetostat.studies.storage import write_dataset, write_text
    from kinetostat.studies.vibration import as_csv, frequency_range, response_dataset
    from kinetostat.views.vibration_figures import vibration_figures

    frequencies = frequency_range(answer, lowest, highest)
    table, response = options.output / "modes.csv", options.output / "response.nc"
    write_text(table, as_csv(answer))
    write_dataset(response, response_dataset(answer, frequencies))
    return [table, response, *write_figures(options, vibration_figures(answer, along, frequencies))]
