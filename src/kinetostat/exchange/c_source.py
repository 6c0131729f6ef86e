"""The machine as C99 source: functions from a pose to K and C, actuators and quantities, and back.

Every formula is the traced graph of the machine, printed (`engine.printed`). Around the formulas stand short loops
(`c/source.c`): Newton's method for forward kinematics, for states of rest and for the command, with a bounded number of
steps and without allocation. Beside the source come a header, a test with reference numbers that Python has computed
pose by pose, and a make file. Nothing but libm is needed.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from string import Template
from textwrap import fill

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.form import TraceOptions, each_alone, objectives_of, plan_for
from kinetostat.engine.gradient import with_gradients
from kinetostat.engine.machine_functions import (
    DISPLACEMENTS,
    SHORTEST_SHARE,
    STEPS_FORWARD,
    MachineFunctions,
    functions_of,
    quantities_at,
    sample_points,
)
from kinetostat.engine.modes import spring_parts_of
from kinetostat.engine.points import PointTable
from kinetostat.engine.printed import literal, print_graph
from kinetostat.engine.rest import MOST_NEWTON_STEPS, step_of
from kinetostat.engine.trace import Body, Operand
from kinetostat.engine.trigonometry import LARGEST_ANGLE
from kinetostat.equilibrium.state import state_of
from kinetostat.exchange.formats import ascii_line
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import stand
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import ENTRIES, QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.parameters import with_values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.commanding import actuator_targets
from kinetostat.studies.storage import write_text
from kinetostat.tolerances import CLOSED, COMMANDED, ONE_STEP_AWAY
from kinetostat.units import KINDS
from kinetostat.vibration.springwise import ModeCounts, SpringSizes

FILE_NAME = re.compile(r"[\w.-]+$", re.ASCII)
"""Names of files that can become names in C and stand in a make file."""
TEMPLATES = Path(__file__).with_name("c")
PLACE = 12
"""Numbers that place the tool: three of T and nine of the columns of Q."""
STEPS_OF_COMMAND = 30
"""Poses that are tried until the loaded tool is where it should be; a handful are enough where it comes there at
all."""
NEARLY_COMMANDED = 1e-6
"""Correction, rad or in units of the machine's length, below which the rates of the loaded tool are computed, as
differences, if it only comes near its pose."""
ASIDE = 1e-4
"""Displacement of the coordinates for these differences, rad or in units of the machine's length: its square is the
error of central differences."""
COMMENT_WIDTH = 117
"""Characters in a line of a comment, as in our own files."""
SHORTENING = 0.25
"""Factor by which `machine_forward` shortens a step that does not come nearer: a half would try twice as often."""
SWEEPS = 30
"""Sweeps of Jacobi's rotations at most: they converge quadratically, and ten are enough for hundreds of springs."""
AGREED = 1e-10
"""Share of the largest number of its kind by which C and Python may differ in the test: orders of operations differ,
not formulas."""


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
    functions = functions_of(analysis.machine, inputs or (), outputs or ())
    texts = {
        **library_texts(functions, path),
        path.with_name(f"{path.stem}_test.c"): with_names(_test(functions), path.stem),
        path.with_suffix(".mk"): with_names((TEMPLATES / "makefile.mk").read_text("utf-8"), path.stem),
    }
    for place, text in texts.items():
        write_text(place, text)
    return list(texts)


def library_texts(functions: MachineFunctions, path: Path) -> dict[Path, str]:
    """Return the source and the header of the functions, by their paths, of which one is given.

    Raises:
        InputError: the name of the file cannot be a name in C.
    """
    if not FILE_NAME.match(path.stem):
        raise InputError(
            f'The name of "{path.name}" becomes a name in C and in a make file: use letters of the English alphabet, '
            "digits, -, . and _ for it."
        )
    programs = list(_programs(functions))
    texts = {".c": _source(functions, programs), ".h": _header(functions, programs)}
    return {path.with_suffix(suffix): with_names(text, path.stem) for suffix, text in texts.items()}


def prefix_of(stem: str) -> str:
    """Return the beginning of all names in the source code of a file."""
    word = re.sub(r"\W", "_", stem).strip("_").lower() or "pkm"
    return f"m{word}" if word[0].isdigit() else word


