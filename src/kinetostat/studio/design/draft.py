"""A study in the making: what the form shows of it, and what it carries along unseen. Knows no page."""

import math
from dataclasses import dataclass, field
from typing import Any

from kinetostat.machine.loading import as_toml, build, bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.spec.document import LARGEST_FILE, Document, parse
from kinetostat.spec.errors import InputError
from kinetostat.spec.study import OptimizerTable, StudyFile, read_study
from kinetostat.spec.study_text import study_toml
from kinetostat.studies.bundled import study_of
from kinetostat.studies.optimisation.catalogue import ALONG
from kinetostat.studies.optimisation.problem import Problem, problem_of, settings_of
from kinetostat.studio.controls import USUAL_STIFFNESS, Control
from kinetostat.studio.design.state_folder import slug
from kinetostat.studio.wording import shown

AROUND = 0.2
"""How far a variable may go about its present value, unless the designer says otherwise."""
FORM = "the study"
"""What messages call it."""
MOST_AIMS = 4
"""Objectives that the form offers; a file may have more."""
SEARCH = OptimizerTable()
"""The search that is offered first."""


@dataclass
class Draft:
    """A study that is being written.

    Attributes:
        name: of the study.
        machine: that it is about; None for whatever machine is at hand.
        variables, objectives: tables as in a study file, changed in place by the form.
        optimizer: likewise.
        rest: tables that the form does not show.
    """

    name: str
    machine: Machine | None = None
    variables: list[dict[str, Any]] = field(default_factory=list)
    objectives: list[dict[str, Any]] = field(default_factory=lambda: [{"quantity": "compliance_sum"}])
    optimizer: dict[str, Any] = field(
        default_factory=lambda: {
            "population": SEARCH.population, "generations": SEARCH.generations, "seed": SEARCH.seed,
        }
    )  # fmt: skip
    rest: dict[str, Any] = field(default_factory=dict)

    def study(self, machine: str) -> StudyFile:
        """The study, about a machine of this name.

        Raises:
            InputError: what a study file may not say, in the words of `kinetostat optimize`.
        """
        if not self.variables:
            raise InputError("nothing may change yet; add a variable to the study.")
        document: Document = {
            "schema": 1,
            "name": self.name,
            "machine": machine,
            "variables": self.variables,
            "objectives": [_without_none(table) for table in self.objectives],
            "optimizer": _without_none(self.optimizer),
            **self.rest,
        }
        return read_study(document, FORM)

    def problem(self, at_hand: Machine) -> Problem:
        """What is to be solved.

        Raises:
            InputError: as `study`; or what does not fit the machine.
        """
        machine = self.machine or at_hand
        return problem_of(self.study(machine.name), machine)

    def as_file(self, at_hand: Machine) -> tuple[str, bytes]:
        """A file name and the study as TOML, about a bundled machine with changes, or about a file beside it.

        Raises:
            InputError: as `study`.
        """
        machine = self.machine or at_hand
        name, changes = _named(machine)
        study = self.study(name).model_copy(update={"changes": changes})
        head = "" if name in bundled() else f"# Save the machine beside this file, as {name}.\n"
        return f"{slug(self.name, 'study')}.toml", (head + study_toml(study)).encode()

    def unseen(self) -> list[str]:
        """What the study has that the form does not show, in words."""
        poses = self.rest.get("poses", {})
        found = [f"poses {', '.join(poses['over'])}"] if "over" in poses else []
        found += [f"{len(poses['list'])} poses"] if "list" in poses else []
        count = len(self.rest.get("constraints", []))
        found += [f"{count} constraint{'s' if count > 1 else ''}"] if count else []
        tolerances = sum("tolerance" in table for table in self.variables)
        found += [f"{tolerances} tolerances"] if tolerances else []
        return found


def draft_of(study: StudyFile, machine: Machine | None) -> Draft:
    """A draft from a study that has been read."""
    held = study.model_dump(mode="json", by_alias=True, exclude_none=True, exclude_defaults=True)
    known = ("schema", "name", "machine", "set", "variables", "objectives", "optimizer")
    search = {key: getattr(study.optimizer, key) for key in ("population", "generations", "seed")}
    return Draft(
        study.name,
        machine,
        held["variables"],
        held["objectives"],
        {**search, **held.get("optimizer", {})},
        {key: value for key, value in held.items() if key not in known},
    )


def bundled_draft(name: str) -> Draft:
    """The draft of a bundled study."""
    study = study_of(name)
    return draft_of(study, load(study.machine, list(settings_of(study.changes))))


def sent_draft(data: bytes, name: str, at_hand: Machine) -> Draft:
    """The draft of a study file that was sent: about a bundled machine, otherwise about the one at hand.

    Files of the computer that serves the page are never read for it.

    Raises:
        InputError: too large, not text, or a mistake in it.
    """
    if len(data) > LARGEST_FILE:
        raise InputError(f'"{name}" is larger than {LARGEST_FILE >> 20} MiB; a study file is a short TOML text.')
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f'"{name}" is not text; a study file is TOML, saved as UTF-8.') from None
    study = read_study(parse(text, name), name)
    changes = list(settings_of(study.changes))
    if study.machine in bundled():
        found = draft_of(study, load(study.machine, changes))
    else:
        found = draft_of(
            study, build(parse(as_toml(at_hand), at_hand.name), at_hand.name, changes) if changes else None
        )
    found.problem(at_hand)
    return found


def usual_bounds(control: Control, value: float) -> tuple[str, str]:
    """Bounds about a present value as text: 20 % of it, or of half its slider where that is nothing."""
    quantity = control.parameter.quantity
    middle = value if math.isfinite(value) and (value or not quantity.stiff) else USUAL_STIFFNESS
    around = AROUND * abs(middle) if middle else AROUND * max(control.high, 1e-9)
    low, high = middle - around, min(middle + around, quantity.most)
    return shown(quantity, low), shown(quantity, high)


def needs_direction(quantity: str) -> bool:
    """Whether an objective is along or about a direction."""
    return quantity in ALONG


def _named(machine: Machine) -> tuple[str, dict[str, str]]:
    """A bundled machine of the same name with what differs from it, or the name of a file."""
    for name, text in bundled().items():
        document = parse(text, name)
        if document["name"] != machine.name or document["family"] != machine.family.name:
            continue
        known = load(name)
        if values(known).keys() == values(machine).keys() and known.family.literals == machine.family.literals:
            return name, _changes(machine, values(known))
    return f"{slug(machine.name, 'machine')}.toml", {}


def _changes(machine: Machine, old: dict[str, Any]) -> dict[str, str]:
    held = values(machine)
    quantities = {leaf: p.quantity for p in parameters(machine.family) for leaf in p.leaves}
    return {path: quantities[path].show(value) for path, value in held.items() if value != old[path]}


def _without_none(table: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if value not in (None, "")}
