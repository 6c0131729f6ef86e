"""The machine as C99 source: functions from a pose to K and C, actuators and quantities, and back.

Every formula is the traced graph of the machine, printed (`engine.printed`). Around the formulas stand short loops
(`c/source.c`): Newton's method for forward kinematics, for states of rest and for the command, with a bounded number of
steps and without allocation. Beside the source come a header, a test with reference numbers that Python has computed
pose by pose, and a make file. Nothing but libm is needed.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from string import Template
from textwrap import fill

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import evaluate
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.form import (
    Form,
    Specimen,
    TracedFormula,
    form_with_numbers,
    objectives_of,
    placement_of,
    step_of,
)
from kinetostat.engine.gradient import with_gradients
from kinetostat.engine.kernel import closes_inside
from kinetostat.engine.loaded import MOST_NEWTON_STEPS, ONE_STEP_AWAY
from kinetostat.engine.points import PointTable
from kinetostat.engine.printed import C, literal, print_graph
from kinetostat.engine.trace import Body
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.equilibrium.cut import cut_machine
from kinetostat.exchange.formats import ascii_line
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import stand
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.actuators import Actuator
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, parameters, values, with_values
from kinetostat.spec.errors import InputError, choice
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.commanding import actuator_targets
from kinetostat.studies.storage import write_text
from kinetostat.tolerances import CLOSED, COMMANDED
from kinetostat.units import KINDS

FILE_NAME = re.compile(r"[\w.-]+$", re.ASCII)
TEMPLATES = Path(__file__).with_name("c")
LOADS = frozenset(("force", "moment", "gravity", "preload", "temperature_rise"))
"""Words of leaf paths that load a machine."""
ENTRIES = [name for name in QUANTITIES if name.partition("_")[0] in ("compliance", "stiffness")]
"""Quantities that are the entries of C and then of K, on and above the diagonal."""
DISPLACEMENTS = [name for name in QUANTITIES if name.startswith("displacement_")]
STEPS_FORWARD, STEPS_OF_COMMAND = 30, 30
"""Steps of forward kinematics, and poses that are tried until the loaded tool is where it should be."""
SHORTEST_SHARE = 1e-4
"""Share of a step of forward kinematics below which no shorter one is tried."""
TEST_POSES, AROUND = 9, 0.02
"""Poses of the test: that of the file and others near it, so far away in rad or in units of the machine's length."""
AGREED = 1e-10
"""Share of the largest number of its kind by which C and Python may differ in the test."""


@dataclass(frozen=True)
class Library:
    """The functions of a machine.

    Attributes:
        machine: at its pose.
        stem: name of the files without suffix.
        prefix: with which all names in them begin.
        inputs: leaf paths of the arguments: coordinates of the pose, then parameters that were chosen.
        coordinates: number of the coordinates.
        quantities: names of the quantities.
        form: how programs take the machine's numbers: all but the inputs are part of the code.
        closed: whether programs close the legs themselves.
        placement: formula of actuators, tool point and orientation.
        actuators: with traced coordinates.
        rests: whether its states of rest have programs.
    """

    machine: Machine
    stem: str
    prefix: str
    inputs: tuple[str, ...]
    coordinates: int
    quantities: tuple[str, ...]
    form: Form
    closed: bool
    placement: TracedFormula
    actuators: tuple[Actuator, ...]
    rests: bool

    @cached_property
    def specimen(self) -> Specimen:
        """The machine as a kind."""
        return Specimen(self.machine)

    @property
    def square(self) -> bool:
        """Whether there are as many actuators as coordinates, so that the way back is a square system."""
        return len(self.actuators) == self.coordinates

    @cached_property
    def length(self) -> float:
        """The machine's length, m."""
        return float(self.machine.chains().length if self.closed else self.machine.configure().length)

    @cached_property
    def kinds(self) -> list[str]:
        """Kinds of the inputs: length, angle, ..."""
        by_path = {leaf: p.quantity for p in parameters(self.machine.family) for leaf in p.leaves}
        return [by_path[path].kind for path in self.inputs]

    @property
    def given(self) -> list[tuple[str, str]]:
        """Leaf path and kind of each input."""
        return list(zip(self.inputs, self.kinds, strict=True))

    @property
    def needs_state(self) -> bool:
        """Whether a quantity is about the machine at rest."""
        return any(QUANTITIES[name].loaded for name in self.quantities)