def with_names(text: str, stem: str) -> str:
    """Name files, functions and constants of a text, which are templates, after the stem of the files."""
    prefix = prefix_of(stem)
    text = text.replace("machine_", f"{prefix}_").replace("MACHINE_", f"{prefix.upper()}_")
    return text.replace("@stem@", stem)


@dataclass(frozen=True)
class PrintedProgram:
    """A formula as a static C function.

    Attributes:
        name: the name of the function.
        text: its source.
        operations: the number of operations that one call takes.
    """

    name: str
    text: str
    operations: int


def _programs(functions: MachineFunctions) -> Iterator[PrintedProgram]:
    """Print the formulas that the functions of a machine need."""
    bodies = _bodies_of_poses(functions)
    if functions.rests:
        bodies |= _bodies_at_rest(functions)
    if functions.quantities:
        bodies |= _bodies_of_quantities(functions)
    for name, body in bodies.items():
        yield _program(functions, name, body)


def _bodies_of_poses(functions: MachineFunctions) -> dict[str, Body]:
    """Return the bodies of programs of K, C and the actuators at a pose."""
    placement = functions.placement.formula
    actuators = _part_of(placement.body, placement.body.results[: len(functions.actuators)])
    # Limits of loads need a state of rest, which only functions of what is under load are given.
    options = TraceOptions(closed=functions.closed, limited=False)
    return {
        "entries_at": objectives_of(functions.specimen, functions.form, each_alone(ENTRIES), options).body,
        "actuators_at": actuators,
        "actuator_slopes_at": with_gradients(actuators, placement.inputs),
    }


def _bodies_at_rest(functions: MachineFunctions) -> dict[str, Body]:
    """Return the bodies of programs of Newton's steps to rest, of the displacement there, and of the tool's rates."""
    kind, form, closed = functions.specimen, functions.form, functions.closed
    placement, count = functions.placement.formula, len(functions.actuators)
    actuators, tool = placement.body.results[:count], placement.body.results[count : count + PLACE]
    tool_with_gradients = with_gradients(_part_of(placement.body, tool), placement.inputs).results
    return {
        "first_steps_at": step_of(kind, form, closed, "first").body,
        "step_at": step_of(kind, form, closed).body,
        "displacement_at": objectives_of(kind, form, each_alone(DISPLACEMENTS), TraceOptions(closed=closed)).body,
        "placement_at": _part_of(placement.body, [*actuators, *tool_with_gradients]),
    }


def _bodies_of_quantities(functions: MachineFunctions) -> dict[str, Body]:
    """Return the bodies of programs of quantities with their derivatives, and of the springs of which modes are."""
    kind, form, closed, counts = functions.specimen, functions.form, functions.closed, functions.mode_counts
    bodies = {}
    if counts and counts.free:
        bodies["springs_at"] = spring_parts_of(kind, form, closed, at_rest=False).body
    if counts and counts.at_rest:
        bodies["springs_at_rest_at"] = spring_parts_of(kind, form, closed, at_rest=True).body
    plan = plan_for(functions.machine, functions.quantities, functions.inputs)
    options = TraceOptions(closed=closed, limited=functions.needs_state, plan=plan, mode_counts=counts)
    objectives = each_alone(functions.quantities)
    bodies["quantities_at"] = objectives_of(kind, form, objectives, options).body
    formula = objectives_of(kind, form, objectives, options, functions.inputs)
    bodies["quantity_slopes_at"] = with_gradients(formula.body, formula.inputs[: len(functions.inputs)])
    return bodies


def _part_of(body: Body, results: Sequence[Operand]) -> Body:
    """Return the body that gives only some results, or others that are made of them."""
    return Body(body.fixed, body.columns, results, body.code)


