"""The families of machines in closed form. Every `Family` that a module here defines is in the catalogue."""

import importlib
import pkgutil
from functools import cache

from kinetostat.machine.machine import Family


@cache
def families() -> dict[str, Family]:
    """Return every family by name, in alphabetical order."""
    modules = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    defined = [value for module in modules for value in vars(module).values() if isinstance(value, Family)]
    return {family.name: family for family in sorted(defined, key=lambda family: family.name)}
