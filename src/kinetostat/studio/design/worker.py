"""The process of a search, `python -m kinetostat.studio.design.worker`: it waits for a folder and searches there.

It is started before a search needs it, because importing takes longer than the first steps. Libraries of arrays for
which a search has no use are left out, as in a command.
"""

import json
import signal
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from kinetostat.late import LateModule, hide_array_libraries
from kinetostat.spec.errors import InputError
from kinetostat.studies.storage import write_text
from kinetostat.studies.study_folder import in_use

if TYPE_CHECKING:
    from kinetostat.studies.optimisation import search
    from kinetostat.views import optimisation
else:
    search = LateModule("kinetostat.studies.optimisation.search")
    optimisation = LateModule("kinetostat.views.optimisation")

FAILURE = "failed.txt"
"""File in the folder of a search that could not go on, with the reason."""


def work() -> None:
    """Search on from the records in a folder and write the result so far.

    The folder is the first line of the standard input, which comes when a search needs the process, or never.
    """
    optimize, write_result = search.optimize, optimisation.write_result  # imported while nobody waits
    line = sys.stdin.buffer.readline()
    if not line:
        return
    folder, stopped = Path(json.loads(line)), threading.Event()
    threading.Thread(target=_listen, args=(stopped,), daemon=True).start()
    try:
        write_result(optimize(search.stored_problem(folder), folder, stop=stopped.is_set), folder)
    except InputError as error:
        if not in_use(folder):  # otherwise another process is at work here, and the search is not a failure
            write_text(folder / FAILURE, str(error))
    except Exception as error:
        write_text(folder / FAILURE, f"The search ended with an error of the program: {error!r}")
        raise


def _listen(stopped: threading.Event) -> None:
    """Wait until standard input is closed, then ask the search to stop after its step."""
    sys.stdin.buffer.read()
    stopped.set()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in the terminal is for the server, which closes our input
    hide_array_libraries()
    work()
