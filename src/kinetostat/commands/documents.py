"""The commands `report`, `export` and `reproduce`, which write documents and files for others, and `studio`, a page.

No formula lives here.
"""

import argparse
import re
import sys
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import (
    DONE,
    LOCAL_HOSTS,
    MACHINE_HELP,
    NO_ANSWER,
    add_command,
    as_wanted,
    list_written,
    load_machine,
    no_answer,
    print_result,
    progress_bar,
    takes_figures,
    takes_json,
    takes_loaded,
    takes_machine,
    takes_ranges,
    takes_settings,
    takes_units,
    whole_number,
)
from kinetostat.commands.design import search_with_bar

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands

EXPORT_FORMATS = (
    "mjcf", "mjcf-vibration", "urdf", "c", "mex", "linuxcnc", "fmu", "page", "link", "glb", "step", "csv", "netcdf",
    "mat", "modes", "state-space", "klipper", "reprapfirmware", "nastran", "abaqus", "ansys",
)  # fmt: skip
"""Formats of `export`, which help names without loading what writes them."""
REPORT_PARTS = ("maps", "guidelines", "sensitivity", "validation")
"""Parts that `report --without` omits, which help names without loading `studies.report`."""
SHOWN_MACHINE = "zhang-gosselin-4dof"
"""The machine that is shown where none is named."""
USUAL_PORT = 8000
"""Port of the page where none is asked for: the usual one of web servers under development."""
GREATEST_PORT = 65535
"""Ports have 16 bits; 0 would stand for any port that is free, which no browser could know."""
STUDIO_PACKAGE = "nicegui"
"""Package without which the studio is not installed."""
NEEDS = """\
what formats need:
c, mex, linuxcnc, fmu, page, link: legs with closed forms (three parallel revolutes, or a ball joint at an end).
klipper, reprapfirmware: coordinates x, y and z in the pose, and a load; klipper a rest at all points as well.
modes, state-space, mjcf-vibration: something that has a mass.
nastran, abaqus, ansys: a machine that is rigid in no direction.
An export that a machine cannot fill says so in a sentence and writes nothing."""


def add_document_commands(commands: "Commands") -> None:
    """Add `report`, `export`, `reproduce` and `studio`."""
    _add_report_command(commands)
    _add_export_command(commands)
    reproduce = add_command(
        commands, "reproduce", _reproduce, "recompute every table, equation and figure of the paper and compare",
        "kinetostat reproduce -o reproduce",
    )  # fmt: skip
    takes_figures(reproduce, "the page, tables and figures (default: reproduce)")
    reproduce.set_defaults(output=Path("reproduce"))
    reproduce.add_argument("--full", action="store_true", help="print every number, equation and statement")
    takes_json(reproduce)
    _add_studio_command(commands)


def _add_export_command(commands: "Commands") -> None:
    command = add_command(
        commands, "export", _export, "write the machine or its results for other programs",
        "kinetostat export tripteron --to mjcf -o tripteron.xml",
    )  # fmt: skip
    command.epilog = f"{NEEDS}\n\n{command.epilog}"
    takes_machine(command)
    command.add_argument(
        "--to",
        metavar="FORMAT",
        help=f"{', '.join(EXPORT_FORMATS[:-1])} or {EXPORT_FORMATS[-1]} (default: given by the suffix of the file)",
    )
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="the file (default: the name of the machine)"
    )
    in_c = {
        "inputs": "of c, mex, fmu and page: parameters that become arguments",
        "outputs": "of c, mex, fmu and page: quantities, as compliance_x",
    }
    for kind, names in (("inputs", "forces fx,fy,fz,mx,my,mz"), ("outputs", "motions x,y,z,rx,ry,rz")):
        command.add_argument(
            f"--{kind}", metavar="NAMES", type=_names,
            help=f"of a state space: {names} of the tool, or names of actuators (default: the tool's); {in_c[kind]}",
        )  # fmt: skip
    takes_ranges(command, "of klipper and reprapfirmware: the ranges of x and of y; default: about the pose")


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _add_report_command(commands: "Commands") -> None:
    command = add_command(
        commands, "report", _report, "write one document about a machine or a study for a design review",
        'kinetostat report tripteron --set \'load.force=["0 N","0 N","-500 N"]\' -o tripteron.pdf',
    )  # fmt: skip
    command.add_argument(
        "subject", metavar="MACHINE|STUDY",
        help="a machine or study file, the name of a bundled one (see `kinetostat list`), or the folder of a study",
    )  # fmt: skip
    takes_settings(command, "override a field of the machine or of the study; repeatable")
    takes_units(command)
    takes_ranges(command, "an axis of the maps (one or two); default: two coordinates of the pose, over their reach")
    command.add_argument(
        "--without", metavar="PART", action="append", default=[], choices=REPORT_PARTS,
        help=f"omit a part that takes time: {', '.join(REPORT_PARTS)}; repeatable",
    )  # fmt: skip
    takes_loaded(command, "also show the machine at rest under its loads")
    command.add_argument(
        "--engine",
        help="independent engine for the validation: exudyn or pynite (default: the first that is installed)",
    )
    command.add_argument(
        "--fit", metavar="FOLDER", type=Path,
        help="also show an identification of the machine: the folder of `identify -o`, or its fit.json",
    )  # fmt: skip
    command.add_argument(
        "--motion", metavar="FILE", type=Path,
        help="also show what a motion asks of the drives: a CSV file as `kinetostat drives` takes it",
    )  # fmt: skip
    command.add_argument(
        "--elevations", metavar="FROM:TO:COUNT", default="",
        help='also show what gravity does while the machine tilts, e.g. "0 deg:90 deg:7", as `kinetostat elevation`',
    )  # fmt: skip
    command.add_argument("--author", help="author in the title block")
    command.add_argument(
        "--date", help="date in the title block (default: none, so that equal input gives equal files)"
    )
    command.add_argument(
        "-o", "--output", type=Path, default=Path("report.html"), help="the file, .html or .pdf (default: report.html)"
    )


