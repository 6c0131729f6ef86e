"""Modules that are imported when something in them is first used: for parts that most runs never reach.

Where a module has a use for few of those who import it, it names it twice: to the type checker, and here.

    if TYPE_CHECKING:
        from kinetostat.equilibrium import solving
    else:
        solving = LateModule("kinetostat.equilibrium.solving")

The imports stay at the head of the file, and `tests/architecture` reads them as all others.
"""

from importlib import import_module
from typing import Any


class LateModule:
    """Stands for a module, and imports it when an attribute of it is first asked for."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        return getattr(import_module(self._name), attribute)
