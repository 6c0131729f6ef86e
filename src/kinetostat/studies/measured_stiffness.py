"""A measured stiffness beside the computed one: what lies between them, and whether their uncertainties explain it.

Uncertain numbers of the machine come from the lines of [tolerances], or from the record of a fit, whose values then
count as well. Compliances of springs act exactly, errors of geometry by differences of machines placed as built.

Source: theory (69) to (72); ASME V&V 20-2009, *Standard for Verification and Validation in Computational Fluid Dynamics
and Heat Transfer*, sections 1 and 6.
"""

from collections.abc import Collection, Mapping, Sequence
from itertools import compress
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag
from scipy.special import chdtrc

from kinetostat.accuracy.built import compliances_as_built
from kinetostat.accuracy.model import ErrorModel, error_model
from kinetostat.accuracy.toleranced_parts import toleranced_parts
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import REGULAR, Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.tolerance_table import SIGMAS
from kinetostat.studies.identification.record import read_fit
from kinetostat.studies.stiffness_file import MeasuredEntry, MeasuredKind, MeasuredStiffness, read_stiffness
from kinetostat.tolerances import LEAST_DIVISOR

GROUPS_WITHOUT_COMPLIANCE = ("zeros", "gains", "clearances")
"""Groups of errors that leave the compliance of a machine at its pose as it is: they only move it."""
NORMAL_VARIANCE = SIGMAS**-2
"""Variance of a normal deviation whose limit is 1, with `SIGMAS` standard deviations to the limit."""
EVEN_VARIANCE = 1.0 / 3.0
"""Variance of a deviation that is evenly distributed between -1 and 1."""
GEOMETRY_STEP = 1e-5
"""Step of differences by errors of geometry, rad or in units of the machine's length; its square is their error."""
SAME_COMPLIANCE = 1e-9
"""Share of the compliance by which a machine that is placed as built, but without errors, may differ from the drawn
one: round-off of closing its legs."""
COVERAGE_FACTOR = 2.0
"""Standard uncertainties that an interval reaches: about 95 % of normal values lie within."""
LEAST_LIKELY = 0.05
"""Probability below which so much disagreement is not put down to chance."""
LEAST_PROBABILITY = 1e-4
"""Probability below which no number is given."""
RIGID_SHARE = 1e-12
"""Share of the largest compliance, with lengths in units of the machine's, below which a direction counts as rigid."""


@dataclass(frozen=True)
class UncertainNumbers:
    """Numbers of a machine that are not exact.

    Attributes:
        places: their places among the errors of the model [p].
        values: their differences from the drawing, SI [p].
        covariance: the covariance of these values, SI [p x p].
        source: the origin of the covariance, for people; empty where nothing is uncertain.
    """

    places: Integers
    values: Array
    covariance: Array
    source: str


NOTHING_UNCERTAIN = UncertainNumbers(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 0)), "")
"""No numbers, where no fit is given."""


def uncertain_numbers(machine: Machine, model: ErrorModel, fit: Path | None) -> UncertainNumbers:
    """Gather what is known of a machine's numbers: from a fit, and from [tolerances] for those that were not fitted.

    Args:
        machine: the machine as drawn.
        model: the model of its errors.
        fit: the record of `kinetostat identify`; None without one.

    Raises:
        InputError: the record cannot be read or is about another machine, or a line of [tolerances] is about nothing.
    """
    places = {error.path: place for place, error in enumerate(model.errors)}
    by_fit = _numbers_of_fit(machine, places, fit) if fit else NOTHING_UNCERTAIN
    by_tolerance = _toleranced_numbers(machine, model, set(by_fit.places.tolist()))
    return UncertainNumbers(
        places=np.concatenate([by_fit.places, by_tolerance.places]),
        values=np.concatenate([by_fit.values, by_tolerance.values]),
        covariance=block_diag(by_fit.covariance, by_tolerance.covariance),
        source=" and ".join(filter(None, [by_fit.source, by_tolerance.source])),
    )


def _numbers_of_fit(machine: Machine, places: Mapping[str, int], path: Path) -> UncertainNumbers:
    """The numbers of a fit that act on the compliance of a machine; `places` are those of errors by their paths."""
    record = read_fit(path)
    record.check_drawn(machine)
    rows = [n for n, u in enumerate(record.unknowns) if u.group not in (*GROUPS_WITHOUT_COMPLIANCE, "frame", "target")]
    missing = [record.unknowns[n].path for n in rows if record.unknowns[n].path not in places]
    if missing:
        raise InputError(
            f'"{path}" is the fit of a machine with {missing[0]}, which {machine.name} does not have; give the machine '
            "as drawn, not the file that the fit has written."
        )
    return UncertainNumbers(
        places=np.array([places[record.unknowns[n].path] for n in rows], dtype=np.int64),
        values=np.array([record.unknowns[n].value for n in rows]),
        covariance=record.covariance[np.ix_(rows, rows)],
        source=f'the fit "{path}"',
    )


