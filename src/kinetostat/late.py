"""Modules that are imported when something in them is first used, and libraries that nobody is to import unasked.

Where a module has a use for few of those who import it, it names it twice: to the type checker, and here.

    if TYPE_CHECKING:
        from kinetostat.equilibrium import solving
    else:
        solving = LateModule("kinetostat.equilibrium.solving")

The imports stay at the head of the file, and `tests/architecture` reads them as all others.
"""

import sys
from importlib import import_module
from typing import Any


class LateModule:
    """Stands for a module, and imports it when an attribute of it is first asked for."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        return getattr(import_module(self._name), attribute)


ARRAY_LIBRARIES = ("dask", "pint")
"""Libraries that xarray imports with its first dataset where they are installed, so as to know their arrays."""


def hide_array_libraries() -> None:
    """Let imports of array libraries fail, as if they were not installed.

    A command hands none of their arrays to xarray, and they take longer to import than a map takes to compute. What
    needs one calls `show_array_libraries` before, with its name.
    """
    for name in ARRAY_LIBRARIES:
        sys.modules.setdefault(name, None)  # type: ignore[arg-type]


def show_array_libraries(*names: str) -> None:
    """Let array libraries be imported again, where they had been hidden."""
    for name in names:
        if sys.modules.get(name, sys) is None:
            del sys.modules[name]
