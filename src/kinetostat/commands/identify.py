"""The command `identify`: from measurements to the numbers of the machine as built. No formula lives here."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    add_command,
    give,
    load_machine,
    search_bar,
    takes_figures,
    takes_json,
    takes_machine,
    write_figures,
)

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands
    from kinetostat.studies.identification.identification import Identification


def add_identify_command(commands: "Commands") -> None:
    """Add `identify`."""
    command = add_command(
        commands, "identify", _identify, "find the errors of a machine as built that explain what was measured of it",
        "kinetostat identify hexapod measured.csv --fit geometry --fit zeros --frame -o identified",
    )  # fmt: skip
    takes_machine(command)
    command.add_argument(
        "data", metavar="DATA", type=Path,
        help="a CSV file: columns of the commanded pose (x [mm], roll [deg]) or actuators (actuator.leg 1 [mm]) and of "
        "what was measured (measured.x [mm], measured.rx [deg], measured.distance [mm], deflection.z [um]), with "
        "sigma.x [um], force.z [N] and from.x [mm] where they belong",
    )  # fmt: skip
    command.add_argument(
        "--fit", metavar="WHAT", action="append", default=[],
        help="geometry, zeros, gains, compliances, shared, or paths with * (default: geometry and zeros); repeatable",
    )  # fmt: skip
    command.add_argument("--frame", action="store_true", help="the place of the measuring frame is unknown")
    command.add_argument("--target", action="store_true", help="the place of the target on the platform is unknown")
    command.add_argument("--sigma", metavar="LENGTH", default="", help='of measured lengths, e.g. --sigma "5 um"')
    command.add_argument("--sigma-angle", metavar="ANGLE", default="", help='of angles, e.g. --sigma-angle "20 urad"')
    for name, text in (("prior", "standard deviation about zero before measuring"), ("bound", "largest size")):
        command.add_argument(
            f"--{name}", metavar="WHAT=SIZE", action="append", default=[], dest=f"{name}s",
            help=f'{text} by group or path, e.g. --{name} "zeros=0.1 mm"; repeatable',
        )  # fmt: skip
    command.add_argument("--no-outliers", action="store_true", help="keep all values: outliers are not set aside")
    command.add_argument("--next", type=int, default=0, metavar="N", help="propose N poses to measure next")
    takes_figures(
        command, "the machine as built (TOML), the record of the fit (JSON), poses to measure next (CSV) and figures"
    )
    takes_json(command)


def _identify(options: argparse.Namespace) -> int:
    from kinetostat.studies.identification.identification import USUALLY_FITTED, as_json, identify
    from kinetostat.views.identification_tables import print_identification

    with search_bar("fitting") as update:
        answer = identify(
            load_machine(options),
            options.data,
            options.fit or USUALLY_FITTED,
            frame=options.frame,
            target=options.target,
            sigma=options.sigma,
            sigma_angle=options.sigma_angle,
            priors=_given(options.priors, "--prior"),
            bounds=_given(options.bounds, "--bound"),
            robust=not options.no_outliers,
            more=options.next,
            tell=update,
        )
    written = _write(options, answer) if options.output else []
    return give(options, True, lambda: as_json(answer), lambda console: print_identification(console, answer), written)


def _given(texts: list[str], option: str) -> dict[str, str]:
    from kinetostat.spec.errors import InputError, shorten

    given = {}
    for text in texts:
        name, equals, size = (part.strip() for part in text.partition("="))
        if not (name and equals and size):
            raise InputError(f'{option} {shorten(text)} must be what=size, e.g. {option} "zeros=0.1 mm".')
        given[name] = size
    return given


def _write(options: argparse.Namespace, answer: "Identification") -> list[Path]:
    """Write the machine as built, the record and the figures."""
    from kinetostat.accuracy.built import as_built
    from kinetostat.exchange.leg_by_leg import built_text
    from kinetostat.spec.errors import InputError
    from kinetostat.studies.identification.identification import as_json
    from kinetostat.studies.identification.next_poses import as_csv
    from kinetostat.studies.storage import write_json, write_text
    from kinetostat.views.identification_figures import identification_figures

    record, notes, written = as_json(answer), [], []
    try:
        built = as_built(answer.machine, answer.errors)
    except InputError as error:
        record["machine_file"] = str(error)
    else:
        record["home"] = {"commands": built.commands, "actuators": built.coordinates, "senses": built.senses}
        notes = [f"{answer.machine.name} as built, from {answer.observed.data.path}."]
        notes += ["Zeros and gains of actuators are in the record of the fit; coordinates here are the real ones."]
        machine = options.output / "machine.toml"
        write_text(machine, built_text(answer.machine, built.configuration, notes))
        written.append(machine)
    path = options.output / "fit.json"
    write_json(path, record)
    written.append(path)
    if answer.next is not None:
        written.append(options.output / "next-poses.csv")
        write_text(written[-1], as_csv(answer.next))
    return [*written, *write_figures(options, identification_figures(answer))]
