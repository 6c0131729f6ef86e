"""The process of one search: `python -m kinetostat.studio.design.worker FOLDER`.

It stops after its step when whoever started it closes its standard input, or ends in whatever way.
"""

import signal
import sys
import threading
from pathlib import Path

from kinetostat.spec.errors import InputError
from kinetostat.studies.optimisation.result import optimize
from kinetostat.studies.optimisation.result_data import write_result
from kinetostat.studies.optimisation.search import stored_problem
from kinetostat.studies.storage import write_text
from kinetostat.studies.study_folder import in_use

FAILURE = "failed.txt"
"""File of a search that could not go on: why."""


def work(folder: Path) -> None:
    """Search from where the folder stands, and write the answer so far."""
    stopped = threading.Event()
    threading.Thread(target=_listen, args=(stopped,), daemon=True).start()
    try:
        write_result(optimize(stored_problem(folder), folder, stop=stopped.is_set), folder)
    except InputError as error:
        if not in_use(folder):  # another process is at work, and it is well
            write_text(folder / FAILURE, str(error))
    except Exception as error:
        write_text(folder / FAILURE, f"The search ended with an error of the program: {error!r}")
        raise


def _listen(stopped: threading.Event) -> None:
    sys.stdin.buffer.read()
    stopped.set()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    work(Path(sys.argv[1]))