def _toleranced_numbers(machine: Machine, model: ErrorModel, fitted: Collection[int]) -> UncertainNumbers:
    """The numbers that lines of [tolerances] are about, but not those with the places of fitted ones."""
    parts = toleranced_parts(machine, model.errors, machine.tolerances) if machine.tolerances else ()
    # Only a clearance has several errors, and it is in one of the groups that are left out.
    chosen = [part for part in parts if part.group not in GROUPS_WITHOUT_COMPLIANCE and part.errors[0] not in fitted]
    deviating = [part for part in chosen if part.limit > 0.0]
    return UncertainNumbers(
        places=np.array([part.errors[0] for part in deviating], dtype=np.int64),
        values=np.zeros(len(deviating)),
        covariance=np.diag([part.limit**2 * (NORMAL_VARIANCE if part.normal else EVEN_VARIANCE) for part in deviating]),
        source="[tolerances]" if chosen else "",
    )


def spring_dyads(model: ErrorModel) -> Array:
    """Contribution of each spring to C at the tool point [n x 6 x 6 x springs], base axes, SI: theory (8)."""
    loads = [np.broadcast_to(unit, (len(model), 6)) for unit in np.eye(6)]
    return np.stack([model.deflections(load) for load in loads], axis=2)


def compliance_changes(model: ErrorModel, uncertain: UncertainNumbers, dyads: Array) -> tuple[Array, tuple[str, ...]]:
    """Changes of C per unit of each uncertain number [n x 6 x 6 x p], theory (71), and numbers that do not count.

    Errors of geometry are left out of an overconstrained machine, whose legs would be bent by them, and of one whose
    springs change with the pose, away from its home place.

    Args:
        model: the errors of the machine at n poses.
        uncertain: its uncertain numbers.
        dyads: the contributions of its springs to C [n x 6 x 6 x springs].
    """
    first_spring = len(model.errors) - dyads.shape[3]  # springs come last among the errors of a model
    changes = np.zeros((len(model), 6, 6, len(uncertain.places)))
    is_spring = uncertain.places >= first_spring
    changes[..., is_spring] = dyads[..., uncertain.places[is_spring] - first_spring]
    geometry = np.flatnonzero(~is_spring)
    if not geometry.size:
        return changes, ()
    if model.overconstrained or not _drawn_compliance_is_kept(model, dyads):
        return changes, tuple(model.errors[place].path for place in uncertain.places[geometry])
    for n in geometry:
        changes[..., n] = _change_by_error(model, int(uncertain.places[n]))
    return changes, ()


def _drawn_compliance_is_kept(model: ErrorModel, dyads: Array) -> bool:
    """Whether the machine placed without errors has the compliance of the drawn one at all poses.

    The two differ where springs change with the pose, as a strut does that is longer elsewhere.
    """
    drawn = dyads.sum(axis=3)
    differences = np.abs(compliances_as_built(np.zeros(len(model.errors)), model) - drawn)
    return bool((differences.max(axis=(1, 2)) <= SAME_COMPLIANCE * np.abs(drawn).max(axis=(1, 2))).all())


def _change_by_error(model: ErrorModel, place: int) -> Array:
    """The change of the compliance per unit of an error, by central differences [n x 6 x 6]."""
    step = GEOMETRY_STEP * (model.length if model.errors[place].kind == "length" else 1.0)
    errors = step * np.eye(len(model.errors))[place]
    return (compliances_as_built(errors, model) - compliances_as_built(-errors, model)) / (2.0 * step)


@dataclass(frozen=True)
class MeasuredRow:
    """A measured number beside the computed one, all SI.

    Attributes:
        entry: the measured number.
        predicted: the computed number.
        u_num, u_input, u_data: standard uncertainties of the computation, of the machine's numbers and of the
            measurement, as ASME V&V 20 names them.
    """

    entry: MeasuredEntry
    predicted: float
    u_num: float
    u_input: float
    u_data: float

    @property
    def error(self) -> float:
        """Excess of the computed number over the measured one."""
        return self.predicted - self.entry.value

    @property
    def u_val(self) -> float:
        """Standard uncertainty of this difference, theory (69)."""
        return float(np.sqrt(self.u_num**2 + self.u_input**2 + self.u_data**2))

    @property
    def explained(self) -> bool:
        """Whether the uncertainties explain the difference: it is at most twice theirs."""
        return abs(self.error) <= COVERAGE_FACTOR * self.u_val

    @property
    def bounds(self) -> tuple[float, float]:
        """The sizes between which the model's error lies, SI; the lower one is 0 where uncertainties explain it."""
        least = max(abs(self.error) - COVERAGE_FACTOR * self.u_val, 0.0)
        return least, abs(self.error) + COVERAGE_FACTOR * self.u_val


