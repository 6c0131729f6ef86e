"""Identify a machine as built: from measurements to its most likely numbers, their sureness, and what is not seen."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from kinetostat.accuracy.errors import MachineError
from kinetostat.accuracy.model import ErrorModel, error_model
from kinetostat.arrays import Array
from kinetostat.display import number
from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, several, shorten
from kinetostat.spec.fields import Quantity, positive
from kinetostat.studies.identification.fit import Fit, Tell, Wishes, best_fit
from kinetostat.studies.identification.measurements import EULER, ROTATION, Measurements, Sigmas, read_measurements
from kinetostat.studies.identification.next_poses import MOST_PROPOSED, NextPoses, first_poses, next_poses, unit_of
from kinetostat.studies.identification.observation import (
    FRAME_UNKNOWNS,
    TARGET_UNKNOWNS,
    Observation,
    observation,
    place_unknown,
)
from kinetostat.studies.identification.unseen import Unseen, unseen_of
from kinetostat.tolerances import ROUND_OFF_OF_MEASUREMENT
from kinetostat.units import KINDS, UnitError, parse

USUALLY_FITTED = ("geometry", "zeros")
"""Groups of errors that are fitted by default."""
PLAUSIBLE_SIZES = {"length": 1e-3, "angle": 1e-3, "share": 1e-3}
"""Plausible sizes of unknowns: a millimetre, a milliradian, a thousandth."""
PLAUSIBLE_COMPLIANCE_ERROR = 0.1
"""Plausible size of the relative error of a compliance."""
PREFERENCE = 0.02
"""Weight of zero for errors of a machine, in standard deviations per plausible size: half a metre in ten standard
deviations hides nothing that is measured, but what is hardly seen does not run away."""
PLACED_ANYWHERE = 1e-5
"""The same for the measuring frame and the target, which may be metres away."""
MOST_NAMED_POSES = 12
"""Poses to add that a refusal names."""
USUAL_SIGMA = 1e-5
"""Standard deviation of measured lengths, m, where nobody says it; only ratios count then."""


@dataclass(frozen=True)
class Identification:
    """Errors of a machine as built that follow from measurements.

    Attributes:
        machine: as drawn.
        observed: the measurements beside the model.
        fit: the most likely values of the unknowns.
        sizes: plausible size of each unknown, SI [unknowns].
        unseen: combinations that nothing measured sees.
        next: poses that should be measured next; None if nobody asked.
    """

    machine: Machine
    observed: Observation
    fit: Fit
    sizes: Array
    unseen: tuple[Unseen, ...]
    next: NextPoses | None

    def __repr__(self) -> str:
        return (
            f"<Identification of {self.machine.name!r}: {len(self.unknowns)} unknowns from "
            f"{len(self.observed.measured)} values, {self.fit.rank} combinations seen, {len(self.outliers)} outliers>"
        )

    @property
    def unknowns(self) -> tuple[MachineError, ...]:
        """The unknowns of the fit, in order."""
        return self.observed.unknowns

    @property
    def errors(self) -> Array:
        """The errors of the machine that were found, in the order of the model [errors], SI."""
        return self.observed.errors(self.fit.values)

    @property
    def outliers(self) -> list[tuple[int, str, float]]:
        """Values that were set aside: line of the file, name, and residual in standard deviations."""
        data, fit = self.observed.data, self.fit
        return [
            (data.lines[self.observed.row_poses[row]], self.observed.row_names[row], float(fit.after[row]))
            for row in np.flatnonzero(~fit.kept)
        ]

    def scatter(self, residuals: Array) -> dict[str, float]:
        """Root mean square of kept residuals, of positions and distances (m) and of angles (rad).

        Args:
            residuals: in standard deviations [rows].
        """
        fit, off = self.fit, residuals * self.observed.sigma
        turns = np.array([name.removeprefix("deflection.") in (*ROTATION, *EULER) for name in self.observed.row_names])
        kinds = {"length": fit.kept & ~turns, "angle": fit.kept & turns}
        return {kind: float(np.sqrt((off[rows] ** 2).mean())) for kind, rows in kinds.items() if rows.any()}


@checked
def identify(
    machine: Machine,
    data: str | Path,
    fit: Sequence[str] = USUALLY_FITTED,
    *,
    frame: bool = False,
    target: bool = False,
    sigma: str = "",
    sigma_angle: str = "",
    priors: Mapping[str, str] | None = None,
    bounds: Mapping[str, str] | None = None,
    robust: bool = True,
    more: int = 0,
    ties: Mapping[str, str] | None = None,
    tell: Tell = lambda *_: None,
) -> Identification:
    """Find the errors of a machine that explain what was measured of it.

    Args:
        machine: as drawn.
        data: path of a CSV file; its columns are described in docs/calibration.md.
        fit: what to find: "geometry", "zeros", "gains", "compliances", "shared", or paths of errors with * and ?.
        frame: whether the place of the measuring frame is unknown; otherwise it is the base frame.
        target: whether the place of the target on the platform is unknown; otherwise it is the tool point.
        sigma, sigma_angle: standard deviations of measured lengths and angles that have no column, text with a unit.
        priors: what is known before, as standard deviations about zero by group or path, text with a unit.
        bounds: largest sizes by group or path, text with a unit.
        robust: whether outliers are set aside.
        more: how many poses to propose for measuring next.
        ties: further unknowns by names of your own, each of several errors that are one number: a pattern of their
            paths, "geometry.rod_length.*", or a sum with shares, "0.5 * legs.a.b.x + -0.5 * legs.c.b.x".
        tell: receives how far the work is.

    Raises:
        InputError: the file has a mistake, there is no such unknown, or there are fewer values than unknowns.
    """
    if not 0 <= more <= MOST_PROPOSED:
        raise InputError(f"more (--next) is {more}; give a whole number of poses from 0 to {MOST_PROPOSED}.")
    sigmas = Sigmas(
        positive(sigma, "length", "sigma") if sigma else USUAL_SIGMA,
        positive(sigma_angle, "angle", "sigma_angle") if sigma_angle else 0.0,
        bool(sigma or sigma_angle),
    )
    if not sigmas.angle:
        length = float((machine.chains() if machine.family.chains else machine.configure()).length)
        sigmas = Sigmas(sigmas.length, sigmas.length / length, sigmas.known)
    measured = read_measurements(machine, Path(data), sigmas)
    model = error_model(machine, measured.pose, len(measured), np.zeros(6))
    return identification_of(model, measured, fit, frame, target, priors or {}, bounds or {}, robust, more, tell, ties)


def identification_of(
    model: ErrorModel,
    data: Measurements,
    fit: Sequence[str] = USUALLY_FITTED,
    frame: bool = False,
    target: bool = False,
    priors: Mapping[str, str] | None = None,
    bounds: Mapping[str, str] | None = None,
    robust: bool = True,
    more: int = 0,
    tell: Tell = lambda *_: None,
    ties: Mapping[str, str] | None = None,
) -> Identification:
    """Find errors from measurements that are there as numbers; arguments and errors as for `identify`.

    Args:
        model: of the machine at the commanded poses.
        data: what was measured there.
        fit, frame, target, priors, bounds, robust, more, tell, ties: see `identify`.

    Raises:
        InputError: as for `identify`.
    """
    shares: dict[str, Mapping[str, float]] = {}
    unknowns = _unknowns_named(model, fit) if several(fit) or not ties else []
    for name, terms in (ties or {}).items():
        tied, shares[name] = _tied_error(model, name, terms)
        unknowns.append(tied)
    turned = any(name in (*ROTATION, *EULER) for name in data.values)
    places = [
        *(FRAME_UNKNOWNS if frame else ()),
        *(TARGET_UNKNOWNS if target and turned else TARGET_UNKNOWNS[3:] if target else ()),
    ]
    unknowns += [place_unknown(path) for path in places]
    seen = observation(model, data, unknowns, ties=shares)
    sizes = np.array([_plausible_size(unknown) for unknown in unknowns])
    known_before = _sizes_by_name(unknowns, priors or {}, "prior")
    _enough(model.machine, seen, sizes, int(np.isfinite(known_before).sum()))
    wishes = Wishes(
        sizes,
        known_before,
        _sizes_by_name(unknowns, bounds or {}, "bound"),
        np.array([PLACED_ANYWHERE if u.group in ("frame", "target") else PREFERENCE for u in unknowns]),
        robust,
        data.known,
        float((ROUND_OFF_OF_MEASUREMENT * np.where(seen.turns, 1.0, model.length) / seen.sigma).min(initial=np.inf)),
    )
    answer = best_fit(seen, seen.row_poses, wishes, tell)
    hidden = tuple(unseen_of(seen, answer, sizes))
    proposed = next_poses(model.machine, seen, answer, sizes, more) if more else None
    return Identification(model.machine, seen, answer, sizes, hidden, proposed)


def _unknowns_named(model: ErrorModel, patterns: Sequence[str]) -> list[MachineError]:
    """The errors that groups and patterns name, in the order of the model.

    Raises:
        InputError: one names nothing.
    """
    if not several(patterns):
        raise InputError(f'fit is empty; name groups or paths of what is to be found, e.g. "{USUALLY_FITTED[0]}".')
    paths: set[str] = set()
    for pattern in several(patterns):
        named = [e.path for e in model.errors if e.group == pattern or _matches(e, pattern)]
        if not named:
            near = ", ".join(dict.fromkeys(e.group for e in model.errors))
            raise InputError(
                f'"{pattern}" names no error of {model.machine.name}; choose groups ({near}) or paths with *, such as '
                f'"{model.errors[0].path}" or "legs.leg 1.*".'
            )
        paths |= set(named)
    return [error for error in model.errors if error.path in paths]


def _tied_error(model: ErrorModel, name: str, terms: str) -> tuple[MachineError, dict[str, float]]:
    """An unknown that is several errors at once, and how far each of them goes with it, by path.

    Raises:
        InputError: the name is not one, a term names nothing, or errors of several kinds.
    """
    if not name.isidentifier():
        raise InputError(f"the tie {shorten(name)} needs a name of letters, digits and _, such as rod_length.")
    shares: dict[str, float] = {}
    named: list[MachineError] = []
    for term in terms.split("+"):
        factor, star, pattern = term.partition(" * ")
        pattern = (pattern if star else term).strip()
        try:
            share = float(factor) if star else 1.0
        except ValueError:
            raise InputError(f'in the tie {name}, {shorten(factor)} is not a number; write "0.5 * PATH".') from None
        fitting_errors = [error for error in model.errors if _matches(error, pattern)]
        if not fitting_errors:
            raise InputError(
                f'the tie {name}: "{pattern}" names no error of {model.machine.name}; give paths with *, such as '
                f'"{model.errors[0].path}".'
            )
        named += fitting_errors
        shares |= {error.path: shares.get(error.path, 0.0) + share for error in fitting_errors}
    kinds = {error.kind for error in named}
    if len(kinds) > 1:
        raise InputError(
            f"the tie {name} has errors of several kinds, {' and '.join(sorted(kinds))}; tie those of one."
        )
    others = f" and {len(named) - 1} more as one" if len(named) > 1 else ""
    words = f"{name.replace('_', ' ')}: {named[0].words}{others}"
    return MachineError(name, named[0].kind, "tied", words, ""), shares


def _plausible_size(unknown: MachineError) -> float:
    return PLAUSIBLE_COMPLIANCE_ERROR if unknown.group == "compliances" else PLAUSIBLE_SIZES[unknown.kind]


def _matches(error: MachineError, pattern: str) -> bool:
    """Whether a pattern names an error; clearances, which stand where geometry does, are meant by their word only."""
    return fnmatchcase(error.path, pattern) and (error.group != "clearances" or "clearance" in pattern)


def _enough(machine: Machine, seen: Observation, sizes: Array, priors: int) -> None:
    """Refuse fewer values, with what is known before, than unknowns; say how many poses are needed, and which."""
    data, unknowns = seen.data, len(seen.unknowns) - priors
    if data.count >= unknowns:
        return
    each = max(data.count / max(len(data), 1), 1.0)
    needed = int(np.ceil(unknowns / each))
    poses = first_poses(machine, seen, sizes, min(needed - len(data), MOST_NAMED_POSES))
    scales = [machine.display.scale(unit_of(machine, path)) for path in poses]
    heads = ", ".join(scale.label(path.removeprefix("pose.")) for scale, path in zip(scales, poses, strict=True))
    rows = np.column_stack([scale.factor * values for scale, values in zip(scales, poses.values(), strict=True)])
    named = "; ".join(", ".join(number(value, digits=3) for value in row) for row in rows.tolist())
    raise InputError(
        f'"{data.path}": {len(data)} poses give {data.count} measured values for {unknowns} unknowns; measure at '
        f"least {needed} poses like these (better {2 * needed}), spread over the workspace and its angles, or fit less "
        f"(--fit). Those to add first, {heads}: {named}."
    )


def _sizes_by_name(unknowns: Sequence[MachineError], given: Mapping[str, str], what: str) -> Array:
    """Sizes by group or path for all unknowns, SI; infinity where none is given."""
    result = np.full(len(unknowns), np.inf)
    for pattern, text in given.items():
        named = [n for n, u in enumerate(unknowns) if u.group == pattern or fnmatchcase(u.path, pattern)]
        kinds = {kind for kind in PLAUSIBLE_SIZES for n in named if unknowns[n].kind == kind}
        if not named:
            raise InputError(
                f'the {what} "{pattern}" belongs to nothing that is fitted; name a group or a path with *.'
            )
        fitting = {}
        for kind in kinds:
            try:
                fitting[kind] = parse(text, kind)
            except UnitError:
                continue
            try:
                Quantity(kind, "", positive=True).check(fitting[kind])
            except UnitError as error:
                raise InputError(f"the {what} of {pattern} is {shorten(text)}: {error}.") from None
        if not fitting:
            unit = " or ".join(f'"{KINDS[kind].example}"' for kind in sorted(kinds))
            raise InputError(f"the {what} of {pattern} is {text}, which is of another kind; write for example {unit}.")
        for n in named:
            result[n] = min(result[n], fitting.get(unknowns[n].kind, np.inf))
    return result
