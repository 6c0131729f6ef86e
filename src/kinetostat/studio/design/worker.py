"""The process of a search: `python -m kinetostat.studio.design.worker`. What it does stands in `runs`.

It starts as a command does: libraries of arrays that a search has no use for would take a third of the time until its
first step, which a designer waits for.
"""

import signal
from typing import TYPE_CHECKING

from kinetostat.late import LateModule, hide_array_libraries

if TYPE_CHECKING:
    from kinetostat.studio.design import runs
else:
    runs = LateModule("kinetostat.studio.design.runs")

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in the terminal is for the server, which closes our input
    hide_array_libraries()
    runs.work()
