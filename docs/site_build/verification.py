"""Tables of the verification manual: every number beside the same by another way, computed as the site is built."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.parameters import values, with_values
from kinetostat.studies.analysis import analyze
from kinetostat.studies.reproduction import Reproduction, reproduce
from kinetostat.tolerances import AGREED
from kinetostat.validation.comparison import KNOWN, block_differences, frequency_difference, frequency_pairs, validate
from site_build.markdown import difference, table
from site_build.second_route import compliance

SAME = 1e-9
"""Relative difference of two routes beyond which the build stops; what is seen is some rounding units."""
BLOCKS = ("rotation", "coupling", "translation")
HEAVY = (
    "tool.mass=5 kg",
    "tool.centre_of_mass=[0.01, 0.02, 0.03]",
    "tool.inertia=[0.05, 0.06, 0.07, 0.004, -0.003, 0.002]",
)
"""A platform with mass and inertia, for machines that are bundled without masses."""
PUBLISHED = {
    "rx": ("5.2e-6", 0, 0),
    "rz": ("1.7e-6", 2, 2),
    "x": ("4.7e-8", 3, 3),
    "z": ("2.1e-8", 5, 5),
    "x, ry": ("3.2e-7", 3, 1),
}
"""Entries of C of the general hexapod as tdehaeze/stewart-simscape prints them, and where they stand."""


@cache
def paper() -> Reproduction:
    """The paper, computed once."""
    return reproduce()


def printed_beside_computed(_folder: Path) -> str:
    """Every number of the paper, with its verdict.

    Raises:
        ValueError: a number differs from print, and no misprint explains it.
    """
    if not paper().explained:
        raise ValueError("numbers of the paper differ; see `kinetostat reproduce`")
    rows = (
        (one.place, one.component, one.printed, f"{one.computed:.7g}", one.unit, one.reason or one.verdict.value)
        for one in paper().comparisons
    )
    return table(("where", "what", "printed", "computed", "unit", "verdict"), rows)


def equations(_folder: Path) -> str:
    """The paper's equations as statements whose residual vanishes."""
    rows = (
        (one.equation, one.statement, difference(one.residual, one.tolerance), f"{one.tolerance:.0e}")
        for one in paper().checks
    )
    return table(("equation", "statement", "residual", "allowed"), rows, 2)


def statements(_folder: Path) -> str:
    """What the paper says in words, measured."""
    found = paper().all_claims
    rows = ((one.place, one.statement, one.measured, f"**{one.finding.value}** {one.limits}") for one in found)
    return table(("where", "statement", "measured", "verdict"), rows)


def closed_forms(_folder: Path) -> str:
    """Machines whose K or C can be written down, beside what is computed."""
    return table(("machine", "entry", "closed form", "its value", "computed", "difference"), _closed(), 3)


def _closed() -> Iterator[tuple[str, ...]]:
    height, k = 0.1, 20e6
    found = analyze(load("hexapod-cubic")).stiffness_diagonal
    forms = {
        "1.5 k Hc²": (1.5 * k * height**2, (0, 1)),
        "6 k Hc²": (6 * k * height**2, (2,)),
        "2 k": (2 * k, (3, 4, 5)),
    }
    for form, (value, entries) in forms.items():
        for i in entries:
            yield _closed_row("hexapod-cubic", f"K {GROUPS['stiffness'][i][10:]}", form, value, found[i])
    slides = load("orthoglide", ["pose.x=0", "pose.y=0", "pose.z=0"])
    rigid = with_values(slides, {path: np.inf for path in values(slides) if _yields(path)})
    given, found = values(slides)["stiffness.actuator.0"], analyze(rigid).compliance_diagonal
    for i, name in enumerate("xyz", 3):
        yield _closed_row("orthoglide, rigid links", f"C {name}", "1/k", 1 / given, found[i])


def _yields(path: str) -> bool:
    return path.startswith("stiffness.") and "actuator" not in path


def _closed_row(machine: str, entry: str, form: str, expected: float, found: float) -> tuple[str, ...]:
    return machine, entry, form, f"{expected:.9g}", f"{found:.9g}", difference(abs(found / expected - 1), SAME)


def published_elsewhere(_folder: Path) -> str:
    """The general hexapod beside what its authors print."""
    found = analyze(load("hexapod")).C
    rows = ((name, text, _as_printed(abs(found[i][j]), text)) for name, (text, i, j) in PUBLISHED.items())
    return table(("entry of C", "printed", "computed"), rows, 2)


def _as_printed(value: float, text: str) -> str:
    """A value to more digits than are printed.

    Raises:
        ValueError: it does not round to what is printed.
    """
    if float(f"{value:.1e}") != float(text):
        raise ValueError(f"{value:.6g} is printed as {text}")
    return f"{value:.6g}"


def second_routes(_folder: Path) -> str:
    """Every bundled machine by four ways that share no code after its joints are placed."""
    head = ("machine", "dense matrices", "machine code", "shares add up", "K C = 1")
    return table(head, (_routes(name) for name in bundled()), 4)


def _routes(name: str) -> tuple[str, ...]:
    machine = load(name)
    response, length = respond(machine), float(respond(machine).configuration.length)
    ours = np.array(response.compliance.rows(), dtype=float)
    dense = max(block_differences(compliance(response), ours, length).values())
    exist = list(machine.family.components)
    return f"`{name}`", difference(dense, SAME), _compiled(name, ours), _added(name), _product(response, exist, length)


def _compiled(name: str, ours: np.ndarray) -> str:
    machine = load(name)
    path = next(path for path in values(machine) if path.startswith("pose."))
    names = [GROUPS["compliance"][i] for i in machine.family.components]
    found = evaluate(machine, PointTable({path: np.array([values(machine)[path]])}), names).values
    pairs = [(found[name][0], ours[i, i]) for name, i in zip(names, machine.family.components, strict=True)]
    return difference(max(abs(a / b - 1.0) for a, b in pairs if b), SAME)


def _added(name: str) -> str:
    shares = np.nan_to_num([part.compliance_share for part in analyze(load(name)).attribution])
    sums = shares.sum(axis=0)
    return difference(float(abs(sums[sums > 0] - 1.0).max()), SAME)


def _product(response: Response, exist: list[int], length: float) -> str:
    scale = np.diag(np.repeat([length, 1.0], 3)[exist])
    stiffness, compliance = (
        np.array(matrix.rows(), dtype=float)[np.ix_(exist, exist)]
        for matrix in (response.stiffness, response.compliance)
    )
    scaled = (np.linalg.inv(scale) @ stiffness @ np.linalg.inv(scale), scale @ compliance @ scale)
    error = np.linalg.norm(scaled[0] @ scaled[1] - np.eye(len(exist)))
    return difference(float(error / (np.linalg.norm(scaled[0]) * np.linalg.norm(scaled[1]))), SAME)


def engine(_folder: Path) -> str:
    """Every bundled machine in the multibody engine, at its bundled pose."""
    chosen = KNOWN[0]
    rows = []
    for name in bundled():
        answer = validate(load(name), chosen.name)
        pairs = frequency_pairs(load(name, HEAVY), chosen)
        apart = max(frequency_difference(*pair) for pair in pairs)
        cells = *(difference(answer.differences[block], AGREED) for block in BLOCKS), difference(apart, AGREED)
        rows.append((f"`{name}`", *cells))
    return table((f"machine ({chosen.name} {chosen.version})", *BLOCKS, "frequencies"), rows, len(BLOCKS) + 1)
