"""A study while it is being written: what the form shows, and what it carries along from a study file.

A draft becomes a `StudyFile` by the same reader as a file does, so that the form and `kinetostat optimize` agree.
"""

import math
import re
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from kinetostat.machine.loading import build, bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.machine.saving import as_file
from kinetostat.spec.document import Document, parse, text_of
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import Quantity
from kinetostat.spec.study import OptimizerTable, StudyFile, read_study, study_toml
from kinetostat.studies.bundled import study_of
from kinetostat.studies.optimisation.problem import Problem, problem_of, settings_of
from kinetostat.studies.optimisation.terms import ALONG
from kinetostat.studio.controls import USUAL_STIFFNESS, Control
from kinetostat.studio.design.state_folder import slug
from kinetostat.studio.wording import shown_value, typed_value
from kinetostat.units import UNIT, UnitError

StudyTable: TypeAlias = dict[str, Any]
"""A table of a study file, such as one of its variables, by the words of the file."""
BOUNDS_SHARE = 0.2
"""Bounds of a new variable, as a share of its present value: a change that a designer would consider."""
LEAST_WIDTH = 1e-9
"""Least end of a slider of which the share is taken where the value is zero, SI: equal bounds would be refused."""
FORM = "the study"
"""Name of a draft in messages, where a file would have its path."""
MOST_OBJECTIVES = 4
"""Objectives that the form offers, as many as a front can be looked at with; a file may have more."""
SEARCH_KEYS = ("population", "generations", "seed")
"""Numbers of the search that the form always shows, also where a study leaves them out."""
SHOWN_PARTS = ("schema", "name", "machine", "set", "variables", "objectives", "constraints", "poses", "optimizer")
"""Parts of a study file that the form shows, or that a draft writes itself; others are carried along as they are."""
_NUMBER_AND_UNIT = re.compile(rf"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*{UNIT.pattern}\s*")
"""A bound that a study file may hold as it was typed: anything else that can be read is arithmetic."""


@dataclass
class Draft:
    """A study that is being written.

    Attributes:
        name: the name of the study.
        machine: the machine of the study; None for that of the session.
        variables, objectives, constraints, poses, optimizer: tables as in a study file, changed in place by the form.
        rest: tables of a study file that the form does not show.
    """

    name: str
    machine: Machine | None = None
    variables: list[StudyTable] = field(default_factory=list)
    objectives: list[StudyTable] = field(default_factory=lambda: [{"quantity": "compliance_sum"}])
    constraints: list[StudyTable] = field(default_factory=list)
    poses: StudyTable = field(default_factory=dict)
    optimizer: StudyTable = field(default_factory=lambda: _search_numbers(OptimizerTable()))
    rest: StudyTable = field(default_factory=dict)

    def study(self, machine: str) -> StudyFile:
        """Return the study as a file would hold it, about a machine of this name.

        Raises:
            InputError: a value is not valid; the message is that of `kinetostat optimize`.
        """
        if not self.variables:
            raise InputError("the study has no variable yet; add at least one.")
        document: Document = {
            "schema": 1,
            "name": self.name,
            "machine": machine,
            "variables": self.variables,
            "objectives": [_without_none(table) for table in self.objectives],
            "constraints": [_without_none(table) for table in self.constraints],
            "poses": self.poses,
            "optimizer": _without_none(self.optimizer),
            **self.rest,
        }
        return read_study(document, FORM)

    def problem(self, present: Machine) -> Problem:
        """Return the problem to solve; `present` is the machine of the session.

        Raises:
            InputError: a value is not valid or does not fit the machine.
        """
        machine = self.machine or present
        return problem_of(self.study(machine.name), machine)

    def as_file(self, present: Machine) -> tuple[str, bytes]:
        """Return a file name and the study as TOML, about a bundled machine with changes or a machine file beside it.

        Raises:
            InputError: a value is not valid.
        """
        machine = self.machine or present
        name, changes = _reference(machine)
        study = self.study(name).model_copy(update={"changes": changes})
        head = "" if name in bundled() else f"# Save the machine beside this file, as {name}.\n"
        return f"{slug(self.name, 'study')}.toml", (head + study_toml(study)).encode()

    def hidden_parts(self) -> list[str]:
        """Return short descriptions of what the study has but the form does not show."""
        parts = ["conditions of the workspace"] if self.poses.get("where") else []
        tolerances = sum("tolerance" in table for table in self.variables)
        return parts + ([_count_in_words(tolerances, "tolerance")] if tolerances else [])