def write(
    analysis: Analysis, path: Path, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> list[Path]:
    """Write NAME.c, NAME.h, NAME_test.c and NAME.mk beside each other; NAME is that of the path.

    Args:
        analysis: the analysis of the machine at its pose.
        path: the path of NAME.c.
        inputs: leaf paths of parameters that become arguments after the coordinates of the pose, as "load.force.2".
        outputs: names of quantities to compute with their derivatives, as "compliance_x" or "frequency_1".

    Raises:
        InputError: legs of the machine have no closed form, or an input or output is unknown or has no program.
    """
    if not FILE_NAME.match(path.stem):
        raise InputError(
            f'The name of "{path.name}" becomes a name in C and in a make file: use letters of the English alphabet, '
            "digits, -, . and _ for it."
        )
    library = library_of(analysis.machine, path.stem, inputs or (), outputs or ())
    programs = list(_programs(library))
    texts = {
        path: _source(library, programs),
        path.with_suffix(".h"): _header(library, programs),
        path.with_name(f"{path.stem}_test.c"): _test(library),
        path.with_suffix(".mk"): Template((TEMPLATES / "makefile.mk").read_text("utf-8")).substitute(stem=path.stem),
    }
    for place, text in texts.items():
        write_text(place, text)
    return list(texts)


def library_of(machine: Machine, stem: str, inputs: Sequence[str], outputs: Sequence[str]) -> Library:
    """Choose what functions of a machine take and give, see `write`."""
    closed = machine.family.chains is not None
    if closed and not closes_inside(machine):
        raise InputError(
            f"{machine.name} cannot be written as a program: a leg of it has no closed form, so that its joints are "
            "found by iteration along a way; legs have one if three of their revolutes are parallel, or if a ball "
            "joint is at one end."
        )
    known = values(machine)
    pose = [name for name in known if name.startswith(POSE)]
    chosen = [choice(name, [leaf for leaf in known if leaf not in pose], "--inputs") for name in inputs]
    wanted = [choice(name, [q for q, row in QUANTITIES.items() if not row.cut], "--outputs") for name in outputs]
    paths = tuple(dict.fromkeys([*pose, *chosen]))
    acting = any(value or path in paths for path, value in known.items() if LOADS.intersection(path.split(".")))
    rests = acting and cut_machine(machine, paths) is not None
    needing = [name for name in wanted if QUANTITIES[name].loaded]
    if needing and not rests:
        raise InputError(
            f"{needing[0]} has no program for {machine.name}: nothing loads it, or legs that are no rods close its "
            "loops; leave it out of --outputs, or give the machine a load."
        )
    form = form_with_numbers(machine, paths)
    placement, actuators = placement_of(Specimen(machine), form, paths, closed)
    word = re.sub(r"\W", "_", stem).strip("_").lower() or "pkm"
    prefix = f"m{word}" if word[0].isdigit() else word
    return Library(
        machine, stem, prefix, paths, len(pose), tuple(dict.fromkeys(wanted)), form, closed, placement,
        tuple(actuators), rests,
    )  # fmt: skip


@dataclass(frozen=True)
class PrintedProgram:
    """A formula as a static C function.

    Attributes:
        name: of the function.
        text: its source.
        operations: that one call takes.
    """

    name: str
    text: str
    operations: int


def _programs(library: Library) -> Iterator[PrintedProgram]:
    """Print the formulas that the functions of a machine need."""
    kind, form, closed = library.specimen, library.form, library.closed
    entries = objectives_of(kind, form, [((name, 1.0),) for name in ENTRIES], closed=closed)
    yield _program(library, "entries_at", entries.body)
    placement, count = library.placement, len(library.actuators)
    body = placement.body
    driven = Body(body.fixed, body.columns, body.results[:count], body.code)
    yield _program(library, "actuators_at", driven)
    yield _program(library, "actuator_slopes_at", with_gradients(driven, placement.inputs))
    if library.rests:
        for name, first in (("first_steps_at", True), ("step_at", False)):
            yield _program(library, name, step_of(kind, form, closed, first).body)
        displacements = objectives_of(kind, form, [((name, 1.0),) for name in DISPLACEMENTS], closed=closed)
        yield _program(library, "displacement_at", displacements.body)
        places = Body(body.fixed, body.columns, body.results[count:], body.code)
        sloped = with_gradients(places, placement.inputs).results
        yield _program(library, "placement_at", Body(body.fixed, body.columns, [*driven.results, *sloped], body.code))
    if library.quantities:
        wanted = [((name, 1.0),) for name in library.quantities]
        yield _program(library, "quantities_at", objectives_of(kind, form, wanted, closed=closed).body)
        formula = objectives_of(kind, form, wanted, library.inputs, closed)
        inputs = formula.inputs[: len(library.inputs)]
        yield _program(library, "quantity_slopes_at", with_gradients(formula.body, inputs))


def _program(library: Library, name: str, body: Body) -> PrintedProgram:
    """Print a body as a function that returns its code; columns after the inputs are the coordinates of a state."""
    given = len(library.inputs)
    names = [f"in[{k}]" if k < given else f"state[{k - given}]" for k in range(len(body.columns))]
    printed = print_graph(body.columns, names, [*body.results, body.code], C)
    lines = [*printed.lines, *(f"out[{k}] = {value};" for k, value in enumerate(printed.results[:-1]))]
    lines.append(f"return (int)({printed.results[-1]});")
    state = "const double *state, " if len(body.columns) > given else ""
    unused = [f"(void){word};" for word in ("in", "state") if not any(f"{word}[" in line for line in lines)]
    unused = [line for line in unused if state or "state" not in line]
    text = "".join(f"    {line}\n" for line in [*unused, *lines])
    head = f"/* {printed.operations} operations. */\nstatic int {name}(const double *in, {state}double *out)\n"
    return PrintedProgram(name, f"{head}{{\n{text}}}\n", printed.operations)


def _text(library: Library, template: str, words: Mapping[str, object]) -> str:
    """A file from its template: the sections that a machine needs, with words filled in, named after the machine."""
    needed = {
        "always": True,
        "solve": library.square or library.rests,
        "forward": library.square,
        "rest": library.rests,
        "quantities": bool(library.quantities),
        "scale": library.rests or bool(library.quantities),
    }
    _, *pieces = re.split(r"/\* section: (\w+) \*/\n", (TEMPLATES / template).read_text("utf-8"))
    text = "".join(part for name, part in zip(pieces[::2], pieces[1::2], strict=True) if needed[name])
    filled = Template(text).substitute(words)
    return filled.replace("machine_", f"{library.prefix}_").replace("MACHINE_", f"{library.prefix.upper()}_")


def _note(library: Library, made: str) -> str:
    name = ascii_line(library.machine.name).replace("*/", "* /")
    return f"/* {name}. {made} kinetostat {version('kinetostat')}; do not edit. */"


def _source(library: Library, programs: Sequence[PrintedProgram]) -> str:
    """NAME.c: constants, printed formulas, and the loops around them."""
    turning = ", ".join(str(int(kind == "angle")) for kind in library.kinds)
    sliding = ", ".join(str(int(actuator.slides)) for actuator in library.actuators)
    constants = [f"static const int IS_ANGLE[MACHINE_INPUTS] = {{{turning}}};"]
    numbers: dict[str, float] = {"LARGEST_ANGLE": LARGEST_ANGLE}
    if library.square or library.rests:
        numbers["LENGTH"] = library.length
    if library.square:
        constants.append(f"static const int IS_SLIDE[MACHINE_ACTUATORS] = {{{sliding}}};")
        numbers |= {"CLOSED": CLOSED, "SHORTEST_SHARE": SHORTEST_SHARE, "STEPS_FORWARD": STEPS_FORWARD}
    if library.rests:
        size = len(step_of(library.specimen, library.form, library.closed).body.results) - 1
        numbers |= {"STATES": size, "STEPS_AT_REST": MOST_NEWTON_STEPS, "ONE_STEP_AWAY": ONE_STEP_AWAY}
        numbers |= {"COMMANDED": COMMANDED, "STEPS_OF_COMMAND": STEPS_OF_COMMAND}
    constants += [f"#define {name} {number!r}" for name, number in numbers.items()]
    words = {
        "note": _note(library, "Made by"),
        "stem": library.stem,
        "constants": "\n".join(constants) + "\n",
        "programs": "\n".join(program.text for program in programs),
        "rest_first": "double state[STATES];\n    rest_of(at, state);" if library.needs_state else "",
        "state": "state, " if library.needs_state else "",
    }
    return _text(library, "source.c", words).replace("\n    \n", "\n")


def _header(library: Library, programs: Sequence[PrintedProgram]) -> str:
    """NAME.h: what the functions take and give, with units, and the work that they do at most."""
    work = {program.name: program.operations for program in programs}
    trials = 1 + math.ceil(math.log(SHORTEST_SHARE) / math.log(0.25))
    work["forward"] = STEPS_FORWARD * (work["actuator_slopes_at"] + trials * work["actuators_at"])
    if library.rests:
        work["rest"] = work["first_steps_at"] + MOST_NEWTON_STEPS * work["step_at"] + work["displacement_at"]
        work["command"] = STEPS_OF_COMMAND * (work["rest"] + work["placement_at"])
    given = [f"in[{k}]: {path}, {KINDS[kind].unit}" for k, (path, kind) in enumerate(library.given)]
    driven = [f"[{k}]: {ascii_line(a.name)}, {a.unit}: {a.meaning}" for k, a in enumerate(library.actuators)]
    listed = [f"[{k}]: {name}, {QUANTITIES[name].unit}" for k, name in enumerate(library.quantities)]
    sizes = (len(library.inputs), library.coordinates, len(library.actuators), len(library.quantities))
    names = ("INPUTS", "COORDINATES", "ACTUATORS", "QUANTITIES")
    words: dict[str, object] = {
        "note": _note(library, "Made by"),
        "sizes": ", ".join(f"MACHINE_{name} = {size}" for name, size in zip(names, sizes, strict=True)),
        "statuses": ",\n    ".join(f"MACHINE_{status.name} = {int(status)}" for status in Status),
        "sentences": "\n".join(_wrapped(f"{status.name}: {status.sentence}") for status in Status),
        "given": _listing(given),
        "driven": _listing(driven),
        "listed": _listing(listed),
    }
    return _text(library, "header.h", words | work)


def _listing(rows: Sequence[str]) -> str:
    return "".join(f"   {ascii_units(row)}\n" for row in rows)


def _wrapped(text: str) -> str:
    return fill(text, 117, initial_indent="   ", subsequent_indent="     ")


def ascii_units(text: str) -> str:
    """Write units in ASCII: N*m for N·m, kg/m^3."""
    return text.translate(
        {ord("·"): "*", ord("²"): "^2", ord("³"): "^3", ord("⁴"): "^4", ord("°"): "deg", ord("µ"): "u"}
    )


def _test(library: Library) -> str:
    """NAME_test.c: poses, and what Python computes there one by one, without the printed formulas."""
    columns = _test_points(library)
    count = len(next(iter(columns.values())))
    rows = np.array(list(columns.values())).T
    machines = [with_values(library.machine, dict(zip(library.inputs, row.tolist(), strict=True))) for row in rows]
    responses = [respond(machine) for machine in machines]
    matrices = [[*np.ravel(r.stiffness.rows()), *np.ravel(r.compliance.rows())] for r in responses]
    blocks = {"MATRICES": np.array(matrices, dtype=float)}
    blocks["COORDINATES"] = np.array([[a.coordinate for a in stand(machine)] for machine in machines], dtype=float)
    if library.rests:
        blocks["DISPLACEMENT"] = _evaluated(library, columns, DISPLACEMENTS)
        blocks["COMMAND"] = _commanded(library, columns, count)
    if library.quantities:
        blocks["QUANTITIES"] = _evaluated(library, columns, library.quantities)
        points = PointTable(columns)
        sloped = evaluate_gradient(library.machine, points, library.quantities, library.inputs).gradients
        blocks["SLOPES"] = np.moveaxis(sloped, 2, 0).reshape(count, -1)
    arrays = [_array("POSES", rows), *(_array(f"REFERENCE_{name}", block) for name, block in blocks.items())]
    words = {
        "note": _note(library, "Test of the functions, made by"),
        "stem": library.stem,
        "arrays": "\n".join(arrays),
        "agreed": AGREED,
        "rows": count,
    }
    return _text(library, "test.c", words)


def _evaluated(library: Library, columns: dict[str, Array], names: Sequence[str]) -> Array:
    found = evaluate(library.machine, PointTable(columns), names).values
    return np.stack([found[name] for name in names], axis=1)


def _commanded(library: Library, columns: dict[str, Array], count: int) -> Array:
    """Coordinates of the actuators of the loaded machine [n x actuators]; NaN where it comes to no rest."""
    try:
        return actuator_targets(library.machine, columns, count).coordinates
    except InputError:
        return np.full((count, len(library.actuators)), np.nan)


def _test_points(library: Library) -> dict[str, Array]:
    """The pose of the file and some near it, those at which the machine has an answer: values by leaf path."""
    known = values(library.machine)
    drawn = np.random.default_rng(0).uniform(-AROUND, AROUND, (TEST_POSES, len(library.inputs)))
    drawn[0], drawn[:, library.coordinates :] = 0.0, 0.0
    units = np.where(np.array(library.kinds) == "length", library.length, 1.0)
    rows = np.array([float(known[path]) for path in library.inputs]) + drawn * units
    columns = dict(zip(library.inputs, rows.T, strict=True))
    wanted = ["singularity_margin", *(name for name in library.quantities if not QUANTITIES[name].loaded)]
    answered = evaluate(library.machine, PointTable(columns), wanted).status == Status.OK
    return {path: column[answered] for path, column in columns.items()}


def _array(name: str, rows: Array) -> str:
    """A table of numbers as a constant of C."""
    lines = ",\n".join(f"    {{{', '.join(literal(float(number), C) for number in row)}}}" for row in rows)
    return f"static const double {name}[{rows.shape[0]}][{rows.shape[1]}] = {{\n{lines}\n}};"
