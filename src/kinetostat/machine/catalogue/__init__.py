"""The families of machines in closed form: those whose modules are here, and those that other packages register."""

import importlib
import pkgutil
from functools import cache
from importlib.metadata import entry_points

from kinetostat.machine.machine import Family
from kinetostat.machine.written.plan import NAME
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError

ENTRY_POINTS = "kinetostat.families"
"""The group in which an installed package names its families, so that the command line knows them as well."""

_REGISTERED: dict[str, Family] = {}


def families() -> dict[str, Family]:
    """Return every family by name, in alphabetical order."""
    return dict(sorted({**_of_this_package(), **_REGISTERED}.items()))


@cache
def _of_this_package() -> dict[str, Family]:
    modules = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    return {value.name: value for module in modules for value in vars(module).values() if isinstance(value, Family)}


@checked
def register(family: Family) -> Family:
    """Add a family of machines to those that files may name, until the program ends.

    Machines of it are loaded, analysed, mapped, optimised and saved as those of any other family. A family of the same
    name that was registered before is replaced, as when a notebook's cell runs again.

    Args:
        family: with its tables and its kinematics in closed form (see docs/extending.md).

    Returns:
        The family.

    Raises:
        InputError: it is not a family, or kinetostat itself has one of that name.
    """
    if family.name in {*_of_this_package(), NAME}:
        raise InputError(f'family "{family.name}" belongs to kinetostat; choose another name.')
    _REGISTERED[family.name] = family
    return family


@cache
def register_installed() -> None:
    """Register the families that installed packages name as entry points; asked only where a name is not known."""
    for entry in entry_points(group=ENTRY_POINTS):
        register(entry.load())
