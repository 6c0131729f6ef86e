"""Files to machines and back: bundled ones by name, others by path, with overrides; machines with other numbers.

A file for people, which keeps comments and order, is written by `saving`.
"""

import copy
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinetostat.display import ENGINEERING, Display, read_display
from kinetostat.late import LateModule
from kinetostat.machine.actuators import check_own_drives, family_with_own_drives
from kinetostat.machine.catalogue import families, family_named
from kinetostat.machine.common_tables import COMMON_TABLES, STATES, NamedLoad, check_inertia
from kinetostat.machine.cross_section import with_rigidities
from kinetostat.machine.leg import Leg
from kinetostat.machine.limits import check_limits, unloaded_parts
from kinetostat.machine.links import driven_slides
from kinetostat.machine.loads import family_with_loads
from kinetostat.machine.machine import Family, Machine, Written
from kinetostat.machine.orientation import form_of, remove_replaced_form, with_angles
from kinetostat.machine.parameters import POSE, Given, check_contrast, find_field, numbered_entry, with_values
from kinetostat.machine.series import family_with_parts, with_named_parts
from kinetostat.machine.written.plan import CABLE, NAME, PLANAR_POSE, SPATIAL_POSE, SUMMARY
from kinetostat.spec import document as documents
from kinetostat.spec.arguments import as_list, checked
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, hint, shorten
from kinetostat.spec.fields import optional, quantities
from kinetostat.spec.immutable import FixedDict
from kinetostat.spec.requirements import TABLE, requirement_lines, take_requirements, with_files
from kinetostat.spec.tolerance_table import TABLE as TOLERANCES
from kinetostat.spec.tolerance_table import take_tolerances, tolerance_lines
from kinetostat.spec.validation import SCHEMA_VERSION, validated_tables
from kinetostat.units import UnitError

if TYPE_CHECKING:
    from kinetostat.machine.written import checking
    from kinetostat.machine.written import document as legs_of_file
    from kinetostat.machine.written import family as written_family
else:
    checking = LateModule("kinetostat.machine.written.checking")
    legs_of_file = LateModule("kinetostat.machine.written.document")
    written_family = LateModule("kinetostat.machine.written.family")

SUFFIX = ".toml"
"""End of the names of machine files."""
STUDY_REFUSAL = (
    "is a study, but this command takes a machine; name the machine that the study gives as machine = ..., or use "
    "`kinetostat check`, `optimize` or `report`, which take studies."
)
"""The message for a study in the place of a machine."""
TOP_LEVEL_KEYS = ("schema", "name", "family", "display", "sections", TABLE, TOLERANCES)
"""Keys of a file at its top beside the tables of its family."""
CHECKED_ALONE = ("pose", "tool", "load")
"""Tables of machines written leg by leg whose numbers are checked by themselves, and not against others."""


@checked
@cache
def bundled() -> dict[str, str]:
    """The text of every bundled machine file by name, in alphabetical order."""
    files = sorted(Path(__file__).with_name("bundled").glob(f"*{SUFFIX}"), key=lambda file: file.name)
    return FixedDict({file.stem: file.read_text(encoding="utf-8") for file in files})


@checked
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
        return build(shipped[name], name, settings)
    path = Path(machine)
    if not documents.exists(path):
        advice = hint(name, shipped, f"bundled machines: {', '.join(shipped)}.")
        raise InputError(f"{shorten(name)} is neither a file nor a bundled machine; {advice}")
    loaded = build(documents.read_text(path), name, settings)
    if not loaded.requirements:
        return loaded
    return replace(loaded, requirements=with_files(dict(loaded.requirements), path.parent))


@checked
def build(document: str | Document, origin: str = "the machine", settings: Sequence[str] = ()) -> Machine:
    """A machine from what a machine file says.

    Args:
        document: its TOML text, or the tables in it.
        origin: names it in messages.
        settings: overrides "path=value".

    Raises:
        InputError: a mistake in the document or an override.
    """
    if isinstance(document, str):
        tables = documents.parse(document, origin)
        overrides = _in_full(tables, settings)
        return replace(build(tables, origin, overrides), written=Written(document, tuple(overrides)))
    if documents.is_study(document):
        raise InputError(f'"{origin}" {STUDY_REFUSAL}')
    rest, overrides, requirements = take_requirements(document, _in_full(document, settings), origin)
    rest, overrides, tolerances = take_tolerances(rest, overrides, origin)
    build_kind = _build_written if rest.get("family") == NAME else _build_family
    machine = build_kind(rest, origin, overrides)
    return replace(machine, requirements=requirements, tolerances=tolerances, whole_check=checked_as_file)


