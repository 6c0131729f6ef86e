"""Identify a machine as built: from measurements to its most likely numbers, their intervals, and what is not seen.

The question is put together here from what a user writes: unknowns by groups, paths and ties, priors and bounds. What
measurements say about it is computed in `observation`, `fit`, `unseen` and `next_poses`.
"""

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
from kinetostat.machine.parameters import POSE
from kinetostat.spec.arguments import as_list, checked
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity, positive_number
from kinetostat.studies.identification.fit import Fit, FitOptions, Tell, best_fit
from kinetostat.studies.identification.measurements import EULER, ROTATION, Measurements, Sigmas, read_measurements
from kinetostat.studies.identification.next_poses import (
    MOST_PROPOSED,
    NextPoses,
    Poses,
    first_poses,
    next_poses,
    unit_of,
)
from kinetostat.studies.identification.observation import (
    FRAME_UNKNOWNS,
    PLACES,
    TARGET_UNKNOWNS,
    Observation,
    observation,
    place_unknown,
)
from kinetostat.studies.identification.record import Outlier
from kinetostat.studies.identification.unseen import Unseen, unseen_of
from kinetostat.tolerances import ROUND_OFF_OF_MEASUREMENT
from kinetostat.units import KINDS, UnitError, parse

USUALLY_FITTED = ("geometry", "zeros")
"""Groups of errors that are fitted by default: nearly every calibration sees them, by positions alone."""
PLAUSIBLE_SIZES = {"length": 1e-3, "angle": 1e-3, "share": 1e-3}
"""Plausible sizes of unknowns by kind, as machines are built: a millimetre, a milliradian, a thousandth. They make
kinds comparable, and say how far combinations may go that nothing sees."""
PLAUSIBLE_COMPLIANCE_ERROR = 0.1
"""Plausible size of the relative error of a compliance: tables and models of springs are no better."""
PREFERENCE = 0.02
"""Preference of errors of the machine for zero, in standard deviations per plausible size: an error of ten plausible
sizes costs a fifth of a standard deviation, which hides nothing that is measured; what is hardly seen stays small."""
PREFERENCE_OF_PLACES = 1e-5
"""The same for the measuring frame and the target, which may be metres away."""
MOST_NAMED_POSES = 12
"""Greatest number of poses to add that a refusal names: more would bury the rest of its message."""
USUAL_SIGMA = 1e-5
"""Standard deviation of measured lengths, m, where nobody says it; only its ratio to that of angles counts then."""