def _add_studio_command(commands: "Commands") -> None:
    studio = add_command(
        commands, "studio", _studio, "open a page in the browser to see a machine, move it, and see where it is stiff",
        "kinetostat studio tripteron --port 8010",
    )  # fmt: skip
    studio.set_defaults(doing="opening the studio", serves=True)
    takes_machine(studio, f"{MACHINE_HELP}; default: {SHOWN_MACHINE}", SHOWN_MACHINE)
    studio.add_argument("--port", type=_port, default=USUAL_PORT, help=f"port to listen on (default: {USUAL_PORT})")
    studio.add_argument(
        "--host", default=LOCAL_HOSTS[0],
        help=f"address to listen on (default: {LOCAL_HOSTS[0]}, which only this computer can reach)",
    )  # fmt: skip
    studio.add_argument(
        "--state", metavar="FOLDER", type=Path,
        help="folder for the searches and favourites of the Design tab (default: in your user data)",
    )  # fmt: skip
    studio.add_argument("--no-browser", action="store_true", help="do not open a browser")


def _report(options: argparse.Namespace) -> int:
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.report import gather, subject_of
    from kinetostat.views.report.writing import ReportOptions, report_path, write_report
    from kinetostat.views.tables import print_written, terminal

    path = report_path(options.output)
    wanted = ReportOptions(**{field.name: getattr(options, field.name) for field in fields(ReportOptions)})
    subject = subject_of(options.subject, options.settings)
    result = search_with_bar(subject.problem, subject.folder) if subject.problem else None
    if result is not None and not result.solved:
        return no_answer(result.message)
    result = result.in_units(options.units) if result and options.units else result
    machine = as_wanted(options, subject.machine if result is None else result.machine)
    with progress_bar("computing") as progress:
        answers = gather(
            machine,
            wanted.ranges,
            wanted.without,
            result,
            progress,
            fit=wanted.fit,
            motion=wanted.motion,
            elevations=wanted.elevations,
        )
        if answers.analysis.status is Status.OK:
            words = [options.subject, *(word for text in options.settings for word in ("--set", text))]
            write_report(answers, wanted, words, subject.inputs, path, progress)
    if answers.analysis.status is not Status.OK:
        return no_answer(answers.analysis.message)
    list_written(None, [path])
    print_written(terminal(), [path])
    return DONE if all(verdict.met for verdict in answers.of("requirements") or ()) else NO_ANSWER


def _export(options: argparse.Namespace) -> int:
    from kinetostat.exchange.formats import format_for
    from kinetostat.kinematics.status import Status
    from kinetostat.studies.analysis import analyze
    from kinetostat.studies.storage import place_of
    from kinetostat.views.tables import print_written, terminal

    export_format = format_for(options.to, options.output)
    if options.output:
        place_of(options.output)  # a place that cannot be written is refused before anything is computed
    analysis = analyze(load_machine(options))
    if analysis.status is not Status.OK:
        return no_answer(analysis.message)
    stem = re.sub(r"[^\w.-]+", "-", Path(options.machine).stem).strip("-")
    path = options.output or Path(f"{stem}{export_format.suffix}")
    written = export_format.write(
        analysis, path, inputs=options.inputs, outputs=options.outputs, over=options.ranges or None
    )
    print_written(terminal(), written)
    return DONE


def _reproduce(options: argparse.Namespace) -> int:
    from kinetostat.studies.reproduction import reproduce
    from kinetostat.views.data_forms import json_of
    from kinetostat.views.paper import REPRODUCTION, print_summary, write_all

    with progress_bar("reproducing") as progress:
        reproduction = reproduce(progress)
    with progress_bar("drawing") as progress:
        written = write_all(reproduction, options.output, options.formats, progress)
    list_written(options.output, written)
    return print_result(
        options,
        reproduction.explained,
        lambda: json_of(REPRODUCTION, reproduction),
        lambda console: print_summary(console, reproduction, written, options.full),
    )


def _port(text: str) -> int:
    return whole_number(text, f"a port; give a number from 1 to {GREATEST_PORT}", 1, GREATEST_PORT)


def _studio(options: argparse.Namespace) -> int:
    from kinetostat.machine.loading import bundled
    from kinetostat.spec.errors import InputError
    from kinetostat.spec.installation import extra_command

    machine = load_machine(options)
    if find_spec(STUDIO_PACKAGE) is None:
        raise InputError(f"the studio is not installed; install it with `{extra_command('studio')}`.")
    from kinetostat.studio.design.state_folder import check_state, usual_state
    from kinetostat.studio.serving import serve

    state = options.state or usual_state()
    check_state(state)
    if options.host not in LOCAL_HOSTS:
        print(
            f"kinetostat: --host {options.host} lets everyone who can reach this computer open the studio, without "
            "password or encryption: use it in a network that you trust.",
            file=sys.stderr,
        )
    name = options.machine if options.machine in bundled() and not (options.settings or options.units) else ""
    serve(machine, name, options.host, options.port, not options.no_browser, state)
    return DONE
