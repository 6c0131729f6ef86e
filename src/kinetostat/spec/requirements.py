"""Table [requirements] of machine and study files: what must hold, and where. Nothing is looked up or evaluated.

Which quantities and fields exist depends on the machine and is checked where the requirements are judged.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import chain
from pathlib import Path
from typing import Any, TypeAlias

from kinetostat.frozen import dataclass
from kinetostat.spec.arguments import as_list
from kinetostat.spec.document import Document, override, read_text, toml_key, toml_value
from kinetostat.spec.errors import InputError, shorten

TABLE = "requirements"
"""Name of the table in files."""
MOST_POSES = 10_000
"""Poses of a requirement: each is solved for whenever the requirement is judged."""
MOST_CONDITIONS = 50
"""Conditions of a requirement: more than there are quantities that anybody bounds."""
MOST_RANGES = 6
"""Axes of a box: no pose has more coordinates."""
LONGEST_REQUIREMENT_NAME = 80
"""Characters of the name of a requirement: a row of a table has room for it."""
FILES = ("motion", "catalogue")
"""Parts of a requirement that are texts of files, or the name of a file beside that of the machine."""
DRIVEN = ("fits", *FILES, "gear", "screw")
"""Parts of a requirement on motors."""


@dataclass(frozen=True)
class Requirement:
    """Conditions that must hold, and where: at the pose of the file unless `over` or `poses` is given.

    Or a motor that must do a motion at every drive.

    Attributes:
        demand: conditions that must all hold, such as "free_stiffness_z > 50 N/um"; none of a motor.
        over: a box: ranges such as "x=-2 cm:2 cm:11".
        poses: poses, each with the fields in which it differs.
        fits: name of a motor of the catalogue; empty if the requirement is not about motors.
        motion: the motion that the motor must do: the lines of a CSV file, or the name of such a file.
        catalogue: the lines of a catalogue, or the name of such a file; that of kinetostat if empty.
        gear, screw: names of a gear and a screw of the catalogue; those of the machine's [drives] if empty.
    """

    demand: list[str] = field(default_factory=list)
    over: list[str] = field(default_factory=list)
    poses: list[dict[str, float | str]] = field(default_factory=list)
    fits: str = ""
    motion: str = ""
    catalogue: str = ""
    gear: str = ""
    screw: str = ""


Requirements: TypeAlias = dict[str, Requirement]
"""Requirements by the names that people give them."""
REQUIREMENT_FORM = (
    'write NAME = "free_stiffness_z > 50 N/um", or NAME = { demand = "...", over = ["x=-2 cm:2 cm:11"] } for a box, or '
    'NAME = { demand = "...", poses = [{ x = "1 cm" }, { x = "2 cm" }] } for a list of poses, or '
    'NAME = { fits = "MOTOR", motion = "motion.csv" } for a motor of a catalogue'
)
"""End of the messages on what is not a requirement."""


def take_requirements(
    document: Document, settings: Sequence[str], origin: str
) -> tuple[Document, list[str], Requirements]:
    """Part a machine file into all that is not a requirement and its requirements, with their overrides.

    Args:
        document: the document as written.
        settings: overrides "path=value".
        origin: name of the file, for messages.

    Returns:
        The document and the settings without requirements, and the requirements by name.

    Raises:
        InputError: names the requirement that is not one, and how to write it.
    """
    overrides = [text for text in as_list(settings) if text.partition("=")[0].strip().split(".")[0] == TABLE]
    others = [text for text in as_list(settings) if text not in overrides]
    written = override({TABLE: document.get(TABLE, {})}, overrides, {})[TABLE]
    return {key: value for key, value in document.items() if key != TABLE}, others, read_requirements(written, origin)


def read_requirements(written: object, origin: str) -> Requirements:
    """Read the table [requirements].

    Raises:
        InputError: names the requirement that is not one, and how to write it.
    """
    if not isinstance(written, dict):
        raise InputError(f'"{origin}": {TABLE} is wrong in {shorten(written)}; {REQUIREMENT_FORM}.')
    requirements = {}
    for name, entry in written.items():
        table = {"demand": entry} if isinstance(entry, str | list) else entry
        wrong = _wrong_part(name, table)
        if wrong is not None:
            place = f"{TABLE}.{name}.{wrong}" if wrong else f"{TABLE}.{name}"
            raise InputError(f'"{origin}": {place} is wrong in {shorten(entry)}; {REQUIREMENT_FORM}.')
        requirements[name] = _requirement_of(**table)
    return requirements


def _wrong_part(name: object, table: Any) -> str | None:
    """Return the key of the first part of a requirement that is not as it must be; None if all of it is right.

    The key is empty where the whole is wrong.
    """
    if not (isinstance(name, str) and 0 < len(name) <= LONGEST_REQUIREMENT_NAME and isinstance(table, dict)):
        return ""
    if "fits" in table:
        wrong = (str(key) for key, value in table.items() if key not in DRIVEN or not isinstance(value, str))
        missing = (key for key in ("fits", "motion") if not table.get(key))
        return next(chain(wrong, missing), None)
    demand, over, poses = table.get("demand"), table.get("over", []), table.get("poses", [])
    if not (isinstance(demand, str) or (_are_texts(demand, MOST_CONDITIONS) and demand)):
        return "demand"
    if not _are_texts(over, MOST_RANGES):
        return "over"
    if not (isinstance(poses, list | tuple) and len(poses) <= MOST_POSES and all(map(_is_pose, poses))):
        return "poses"
    return next((str(key) for key in table if key not in ("demand", "over", "poses")), None)


def _requirement_of(
    demand: Any = (), over: Sequence[str] = (), poses: Sequence[Mapping[str, Any]] = (), **driven: str
) -> Requirement:
    """Make a requirement of what was written; numbers of poses are SI, and all else of them is text."""
    listed = [{key: value if isinstance(value, str) else float(value) for key, value in pose.items()} for pose in poses]
    return Requirement(as_list(demand), list(over), listed, **driven)


def with_files(requirements: Requirements, folder: Path) -> Requirements:
    """Put the lines of files that requirements name in the place of their names, so that a machine needs no folder.

    Args:
        requirements: the requirements as they were written.
        folder: the folder of the file in which they were written; others lie beside it or below.

    Raises:
        InputError: names the requirement whose file cannot be read, or lies elsewhere.
    """
    return {name: _with_files(requirement, name, folder) for name, requirement in requirements.items()}


def _with_files(requirement: Requirement, name: str, folder: Path) -> Requirement:
    texts: dict[str, Any] = {}
    for part in FILES:
        file = getattr(requirement, part)
        if not file or is_text(file):
            continue
        # A machine file may come from anybody; it is not to make a server read what lies elsewhere.
        if Path(file).is_absolute() or ".." in Path(file).parts or ":" in file:
            raise InputError(
                f"{TABLE}.{name}.{part} is {shorten(file)}; the file must lie in the folder of the machine file or "
                "below: write its name from there."
            )
        try:
            lines = read_text(folder / file)
        except InputError as error:
            raise InputError(f"{TABLE}.{name}.{part}: {error}") from None
        texts[part] = lines if is_text(lines) else f"{lines}\n"
    return replace(requirement, **texts)


def is_text(part: str) -> bool:
    """Return whether a part of a requirement is the text of a file, and not the name of one."""
    return "\n" in part


def _are_texts(entries: Any, most: int) -> bool:
    return isinstance(entries, list | tuple) and len(entries) <= most and all(isinstance(text, str) for text in entries)


def _is_pose(pose: object) -> bool:
    """Return whether something holds fields by name, each with a number or a text."""
    return isinstance(pose, dict) and all(
        isinstance(key, str) and isinstance(value, int | float | str) for key, value in pose.items()
    )


def requirements_schema() -> dict[str, Any]:
    """Return the JSON Schema of the table, in which a condition or a list of them may stand for a whole requirement."""
    return {
        "type": "object",
        "description": "what must hold, by name: at the pose of the file, over a box, or at a list of poses",
        "additionalProperties": {"anyOf": [CONDITION, CONDITIONS, _conditions_schema(), _motor_schema()]},
    }


CONDITION: Mapping[str, Any] = {"type": "string", "examples": ["free_stiffness_z > 50 N/um"]}
CONDITIONS: Mapping[str, Any] = {"type": "array", "items": CONDITION, "minItems": 1}


def _conditions_schema() -> dict[str, Any]:
    """Return the schema of conditions that hold over a box or at a list of poses."""
    pose = {"type": "object", "additionalProperties": {"anyOf": [{"type": "number"}, {"type": "string"}]}}
    lists = {
        "over": ('a box: ranges as "x=-2 cm:2 cm:11"', {"type": "string"}, MOST_RANGES),
        "poses": ("poses, each with the fields in which it differs", pose, MOST_POSES),
    }
    properties: dict[str, Any] = {
        "demand": {"anyOf": [CONDITION, CONDITIONS], "description": "conditions that must all hold"}
    }
    for name, (description, items, most) in lists.items():
        properties[name] = {"default": [], "description": description, "items": items, "maxItems": most}
        properties[name] |= {"title": name.title(), "type": "array"}
    return _table_schema(str(Requirement.__doc__).partition("\n")[0], properties, ["demand"], "Requirement")


def _motor_schema() -> dict[str, Any]:
    """Return the schema of a motor that must do a motion."""
    meanings = {
        "fits": "name of a motor of the catalogue",
        "motion": "that it must do: name of a CSV file beside this one, or its lines",
        "catalogue": "of motors: name of a TOML file beside this one, or its lines; default that of kinetostat",
        "gear": "of the catalogue; default as in [drives]",
        "screw": "of the catalogue; default as in [drives]",
    }
    properties = {name: {"type": "string", "description": meaning} for name, meaning in meanings.items()}
    return _table_schema("A motor that must do a motion at every drive.", properties, ["fits", "motion"], "Motor")


def _table_schema(description: str, properties: dict[str, Any], required: list[str], title: str) -> dict[str, Any]:
    """Return the schema of a table that has no other fields than its properties."""
    return {
        "additionalProperties": False,
        "description": description,
        "properties": properties,
        "required": required,
        "title": title,
        "type": "object",
    }


def requirement_lines(requirements: Mapping[str, Requirement]) -> Iterator[str]:
    """Give the lines of the table as TOML that reads back as the same requirements; none without a requirement."""
    if not requirements:
        return
    yield from ("", f"[{TABLE}]")
    for name, requirement in requirements.items():
        yield f"{toml_key(name)} = {_text(requirement)}"


def _text(requirement: Requirement) -> str:
    if requirement.fits:
        return toml_value({part: text for part in DRIVEN if (text := getattr(requirement, part))})
    demand: Any = requirement.demand if len(requirement.demand) > 1 else requirement.demand[0]
    places = {"over": requirement.over, "poses": requirement.poses}
    named = {name: entries for name, entries in places.items() if entries}
    return toml_value({"demand": demand, **named} if named else demand)
