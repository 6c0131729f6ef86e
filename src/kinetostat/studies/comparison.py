"""Designs side by side: where their files differ, how stiff each is, and what each gains against the first.

Any machines can be compared, of one family or not; what only some of them have is missing for the others. What is
printed or drawn is in `views`.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.batch import Progress, silent
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import element_share, elements, without_rounding
from kinetostat.kinetostatics.extremes import ROTATIONS, TRANSLATIONS
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, find, parameters, values
from kinetostat.spec.arguments import as_list, checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import parse_range
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.studies.analysis import Analysis, analyze
from kinetostat.studies.design_numbers import DesignRow, rows_at_poses, rows_over
from kinetostat.studies.evaluation import PoseCount
from kinetostat.studies.requirements import Verdict, requirements

if TYPE_CHECKING:
    import pandas as pd

MOST_DESIGNS = 12
"""Designs that are compared: each is a column of a table, and twice as many fit on no page."""
OVERRIDE_SEPARATOR = ";"
"""Sign between overrides of one design."""
_OVERRIDDEN = re.compile(r"(.+?):(\s*[A-Za-z_][\w.-]*\s*=.*)", re.DOTALL)
"""A design with overrides: the machine, a colon, and what begins with a field and a sign of equality."""


@dataclass(frozen=True)
class Design:
    """A machine under the name by which it was given.

    Attributes:
        label: the name, as written.
        machine: the machine with its pose.
        analysis: the analysis of the machine.
    """

    label: str
    machine: Machine
    analysis: Analysis

    @property
    def answered(self) -> bool:
        """Whether its pose has an answer."""
        return self.analysis.status is Status.OK


@dataclass(frozen=True)
class Difference:
    """A field of which not all designs that have it say the same.

    Attributes:
        path: path of the field.
        parameters: the field in each design, not always of the same kind; None where a design has no such field.
        values: its values in each design, SI, entry by entry; empty where a design has no such field.
    """

    path: str
    parameters: tuple[Parameter | None, ...]
    values: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class SoftDirection:
    """The softest rotation or translation of a design, and what makes it soft.

    Attributes:
        direction: name of the component.
        shares: names of elements and their shares in its compliance, the greatest first.
    """

    direction: str
    shares: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False)
class Comparison(ImmutableAnswer):
    """Designs side by side.

    Attributes:
        designs: the designs in order; the others are compared with the first.
        differences: fields that at least two designs have and that do not agree.
        rows: numbers at the pose of each design.
        softest: the softest rotation and translation of each design; fewer where it has none.
        verdicts: verdicts on the requirements of all files, each judged for every design; None where a design lacks the
            quantity.
        ranges: ranges of the grid, as written.
        where: these poses in words, "over x=-1 cm:1 cm:5"; empty without any.
        poses: for each design, the number of poses with an answer, and that of all; empty without any.
        over: numbers over those poses.
    """

    designs: tuple[Design, ...]
    differences: tuple[Difference, ...]
    rows: tuple[DesignRow, ...]
    softest: tuple[tuple[SoftDirection, ...], ...]
    verdicts: tuple[tuple[Verdict | None, ...], ...] = ()
    ranges: tuple[str, ...] = ()
    where: str = ""
    poses: tuple[PoseCount, ...] = ()
    over: tuple[DesignRow, ...] = ()

    def to_pandas(self) -> "pd.DataFrame":
        """Return a table of pandas: a row for each number, with its unit, and a column for each design, SI."""
        import pandas as pd  # takes long to load

        rows = [[row.group, row.name, row.unit, *row.values] for row in (*self.rows, *self.over)]
        names = [design.label for design in self.designs]
        return pd.DataFrame(rows, columns=["group", "number", "unit", *names]).set_index(["group", "number"])

    @property
    def machine(self) -> Machine:
        """The first design, with which the others are compared, and in whose units all are shown."""
        return self.designs[0].machine

    def __repr__(self) -> str:
        return f"<Comparison of {', '.join(design.label for design in self.designs)}>"


def read_design(text: str, settings: Sequence[str] = ()) -> Design:
    """Read a design from text: a file or bundled name, and after a colon overrides of its fields.

    Args:
        text: "NAME" or "NAME:path=value;path=value".
        settings: overrides for all designs, applied first.

    Raises:
        InputError: no such machine, or a mistake in it.
    """
    match = None if text in bundled() else _OVERRIDDEN.fullmatch(text)
    if match is None:
        machine = load(text, settings)
    else:
        overrides = [setting.strip() for setting in match[2].split(OVERRIDE_SEPARATOR) if setting.strip()]
        machine = load(match[1], [*settings, *overrides])
    return Design(text, machine, analyze(machine))


@checked
def compare(
    designs: Sequence[Design | Machine | str] | Mapping[str, Machine | str],
    ranges: Sequence[str] = (),
    progress: Progress = silent,
    quantities: Sequence[str] = (),
    poses: Any = None,
) -> Comparison:
    """Compare designs, each at its own pose and, where ranges or poses are given, all over the same of them.

    Requirements of any of the files are judged for all designs.

    Args:
        designs: two or more; machines, by names of your choice if you like, or texts, "NAME" or
            "NAME:path=value;path=value".
        ranges: "FIELD=from:to:count", of fields that all of them have.
        progress: receives how far the work is.
        quantities: further numbers, by the names of quantities or groups; "built_error" is the error as built that 95 %
            of the machines within the tolerances keep. Over poses they take the place of compliances and margin.
        poses: instead of ranges, poses as `evaluate` takes them, such as the path of a CSV file.

    Raises:
        InputError: fewer than two designs or too many, ranges or poses that one of them does not take, both of them, or
            a quantity that none of them has.
    """
    designs, ranges = [designs] if isinstance(designs, str) else designs, as_list(ranges)
    if not 2 <= len(designs) <= MOST_DESIGNS:
        raise InputError(
            f"compare takes 2 to {MOST_DESIGNS} designs, not {len(designs)}; give files, names or NAME:path=value."
        )
    if ranges and poses is not None:  # first, since analyses of designs take much longer
        raise InputError("the poses come from a list or from ranges, not from both; leave one of them out.")
    analysed = tuple(_analysed_designs(designs))
    for design in analysed:
        _refuse_absent(design, ranges)
    analyses, names, where = [design.analysis for design in analysed], as_list(quantities), ""
    if ranges:
        where = f"over {', '.join(ranges)}"
    elif poses is not None:
        where = f"at the poses of {poses if isinstance(poses, str | Path) else 'the list'}"
    over, counts = rows_over(analyses, ranges, poses, names, progress) if where else ((), ())
    return Comparison(
        designs=analysed,
        differences=_differences(analysed),
        rows=rows_at_poses(analyses, names),
        softest=tuple(_softest(design) for design in analysed),
        verdicts=_verdicts(analysed),
        ranges=tuple(ranges),
        where=where,
        poses=counts,
        over=over,
    )


def _verdicts(designs: Sequence[Design]) -> tuple[tuple[Verdict | None, ...], ...]:
    """Judge the requirements of all files for every design: a row for each condition, a column for each design.

    Of requirements with one name, that of the first design counts. A design has no verdict on a quantity that its
    machine lacks, unless its own file requires it: then the message about it is raised.
    """
    requirements_by_name: dict[str, Any] = {}
    for design in designs:
        requirements_by_name = {**design.machine.requirements, **requirements_by_name}
    columns = []
    for design in designs:
        column: dict[tuple[str, str], Verdict] = {}
        for name, requirement in requirements_by_name.items():
            try:
                verdicts = requirements(replace(design.machine, requirements={name: requirement}))
            except InputError:
                if name in design.machine.requirements:
                    raise
                continue
            column |= {(name, verdict.condition): verdict for verdict in verdicts}
        columns.append(column)
    conditions = dict.fromkeys(condition for column in columns for condition in column)
    return tuple(tuple(column.get(condition) for column in columns) for condition in conditions)


def _refuse_absent(design: Design, ranges: Sequence[str]) -> None:
    """Refuse ranges of fields that a design lacks, by its name."""
    for text in ranges:
        try:
            find(design.machine.family, parse_range(text).field)
        except InputError as error:
            raise InputError(f"{design.label}: {error}") from None


def _analysed_designs(designs: Sequence[Design | Machine | str] | Mapping[str, Machine | str]) -> Iterator[Design]:
    """The designs, analysed, under the names that they are given or read by; machines without a name are numbered."""
    if isinstance(designs, Mapping):
        for name, design in designs.items():
            yield replace(_analysed_design(design, name), label=name)
    else:
        for number, each in enumerate(designs, 1):
            yield _analysed_design(each, f"design {number}")


def _analysed_design(design: Design | Machine | str, name: str) -> Design:
    """A machine under a name; a design itself; or one that is read from a text, which is its label."""
    if isinstance(design, Machine):
        return Design(name, design, analyze(design))
    return read_design(design) if isinstance(design, str) else design


def _differences(designs: Sequence[Design]) -> tuple[Difference, ...]:
    """Fields that two designs have at least, whole ones where they have entries, and of which not all say the same."""
    numbers_by_design = [values(design.machine) for design in designs]
    fields_by_design = [_whole_fields(design.machine) for design in designs]
    differences = []
    for path in dict.fromkeys(path for fields in fields_by_design for path in fields):
        parameters_at_path = tuple(fields.get(path) for fields in fields_by_design)
        rows = tuple(
            tuple(numbers[leaf] for leaf in parameter.leaves) if parameter else ()
            for numbers, parameter in zip(numbers_by_design, parameters_at_path, strict=True)
        )
        pairs = zip(parameters_at_path, rows, strict=True)
        if len({(parameter.quantity.kind, row) for parameter, row in pairs if parameter}) > 1:
            differences.append(Difference(path, parameters_at_path, rows))
    return tuple(differences)


def _whole_fields(machine: Machine) -> dict[str, Parameter]:
    """The fields of a machine by path, those with entries as one."""
    all_parameters = list(parameters(machine.family))
    entries = {leaf for parameter in all_parameters if parameter.quantity.count for leaf in parameter.leaves}
    return {parameter.path: parameter for parameter in all_parameters if parameter.path not in entries}


def _softest(design: Design) -> tuple[SoftDirection, ...]:
    """The softest rotation and translation of a design, with the shares of its elements."""
    if not design.answered:
        return ()
    response, components = respond(design.machine), design.machine.family.components
    diagonal = without_rounding(response.compliance.diagonal(), response)[:, 0]
    softest = []
    for block in (ROTATIONS, TRANSLATIONS):
        compliant = [i for i in components if i in block and 0.0 < diagonal[i] < math.inf]
        if compliant:
            i = max(compliant, key=lambda i: diagonal[i])
            shares = [
                (element.name, float(element_share(response, element)[i] / diagonal[i]))
                for element in elements(response.configuration)
                if element.stiffness != math.inf
            ]
            greatest_first = tuple(sorted(shares, key=lambda name_and_share: -name_and_share[1]))
            softest.append(SoftDirection(COMPONENTS[i], greatest_first))
    return tuple(softest)
