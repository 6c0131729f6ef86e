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
MOST_EDITS = 2
"""Edits until the machine is the same: one as a rule, two where a link's cross-section becomes a number and a mass. The
file of a machine that differs after the last one is written afresh."""
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


def _value_at(value: Any, keys: list[str]) -> Any:
    """Return what stands in a document below some keys; a value where a table or list would be stands for all in it."""
    try:
        for key in keys:
            value = _inside(value, key) if isinstance(value, dict | list) else value
    except (LookupError, ValueError):
        return None
    return value


def _edited_text(written: Written, machine: Machine) -> str | None:
    """Return the text with the numbers of the machine; None where editing does not lead to it."""
    try:
        document = tomlkit.parse(written.text)
        remove_replaced_form(document, written.settings, tuple(quantities(machine.family.tables["pose"])), machine.name)
        for setting in (setting for setting in written.settings if not setting.startswith(TOLERANCES)):
            path, _, value = setting.partition("=")
            *table, key = path.strip().split(".")
            container = _table_at(document, table)
            if isinstance(container, dict | list):  # else one value stands for all entries, and one of them was set
                _put(container, key, setting_value(value.strip()))
        for edits_left in reversed(range(MOST_EDITS + 1)):
            edited = tomlkit.dumps(document)
            present = build(edited, machine.name)
            if _is_same(present, machine):
                return edited
            if edits_left:
                _write_differences(document, present, machine)
    except (TOMLKitError, InputError, LookupError, TypeError, ValueError):
        return None
    return None


def _is_same(first: Machine, second: Machine) -> bool:
    """Whether two machines have equal files; tolerances also in their order, because later ones hold."""
    return (
        first.name == second.name
        and first.family.name == second.family.name
        and first.family.literals == second.family.literals
        and first.loaded == second.loaded
        and first.display == second.display
        and first.requirements == second.requirements
        and list(first.tolerances.items()) == list(second.tolerances.items())
        and values(first) == values(second)
    )


def _write_differences(document: Any, present: Machine, machine: Machine) -> None:
    """Write all that differs between the machine in the document and the wanted one."""
    if machine.name != present.name:
        _put(document, "name", machine.name)
    if machine.requirements != present.requirements:
        document.update(tomlkit.parse("\n".join(requirement_lines(machine.requirements))))
    if list(machine.tolerances.items()) != list(present.tolerances.items()):
        document.update(tomlkit.parse("\n".join(tolerance_lines(machine.tolerances))))
    if machine.loaded != present.loaded:
        _put(_table_at(document, ["load"]), "state", machine.state)
    for table, literals in machine.family.literals.items():
        known = present.family.literals.get(table, {})
        for key in (key for key, value in literals.items() if known.get(key) != value):
            _put(_table_at(document, table.split(".") if table else []), key, literals[key])
    if any(form in document.get("pose", {}) for form in FORMS) and machine.tables["pose"] != present.tables["pose"]:
        remove_replaced_form(document, [f"pose.{name}=" for name in ANGLES], ANGLES, machine.name)
    for table, name, quantity in _fields(machine):
        new = getattr(machine.tables[table], name)
        old = getattr(present.tables.get(table), name, None)
        if new != old:
            _put_numbers(_table_at(document, table.split(".")), name, quantity, new, old)


def _fields(machine: Machine) -> Iterator[tuple[str, str, Quantity]]:
    for table, fields in machine.family.every_table.items():
        yield from ((table, name, quantity) for name, quantity in quantities(fields).items())


def _put_numbers(container: Any, name: str, quantity: Quantity, new: Any, old: Any) -> None:
    """Put the new numbers of a field into its table, in the units in which the old ones are written."""
    if isinstance(container, list):  # springs in series, each a text of its name and its stiffness
        number = [str(text).partition(" ")[0] for text in container].index(name)
        container[number] = f"{name} {quantity.in_file(new, container[number].partition(' ')[2])}"
        return
    before = container.get(name)
    if quantity.count is None:
        _put(container, name, quantity.in_file(new, before))
    elif isinstance(before, list) and old is not None:
        for i, (value, former) in enumerate(zip(new, old, strict=True)):
            if value != former:
                before[i] = quantity.in_file(value, before[i])
    elif not quantity.apart and len(set(new)) == 1:  # one value stands for all
        _put(container, name, quantity.in_file(new[0], before))
    else:
        _put(container, name, [quantity.in_file(value, before) for value in new])


def _table_at(document: Any, keys: list[str]) -> Any:
    """Return the table, or the list, at a path; legs, joints and links by their names. Missing tables are added."""
    table = document
    for key in keys:
        if _inside(table, key) is None:
            table[key] = tomlkit.table()
        table = _inside(table, key)
    return table


def _inside(container: Any, key: str) -> Any:
    """Return an entry of a table by its key, or of a list by its name or number; None of a table that lacks it."""
    if isinstance(container, list):
        named = [entry for entry in container if isinstance(entry, dict) and entry.get("name") == key]
        return named[0] if named else container[int(key)]
    if key in container:
        return container[key]
    entries = (_inside(container[name], key) for name in TABLES_WITH_NAMES if name in container)
    return next((entry for entry in entries if entry is not None), None)


def _put(container: Any, key: str, value: Any) -> None:
    """Put a value into a table or a list; a comment behind it stays in its column."""
    if isinstance(container, list):
        container[int(key)] = value
        return
    before = container.get(key)
    if before is value:
        return
    container[key] = value
    after = container[key]
    if isinstance(before, Item) and isinstance(after, Item) and before.trivia.comment:
        room = len(before.trivia.comment_ws) + len(before.as_string()) - len(after.as_string())
        after.trivia.comment_ws = " " * max(1, room)
