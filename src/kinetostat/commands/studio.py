"""The command `studio`: a page in the browser on which to see and move a machine."""

import argparse
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.commands.common import DONE, MACHINE, add_command, load_machine, takes_units

if TYPE_CHECKING:
    from kinetostat.commands.common import Commands

FIRST = "zhang-gosselin-4dof"
"""The machine that is shown where none is named."""
PORT = 8000
"""Port of the page where none is asked for: the usual one of web servers under development."""
LOCAL = ("127.0.0.1", "localhost", "::1")
EXTRA = "nicegui"
"""Packages that the studio needs besides kinetostat itself."""


def add_studio_command(commands: "Commands") -> None:
    """Add the command."""
    studio = add_command(
        commands, "studio", _studio, "open a page in the browser to see a machine, move it, and see where it is stiff",
        "kinetostat studio tripteron --port 8010",
    )  # fmt: skip
    studio.set_defaults(doing="opening the studio", serves=True)
    studio.add_argument("machine", metavar="MACHINE", nargs="?", default=FIRST, help=f"{MACHINE}; default: {FIRST}")
    studio.add_argument(
        "--set", metavar="PATH=VALUE", action="append", default=[], dest="settings",
        help='override a field, e.g. --set geometry.base_radius="26 cm"; repeatable',
    )  # fmt: skip
    takes_units(studio)
    studio.add_argument("--port", type=_port, default=PORT, help=f"port to listen on (default: {PORT})")
    studio.add_argument(
        "--host", default=LOCAL[0],
        help="address to listen on (default: 127.0.0.1, which only this computer can reach)",
    )  # fmt: skip
    studio.add_argument(
        "--state", metavar="FOLDER", type=Path,
        help="folder for the searches and favourites of the Design tab (default: in your user data)",
    )  # fmt: skip
    studio.add_argument("--no-browser", action="store_true", help="do not open a browser")


def _port(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text[:6]) < 65536:
        raise argparse.ArgumentTypeError(f"{text} is not a port; give a number from 1 to 65535")
    return int(text)


def _studio(options: argparse.Namespace) -> int:
    from kinetostat.machine.loading import bundled
    from kinetostat.spec.errors import InputError
    from kinetostat.spec.installation import extra_command

    machine = load_machine(options)
    if find_spec(EXTRA) is None:
        raise InputError(f"the studio is not installed; install it with `{extra_command('studio')}`.")
    from kinetostat.studio.design.state_folder import check_state, usual_state
    from kinetostat.studio.serving import serve

    state = options.state or usual_state()
    check_state(state)
    if options.host not in LOCAL:
        print(
            f"kinetostat: --host {options.host} lets everyone who can reach this computer open the studio, without "
            "password or encryption: use it in a network that you trust.",
            file=sys.stderr,
        )
    name = options.machine if options.machine in bundled() and not (options.settings or options.units) else ""
    serve(machine, name, options.host, options.port, not options.no_browser, state)
    return DONE