def _program(functions: MachineFunctions, name: str, body: Body) -> PrintedProgram:
    """Print a body as a function that returns its status; columns after the inputs are the coordinates of a state."""
    count = len(functions.inputs)
    names = [f"in[{k}]" if k < count else f"state[{k - count}]" for k in range(len(body.columns))]
    printed = print_graph(body.columns, names, body.results, body.code)
    end = f"return (int)({printed.code});"
    lines = [*printed.first]
    if printed.condition:  # only then the rest is computed
        lines.append(f"if (!({printed.condition})) {{")
        lines += [f"    for (int k = 0; k < {len(printed.results)}; k++) {{", "        out[k] = NAN;", "    }"]
        lines += [f"    {end}", "}"]
    lines += [*printed.then, *(f"out[{k}] = {value};" for k, value in enumerate(printed.results)), end]
    arguments = ["in", "state"] if len(body.columns) > count else ["in"]
    unused = [f"(void){word};" for word in arguments if not any(f"{word}[" in line for line in lines)]
    text = "".join(f"    {line}\n" for line in [*unused, *lines])
    parameters = ", ".join([*(f"const double *{word}" for word in arguments), "double *out"])
    head = f"/* {printed.operations} operations. */\nstatic int {name}({parameters})\n"
    return PrintedProgram(name, f"{head}{{\n{text}}}\n", printed.operations)


def filled_template(functions: MachineFunctions, template: str, words: Mapping[str, object]) -> str:
    """Return a file from its template: the sections that a machine needs, with words filled in."""
    needed = {
        "always": True,
        "solve": functions.square or functions.rests,
        "forward": functions.square,
        "no_forward": not functions.square,
        "rest": functions.rests,
        "loaded_forward": functions.square and functions.rests,
        "quantities": bool(functions.quantities),
        "modes": functions.mode_counts is not None,
        "scale": functions.rests or bool(functions.quantities),
    }
    _, *pieces = re.split(r"/\* section: (\w+) \*/\n", (TEMPLATES / template).read_text("utf-8"))
    text = "".join(part for name, part in zip(pieces[::2], pieces[1::2], strict=True) if needed[name])
    return Template(text).substitute({"note": _note(functions, "Made by"), **words})


def _note(functions: MachineFunctions, made: str) -> str:
    """Return the comment with which a file begins."""
    return f"/* {in_comment(functions.machine.name)}. {made} kinetostat {version('kinetostat')}; do not edit. */"


def _source(functions: MachineFunctions, programs: Sequence[PrintedProgram]) -> str:
    """Return NAME.c: constants, printed formulas, and the loops around them."""
    turning = ", ".join(str(int(kind == "angle")) for kind in functions.kinds)
    sliding = ", ".join(str(int(actuator.slides)) for actuator in functions.actuators)
    constants = [f"static const int IS_ANGLE[MACHINE_INPUTS] = {{{turning}}};"]
    numbers: dict[str, float] = {"LARGEST_ANGLE": LARGEST_ANGLE}
    if functions.square or functions.rests:
        numbers["LENGTH"] = functions.length
    if functions.square:
        constants.append(f"static const int IS_SLIDE[MACHINE_ACTUATORS] = {{{sliding}}};")
        numbers |= {"CLOSED": CLOSED, "STEPS_FORWARD": STEPS_FORWARD}
        numbers |= {"SHORTEST_SHARE": SHORTEST_SHARE, "SHORTENING": SHORTENING}
    if functions.rests:
        numbers |= {"STATES": functions.states, "STEPS_AT_REST": MOST_NEWTON_STEPS, "ONE_STEP_AWAY": ONE_STEP_AWAY}
        numbers |= {"COMMANDED": COMMANDED, "STEPS_OF_COMMAND": STEPS_OF_COMMAND}
        numbers |= {"NEARLY_COMMANDED": NEARLY_COMMANDED, "ASIDE": ASIDE}
    if functions.mode_counts:
        sizes = functions.springs
        numbers |= {"WAYS": sizes.ways, "SPRINGS": sizes.springs, "CONDITIONS": sizes.conditions, "SWEEPS": SWEEPS}
    constants += [f"#define {name} {number!r}" for name, number in numbers.items()]
    words = {
        "constants": "\n".join(constants) + "\n",
        "programs": "\n".join(program.text for program in programs),
        "rest_first": "\n    ".join(_state_lines(functions)),
        "state": "state, " if functions.needs_state or functions.mode_counts else "",
    }
    return filled_template(functions, "source.c", words).replace("\n    \n", "\n")