def _count_in_words(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def draft_of(study: StudyFile, machine: Machine | None) -> Draft:
    """Return a draft of a study that has been read; `machine` None stands for the machine of the session."""
    tables = study.model_dump(mode="json", by_alias=True, exclude_none=True, exclude_defaults=True)
    return Draft(
        name=study.name,
        machine=machine,
        variables=tables["variables"],
        objectives=tables["objectives"],
        constraints=tables.get("constraints", []),
        poses=tables.get("poses", {}),
        optimizer=_search_numbers(study.optimizer) | tables.get("optimizer", {}),
        rest={key: value for key, value in tables.items() if key not in SHOWN_PARTS},
    )


def _search_numbers(search: OptimizerTable) -> StudyTable:
    return {key: getattr(search, key) for key in SEARCH_KEYS}


def bundled_draft(name: str) -> Draft:
    """Return the draft of a bundled study."""
    study = study_of(name)
    return draft_of(study, load(study.machine, list(settings_of(study.changes))))


def sent_draft(data: bytes, name: str, present: Machine) -> Draft:
    """Return the draft of a study file that was sent by the browser.

    A study of a bundled machine is about that machine. Any other is taken to be about the machine of the session,
    because a path in the file would be one on the server, and no file of the server is ever read for a page.

    Args:
        data: content of the file.
        name: the name of the file, for messages.
        present: machine of the session.

    Raises:
        InputError: the file is too large, is not text, has a mistake, or does not fit the machine.
    """
    study = read_study(parse(text_of(data, name), name), name)
    changes = list(settings_of(study.changes))
    if study.machine in bundled():
        machine: Machine | None = load(study.machine, changes)
    else:
        machine = build(as_file(present), present.name, changes) if changes else None
    draft = draft_of(study, machine)
    draft.problem(present)
    return draft


def usual_bounds(control: Control, value: float) -> tuple[str, str]:
    """Return bounds for a new variable as text: 20 % about its value, or of its slider's end if the value is zero.

    Those of a stiffness that is rigid or free lie about `USUAL_STIFFNESS`.
    """
    quantity = control.parameter.quantity
    is_rigid_or_free = not math.isfinite(value) or (quantity.stiff and not value)
    middle = USUAL_STIFFNESS if is_rigid_or_free else value
    around = BOUNDS_SHARE * abs(middle) if middle else BOUNDS_SHARE * max(control.high, LEAST_WIDTH)
    low, high = middle - around, min(middle + around, quantity.most)
    return shown_value(quantity, low), shown_value(quantity, high)


def bound_text(quantity: Quantity, typed: str, shown_unit: str) -> str:
    """Return a bound that was typed as a study file may hold it; what cannot be read stays for the reader to refuse.

    Args:
        quantity: the quantity of the variable.
        typed: a quantity, a bare number in the unit shown, or arithmetic.
        shown_unit: the unit that the field showed first; empty where it showed none.
    """
    try:
        value = typed_value(typed, quantity.kind, shown_unit)
    except UnitError:
        return typed
    return typed if _NUMBER_AND_UNIT.fullmatch(typed) else quantity.show(value)


def needs_direction(quantity: str) -> bool:
    """Return whether an objective is taken along or about a direction."""
    return quantity in ALONG


def _reference(machine: Machine) -> tuple[str, dict[str, str]]:
    """Return how a study file refers to a machine: a bundled one and what differs from it, or the name of a file."""
    for name, text in bundled().items():
        document = parse(text, name)
        if document["name"] != machine.name or document["family"] != machine.family.name:
            continue
        known = load(name)
        if values(known).keys() == values(machine).keys() and known.family.literals == machine.family.literals:
            return name, _changes(machine, values(known))
    return f"{slug(machine.name, 'machine')}.toml", {}


def _changes(machine: Machine, known_values: dict[str, float]) -> dict[str, str]:
    """Return the values that differ from known ones, by path and as a file writes them."""
    quantities = {leaf: p.quantity for p in parameters(machine.family) for leaf in p.leaves}
    return {
        path: str(quantities[path].in_file(value))
        for path, value in values(machine).items()
        if value != known_values[path]
    }


def _without_none(table: StudyTable) -> StudyTable:
    return {key: value for key, value in table.items() if value not in (None, "")}
