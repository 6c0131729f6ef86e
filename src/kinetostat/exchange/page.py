"""The machine as a page: one HTML file with its formulas, a picture, matrices and a map that follow sliders.

The formulas are the traced graph of the machine, printed as JavaScript, so that the page needs no server and asks for
nothing. When it opens it compares itself with numbers that Python has computed pose by pose.
"""

import json
import math
from collections.abc import Mapping, Sequence
from html import escape
from importlib.metadata import version
from pathlib import Path
from string import Template

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.form import objectives_of
from kinetostat.engine.printed import JAVASCRIPT, print_graph
from kinetostat.engine.trace import Body
from kinetostat.exchange.machine_functions import ENTRIES, MachineFunctions, functions_of, sample_points
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import as_toml
from kinetostat.machine.parameters import POSE, values, with_values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text
from kinetostat.units import KINDS
from kinetostat.views.page import whole_page

TEMPLATES = Path(__file__).with_name("web")
SPAN, TURN, SHARE = 0.4, math.radians(30.0), 0.5
"""Ranges of sliders about the value in the file: of lengths, in units of the machine's length; of angles, rad; of other
numbers, as a share of themselves."""
DIAGONAL_UNITS = {
    "stiffness": {True: (1e-3, "kN·m/rad"), False: (1e-6, "N/µm")},
    "compliance": {True: (1e6, "µrad/(N·m)"), False: (1e6, "µm/N")},
}
"""Factor from SI and unit of diagonal entries, by matrix and whether they are of a rotation."""


def write(
    analysis: Analysis, path: Path, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> list[Path]:
    """Write the page of a machine.

    Args:
        analysis: the analysis of the machine at its pose.
        path: the path of the page.
        inputs: leaf paths of parameters that get a slider beside the coordinates of the pose, as "tool.offset.2".
        outputs: names of quantities that the page shows beside K and C, as "frequency_1".

    Raises:
        InputError: legs of the machine have no closed form, or an input or output is unknown or has no program.
    """
    functions = functions_of(analysis.machine, inputs or (), outputs or ())
    if functions.needs_state:
        raise InputError(
            "A page has no states of rest, so that quantities under load are not among its outputs; --to c has them."
        )
    write_text(path, page_of(functions, path.stem))
    return [path]


def page_of(functions: MachineFunctions, stem: str) -> str:
    """Return the page of a machine as a text; `stem` is the name of the machine file that it offers."""
    kind, form, machine = functions.specimen, functions.form, functions.machine
    wanted = [((name, 1.0),) for name in (*ENTRIES, *functions.quantities)]
    programs = {
        "answers": objectives_of(kind, form, wanted, closed=functions.closed).body,
        "places": functions.placement.formula.body,
    }
    words = {
        "name": escape(machine.name),
        "parameters": " and parameters" if len(functions.inputs) > functions.coordinates else "",
        "version": version("kinetostat"),
        "data": json.dumps(_data(functions, programs, stem), ensure_ascii=False).replace("<", "\\u003c"),
        "programs": "\n".join(["const programs = {};", *(_program(name, body) for name, body in programs.items())]),
        "script": (TEMPLATES / "page.js").read_text("utf-8"),
    }
    body = Template((TEMPLATES / "page.html").read_text("utf-8")).substitute(words)
    return whole_page(machine.name, (TEMPLATES / "page.css").read_text("utf-8"), [body])


def _program(name: str, body: Body) -> str:
    """A body as a function of JavaScript from inputs `p` to results in `o`; it returns the status."""
    printed = print_graph(
        body.columns, [f"p[{k}]" for k in range(len(body.columns))], [*body.results, body.code], JAVASCRIPT
    )
    lines = [*printed.lines, *(f"o[{k}] = {value};" for k, value in enumerate(printed.results[:-1]))]
    return f"programs.{name} = (p, o) => {{\n{chr(10).join(lines)}\nreturn {printed.results[-1]};\n}};"


def _data(functions: MachineFunctions, programs: Mapping[str, Body], stem: str) -> dict[str, object]:
    """The data of the page beside its programs."""
    machine = functions.machine
    known = values(machine)
    rows = []
    for path, kind in functions.given:
        home = float(known[path])
        span = {"length": SPAN * functions.length, "angle": TURN}.get(kind, SHARE * abs(home) or 1.0)
        label = path.removeprefix(POSE)
        rows.append(
            {
                "name": label,
                "label": label,
                "si": KINDS[kind].unit,
                "home": home,
                "low": home - span,
                "high": home + span,
            }
        )
    components = [COMPONENTS[i] for i in machine.family.components]
    mapped = [
        {"place": ENTRIES.index(f"{matrix}_{name}"), "label": f"{letter} {name}", "factor": factor, "unit": unit}
        for matrix, letter in (("stiffness", "K"), ("compliance", "C"))
        for name in components
        for factor, unit in (DIAGONAL_UNITS[matrix][name.startswith("r")],)
    ]
    mapped += [
        {"place": len(ENTRIES) + k, "label": name, "factor": 1.0, "unit": QUANTITIES[name].unit}
        for k, name in enumerate(functions.quantities)
    ]
    columns = sample_points(functions)
    points = np.array(list(columns.values())).T
    return {
        "inputs": rows,
        "actuators": [{"name": a.name, "si": a.unit} for a in functions.actuators],
        "legs": functions.placement.legs,
        "quantities": [{"name": name, "si": QUANTITIES[name].unit} for name in functions.quantities],
        "statuses": [status.sentence for status in Status],
        "planar": machine.family.planar,
        "length": functions.length,
        "answers": len(programs["answers"].results),
        "places": len(programs["places"].results),
        "mapped": mapped,
        "first": "K z" if "z" in components else f"K {components[-1]}",
        "samples": [_sample(functions, row.tolist()) for row in points],
        "file": as_toml(machine),
        "fileName": f"{stem}.toml",
    }


def _sample(functions: MachineFunctions, point: list[float]) -> dict[str, object]:
    """A point, and the entries of C and K there as Python computes them; words where JSON has no numbers."""
    response = respond(with_values(functions.machine, dict(zip(functions.inputs, point, strict=True))))
    numbers = [float(QUANTITIES[name].value(response)) for name in ENTRIES]
    words = [n if math.isfinite(n) else None if math.isnan(n) else "inf" if n > 0.0 else "-inf" for n in numbers]
    return {"values": point, "expected": words}