@dataclass(frozen=True)
class Identification:
    """Errors of a machine as built that follow from measurements.

    Attributes:
        machine: the machine as drawn.
        observed: the measurements beside the model.
        fit: the most likely values of the unknowns.
        sizes: plausible size of each unknown, SI [unknowns].
        unseen: combinations of unknowns that change nothing that was measured.
        next: poses that should be measured next; None if none were asked for, or too few can be placed.
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
    def outliers(self) -> list[Outlier]:
        """Values that were set aside."""
        lines, observed = self.observed.data.lines, self.observed
        return [
            Outlier(lines[observed.row_poses[row]], observed.row_names[row], float(self.fit.after[row]))
            for row in np.flatnonzero(~self.fit.kept)
        ]

    def scatter(self, residuals: Array) -> dict[str, float]:
        """Root mean square of kept residuals, times their standard deviations: "length" in m, "angle" in rad.

        Args:
            residuals: residuals in standard deviations, of all rows [rows].
        """
        differences, kept, turns = residuals * self.observed.sigma, self.fit.kept, self.observed.turns
        kinds = {"length": kept & ~turns, "angle": kept & turns}
        return {kind: float(np.sqrt((differences[rows] ** 2).mean())) for kind, rows in kinds.items() if rows.any()}


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
        machine: the machine as drawn.
        data: path of a CSV file; its columns are described in docs/calibration.md.
        fit: errors to find: "geometry", "zeros", "gains", "compliances", "shared", or paths of errors with * and ?.
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
    sigma_length = positive_number(sigma, "length", "sigma") if sigma else USUAL_SIGMA
    if sigma_angle:
        sigma_turn = positive_number(sigma_angle, "angle", "sigma_angle")
    else:  # the turn that moves a point at the machine's length by as much
        sigma_turn = sigma_length / float((machine.chains() if machine.family.chains else machine.configure()).length)
    sigmas = Sigmas(length=sigma_length, angle=sigma_turn, known=bool(sigma or sigma_angle))
    measured = read_measurements(machine, Path(data), sigmas)
    model = error_model(machine, measured.pose, len(measured), np.zeros(6))
    return identification_of(
        model,
        measured,
        fit,
        frame=frame,
        target=target,
        priors=priors,
        bounds=bounds,
        robust=robust,
        more=more,
        ties=ties,
        tell=tell,
    )


def identification_of(
    model: ErrorModel,
    data: Measurements,
    fit: Sequence[str] = USUALLY_FITTED,
    *,
    frame: bool = False,
    target: bool = False,
    priors: Mapping[str, str] | None = None,
    bounds: Mapping[str, str] | None = None,
    robust: bool = True,
    more: int = 0,
    ties: Mapping[str, str] | None = None,
    tell: Tell = lambda *_: None,
) -> Identification:
    """Find errors from measurements that are numbers already; arguments and errors as for `identify`.

    Args:
        model: the errors of the machine at the commanded poses.
        data: what was measured there.
        fit, frame, target, priors, bounds, robust, more, ties, tell: see `identify`.

    Raises:
        InputError: as for `identify`.
    """
    # Ties alone are enough; without them, an empty `fit` is refused.
    unknowns = _errors_named(model, fit) if as_list(fit) or not ties else []
    tied = {name: _tied_error(model, name, terms) for name, terms in (ties or {}).items()}
    unknowns += [unknown for unknown, _ in tied.values()]
    unknowns += [place_unknown(path) for path in _place_paths(data, frame, target)]
    observed = observation(model, data, unknowns, ties={name: shares for name, (_, shares) in tied.items()})
    sizes = np.array([_plausible_size(unknown) for unknown in unknowns])
    known_before = _sizes_by_name(unknowns, priors or {}, "prior")
    _check_count(model.machine, observed, sizes, int(np.isfinite(known_before).sum()))
    units = np.where(observed.turns, 1.0, model.length)
    options = FitOptions(
        sizes=sizes,
        priors=known_before,
        bounds=_sizes_by_name(unknowns, bounds or {}, "bound"),
        preferred=np.array([PREFERENCE_OF_PLACES if u.group in PLACES else PREFERENCE for u in unknowns]),
        robust=robust,
        known=data.known,
        resolution=float((ROUND_OFF_OF_MEASUREMENT * units / observed.sigma).min(initial=np.inf)),
    )
    result = best_fit(observed, observed.row_poses, options, tell)
    return Identification(
        machine=model.machine,
        observed=observed,
        fit=result,
        sizes=sizes,
        unseen=tuple(unseen_of(observed, result, sizes)),
        next=next_poses(model.machine, observed, result, sizes, more) if more else None,
    )


def _place_paths(data: Measurements, frame: bool, target: bool) -> list[str]:
    """Paths of the unknown places; how the target is turned matters only where orientations are measured."""
    measures_turns = any(name in (*ROTATION, *EULER) for name in data.values)
    of_target = TARGET_UNKNOWNS if measures_turns else TARGET_UNKNOWNS[3:]
    return [*(FRAME_UNKNOWNS if frame else ()), *(of_target if target else ())]


def _errors_named(model: ErrorModel, patterns: Sequence[str]) -> list[MachineError]:
    """The errors that groups and patterns name, in the order of the model.

    Raises:
        InputError: a pattern names nothing.
    """
    if not as_list(patterns):
        raise InputError(f'fit is empty; name groups or paths of what is to be found, e.g. "{USUALLY_FITTED[0]}".')
    paths: set[str] = set()
    for pattern in as_list(patterns):
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
    """An unknown that stands for several errors, and the share of it that each of them takes, by path.

    Raises:
        InputError: the name is not an identifier, a term names nothing, or the errors are of several kinds.
    """
    if not name.isidentifier():
        raise InputError(f"the tie {shorten(name)} needs a name of letters, digits and _, such as rod_length.")
    shares: dict[str, float] = {}
    named: list[MachineError] = []
    for term in terms.split("+"):
        factor, has_factor, pattern = term.partition(" * ")
        pattern = (pattern if has_factor else term).strip()
        try:
            share = float(factor) if has_factor else 1.0
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
    return MachineError(path=name, kind=named[0].kind, group="tied", words=words, leg=""), shares


def _plausible_size(unknown: MachineError) -> float:
    return PLAUSIBLE_COMPLIANCE_ERROR if unknown.group == "compliances" else PLAUSIBLE_SIZES[unknown.kind]


def _matches(error: MachineError, pattern: str) -> bool:
    """Whether a pattern names an error; clearances, which stand where geometry does, are meant by their word only."""
    return fnmatchcase(error.path, pattern) and (error.group != "clearances" or "clearance" in pattern)


def _check_count(machine: Machine, observed: Observation, sizes: Array, priors: int) -> None:
    """Refuse fewer measured values than unknowns without a prior; say how many poses are needed, and which.

    `priors` is the number of unknowns with a prior.
    """
    data, unknowns = observed.data, len(observed.unknowns) - priors
    if data.count >= unknowns:
        return
    values_per_pose = max(data.count / max(len(data), 1), 1.0)
    least_poses = int(np.ceil(unknowns / values_per_pose))
    poses = first_poses(machine, observed, sizes, min(least_poses - len(data), MOST_NAMED_POSES))
    raise InputError(
        f'"{data.path}": {len(data)} poses give {data.count} measured values for {unknowns} unknowns; measure at '
        f"least {least_poses} poses like these (better {2 * least_poses}), spread over the workspace and its angles, "
        f"or fit less (--fit). Those to add first, {_poses_in_words(machine, poses)}."
    )


def _poses_in_words(machine: Machine, poses: Poses) -> str:
    """Write poses as a head of coordinates with their units, and the numbers of each pose after it."""
    scales = [machine.display.scale(unit_of(machine, path)) for path in poses]
    heads = ", ".join(scale.label(path.removeprefix(POSE)) for scale, path in zip(scales, poses, strict=True))
    rows = np.column_stack([scale.factor * values for scale, values in zip(scales, poses.values(), strict=True)])
    return f"{heads}: {'; '.join(', '.join(number(value, digits=3) for value in row) for row in rows.tolist())}"


def _sizes_by_name(unknowns: Sequence[MachineError], texts: Mapping[str, str], subject: str) -> Array:
    """Sizes of all unknowns, SI, from texts by group or path; infinity where there is none [unknowns].

    A group may have lengths and angles: a text is about those of its kind. Of two texts, the smaller size counts.

    Args:
        unknowns: the unknowns of the fit.
        texts: a size with its unit, by group or by a path with * and ?.
        subject: "prior" or "bound", for messages.
    """
    result = np.full(len(unknowns), np.inf)
    for pattern, text in texts.items():
        rows = [n for n, u in enumerate(unknowns) if u.group == pattern or fnmatchcase(u.path, pattern)]
        kinds = {unknowns[n].kind for n in rows}
        if not rows:
            raise InputError(
                f'the {subject} "{pattern}" belongs to nothing that is fitted; name a group or a path with *.'
            )
        sizes = {
            kind: size for kind in kinds if (size := _read_size(text, kind, f"{subject} of {pattern}")) is not None
        }
        if not sizes:
            unit = " or ".join(f'"{KINDS[kind].example}"' for kind in sorted(kinds))
            raise InputError(
                f"the {subject} of {pattern} is {text}, which is of another kind; write for example {unit}."
            )
        for n in rows:
            result[n] = min(result[n], sizes.get(unknowns[n].kind, np.inf))
    return result


def _read_size(text: str, kind: str, subject: str) -> float | None:
    """The size that a text means, SI; None if it is of another kind.

    Raises:
        InputError: it is not more than 0.
    """
    try:
        size = parse(text, kind)
    except UnitError:
        return None
    try:
        Quantity(kind, "", positive=True).check(size)
    except UnitError as error:
        raise InputError(f"the {subject} is {shorten(text)}: {error}.") from None
    return size
