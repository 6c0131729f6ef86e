"""The C functions of a machine inside of other programs: kinematics of LinuxCNC, functions of MATLAB, a model of FMI 3.

Each is a thin file around the source that `c_source` writes; no formula is stated here.
"""

import io
import math
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from xml.sax.saxutils import quoteattr

from kinetostat.engine.machine_functions import MachineFunctions, functions_of
from kinetostat.exchange.c_source import (
    STEPS_OF_COMMAND,
    ascii_units,
    filled_template,
    in_comment,
    library_texts,
    listing,
    prefix_of,
    with_names,
)
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import stand
from kinetostat.machine.loading import as_toml
from kinetostat.machine.parameters import POSE, values
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_bytes, write_text

UNITS_OF_LINUXCNC = {"length": 1e3, "angle": math.degrees(1.0)}
"""Units of LinuxCNC, mm and deg, in a SI unit."""
AXES = {"x": "tran.x", "y": "tran.y", "z": "tran.z", "roll": "a", "pitch": "b", "yaw": "c", "angle": "c"}
"""Axes of LinuxCNC for coordinates of poses; others take the first free one of `FREE_AXES`."""
FREE_AXES = {"length": ("tran.z", "tran.y", "tran.x"), "angle": ("a", "b", "c")}
"""Axes of LinuxCNC by the kind of a coordinate, those first that most machines move along."""
EARLIEST = (1980, 1, 1, 0, 0, 0)
"""Date of the files in an archive, so that the same machine gives the same bytes."""
DESCRIPTIONS = {
    "first_input": "argument of the machine",
    "driven": "coordinate at which an actuator is to stand",
    "reached": "pose at which the actuators stand as driven",
    "stiffness": "stiffness at the tool point, rows rx ry rz x y z, base axes, SI",
    "compliance": "compliance at the tool point, rows rx ry rz x y z, base axes, SI",
    "coordinates": "coordinate of an actuator at the pose",
    "displacement": "motion of the tool at rest under the loads: rotation vector, rad, and displacement, m, base axes",
    "quantity": "quantity of the machine, SI",
    "command": "coordinate of an actuator that brings the loaded tool to the pose",
}
"""Sentences about variables of a model, by their group."""
SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("windows", ".dll")}
"""Words of FMI for systems, and the suffixes of their libraries."""
PROCESSORS = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
"""Words of FMI for processors, by the names that systems give them."""


def write_linuxcnc(analysis: Analysis, path: Path) -> list[Path]:
    """Write a component of LinuxCNC that has the kinematics of the machine, for `halcompile --install`.

    Args:
        analysis: the analysis of the machine at its pose.
        path: the path of NAME.comp, where NAME is the name of the component.

    Raises:
        InputError: legs of the machine have no closed form, or the name cannot be a name in C.
    """
    functions = functions_of(analysis.machine, (), ())
    source, header = library_texts(functions, path).values()
    # Both become one file, which has its own #include of the mathematics.
    source = source.replace(f'#include "{path.stem}.h"\n', "").replace("#include <math.h>\n", "")
    axes = _axes(functions)
    rows = list(enumerate(zip(axes, (UNITS_OF_LINUXCNC[kind] for kind in functions.kinds), strict=True)))
    letters = {axis: axis.removeprefix("tran.").upper() for axis in axes}
    joints = [UNITS_OF_LINUXCNC["length" if actuator.slides else "angle"] for actuator in functions.actuators]
    words = {
        "name": in_comment(functions.machine.name).replace('"', "'"),
        "axes": listing([f"{letters[a]}: {path}" for a, (path, _) in zip(axes, functions.arguments, strict=True)]),
        "joints": listing([f"{k}: {in_comment(a.name)}, {a.meaning}" for k, a in enumerate(functions.actuators)]),
        "library": f"{header}\n{source}",
        "joint_units": ", ".join(map(repr, joints)),
        "from_axes": "".join(f"    in[{k}] = world->{axis} / {unit!r};\n" for k, (axis, unit) in rows),
        "to_axes": "".join(f"    world->{axis} = in[{k}] * {unit!r};\n" for k, (axis, unit) in rows),
        "type": "KINEMATICS_BOTH" if functions.square else "KINEMATICS_INVERSE_ONLY",
        "steps": STEPS_OF_COMMAND,
    }
    write_text(path, with_names(filled_template(functions, "linuxcnc.comp", words), path.stem))
    return [path]


def _axes(functions: MachineFunctions) -> list[str]:
    """Return the axis of LinuxCNC that each coordinate of the pose has."""
    names = [path.removeprefix(POSE) for path in functions.inputs]
    used_axes = {AXES[name] for name in names if name in AXES}
    axes = []
    for name, kind in zip(names, functions.kinds, strict=True):
        axis = AXES.get(name) or next(free for free in FREE_AXES[kind] if free not in used_axes)
        used_axes.add(axis)
        axes.append(axis)
    return axes