def _state_lines(functions: MachineFunctions) -> list[str]:
    """Return lines of C that find the state of which quantities are: of rest, then modes in the order of columns."""
    counts = functions.mode_counts or ModeCounts()
    modes = counts.loaded + counts.factor + counts.free
    if not (functions.needs_state or modes):
        return []
    rests = functions.states if functions.needs_state else 0
    lines = [f"double state[{rests + modes * functions.springs.springs}];" if modes else "double state[STATES];"]
    lines += ["rest_of(at, state);"] if rests else []
    lines += ["double parts[PARTS];"] if modes else []
    place = rests
    for program, arguments, groups in (
        ("springs_at_rest_at", "at, state, parts", ((counts.loaded, 1), (counts.factor, 0))),
        ("springs_at", "at, parts", ((counts.free, 1),)),
    ):
        lines += [f"{program}({arguments});"] if any(count for count, _ in groups) else []
        for count, massive in groups:
            if count:
                lines.append(f"modes_of(parts, {massive}, {count}, state + {place});")
                place += count * functions.springs.springs
    return lines


def _header(functions: MachineFunctions, programs: Sequence[PrintedProgram]) -> str:
    """Return NAME.h: arguments and results of the functions, with units, and the work that they do at most."""
    work = {program.name: program.operations for program in programs}
    trials = 1 + math.ceil(math.log(SHORTEST_SHARE) / math.log(SHORTENING))
    work["forward"] = STEPS_FORWARD * (work["actuator_slopes_at"] + trials * work["actuators_at"])
    if functions.rests:
        work["rest"] = work["first_steps_at"] + MOST_NEWTON_STEPS * work["step_at"] + work["displacement_at"]
        poses = STEPS_OF_COMMAND + 2 * functions.coordinates
        work["command"] = poses * (work["rest"] + 2 * work["placement_at"])
    before = _operations_before(functions, work)
    arguments = [
        f"in[{k}]: {in_comment(path)}, {KINDS[kind].unit}" for k, (path, kind) in enumerate(functions.arguments)
    ]
    driven = [f"[{k}]: {in_comment(a.name)}, {a.unit}: {a.meaning}" for k, a in enumerate(functions.actuators)]
    listed = [f"[{k}]: {name}, {QUANTITIES[name].unit}" for k, name in enumerate(functions.quantities)]
    sizes = (len(functions.inputs), functions.coordinates, len(functions.actuators), len(functions.quantities))
    names = ("INPUTS", "COORDINATES", "ACTUATORS", "QUANTITIES")
    words: dict[str, object] = {
        "sizes": ", ".join(f"MACHINE_{name} = {size}" for name, size in zip(names, sizes, strict=True)),
        "statuses": ",\n    ".join(f"MACHINE_{status.name} = {int(status)}" for status in Status),
        "sentences": "\n".join(_wrap(f"{status.name}: {status.sentence}") for status in Status),
        "given": listing(arguments),
        "driven": listing(driven),
        "listed": listing(listed),
        "before": f"\n   At most {before} before them, for the states and modes that they are of." if before else "",
    }
    return filled_template(functions, "header.h", words | work)


def _operations_before(functions: MachineFunctions, work: Mapping[str, int]) -> int:
    """Return the most operations that find the state of rest and the modes of which quantities are: `_state_lines`."""
    counts = functions.mode_counts or ModeCounts()
    result = work["first_steps_at"] + MOST_NEWTON_STEPS * work["step_at"] if functions.needs_state else 0
    solved = {"springs_at": (counts.free,), "springs_at_rest_at": (counts.loaded, counts.factor)}
    for program, groups in solved.items():
        result += work[program] if any(groups) else 0
        result += sum(_operations_of_modes(functions.springs, count) for count in groups if count)
    return result


def _operations_of_modes(sizes: SpringSizes, count: int) -> int:
    """Return the operations at most of `modes_of` in source.c, loop by loop."""
    n, entries = sizes.springs, sizes.springs * (sizes.springs + 1) // 2
    closed = 4 * sizes.ways * entries + 8 * sizes.conditions * n * n
    rotations = SWEEPS * n * (n - 1) // 2 * (17 + 18 * n) + 2 * n * n
    return 2 * closed + 3 * n**3 + 4 * n * n + rotations + count * 2 * n * n


