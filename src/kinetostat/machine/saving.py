"""A machine as a file for people: the file it was read from, with only those numbers changed that differ.

Comments, units, order and layout stay, because the text is edited (by tomlkit) and not written again. What comes out is
read once more and compared, so that a saved file always gives exactly the same machine; where the text cannot be edited
so (a leg among copies, for example), and where there is none, the whole file is written afresh.
"""

import tomllib
from collections.abc import Iterable, Iterator
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Item

from kinetostat.machine.loading import as_toml, build
from kinetostat.machine.machine import Machine, Written
from kinetostat.machine.orientation import ANGLES, FORMS, remove_replaced_form
from kinetostat.machine.parameters import values
from kinetostat.spec.document import setting_value
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Quantity, quantities
from kinetostat.spec.requirements import requirement_lines
from kinetostat.spec.tolerance_table import TABLE as TOLERANCES
from kinetostat.spec.tolerance_table import tolerance_lines

LONGEST_EDITED_TEXT = 1 << 17
"""Characters of a file that is edited: tomlkit needs a second for as many."""
MOST_EDITS = 3
"""Edits until the machine is the same: one as a rule, two where a link's cross-section becomes a number and a mass."""
TABLES_WITH_NAMES = ("joints", "links")
"""Tables of a leg whose entries have names."""


def as_file(machine: Machine) -> str:
    """Return the text of a machine file that `load` reads back as exactly the same machine.

    Args:
        machine: the machine whose file, where it was read from one, keeps its comments, units and order.
    """
    written = machine.written
    kept = _edited_text(written, machine) if written and len(written.text) <= LONGEST_EDITED_TEXT else None
    return as_toml(machine, readable=True) if kept is None else kept


def written_at(machine: Machine, paths: Iterable[str]) -> dict[str, Any]:
    """Return what the file of a machine says at the paths of numbers; None of those of which it says nothing.

    One value that stands for all entries is that of each of them.
    """
    document = tomllib.loads(machine.written.text) if machine.written else {}
    return {path: _value_at(document, path.split(".")) for path in paths}


def _value_at(at: Any, keys: list[str]) -> Any:
    try:
        for key in keys:
            at = _inside(at, key) if isinstance(at, dict | list) else at
    except (LookupError, ValueError):
        return None
    return at


def _edited_text(written: Written, machine: Machine) -> str | None:
    """Return the text with the numbers of the machine; None where editing does not lead to it."""
    try:
        document = tomlkit.parse(written.text)
        remove_replaced_form(document, written.settings, tuple(quantities(machine.family.tables["pose"])), machine.name)
        for setting in (text for text in written.settings if not text.startswith(TOLERANCES)):
            path, _, text = setting.partition("=")
            *table, key = path.strip().split(".")
            home = _place(document, table)
            if isinstance(home, dict | list):  # else one value stands for all entries, and one of them was set
                _put(home, key, setting_value(text.strip()))
        for _ in range(MOST_EDITS):
            text = tomlkit.dumps(document)
            present = build(text, machine.name)
            if _is_same(present, machine):
                return text
            _write_differences(document, present, machine)
    except (TOMLKitError, InputError, LookupError, TypeError, ValueError):
        return None
    return None


def _is_same(first: Machine, second: Machine) -> bool:
    alike = first.name == second.name and first.family.literals == second.family.literals
    alike = (
        alike
        and first.loaded == second.loaded
        and first.display == second.display
        and first.requirements == second.requirements
        and list(first.tolerances.items()) == list(second.tolerances.items())
    )
    return alike and first.family.name == second.family.name and values(first) == values(second)


def _write_differences(document: Any, present: Machine, machine: Machine) -> None:
    """Write all that differs between the machine in the document and the wanted one."""
    if machine.name != present.name:
        _put(document, "name", machine.name)
    if machine.requirements != present.requirements:
        document.update(tomlkit.parse("\n".join(requirement_lines(machine.requirements))))
    if list(machine.tolerances.items()) != list(present.tolerances.items()):
        document.update(tomlkit.parse("\n".join(tolerance_lines(machine.tolerances))))
    if machine.loaded != present.loaded:
        _put(_place(document, ["load"]), "state", machine.state)
    for table, literals in machine.family.literals.items():
        known = present.family.literals.get(table, {})
        for key in (key for key, value in literals.items() if known.get(key) != value):
            _put(_place(document, table.split(".") if table else []), key, literals[key])
    if any(form in document.get("pose", {}) for form in FORMS) and machine.tables["pose"] != present.tables["pose"]:
        remove_replaced_form(document, [f"pose.{name}=" for name in ANGLES], ANGLES, machine.name)
    for table, name, quantity in _fields(machine):
        new = getattr(machine.tables[table], name)
        old = getattr(present.tables.get(table), name, None)
        if new != old:
            _put(*_field(_place(document, table.split(".")), name, quantity, new, old))


def _fields(machine: Machine) -> Iterator[tuple[str, str, Quantity]]:
    for table, fields in machine.family.every_table.items():
        yield from ((table, name, quantity) for name, quantity in quantities(fields).items())


def _field(home: Any, name: str, quantity: Quantity, new: Any, old: Any) -> tuple[Any, str, Any]:
    """Return the table, the key and the value that stand for the new numbers of a field."""
    if isinstance(home, list):  # springs in series, each a text of its name and its stiffness
        names = [str(text).partition(" ")[0] for text in home]
        place = names.index(name)
        return home, str(place), f"{name} {quantity.in_file(new, home[place].partition(' ')[2])}"
    before = home.get(name)
    if quantity.count is None:
        return home, name, quantity.in_file(new, before)
    if isinstance(before, list) and old is not None:
        for i, (value, former) in enumerate(zip(new, old, strict=True)):
            if value != former:
                before[i] = quantity.in_file(value, before[i])
        return home, name, before
    alike = not quantity.apart and len(set(new)) == 1
    return home, name, quantity.in_file(new[0], before) if alike else [quantity.in_file(v, before) for v in new]


def _place(document: Any, keys: list[str]) -> Any:
    """Return the table, or the list, at a path; legs, joints and links by their names. Missing tables are added."""
    at = document
    for key in keys:
        inner = _inside(at, key)
        if inner is None:
            at[key] = tomlkit.table()
            inner = at[key]
        at = inner
    return at


def _inside(at: Any, key: str) -> Any:
    if isinstance(at, list):
        named = [entry for entry in at if isinstance(entry, dict) and entry.get("name") == key]
        return named[0] if named else at[int(key)]
    lists = (_inside(at[inner], key) for inner in TABLES_WITH_NAMES if inner in at and key not in at)
    return at[key] if key in at else next((entry for entry in lists if entry is not None), None)


def _put(home: Any, key: str, value: Any) -> None:
    """Put a value into a table or a list; a comment behind it stays in its column."""
    if isinstance(home, list):
        home[int(key)] = value
        return
    before = home.get(key)
    if before is value:
        return
    home[key] = value
    after = home[key]
    if isinstance(before, Item) and isinstance(after, Item) and before.trivia.comment:
        room = len(before.trivia.comment_ws) + len(before.as_string()) - len(after.as_string())
        after.trivia.comment_ws = " " * max(1, room)
