"""The command as a process: `kinetostat`, or `python -m kinetostat`. What it does is in `cli`."""

import gc
import os
import signal
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Matrices of machines are small: threads of the linear algebra wait for each other longer than they compute, and forty
# times as long where the processor has other work. Batches are spread over threads by the engine.
FIRST_COLLECTION, FURTHER_COLLECTIONS = 1_000_000, 100_000
"""Objects after which Python looks for garbage: libraries make half a million that stay as long as the process, and to
look through them hundreds of times takes a sixth of their import."""
CODE = 130
"""Exit code of a command that Ctrl-C has stopped: 128 and the number of the signal, as shells have it."""


def _collect_more_often(phase: str, _about: dict[str, int]) -> None:
    """After the first collection, which has seen the libraries."""
    if phase == "stop":
        gc.set_threshold(FURTHER_COLLECTIONS, *gc.get_threshold()[1:])
        gc.callbacks.remove(_collect_more_often)


gc.set_threshold(FIRST_COLLECTION, *gc.get_threshold()[1:])
gc.callbacks.append(_collect_more_often)


def main() -> int:
    """Run the command; Ctrl-C while its program is still being read ends it at once, as nothing has been done yet.

    Returns:
        The exit code.
    """
    obeyed = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # not where a shell has it ignored
    if obeyed:
        signal.signal(signal.SIGINT, lambda *_: os._exit(CODE))
    from kinetostat.cli import main as run
    from kinetostat.late import hide_array_libraries

    hide_array_libraries()
    if obeyed:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    code = run()
    gc.freeze()  # what is left ends with the process: to look through it for garbage would take a tenth of a small map
    if code == CODE and hasattr(signal, "pthread_sigmask"):
        # Where Ctrl-C came in the middle of an `exec`, Python would end itself by the signal, whatever the code.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    return code


if __name__ == "__main__":
    sys.exit(main())