def write_mex(
    analysis: Analysis, path: Path, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> list[Path]:
    """Write NAME.c, NAME.h and NAME_mex.c, which make a function of MATLAB and Octave; NAME is that of the path.

    Arguments and errors are those of `c_source.write`.
    """
    functions = functions_of(analysis.machine, inputs or (), outputs or ())
    arguments = [f"[{k}]: {in_comment(path)}" for k, path in enumerate(functions.inputs, 1)]
    words = {
        "given": listing(arguments),
        "inputs": len(functions.inputs),
        "actuators": len(functions.actuators),
        "quantities": len(functions.quantities),
    }
    texts = library_texts(functions, path)
    texts[path.with_name(f"{path.stem}_mex.c")] = with_names(filled_template(functions, "mex.c", words), path.stem)
    for place, text in texts.items():
        write_text(place, text)
    return list(texts)


@dataclass(frozen=True)
class ModelVariable:
    """A variable of an FMI model.

    Attributes:
        name: the name of the variable.
        unit: its SI unit, or "" where it has none.
        start: its values at the start; zeros for a variable that is computed.
        group: the group to which it belongs: the word under which the source code knows where the group begins.
        is_input: whether it is an input.
        shape: rows and columns of a matrix, or the size of a vector; empty for a single number.
    """

    name: str
    unit: str
    start: tuple[float, ...]
    group: str
    is_input: bool = False
    shape: tuple[int, ...] = ()


def write_fmu(
    analysis: Analysis, path: Path, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> list[Path]:
    """Write the machine as a model of FMI 3.0: its source and, where a C compiler is installed, its library.

    Arguments and errors are those of `c_source.write`; the path is that of NAME.fmu, and `inputs` become inputs of the
    model.
    """
    functions = functions_of(analysis.machine, inputs or (), outputs or ())
    stem = path.stem
    variables = _variables(functions)
    statuses = ["status", *(["reached.status"] if functions.square else [])]
    texts = {f"sources/{place.name}": text for place, text in library_texts(functions, path).items()}
    token = sha256("".join(texts.values()).encode()).hexdigest()
    adapter = _fmi_source(functions, variables, len(statuses), token)
    texts["sources/fmi3.c"] = with_names(adapter, stem)
    texts["sources/buildDescription.xml"] = _build_description(stem)
    texts["modelDescription.xml"] = _model_description(functions, stem, variables, statuses, token)
    texts[f"resources/{stem}.toml"] = as_toml(functions.machine)
    contents = {name: text.encode("utf-8") for name, text in texts.items()} | _library(texts, stem)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(zipfile.ZipInfo(name, EARLIEST), content, zipfile.ZIP_DEFLATED)
    write_bytes(path, buffer.getvalue())
    return [path]


def _variables(functions: MachineFunctions) -> list[ModelVariable]:
    """Return the variables of the model, in the order in which they lie in memory."""
    numbers, actuators = values(functions.machine), stand(functions.machine)
    units = {"length": "m", "angle": "rad"}

    def output(name: str, unit: str, group: str, *shape: int) -> ModelVariable:
        return ModelVariable(name, unit, (0.0,) * math.prod(shape), group, shape=shape)

    rows = [ModelVariable("time", "s", (0.0,), "time")]
    rows += [
        ModelVariable(path, units.get(kind, ""), (float(numbers[path]),), "first_input", is_input=True)
        for path, kind in functions.arguments
    ]
    if functions.square:
        rows += [
            ModelVariable(f"driven.{a.name}", a.unit, (float(a.coordinate),), "driven", is_input=True)
            for a in actuators
        ]
        rows += [
            ModelVariable(f"reached.{path.removeprefix(POSE)}", units[kind], (float(numbers[path]),), "reached")
            for path, kind in functions.arguments[: functions.coordinates]
        ]
    rows += [output("K", "", "stiffness", 6, 6), output("C", "", "compliance", 6, 6)]
    rows += [output(f"coordinate.{a.name}", a.unit, "coordinates") for a in functions.actuators]
    if functions.rests:
        rows.append(output("displacement", "", "displacement", 6))
        rows += [output(f"command.{a.name}", a.unit, "command") for a in functions.actuators]
    rows += [output(name, "", "quantity") for name in functions.quantities]
    return rows


def _fmi_source(functions: MachineFunctions, variables: Sequence[ModelVariable], statuses: int, token: str) -> str:
    """Return the adapter between the functions of the machine and those of FMI."""
    first_of_group: dict[str, int] = {}
    table: list[str] = []
    start: list[float] = []
    for variable in variables:
        first_of_group.setdefault(variable.group, len(start))
        row = f"{len(start)}, {len(variable.start)}, {int(variable.is_input)}"
        table.append(f"    {{{row}}}, /* {in_comment(variable.name)} */\n")
        start += variable.start
    words = {
        "token": token,
        "statuses": statuses,
        "numbers": len(start),
        "variables": "".join(table),
        "start": ", ".join(map(repr, start)),
        **first_of_group,
    }
    return filled_template(functions, "fmi3.c", words)


def _model_description(
    functions: MachineFunctions, stem: str, variables: Sequence[ModelVariable], statuses: Sequence[str], token: str
) -> str:
    """Return modelDescription.xml: names, units and value references of the variables."""
    units = sorted({variable.unit for variable in variables} - {""})
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiModelDescription fmiVersion="3.0" modelName={quoteattr(functions.machine.name)}'
        f' instantiationToken="{token}" generationTool="kinetostat" variableNamingConvention="flat">',
        f'  <ModelExchange modelIdentifier="{prefix_of(stem)}"/>',
        f'  <CoSimulation modelIdentifier="{prefix_of(stem)}" canHandleVariableCommunicationStepSize="true"/>',
        "  <UnitDefinitions>",
        *(f'    <Unit name="{unit}"><BaseUnit {unit}="1"/></Unit>' for unit in units),
        "  </UnitDefinitions>",
        "  <ModelVariables>",
    ]
    lines += [_variable_line(reference, variable) for reference, variable in enumerate(variables)]
    references = range(len(variables), len(variables) + len(statuses))
    lines += [
        f'    <Int32 name="{name}" valueReference="{reference}" causality="output" variability="discrete"/>'
        for reference, name in zip(references, statuses, strict=True)
    ]
    outputs = [k for k, variable in enumerate(variables) if not variable.is_input and variable.group != "time"]
    lines += ["  </ModelVariables>", "  <ModelStructure>"]
    for element in ("Output", "InitialUnknown"):
        lines += [f'    <{element} valueReference="{reference}"/>' for reference in [*outputs, *references]]
    return "\n".join([*lines, "  </ModelStructure>", "</fmiModelDescription>", ""])


def _variable_line(reference: int, variable: ModelVariable) -> str:
    unit = f' unit="{variable.unit}"' if variable.unit else ""
    description = DESCRIPTIONS.get(variable.group, "")
    described = f" description={quoteattr(description)}" if description else ""
    head = f'    <Float64 name={quoteattr(ascii_units(variable.name))} valueReference="{reference}"{unit}{described}'
    if variable.group == "time":
        return f'{head} causality="independent" variability="continuous"/>'
    if variable.is_input:
        return f'{head} causality="input" variability="continuous" start="{variable.start[0]!r}"/>'
    sizes = "".join(f'<Dimension start="{size}"/>' for size in variable.shape)
    tail = ' causality="output" variability="continuous"'
    return f"{head}{tail}>{sizes}</Float64>" if sizes else f"{head}{tail}/>"


def _build_description(stem: str) -> str:
    """Return buildDescription.xml: the files that an importer compiles where there is no library for its system."""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'  <BuildConfiguration modelIdentifier="{prefix_of(stem)}">\n    <SourceFileSet language="C99">\n'
        f'      <SourceFile name="fmi3.c"/>\n      <SourceFile name="{stem}.c"/>\n    </SourceFileSet>\n'
        "  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )


def _library(texts: dict[str, str], stem: str) -> dict[str, bytes]:
    """Return the compiled model for this system, by its name in the archive; nothing where there is no C compiler."""
    system, suffix = SYSTEMS.get(sys.platform, ("", ""))
    processor = PROCESSORS.get(platform.machine().lower(), "")
    compiler = next((program for name in ("cc", "gcc", "clang") if (program := shutil.which(name))), None)
    if not (system and processor and compiler):
        return {}
    sources = {Path(name).name: text for name, text in texts.items() if name.startswith("sources/")}
    library = f"{prefix_of(stem)}{suffix}"
    files = [name for name in sources if name.endswith(".c")]
    # Straight formulas run as fast after -O1 as after -O2, and long ones compile in six tenths of the time.
    command = [compiler, "-std=c99", "-O1", "-shared", "-fPIC", "-o", library, *files, "-lm"]
    try:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in sources.items():
                (Path(folder) / name).write_text(text, "utf-8")
            if subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode:
                return {}
            return {f"binaries/{processor}-{system}/{library}": (Path(folder) / library).read_bytes()}
    except OSError:  # no room for files that only the compiler reads: importers compile the sources
        return {}
