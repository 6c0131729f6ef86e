"""Table [requirements] of machine and study files: what must hold, and where. Nothing is looked up or evaluated.

Which quantities and fields exist depends on the machine and is checked where the requirements are judged.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError

from kinetostat.spec.document import Document, override, toml_key, toml_value
from kinetostat.spec.errors import InputError, several, shorten

TABLE = "requirements"
MOST_LISTED = 10_000


class Requirement(BaseModel):
    """Conditions that must hold, and where: at the pose of the file unless `over` or `poses` is given."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    demand: Annotated[list[str], BeforeValidator(lambda given: [given] if isinstance(given, str) else given)] = Field(
        description='conditions that must all hold, e.g. "free_stiffness_z > 50 N/um"', min_length=1, max_length=50
    )
    over: list[str] = Field(default=[], description='a box: ranges as "x=-2 cm:2 cm:11"', max_length=6)
    poses: list[dict[str, float | str]] = Field(
        default=[], description="poses, each with the fields in which it differs", max_length=MOST_LISTED
    )


def _whole(given: Any) -> Any:
    """A condition alone, or a list of conditions, stands for a requirement at the pose of the file."""
    return {"demand": given} if isinstance(given, str | list) else given


Requirements: TypeAlias = dict[
    Annotated[str, Field(min_length=1, max_length=80)], Annotated[Requirement, BeforeValidator(_whole)]
]
"""Requirements by the names that people give them."""
_READER: TypeAdapter[Requirements] = TypeAdapter(Requirements, config=ConfigDict(defer_build=True))
HOW = (
    'write NAME = "free_stiffness_z > 50 N/um", or NAME = { demand = "...", over = ["x=-2 cm:2 cm:11"] } for a box, or '
    'NAME = { demand = "...", poses = [{ x = "1 cm" }, { x = "2 cm" }] } for a list of poses'
)


def take_requirements(
    document: Document, settings: Sequence[str], origin: str
) -> tuple[Document, list[str], Requirements]:
    """Part a machine file into all that is not a requirement and its requirements, with their overrides.

    Args:
        document: what was written.
        settings: overrides "path=value".
        origin: name of the file, for messages.

    Returns:
        The document and the settings without requirements, and the requirements by name.

    Raises:
        InputError: names the requirement that is not one, and how to write it.
    """
    meant = [text for text in several(settings) if text.partition("=")[0].strip().split(".")[0] == TABLE]
    others = [text for text in several(settings) if text not in meant]
    written = override({TABLE: document.get(TABLE, {})}, meant, {})[TABLE]
    return {key: value for key, value in document.items() if key != TABLE}, others, read_requirements(written, origin)


def read_requirements(written: object, origin: str) -> Requirements:
    """Read the table [requirements].

    Raises:
        InputError: names the requirement that is not one, and how to write it.
    """
    try:
        return _READER.validate_python(written)
    except ValidationError as error:
        location = error.errors()[0]["loc"]
        place = ".".join([TABLE, *(str(part) for part in location if str(part) != "[key]")][:3])
        value = written.get(location[0]) if isinstance(written, dict) and location else written
        raise InputError(f'"{origin}": {place} is wrong in {shorten(value)}; {HOW}.') from None


def requirements_schema() -> dict[str, Any]:
    """The JSON Schema of the table, in which one condition or a list of them may stand for a whole requirement."""
    text: dict[str, Any] = {"type": "string", "examples": ["free_stiffness_z > 50 N/um"]}
    several_texts = {"type": "array", "items": text, "minItems": 1}
    table = Requirement.model_json_schema()
    table["properties"]["demand"] = {"anyOf": [text, several_texts], "description": "conditions that must all hold"}
    return {
        "type": "object",
        "description": "what must hold, by name: at the pose of the file, over a box, or at a list of poses",
        "additionalProperties": {"anyOf": [text, several_texts, table]},
    }


def requirement_lines(requirements: Mapping[str, Requirement]) -> Iterator[str]:
    """The lines of the table as TOML that reads back as the same requirements; none without a requirement."""
    if not requirements:
        return
    yield from ("", f"[{TABLE}]")
    for name, requirement in requirements.items():
        yield f"{toml_key(name)} = {_text(requirement)}"


def _text(requirement: Requirement) -> str:
    demand: Any = requirement.demand if len(requirement.demand) > 1 else requirement.demand[0]
    where = {"over": requirement.over, "poses": requirement.poses}
    written = {name: entries for name, entries in where.items() if entries}
    return toml_value({"demand": demand, **written} if written else demand)