@dataclass(frozen=True)
class MeasuredComparison:
    """A machine beside its measured stiffness.

    Attributes:
        machine: the measured machine.
        path: the path of the file.
        rows: the rows in the order of the file.
        chi_square: the sum of squared differences over their uncertainties, correlations counted, theory (72).
        probability: the probability of at least as large a sum where the model has no error.
        source: the origin of the uncertainties of the machine's numbers; empty where there are none.
        left_out: the paths of uncertain numbers that do not count.
    """

    machine: Machine
    path: str
    rows: tuple[MeasuredRow, ...]
    chi_square: float
    probability: float
    source: str
    left_out: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<MeasuredComparison of {self.machine.name!r}: {len(self.rows)} values, agrees {self.agrees}>"

    @property
    def agrees(self) -> bool:
        """Whether the uncertainties explain all differences together."""
        return self.probability >= LEAST_LIKELY

    @property
    def shares(self) -> dict[str, float]:
        """Shares of the sources in the variances of the differences, on average; they add up to 1."""
        parts = np.array([[row.u_num, row.u_input, row.u_data] for row in self.rows]) ** 2
        means = (parts / parts.sum(axis=1, keepdims=True)).mean(axis=0)
        return dict(zip(("numerics", "inputs", "measurement"), means.tolist(), strict=True))

    @property
    def message(self) -> str:
        """The verdict in words."""
        inside, count = sum(row.explained for row in self.rows), len(self.rows)
        probability = f"{100.0 * self.probability:.2g} %" if self.probability > LEAST_PROBABILITY else "below 0.01 %"
        text = (
            f"{self.machine.name}: {inside} of {count} measured numbers lie within twice the uncertainty of the "
            f"comparison. Together they are {'as' if self.agrees else 'not as'} near to the computed ones as "
            f"uncertainties allow (chi-square {self.chi_square:.3g} for {count}, probability "
            f"{probability})"
        )
        if not self.agrees:
            return f"{text}: the model is wrong there, or the uncertainties are too small."
        worst = max(
            row.bounds[1] / max(abs(row.entry.value), abs(row.predicted), LEAST_DIVISOR) for row in self._diagonal
        )
        return f"{text}: no error of the model is seen. One of up to {100.0 * worst:.2g} % would not be seen."

    @property
    def _diagonal(self) -> Sequence[MeasuredRow]:
        """Rows whose value says how large a number is; all where there are none."""
        places = [row.entry.place for row in self.rows]
        is_diagonal = [p.row == p.column and p.kind is not MeasuredKind.DEFLECTION for p in places]
        return list(compress(self.rows, is_diagonal)) or self.rows


@checked
def validate_measured(
    machine: Machine, data: str | Path, *, fit: str | Path | None = None, sigma: str = "", sigma_angle: str = ""
) -> MeasuredComparison:
    """Compare the stiffness of a machine at its tool point with a measured one, theory (69) to (72).

    Args:
        machine: the machine at the pose at which it was measured, with [tolerances] that say how sure its numbers are.
        data: path of a CSV file; its columns are described in docs/validation.md.
        fit: path of the fit.json of `kinetostat identify`, whose values and covariance then count.
        sigma: standard deviation of what has none in the file: a share ("3 %"), or of deflections a length.
        sigma_angle: the same of deflections that are angles.

    Raises:
        InputError: a file has a mistake, the machine has no place at a pose, or it is rigid where a stiffness is asked.
    """
    measured = read_stiffness(machine, Path(data), sigma, sigma_angle)
    pose = dict(measured.deflections.pose) if measured.deflections else {}
    count = len(measured.deflections) if measured.deflections else 1
    model = error_model(machine, pose, count, np.zeros(6))
    unplaced = np.flatnonzero(~np.isin(model.drawn.status, REGULAR))
    if unplaced.size:
        sentence = Status(int(model.drawn.status[unplaced[0]])).sentence
        line = f"line {measured.deflections.lines[unplaced[0]]}: " if measured.deflections else ""
        raise InputError(f'"{data}", {line}the drawn machine is not at the measured pose. {sentence}')
    response = respond(with_values(machine, pose) if pose else machine)
    computed = stacked_columns([entry for row in response.compliance.rows() for entry in row], count).reshape(-1, 6, 6)
    uncertain = uncertain_numbers(machine, model, Path(fit) if fit else None)
    return _comparison(machine, model, measured, computed, uncertain)