def _in_full(document: Document, settings: Sequence[str]) -> list[str]:
    """Write overrides with the whole path of their fields: "x=5 mm" as "pose.x=5 mm"."""
    pairs = ((setting, *setting.partition("=")) for setting in as_list(settings))
    return [
        f"{_whole_path(document, numbered_entry(name.strip()))}={value}" if sign and name.strip() else as_written
        for as_written, name, sign, value in pairs
    ]


def _whole_path(document: Document, name: str) -> str:
    """Return the whole path of a field that an override names; paths that begin with a table stay as they are."""
    kind, head = document.get("family"), name.partition(".")[0]
    if form_of(name) and not name.startswith("pose"):
        return f"{POSE}{name}"
    if kind == NAME:
        return f"{POSE}{name}" if name in (*SPATIAL_POSE, *PLANAR_POSE) else _common_path(document, name)
    family = family_named(kind) if isinstance(kind, str) else None
    if family is None:
        return name
    tables = {table.partition(".")[0] for table in family.every_table}
    return name if head in {*TOP_LEVEL_KEYS, *document, *tables} else find_field(family, name).path


def _common_path(document: Document, name: str) -> str:
    """Return the path of a field of a common table that is named by its end, "force.0", if nothing else is so named.

    Names of legs and joints are not known yet, so that every key in their tables counts as such a name.
    """
    head = name.partition(".")[0]
    tables = [table for table, fields in COMMON_TABLES.items() if head in quantities(fields)]
    elsewhere = {*TOP_LEVEL_KEYS, *document, *_keys_within([document.get("legs"), document.get("sections")])}
    return f"{tables[0]}.{name}" if len(tables) == 1 and head not in elsewhere else name


def _keys_within(data: object) -> Iterator[str]:
    """List the keys of all tables in a part of a document."""
    if isinstance(data, dict):
        yield from data
    inner = data.values() if isinstance(data, dict) else data if isinstance(data, list) else ()
    for entry in inner:
        yield from _keys_within(entry)


def _build_family(document: Document, origin: str, settings: Sequence[str]) -> Machine:
    """A machine of a family in closed form."""
    family = _family(document.get("family"), origin)
    document = with_named_parts(document, family, origin)
    counts = _list_lengths(family_with_parts(family, document))
    document = _with_overrides(document, settings, counts, tuple(quantities(family.tables["pose"])), origin)
    document = with_named_parts(document, family, origin)  # those that overrides have written
    tables, display, loaded = _without_display_and_state(document, origin)
    extended = _extended_family(family_with_parts(family, tables), tables, origin)
    machine = _validated_machine(extended, with_rigidities(tables, family, origin), origin, display)
    configuration = machine.configure()
    parts = unloaded_parts(configuration.legs, configuration.platform.rotation.z, family.planar)
    check_limits(machine.tables["limits"], parts, origin)
    check_own_drives(extended, configuration.legs, origin)
    return replace(machine, loaded=loaded)


def _build_written(document: Document, origin: str, settings: Sequence[str]) -> Machine:
    """A machine written leg by leg.

    Its numbers are checked with the plan as the file has it. Then they tell which legs have a closed form and which
    freedoms are idle; both belong to the plan, and so to the family that the machine gets.
    """
    document = legs_of_file.by_name(document, origin)
    legs_of_file.check_paths(document, settings)
    coordinates = PLANAR_POSE if document.get("space") == "planar" else SPATIAL_POSE
    document = legs_of_file.with_parts(_with_overrides(document, settings, {}, coordinates, origin), origin)
    tables, display, loaded = _without_display_and_state(document, origin)
    plan, numbers = legs_of_file.separate(tables, origin)
    family = _extended_family(written_family.family_of(plan), numbers, origin)
    machine = _validated_machine(family, numbers, origin, display)
    checking.check_numbers(plan, machine.tables, origin)
    plan = checking.complete_plan(plan, machine.family_tables)
    family = _extended_family(written_family.family_of(plan), numbers, origin)
    machine = with_values(replace(machine, family=family, loaded=loaded), {})  # its tables become those of this family
    chains = machine.chains()
    legs = [Leg(leg.name, tuple(s.element for s in steps)) for leg, steps in zip(plan.legs, chains.legs, strict=True)]
    slides = [(leg.name, 0.0) for leg in legs for _ in driven_slides(leg.chain)]  # 0.0: at home none has travelled
    parts = unloaded_parts(legs, chains.home.rotation.z, plan.planar, slides)
    check_limits(machine.tables["limits"], parts, origin)
    check_own_drives(family, legs, origin)
    return machine


