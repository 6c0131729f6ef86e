"""A study as the text of a file that `read_study` reads back as the same study. Nothing is looked up or solved."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

from kinetostat.spec.document import toml_key
from kinetostat.spec.requirements import requirement_lines
from kinetostat.spec.study import StudyFile

TABLES = ("set", "poses", "optimizer", "robustness")
LISTS = ("variables", "objectives", "constraints")


def study_toml(study: StudyFile) -> str:
    """The TOML text of a study; what is as it would be without being written is left out."""
    content = study.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    lines = ["schema = 1", *_pairs({key: content[key] for key in ("name", "machine")})]
    lines += _table("[set]", content.get("set", {}))
    for name in LISTS:
        for table in content.get(name, []):
            lines += _table(f"[[{name}]]", table)
    for name in TABLES[1:]:
        lines += _table(f"[{name}]", content.get(name, {}))
    lines += requirement_lines(study.requirements)
    return "\n".join(lines) + "\n"


def _table(head: str, table: Mapping[str, Any]) -> list[str]:
    return ["", head, *_pairs(table)] if table else []


def _pairs(table: Mapping[str, Any]) -> Iterator[str]:
    for key, value in table.items():
        yield f"{toml_key(key)} = {_value(value)}"


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{ {', '.join(_pairs(value))} }}"
    if isinstance(value, list):
        return f"[{', '.join(_value(entry) for entry in value)}]"
    return json.dumps(value, ensure_ascii=False)
