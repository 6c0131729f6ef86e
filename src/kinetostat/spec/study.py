"""Study files: reading what people may write about an optimisation, what is wrong with it, and writing it again.

Nothing is looked up or solved: which fields and quantities exist depends on the machine, and is checked where the
problem is built.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError, WithJsonSchema

from kinetostat.spec.document import Document, override, toml_pairs
from kinetostat.spec.errors import PRINTABLE, InputError, cut, first_mistakes, hint, shorten
from kinetostat.spec.requirements import TABLE, Requirements, read_requirements, requirement_lines, requirements_schema

MOST_POPULATION = 100_000
"""Designs of a generation: some hundred are usual, so that more than this is a mistake."""
MOST_GENERATIONS = 100_000
"""Generations of a search: some hundred are usual, so that more than this is a mistake."""
MOST_STARTS = 1000
"""Starts of the gradient method: each is a search of its own, and some dozen are usual."""
MOST_SAMPLES = 100_000
"""Random machines around the best design: with so many a share of them is known to a thousandth or two."""
MOST_LISTED = 10_000
"""Poses of a list and choices of a variable: every design is judged at each pose."""

Written: TypeAlias = float | str
"""A value of a field as people write it: text with a unit, or a bare number in SI."""
Path: TypeAlias = Annotated[str, Field(min_length=1, max_length=200)]
Method: TypeAlias = Literal["genetic", "gradient", "hybrid", "nsga2"]
OVER = "worst, mean or percentile P"
"""Words for what is taken over all poses, or over all machines that manufacture makes."""


class StudyTable(BaseModel):
    """A table of a study file: refuses keys that it does not have."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True, allow_inf_nan=False, defer_build=True)


class VariableTable(StudyTable):
    """A table [[variables]]: a field of the machine, or several tied together, and what it may be."""

    path: Path | None = Field(default=None, description="a field of the machine file, e.g. geometry.base_radius")
    paths: list[Path] | None = Field(
        default=None, description="several fields tied together", min_length=1, max_length=100
    )
    ratios: list[float] | None = Field(default=None, description="ratios of `paths` to the variable (default: 1)")
    start: Written | None = Field(default=None, alias="from", description="least value, with its unit")
    end: Written | None = Field(default=None, alias="to", description="greatest value")
    choices: list[Written | list[Written]] | None = Field(
        default=None,
        description="instead of bounds: a catalogue, each entry a value, or a list of one for each of `paths`",
        min_length=1,
        max_length=MOST_LISTED,
    )
    labels: list[str] | None = Field(default=None, description="what people call the choices")
    fixed: bool = Field(
        default=False, description="held at the machine's value: it is not searched, but has its tolerance"
    )
    tolerance: Written | None = Field(default=None, description="tolerance of manufacture, plus and minus")

    @property
    def fields(self) -> list[str]:
        """The fields, as written."""
        return self.paths or ([self.path] if self.path else [])


class TermTable(StudyTable):
    """A quantity, and whether its worst value, mean or a percentile over all poses is taken."""

    quantity: Path = Field(
        description="e.g. compliance_sum, stiffness_z, frobenius_condition; docs/design.md lists all"
    )
    weights: list[float] | None = Field(default=None, description="weights of a sum, one for each of rx ry rz x y z")
    direction: Annotated[list[float], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="direction for a quantity that needs one: x, y, z in base axes"
    )
    over: str = Field(default="worst", description=f"what is taken over all poses: {OVER}")


class ObjectiveTable(TermTable):
    """A table [[objectives]]."""

    goal: Literal["minimize", "maximize"] | None = Field(
        default=None,
        description="needed where neither is better for every design; otherwise more stiffness, less mass, ...",
    )


class ConstraintTable(TermTable):
    """A table [[constraints]]."""

    at_least: Written | None = Field(default=None, description="lower bound, with its unit")
    at_most: Written | None = Field(default=None, description="upper bound")


class PosesTable(StudyTable):
    """Table [poses]: where the machine is judged; its own pose unless more is said."""

    listed: list[dict[str, Written]] | None = Field(
        default=None,
        alias="list",
        description="poses, each with the fields in which it differs",
        max_length=MOST_LISTED,
    )
    over: list[str] | None = Field(
        default=None, description='a grid: ranges as "x=-2 cm:2 cm:21", all combinations', min_length=1, max_length=6
    )
    within: Literal["workspace"] | None = Field(
        default=None,
        description="only those nodes of the grid that lie in the workspace of the machine as its file says",
    )
    where: list[str] = Field(default=[], description='conditions of that workspace, e.g. "free_stiffness_z > 50 N/um"')
    required: float = Field(default=1.0, description="share of the poses that a design must reach", ge=0.0, le=1.0)


class OptimizerTable(StudyTable):
    """Table [optimizer]: how the best design is looked for."""

    method: Method | None = Field(
        default=None, description="genetic, gradient, hybrid (genetic, then gradient) or nsga2"
    )
    population: int = Field(default=80, description="designs of a generation", ge=4, le=MOST_POPULATION)
    generations: int = Field(
        default=100, description="generations, the first random one included", ge=1, le=MOST_GENERATIONS
    )
    starts: int = Field(default=16, description="number of starts of the gradient method", ge=1, le=MOST_STARTS)
    seed: int = Field(default=1, description="of the random numbers", ge=0, lt=2**32)


class RobustnessTable(StudyTable):
    """Table [robustness]: how manufacture within the tolerances is taken into account."""

    samples: int = Field(default=1000, description="random machines around the best design", ge=1, le=MOST_SAMPLES)
    distribution: Literal["uniform", "normal"] = Field(
        default="uniform", description="within the tolerance; normal: the tolerance is three standard deviations"
    )
    objective: str = Field(
        default="nominal", description=f"what is optimised: nominal, or {OVER} of the machines that manufacture makes"
    )
    search_samples: int = Field(default=16, description="machines around each design during the search", ge=1, le=1000)