def _extended_family(family: Family, document: Document, origin: str) -> Family:
    """The family with the tables of named loads and of single drives that a document has."""
    return family_with_own_drives(family_with_loads(family, document, origin), document, origin)


def _with_overrides(
    document: Document, settings: Sequence[str], counts: Mapping[str, int], coordinates: Sequence[str], origin: str
) -> Document:
    """The document with overrides, and with its orientation, however it is written, in the angles of the pose."""
    tables = [key for key in ("pose", *COMMON_TABLES) if isinstance(document.get(key), dict)]
    draft = {**document, **{key: copy.deepcopy(document[key]) for key in tables}}
    remove_replaced_form(draft, settings, coordinates, origin)
    for setting in settings:
        _write_out_default(draft, setting.partition("=")[0].strip())
    return with_angles(documents.override(draft, settings, counts), coordinates, origin)


def _write_out_default(document: Document, path: str) -> None:
    """Write out a list that a common table leaves to its default, if an override names an entry: `load.gravity.2`.

    The document is changed; for all other paths it stays as it is.
    """
    field, _, entry = path.rpartition(".")
    name, _, key = field.rpartition(".")
    fields = COMMON_TABLES.get(name, NamedLoad if name.startswith("load.") else None)
    quantity = None if fields is None else quantities(fields).get(key)
    if quantity is None or quantity.count is None or not entry.isdecimal():
        return
    table: Any = document
    for part in name.split("."):
        table = table.setdefault(part, {}) if isinstance(table, dict) else None
    if isinstance(table, dict):
        table.setdefault(key, list(getattr(fields, key)))


def _validated_machine(family: Family, document: Document, origin: str, display: Display) -> Machine:
    """A machine of the numbers of a document, which are checked against their fields and against each other."""
    name, instances = validated_tables(document, origin, family.name, family.every_table)
    machine = Machine(name, family, instances, display)
    check_contrast(machine, origin)
    check_inertia(machine.tables, origin)
    return machine


def _without_display_and_state(document: Document, origin: str) -> tuple[Document, Display, bool]:
    """Part a document into its tables of numbers, its display, and whether the machine is meant under its loads."""
    tables = {key: value for key, value in document.items() if key != "display"}
    try:
        display = read_display(document.get("display", {}))
    except UnitError as error:
        raise InputError(f'"{origin}": {error}.') from None
    load = document.get("load")
    if not isinstance(load, dict) or "state" not in load:
        return tables, display, False
    tables["load"] = {key: value for key, value in load.items() if key != "state"}
    return tables, display, STATES[choice(load["state"], STATES, f'"{origin}": load.state')]


def _list_lengths(family: Family) -> dict[str, int]:
    """Number of entries of each field, by path, for which one value may stand."""
    return {
        f"{name}.{field}": quantity.count
        for name, table in family.every_table.items()
        for field, quantity in quantities(table).items()
        if quantity.count is not None and not quantity.apart
    }


def _family(name: object, origin: str) -> Family:
    """The family of a name.

    Raises:
        InputError: there is none; with the name that was probably meant, or all of them.
    """
    family = family_named(name) if isinstance(name, str) else None
    if family is not None:
        return family
    known = [*families(), NAME]
    if name is None:
        raise InputError(f'"{origin}": family is missing; add family = "..." with one of: {", ".join(known)}.')
    advice = hint(str(name), known, f"known families: {', '.join(known)}.")
    raise InputError(f'"{origin}": family is {shorten(name)}, which is not known; {advice}')


def kinds_of_machine() -> dict[str, str]:
    """Every kind of machine that a file may name, with one line about each."""
    return {**{family.name: family.summary for family in families().values()}, NAME: SUMMARY}


