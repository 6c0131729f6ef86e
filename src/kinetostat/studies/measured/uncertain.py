"""Which numbers of a machine are uncertain, how much, and how they change its compliance: theory (71).

They come from the lines of [tolerances], or from the record of a fit, whose values then count as well. Compliances of
springs act exactly; errors of geometry by differences of machines that are placed as built.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kinetostat.accuracy.built import compliances_as_built
from kinetostat.accuracy.model import ErrorModel
from kinetostat.arrays import Array, Integers
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.spec.tolerance_table import SIGMAS
from kinetostat.studies.budget.tolerances import toleranced_parts
from kinetostat.studies.identification.record import read_fit

STANDING = ("zeros", "gains", "clearances")
"""Groups of errors that leave the compliance of a machine at its pose as it is: they only move it."""
STEP = 1e-5
"""Of differences by errors of geometry, rad or in units of the machine's length: what they leave out is its square."""
SAME = 1e-9
"""Share by which a machine that is placed as built may differ from the drawn one, without any error."""


@dataclass(frozen=True)
class Uncertain:
    """Numbers of a machine that are not exact.

    Attributes:
        places: in the errors of the model [p].
        values: by which they differ from the drawing, SI [p].
        covariance: SI [p x p].
        source: where that is from, for people; empty where nothing is uncertain.
    """

    places: Integers
    values: Array
    covariance: Array
    source: str


def uncertain_of(machine: Machine, model: ErrorModel, fit: Path | None) -> Uncertain:
    """Gather what is known of a machine's numbers: from a fit, and from [tolerances] for those that were not fitted.

    Args:
        machine: as drawn.
        model: its errors.
        fit: record of `kinetostat identify`; None without one.

    Raises:
        InputError: the record cannot be read or is about another machine, or a line of [tolerances] is about nothing.
    """
    paths = {error.path: place for place, error in enumerate(model.errors)}
    fitted, values, covariance = _of_fit(machine, paths, fit) if fit else ([], np.zeros(0), np.zeros((0, 0)))
    parts = toleranced_parts(machine, model.errors, machine.tolerances) if machine.tolerances else ()
    chosen = [part for part in parts if part.group not in STANDING and part.errors[0] not in fitted]
    variances = [part.limit**2 * (SIGMAS**-2 if part.normal else 1.0 / 3.0) for part in chosen]
    places = [*fitted, *(part.errors[0] for part in chosen)]
    whole = np.zeros((len(places), len(places)))
    whole[: len(fitted), : len(fitted)] = covariance
    whole[np.arange(len(fitted), len(places)), np.arange(len(fitted), len(places))] = variances
    counted = [place for place, size in enumerate(np.diag(whole)) if size > 0.0 or place < len(fitted)]
    sources = [f'the fit "{fit}"' if fit else "", "[tolerances]" if chosen else ""]
    return Uncertain(
        np.array(places, dtype=np.int64)[counted],
        np.concatenate([values, np.zeros(len(chosen))])[counted],
        whole[np.ix_(counted, counted)],
        " and ".join(filter(None, sources)),
    )


def _of_fit(machine: Machine, paths: Mapping[str, int], path: Path) -> tuple[list[int], Array, Array]:
    """Places, values and covariance of what a fit says of the machine's compliance."""
    record = read_fit(path)
    record.check(machine)
    rows = [n for n, u in enumerate(record.unknowns) if u.group not in (*STANDING, "frame", "target")]
    missing = [record.unknowns[n].path for n in rows if record.unknowns[n].path not in paths]
    if missing:
        raise InputError(
            f'"{path}" is the fit of a machine with {missing[0]}, which {machine.name} does not have; give the machine '
            "as drawn, not the file that the fit has written."
        )
    values = np.array([record.unknowns[n].value for n in rows])
    return [paths[record.unknowns[n].path] for n in rows], values, record.covariance[np.ix_(rows, rows)]


def dyads_of(model: ErrorModel) -> Array:
    """What each spring brings to the compliance at the tool point [n x 6 x 6 x springs], base axes, SI: theory (8)."""
    loads = [np.broadcast_to(unit, (len(model), 6)) for unit in np.eye(6)]
    return np.stack([model.deflections(load) for load in loads], axis=2)


def compliance_changes(model: ErrorModel, uncertain: Uncertain, dyads: Array) -> tuple[Array, tuple[str, ...]]:
    """How the compliance changes per unit of each uncertain number [n x 6 x 6 x p], and which ones are not counted.

    Errors of geometry are left out of an overconstrained machine, whose legs would be bent by them, and of one whose
    springs change with the pose, away from its home place.

    Args:
        model: of the machine at n poses.
        uncertain: numbers.
        dyads: of its springs [n x 6 x 6 x springs].
    """
    first = len(model.errors) - dyads.shape[3]
    changes = np.zeros((len(model), 6, 6, len(uncertain.places)))
    geometry = [n for n, place in enumerate(uncertain.places) if place < first]
    for n, place in enumerate(uncertain.places):
        if place >= first:
            changes[..., n] = dyads[..., place - first]
    if not geometry:
        return changes, ()
    if model.overconstrained or not _agrees(model, dyads):
        return changes, tuple(model.errors[uncertain.places[n]].path for n in geometry)
    for n in geometry:
        changes[..., n] = _change(model, int(uncertain.places[n]))
    return changes, ()


def _agrees(model: ErrorModel, dyads: Array) -> bool:
    """Whether the machine placed without errors has the compliance of the drawn one at all poses.

    It has not where springs change with the pose, as a strut does that is longer elsewhere.
    """
    drawn = dyads.sum(axis=3)
    off = np.abs(compliances_as_built(np.zeros(len(model.errors)), model) - drawn)
    return bool((off.max(axis=(1, 2)) <= SAME * np.abs(drawn).max(axis=(1, 2))).all())


def _change(model: ErrorModel, place: int) -> Array:
    """Of the compliance per unit of an error, by central differences [n x 6 x 6]."""
    size = STEP * (model.length if model.errors[place].kind == "length" else 1.0)
    way = size * np.eye(len(model.errors))[place]
    return (compliances_as_built(way, model) - compliances_as_built(-way, model)) / (2.0 * size)
