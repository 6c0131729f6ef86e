"""Plain data of any answer, as JSON takes it: dictionaries, lists, texts and finite numbers in SI. Nothing is computed.

Each study lists what belongs to its answer (`as_json`); how a value is written is decided here alone.
"""

import csv
import io
import math
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from kinetostat.algebra.screw import Screw
from kinetostat.algebra.vector import Vector
from kinetostat.spec.renamed import RENAMED, with_former_keys


def as_answer(data: dict[str, Any]) -> dict[str, Any]:
    """Turn an answer into plain data, in which the keys of the version before stand beside those of today."""
    return {key: plain(value) for key, value in with_former_keys(data, RENAMED["JSON key"]).items()}


def plain(value: Any) -> Any:
    """Turn a value into plain data.

    Numbers that are infinite or not a number become null, arrays and tuples become lists, vectors lists of three
    numbers, and dataclasses dictionaries of their fields; the keys of dictionaries become texts.

    Args:
        value: dictionaries, sequences, arrays, dataclasses and scalars, nested to any depth.
    """
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, np.ndarray):
        return _nested_lists(value)
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Vector | Screw):
        return plain(value.components())
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    return value


def _nested_lists(values: np.ndarray[Any, Any]) -> Any:
    """An array as nested lists, with null for what is not finite; at once, because grids have millions of numbers."""
    if values.dtype.kind != "f":
        return values.tolist()
    entries = values.astype(object)
    entries[~np.isfinite(values)] = None
    return entries.tolist()


def stiffness_of_spring(stiffness: float | None) -> float | str | None:
    """A spring's stiffness as machine files write it: infinity is "rigid"."""
    return "rigid" if stiffness is not None and math.isinf(stiffness) else stiffness


def no_formula(text: str) -> str:
    """Return a name with an apostrophe before it where a spreadsheet would take it for a formula and compute it."""
    return f"'{text}" if text.lstrip()[:1] in ("=", "+", "-", "@") else text


def columns_csv(columns: Mapping[str, Iterable[Any]]) -> str:
    """Write columns of equal length as CSV, heads first; a cell is empty where a number is not known (NaN).

    Texts that a spreadsheet would take for a formula have an apostrophe before them.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([no_formula(head) for head in columns])
    for row in zip(*columns.values(), strict=True):
        writer.writerow([_cell(value) for value in row])
    return text.getvalue()


def _cell(value: Any) -> Any:
    if isinstance(value, str):
        return no_formula(value)
    if isinstance(value, float | np.floating):
        return "" if math.isnan(value) else float(value)
    return value