def in_comment(text: str) -> str:
    """Return a name of a machine file in one line of ASCII that neither ends a comment nor begins one."""
    return ascii_line(text).replace("*", "x").replace("/", "|").replace("\\", "|").replace("?", ".")


def listing(rows: Sequence[str]) -> str:
    """Return rows as lines of a comment."""
    return "".join(f"   {ascii_units(row)}\n" for row in rows)


def _wrap(text: str) -> str:
    return fill(text, COMMENT_WIDTH, initial_indent="   ", subsequent_indent="     ")


def ascii_units(text: str) -> str:
    """Write units in ASCII: N*m for N·m, kg/m^3."""
    return text.translate(
        {ord("·"): "*", ord("²"): "^2", ord("³"): "^3", ord("⁴"): "^4", ord("°"): "deg", ord("µ"): "u"}
    )


def _test(functions: MachineFunctions) -> str:
    """Return NAME_test.c: poses, and what Python computes there one by one, without the printed formulas."""
    columns = sample_points(functions)
    rows = np.array(list(columns.values())).T
    count, command_scale = len(rows), 1.0
    machines = [with_values(functions.machine, dict(zip(functions.inputs, row.tolist(), strict=True))) for row in rows]
    responses = [respond(machine) for machine in machines]
    matrices = [[*np.ravel(r.stiffness.rows()), *np.ravel(r.compliance.rows())] for r in responses]
    blocks = {"MATRICES": np.array(matrices, dtype=float)}
    blocks["COORDINATES"] = np.array([[a.coordinate for a in stand(machine)] for machine in machines], dtype=float)
    if functions.rests:
        blocks["DISPLACEMENT"] = quantities_at(functions, columns, DISPLACEMENTS)
        blocks["COMMAND"], command_difference = _targets(functions, columns, count)
        command_scale = max(1.0, command_difference / AGREED)
    if functions.quantities:
        blocks["QUANTITIES"] = quantities_at(functions, columns, functions.quantities)
        points = PointTable(columns)
        gradients = evaluate_gradient(functions.machine, points, functions.quantities, functions.inputs).gradients
        blocks["SLOPES"] = np.moveaxis(gradients, 2, 0).reshape(count, -1)
    arrays = [_array("POSES", rows), *(_array(f"REFERENCE_{name}", block) for name, block in blocks.items())]
    words = {
        "note": _note(functions, "Test of the functions, made by"),
        "arrays": "\n".join(arrays),
        "agreed": AGREED,
        "command_scale": command_scale,
        "rows": count,
    }
    return filled_template(functions, "test.c", words)


def _targets(functions: MachineFunctions, columns: dict[str, Array], count: int) -> tuple[Array, float]:
    """Return coordinates of the actuators of the loaded machine [n x actuators], and the difference that is allowed.

    NaN where it comes to no rest. The stiffness of a parallelogram depends on the pose: C takes it at the pose to which
    the loaded machine is commanded, Python at the pose where it shall be. Commands of both differ by the square of the
    correction.
    """
    try:
        targets = actuator_targets(functions.machine, columns, count)
    except InputError:
        return np.full((count, len(functions.actuators)), np.nan), 0.0
    chains = [leg.chain for leg in state_of(functions.machine).configuration.legs]
    if not any(isinstance(element, Parallelogram) for chain in chains for element in chain):
        return targets.coordinates, 0.0
    units = [functions.length if actuator.unit == "m" else 1.0 for actuator in functions.actuators]
    return targets.coordinates, float(np.nanmax((targets.corrections / units) ** 2, initial=0.0))


def _array(name: str, rows: Array) -> str:
    """Return a table of numbers as a constant of C."""
    lines = ",\n".join(f"    {{{', '.join(literal(float(number)) for number in row)}}}" for row in rows)
    return f"static const double {name}[{rows.shape[0]}][{rows.shape[1]}] = {{\n{lines}\n}};"
