"""Answers at poses as a CSV file that other programs, and `kinetostat path` itself, read. Nothing is computed here."""

import csv
import io
import math
from collections.abc import Sequence
from typing import Any

from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.evaluation.evaluation import PoseAnswers


def as_csv(answers: PoseAnswers) -> str:
    """Write answers as CSV, SI: number of the pose (from 1), its fields, its status in a word, its quantities.

    A quantity is empty where the status is not ok; infinity, of a rigid or a free direction, is "inf".
    """
    columns: dict[str, Sequence[Any]] = {"pose": range(1, answers.poses.count + 1)}
    for field, values in zip(answers.poses.fields, answers.poses.values, strict=True):
        columns[_head(field.shown, field.unit)] = values.tolist()
    columns["status"] = [Status(code).word for code in answers.status.tolist()]
    for name, values in answers.values.items():
        columns[_head(name, QUANTITIES[name].unit)] = ["" if math.isnan(value) else value for value in values.tolist()]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def _head(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit not in ("", "1") else name