def _comparison(
    machine: Machine, model: ErrorModel, measured: MeasuredStiffness, computed: Array, uncertain: UncertainNumbers
) -> MeasuredComparison:
    """Compare measured entries with the computed compliance of the drawn machine [n x 6 x 6].

    The error of the computation is the difference of its two routes: the response, and the sum over springs.
    """
    dyads = spring_dyads(model)
    changes, left_out = compliance_changes(model, uncertain, dyads)
    compliance, between_routes = computed + changes @ uncertain.values, computed - dyads.sum(axis=3)
    loads = measured.deflections.wrenches if measured.deflections else np.zeros((1, 6))
    entries = [
        _computed_entry(entry, compliance[entry.pose], loads[entry.pose], machine.family.components, model.length)
        for entry in measured.entries
    ]
    rates = np.array([each.changes(changes[each.entry.pose]) for each in entries]).reshape(len(entries), -1)
    numeric = np.array([each.changes(between_routes[each.entry.pose, :, :, None])[0] for each in entries])
    inputs = rates @ uncertain.covariance @ rates.T  # covariance of all entries by the machine's numbers
    sigma = np.array([each.entry.sigma for each in entries])
    rows = tuple(
        MeasuredRow(
            entry=each.entry,
            predicted=each.value,
            u_num=abs(float(error)),
            u_input=float(np.sqrt(max(variance, 0.0))),
            u_data=each.entry.sigma,
        )
        for each, error, variance in zip(entries, numeric, np.diag(inputs), strict=True)
    )
    # In units of each entry's sigma, so that entries of all kinds of units can be in one matrix.
    errors = np.array([row.error for row in rows]) / sigma
    covariance = (inputs + np.diag(numeric**2 + sigma**2)) / np.outer(sigma, sigma)
    chi_square = float(errors @ np.linalg.solve(covariance, errors))
    return MeasuredComparison(
        machine=machine,
        path=measured.path,
        rows=rows,
        chi_square=chi_square,
        probability=float(chdtrc(len(rows), chi_square)),
        source=uncertain.source,
        left_out=left_out,
    )


@dataclass(frozen=True)
class _ComputedEntry:
    """A measured number beside that of the machine.

    Attributes:
        entry: the measured number.
        value: the number by the compliance of the machine at its pose, SI.
        slopes: derivatives of this number by the entries of that compliance [6 x 6], theory (71).
    """

    entry: MeasuredEntry
    value: float
    slopes: Array

    def changes(self, changes: Array) -> Array:
        """Changes of the number by those of the compliance [6 x 6 x p], to first order [p]."""
        involved = self.slopes != 0.0  # the others may be infinite
        return np.asarray(self.slopes[involved] @ changes[involved])


def _computed_entry(
    entry: MeasuredEntry, compliance: Array, load: Array, components: Sequence[int], length: float
) -> _ComputedEntry:
    """Compute a measured number.

    Args:
        entry: the measured number.
        compliance: compliance of the machine at its pose, SI [6 x 6].
        load: wrench under which a deflection was measured, SI [6].
        components: components of twists that the machine has; K is the inverse of C over these.
        length: characteristic length of the machine, m.

    Raises:
        InputError: a stiffness was measured where the model is rigid.
    """
    kind, i, j = entry.place
    slopes = np.zeros((6, 6))
    match kind:
        case MeasuredKind.DEFLECTION:
            value, slopes[i] = compliance[i] @ load, load
        case MeasuredKind.COMPLIANCE:
            value, slopes[i, j] = compliance[i, j], 1.0
        case MeasuredKind.FREE_STIFFNESS:
            if not compliance[i, i] > 0.0:
                raise InputError(
                    f"{entry.name} is measured in line {entry.line}, but the model is rigid along {COMPONENTS[i]}; "
                    "give its springs stiffnesses, or leave the line out."
                )
            value, slopes[i, i] = 1.0 / compliance[i, i], -1.0 / compliance[i, i] ** 2
        case MeasuredKind.STIFFNESS:
            stiffness = _stiffness(entry, compliance, components, length)
            value, slopes = stiffness[i, j], -np.outer(stiffness[i], stiffness[:, j])
    return _ComputedEntry(entry, float(value), slopes)


def _stiffness(entry: MeasuredEntry, compliance: Array, components: Sequence[int], length: float) -> Array:
    """K, the inverse of C over the components of the machine [6 x 6], SI; arguments as of `_computed_entry`."""
    places = np.ix_(list(components), list(components))
    units = np.array([length if c < 3 else 1.0 for c in components])
    scaled = compliance[places] * np.outer(units, units)
    if np.linalg.svd(scaled)[1][-1] <= RIGID_SHARE * np.abs(scaled).max():
        raise InputError(
            f"{entry.name} is measured in line {entry.line}, but the model is rigid in some direction, so that "
            "K has no end; give its springs stiffnesses, or compare entries of C (compliance_z)."
        )
    stiffness = np.zeros((6, 6))
    stiffness[places] = np.linalg.inv(scaled) * np.outer(units, units)
    return stiffness