class StudyFile(StudyTable):
    """A study file."""

    schema_version: Literal[1] = Field(default=1, alias="schema", description="version of the file format")
    name: str = Field(description="what people call the study", min_length=1, max_length=80, pattern=PRINTABLE)
    machine: str = Field(description="a bundled machine, or the path of a machine file from this file", min_length=1)
    changes: dict[str, Any] = Field(
        default={}, alias="set", description="fields of the machine that differ from its file"
    )
    variables: list[VariableTable] = Field(description="what may change", min_length=1, max_length=200)
    objectives: list[ObjectiveTable] = Field(description="what is wanted", min_length=1, max_length=6)
    constraints: list[ConstraintTable] = Field(default=[], description="what must hold", max_length=50)
    poses: PosesTable = Field(default=PosesTable(), description="where the machine is judged")
    optimizer: OptimizerTable = Field(default=OptimizerTable(), description="how to search")
    robustness: RobustnessTable = Field(default=RobustnessTable(), description="tolerances of manufacture")
    requirements: Annotated[Requirements, WithJsonSchema(requirements_schema())] = Field(
        default={}, description="what the best design must meet, by name; beside those of the machine's file"
    )


def read_study(document: Document, origin: str, settings: Sequence[str] = ()) -> StudyFile:
    """Return the study that a document describes.

    Args:
        document: the document as written.
        origin: name of the file, for messages.
        settings: overrides "path=value", as `--set` takes them, e.g. "optimizer.seed=3", "variables.0.to=15 cm".

    Raises:
        InputError: one sentence for each mistake, at most five.
    """
    changed = override(document, settings, {})
    required = {TABLE: read_requirements(changed[TABLE], origin)} if TABLE in changed else {}
    try:
        return StudyFile.model_validate({**changed, **required})
    except ValidationError as error:
        mistakes = first_mistakes(error.errors(), lambda mistake: _sentence(dict(mistake), changed))
        raise InputError(f'"{origin}": {mistakes}') from None


def study_schema() -> dict[str, Any]:
    """Return the JSON Schema of study files."""
    schema = StudyFile.model_json_schema(by_alias=True)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "kinetostat study file"}


def _sentence(mistake: dict[str, Any], document: Document) -> str:
    path, value = _place(mistake["loc"], document)
    name = ".".join(cut(part) for part in path)
    if mistake["type"] == "missing":
        return f"{name} is missing ({_field(path)}); `kinetostat new study` prints a complete file."
    if mistake["type"] == "extra_forbidden":
        keys = _keys_at(path[:-1])
        advice = hint(path[-1], keys, f"it may be {', '.join(keys)}.", quoted=False)
        return f"{name} is not known; {advice}"
    if mistake["type"] in ("model_type", "model_attributes_type"):
        return f"{name} is {shorten(value)}; it must be a table with the keys {', '.join(_keys_at(path))}."
    if mistake["type"] == "string_pattern_mismatch":
        return f"{name} is {shorten(value)}; it must be text that can be printed, without control characters."
    message = str(mistake["msg"]).removeprefix("Input ")
    return f"{name} is {shorten(value)}: it {message[0].lower()}{message[1:]}{_hint(path)}."


def _place(location: Sequence[Any], document: Document) -> tuple[list[str], Any]:
    """Return the path of a mistake as people write it, without the names of alternatives, and what stands there."""
    path: list[str] = []
    value: Any = document
    for i, part in enumerate(location):
        inside = (isinstance(value, dict) and part in value) or (isinstance(value, list) and isinstance(part, int))
        if inside or i == 0 or (isinstance(value, dict) and i == len(location) - 1):
            path.append(str(part))
            value = value[part] if inside else None
    return path, value


def _model(path: Sequence[str]) -> type[BaseModel] | None:
    """Return the model of the table at a path."""
    if not path:
        return StudyFile
    tables: dict[str, type[BaseModel]] = {
        "variables": VariableTable,
        "objectives": ObjectiveTable,
        "constraints": ConstraintTable,
        "poses": PosesTable,
        "optimizer": OptimizerTable,
        "robustness": RobustnessTable,
    }
    depth = 2 if len(path) > 1 and path[1].isdecimal() else 1
    return tables.get(path[0]) if len(path) == depth else None


def _keys_at(path: Sequence[str]) -> list[str]:
    model = _model(path)
    return [field.alias or name for name, field in model.model_fields.items()] if model else []


def _field(path: Sequence[str]) -> str:
    model = _model(path[:-1])
    described = {f.alias or n: f.description for n, f in model.model_fields.items()} if model else {}
    return described.get(path[-1]) or "it is needed"


def _hint(path: Sequence[str]) -> str:
    entry = _field(path)
    return f" ({entry})" if entry != "it is needed" else ""


def study_toml(study: StudyFile) -> str:
    """Return the TOML text of a study; what is as it would be without being written is left out."""
    content = study.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    lines = [f"schema = {study.schema_version}", *toml_pairs({key: content[key] for key in ("name", "machine")})]
    lines += _table("[set]", content.get("set", {}))
    for name in ("variables", "objectives", "constraints"):
        for table in content.get(name, []):
            lines += _table(f"[[{name}]]", table)
    for name in ("poses", "optimizer", "robustness"):
        lines += _table(f"[{name}]", content.get(name, {}))
    lines += requirement_lines(study.requirements)
    return "\n".join(lines) + "\n"


def _table(head: str, table: Mapping[str, Any]) -> list[str]:
    return ["", head, *toml_pairs(table)] if table else []
