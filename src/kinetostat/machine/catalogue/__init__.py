"""The families: one file each, found by itself. A module here with a `FAMILY` is in the catalogue; nothing else is."""

import importlib
import pkgutil
from functools import cache

from kinetostat.machine.machine import Family


@cache
def families() -> dict[str, Family]:
    """Every family by name, in alphabetical order."""
    modules = (importlib.import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__))
    return {family.name: family for family in sorted((m.FAMILY for m in modules), key=lambda family: family.name)}
