"""Files to machines: the bundled ones by name, any other by path, with overrides."""

import difflib
import json
import operator
from collections.abc import Sequence
from functools import cache, reduce
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from kinetostat.machine.catalogue import families
from kinetostat.machine.machine import COMMON, Family, Machine
from kinetostat.spec import document as documents
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import quantities
from kinetostat.spec.validation import SCHEMA_VERSION, file_model, sections_in, validate
from kinetostat.units import show

SUFFIX = ".toml"


@cache
def bundled() -> dict[str, str]:
    """The text of every bundled machine file by name, in alphabetical order."""
    found = (resources.files("kinetostat.machine") / "bundled").iterdir()
    files = sorted((f for f in found if f.name.endswith(SUFFIX)), key=lambda f: f.name)
    return {f.name.removesuffix(SUFFIX): f.read_text(encoding="utf-8") for f in files}


def load(machine: str | Path, settings: Sequence[str] = ()) -> Machine:
    """A machine from a file, or a bundled one by its name.

    Args:
        machine: path of a TOML file, or a name from `bundled()`.
        settings: overrides "path=value", as `--set` takes them.

    Raises:
        InputError: no such machine, or a mistake in the file or an override.
    """
    name = str(machine)
    shipped = bundled()
    if name in shipped:
        return build(documents.parse(shipped[name], name), name, settings)
    path = Path(machine)
    if not _exists(path):
        near = difflib.get_close_matches(name, shipped, 1)
        hint = f'did you mean "{near[0]}"?' if near else f"bundled machines: {', '.join(shipped)}."
        raise InputError(f"{shorten(name)} is neither a file nor a bundled machine; {hint}")
    return build(documents.read(path), name, settings)


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that no file can have
        return False


def build(document: Document, origin: str, settings: Sequence[str] = ()) -> Machine:
    """A machine from a document; `origin` names it in messages.

    Raises:
        InputError: a mistake in the document or an override.
    """
    family = _family(document.get("family"), origin)
    sections = family.every_section
    written = documents.override(document, settings, _counts(family))
    data: Any = validate(written, origin, file_model(family.name, sections), sections)
    return Machine(data.name, family, sections_in(data, sections))


def _counts(family: Family) -> dict[str, int]:
    return {
        f"{name}.{field}": quantity.count
        for name, section in family.every_section.items()
        for field, quantity in quantities(section).items()
        if quantity.count is not None
    }


def _family(name: object, origin: str) -> Family:
    known = families()
    if isinstance(name, str) and name in known:
        return known[name]
    if name is None:
        raise InputError(f'"{origin}": family is missing; add family = "..." with one of: {", ".join(known)}.')
    near = difflib.get_close_matches(str(name), known, 1)
    hint = f'did you mean "{near[0]}"?' if near else f"known families: {', '.join(known)}."
    raise InputError(f'"{origin}": family is {shorten(name)}, which is not known; {hint}')


def as_toml(machine: Machine) -> str:
    """A machine file that `load` reads back as the same machine; numbers in SI with their units, all digits."""
    lines = [
        f"schema = {SCHEMA_VERSION}",
        f"name   = {json.dumps(machine.name, ensure_ascii=False)}",
        f'family = "{machine.family.name}"',
    ]
    for name, section in machine.sections.items():
        if name in COMMON and section == COMMON[name]():
            continue
        lines += ["", f"[{name}]"]
        for field, quantity in quantities(type(section)).items():
            held = getattr(section, field)
            texts = [f'"{show(value, quantity.kind)}"' for value in (held if quantity.count else (held,))]
            written = f"[{', '.join(texts)}]" if quantity.count else texts[0]
            lines.append(f"{field} = {written}")
    return "\n".join(lines) + "\n"


def template(family: str) -> str:
    """The text of a commented machine file of a family: a bundled machine to start from.

    Raises:
        InputError: no such family.
    """
    wanted = _family(family, "kinetostat new")
    return next(text for text in bundled().values() if documents.parse(text, "")["family"] == wanted.name)


def machine_schema() -> dict[str, Any]:
    """The JSON Schema of machine files of every family."""
    models = [file_model(family.name, family.every_section) for family in families().values()]
    union: Any = reduce(operator.or_, models)
    schema = TypeAdapter(union).json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "kinetostat machine file", **schema}