def as_toml(machine: Machine, readable: bool = False) -> str:
    """A machine file that `load` reads back as the same machine; it never depends on how the machine was written.

    Args:
        machine: a machine of any family.
        readable: numbers in the units of people where that needs fewer digits; otherwise all are in SI, for programs.
    """
    lines = [
        f"schema = {SCHEMA_VERSION}",
        f"name   = {documents.toml_value(machine.name)}",
        f'family = "{machine.family.name}"',
    ]
    literals = machine.family.literals
    lines += documents.toml_pairs(literals.get("", {}))
    if machine.loaded:
        literals = {**literals, "load": {"state": machine.state}}
    for name in [*machine.tables, *(name for name in literals if name and name not in machine.tables)]:
        table = machine.tables.get(name)
        if table is not None and name not in literals and _holds_defaults(machine.family.every_table[name], table):
            continue
        lines += ["", f"[{'.'.join(documents.toml_key(part) for part in name.split('.'))}]"]
        lines += documents.toml_pairs(literals.get(name, {}))
        lines += _quantity_lines(machine.family.every_table[name], table, readable) if table is not None else []
    if machine.display != ENGINEERING:
        shown = {"units": machine.display.units, "digits": machine.display.digits}
        lines += ["", "[display]", *documents.toml_pairs(shown)]
    return "\n".join([*lines, *requirement_lines(machine.requirements), *tolerance_lines(machine.tolerances)]) + "\n"


def _holds_defaults(fields: type, table: Any) -> bool:
    """Whether a table holds only defaults, so that a file without it says the same."""
    return optional(fields) == set(quantities(fields)) and bool(table == fields())


def _quantity_lines(fields: type, table: Any, readable: bool) -> Iterator[str]:
    """Lines "field = value" of a table; limits that are not set are left out."""
    for field, quantity in quantities(fields).items():
        values = getattr(table, field)
        if quantity.unset is not None and values == quantity.unset:
            continue
        show = quantity.in_file if readable else quantity.show
        texts = [json.dumps(show(value)) for value in (values if quantity.count else (values,))]
        one_for_all = quantity.count is None or (readable and not quantity.apart and len(set(texts)) == 1)
        yield f"{field} = {texts[0] if one_for_all else '[' + ', '.join(texts) + ']'}"


@checked
def changed(machine: Machine, values: Mapping[str, Given] | None = None, **fields: Given) -> Machine:
    """The machine with other numbers: `machine.with_values` as a function.

    Args:
        machine: the machine, which stays as it is.
        values: values of fields, as `Machine.with_values` takes them.
        fields: the same as keywords.

    Raises:
        InputError: as for `Machine.with_values`.
    """
    return machine.with_values(values, **fields)


def checked_as_file(machine: Machine, names: Iterable[str]) -> Machine:
    """The machine, of which fields of these names have changed, checked as a file would be.

    Raises:
        InputError: numbers contradict each other.
    """
    return read_again(machine) if any(is_checked_against_others(machine, name) for name in names) else machine


def is_checked_against_others(machine: Machine, path: str) -> bool:
    """Whether a field is checked against others: then `read_again` has the last word on a change."""
    if form_of(path):
        return False
    parameter = find_field(machine.family, path)
    table = parameter.path.split(".")[0]
    leg_by_leg = machine.family.chains is not None
    return table == "limits" or (leg_by_leg and not parameter.quantity.stiff and table not in CHECKED_ALONE)


def read_again(machine: Machine) -> Machine:
    """The machine as read from its own file, with every check that a file undergoes; takes some 50 ms leg by leg.

    Raises:
        InputError: its numbers contradict each other.
    """
    again = build(documents.parse(as_toml(machine), machine.name), machine.name)
    return replace(again, written=machine.written)


def template(family: str) -> str:
    """The text of a commented machine file to start from: a bundled machine by its name, or one of a family.

    Raises:
        InputError: no such machine and no such family.
    """
    if family in bundled() and family not in families():
        return bundled()[family]
    wanted = family if family == NAME else _family(family, "kinetostat new").name
    parsed = {name: documents.parse(text, "") for name, text in bundled().items()}
    candidates = [name for name, document in parsed.items() if document["family"] == wanted]
    if not candidates:
        raise InputError(
            f'kinetostat has no example file of the family "{wanted}"; look in the package that registers it.'
        )
    # A machine of cables shows no joint, and variants of a machine add words to its name.
    return bundled()[min(candidates, key=lambda name: (_has_cables(parsed[name]), len(name)))]


def _has_cables(document: Document) -> bool:
    return any(leg.get("type") == CABLE for leg in document.get("legs", []))
