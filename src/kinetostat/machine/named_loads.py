"""Loads at points of the platform that have names: tables [load.NAME] in any machine file.

A machine whose file has some gets a family of its own, whose files have these tables. `Machine.load_at` adds them up.
"""

from dataclasses import replace
from functools import lru_cache

from kinetostat.machine.common_tables import Load
from kinetostat.machine.machine import Family
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import quantities

KEPT = 64
"""Families with named loads that are kept, so that machines with the same names share tables and compiled programs."""
MOST_LOADS = 16
"""Named loads of a machine: more is a mistake."""


def family_with_loads(family: Family, document: Document, origin: str) -> Family:
    """The family whose machine files have a table for each named load of a document; itself without any.

    Raises:
        InputError: a name that cannot be one, or too many of them.
    """
    load = document.get("load")
    entries = load.items() if isinstance(load, dict) else ()
    tables = {key: value for key, value in entries if isinstance(value, dict) and key not in quantities(Load)}
    names = tuple(key for key, value in tables.items() if not all(entry.isdecimal() for entry in value))
    if len(names) > MOST_LOADS:
        raise InputError(f'"{origin}": [load] has {len(names)} named loads; at most {MOST_LOADS} are allowed.')
    for name in names:
        if not name.isidentifier() or len(name) > 40:
            raise InputError(
                f'"{origin}": [load.{shorten(name)}] cannot be the name of a load; take letters, digits and _, at most '
                "40 of them, e.g. [load.counterweight]."
            )
    return _with_loads(family, names) if names else family


@lru_cache(KEPT)
def _with_loads(family: Family, names: tuple[str, ...]) -> Family:
    return replace(family, loads=names, recipe=(_with_loads, (family, names)))
