"""The machine as a page: one HTML file with its formulas, a picture, matrices and a map that follow sliders.

The formulas are the traced graph of the machine as data, of which the page makes functions, so that it needs no server
and asks for nothing. When it opens it compares itself with numbers that Python has computed pose by pose. The same
machine can be the end of an address, which any such page opens.
"""

import json
import math
import zlib
from base64 import urlsafe_b64encode
from collections.abc import Sequence
from dataclasses import asdict, replace
from html import escape
from importlib.metadata import version
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.engine.form import TraceOptions, each_alone, objectives_of, plan_for
from kinetostat.engine.gradient import with_gradients
from kinetostat.engine.machine_functions import (
    DISPLACEMENTS,
    SHORTEST_SHARE,
    STEPS_FORWARD,
    MachineFunctions,
    drawn_points,
    functions_of,
    sample_points,
)
from kinetostat.engine.modes import spring_parts_of
from kinetostat.engine.printed import NOTATION, pack_graph
from kinetostat.engine.rest import MOST_NEWTON_STEPS, step_of
from kinetostat.engine.trace import Body
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import ENTRIES, QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import as_toml
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values, with_values
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text
from kinetostat.tolerances import CLOSED, ONE_STEP_AWAY
from kinetostat.units import KINDS
from kinetostat.vibration.springwise import ModeCounts
from kinetostat.views.page import whole_page
from kinetostat.views.scene.anatomy import Anatomy, Proportions, anatomy, proportions_of
from kinetostat.views.scene.leg_solids import rail_ends
from kinetostat.views.scene.machine_scene import has_open_frame, plates

if TYPE_CHECKING:
    from kinetostat.motion.rigid import MotionPlan

TEMPLATES = Path(__file__).with_name("live")
"""Folder of the page's script, style and elements."""
LENGTH_RANGE, ANGLE_RANGE, SHARE_RANGE = 0.4, math.radians(30.0), 0.5
"""Ranges of sliders about the value in the file: of lengths, in units of the machine's length; of angles, rad; of other
numbers, as a share of themselves. Most machines reach a good part of them."""
INDICES = (
    "singularity_margin",
    "frobenius_condition",
    "least_translational_stiffness",
    "greatest_translational_stiffness",
    "least_rotational_stiffness",
    "greatest_rotational_stiffness",
)
"""Quantities that a page shows where none is named."""
FORMAT, VIEWER = 1, "viewer.html"
"""Version of what an address holds, which a page must know, and the page that the documentation has for it."""
LONGEST_ADDRESS = 8000
"""Characters of a machine as part of an address: all browsers and most mail programs take so many. What it can do
without is left out until it fits."""
SPARE = (("shares", "parts"), ("slopes", "forward"), ("", "file"))
"""Pairs that an address can do without, first the first: a program, if any, and the key of the data that go with it."""


def write(
    analysis: Analysis, path: Path, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> list[Path]:
    """Write the page of a machine.

    Args:
        analysis: the analysis of the machine at its pose.
        path: the path of the page.
        inputs: leaf paths of parameters that get a slider beside the coordinates of the pose, as "tool.offset.2".
        outputs: names of quantities that the page shows beside K and C, as "frequency_1"; None for the usual indices.

    Raises:
        InputError: legs of the machine have no closed form, or an input or output is unknown or has no program.
    """
    write_text(path, page_of(page_functions(analysis.machine, inputs, outputs), path.stem))
    return [path]


def write_link(
    analysis: Analysis, path: Path, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> list[Path]:
    """Write the machine as the end of an address: its programs and data, which any page of a machine opens.

    The file is a text with one line, "viewer.html#m=...". Arguments and errors are those of `write`.
    """
    functions = functions_of(analysis.machine, inputs or (), outputs or ())
    write_text(path, f"{VIEWER}#m={address_of(functions, path.stem)}\n")
    return [path]


def page_functions(
    machine: Machine, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> MachineFunctions:
    """Return the functions of a machine for a page, which shows the usual indices where no quantity is named.

    Args:
        machine: the machine at its pose.
        inputs, outputs: as for `write`.

    Raises:
        InputError: as `write`.
    """
    return functions_of(machine, inputs or (), INDICES if outputs is None else outputs)


def page_of(functions: MachineFunctions, stem: str) -> str:
    """Return the page of a machine as a text; `stem` is the name of the machine file that it offers."""
    return _page(functions.machine.name, _page_content(functions, stem))


def viewer() -> str:
    """Return the page that shows the machine of its address, as a text."""
    return _page("kinetostat", None)


def address_of(functions: MachineFunctions, stem: str) -> str:
    """Return a machine as letters, digits, - and _: JSON, compressed, in base 64.

    Programs are data there, which the page checks before it makes functions of them.
    """
    content = _page_content(functions, stem)
    content["data"]["samples"] = content["data"]["samples"][:1]
    for program, key in SPARE:
        text = _compressed_text(content)
        if len(text) <= LONGEST_ADDRESS:
            return text
        content["packed"].pop(program, None)
        content["data"][key] = None
    return _compressed_text(content)


def _page_content(functions: MachineFunctions, stem: str) -> dict[str, Any]:
    """Return the content of a page: data, and programs that are packed (`engine.printed.pack_graph`)."""
    packed = {name: pack_graph(body.columns, [*body.results, body.code]) for name, body in _bodies(functions).items()}
    return {"format": FORMAT, "data": _data(functions, stem), "packed": packed}


def _compressed_text(content: object) -> str:
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"))
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS, 9)
    return urlsafe_b64encode(deflate.compress(text.encode("utf-8")) + deflate.flush()).decode("ascii").rstrip("=")


def _page(name: str, content: object) -> str:
    operations, statuses = json.dumps([*NOTATION]), json.dumps([status.sentence for status in Status])
    formulas = (TEMPLATES / "formulas.js").read_text("utf-8")
    words = {
        "name": escape(name),
        "version": version("kinetostat"),
        "machine": json.dumps(content, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c"),
        "picture": (TEMPLATES / "picture.js").read_text("utf-8"),
        "script": (TEMPLATES / "page.js").read_text("utf-8"),
        "formulas": formulas.replace("$operations", operations).replace("$statuses", statuses),
    }
    body = Template((TEMPLATES / "page.html").read_text("utf-8")).substitute(words)
    return whole_page(name, (TEMPLATES / "page.css").read_text("utf-8"), [body])


def _bodies(functions: MachineFunctions) -> dict[str, Body]:
    """Return the programs of a page, by name."""
    placement = functions.placement.formula
    # What is free of loads takes no state; limits of loads judge the program of the state of rest.
    options = TraceOptions(closed=functions.closed, limited=False)
    answers = objectives_of(functions.specimen, functions.form, each_alone(ENTRIES), options)
    bodies = {"answers": answers.body, "places": placement.body, "shares": functions.shares.formula.body}
    plan = plan_for(functions.machine, functions.quantities, functions.inputs)
    if free := [name for name in functions.quantities if not functions.at_rest(name)]:
        bodies |= _quantity_bodies(functions, free, plan)
    if functions.square:
        driven = placement.body.results[: len(functions.actuators)]
        body = Body(placement.body.fixed, placement.body.columns, driven, placement.body.code)
        bodies["slopes"] = with_gradients(body, placement.inputs)
    return bodies | _bodies_at_rest(functions, plan) if functions.rests else bodies


def _quantity_bodies(functions: MachineFunctions, names: Sequence[str], plan: "MotionPlan | None") -> dict[str, Body]:
    """Return the programs of quantities of the free machine, and that of its modes if they need it."""
    counts = functions.mode_counts or ModeCounts()
    modes = ModeCounts(free=counts.free) if counts.free else None
    options = TraceOptions(closed=functions.closed, limited=False, plan=plan, mode_counts=modes)
    quantities = objectives_of(functions.specimen, functions.form, each_alone(names), options)
    if modes is None:
        return {"quantities": quantities.body}
    springs = spring_parts_of(functions.specimen, functions.form, functions.closed, at_rest=False)
    return {"quantities": quantities.body, "springs": springs.body}


def _bodies_at_rest(functions: MachineFunctions, plan: "MotionPlan | None") -> dict[str, Body]:
    """Return the programs of states of rest: the first step, every later one, what holds there, and its modes."""
    parts = functions.specimen, functions.form, functions.closed
    counts = functions.mode_counts or ModeCounts()
    modes = replace(counts, free=0) if counts.at_rest else None
    names = [*DISPLACEMENTS, *filter(functions.at_rest, functions.quantities)]
    options = TraceOptions(closed=functions.closed, plan=plan, mode_counts=modes)
    loaded = objectives_of(functions.specimen, functions.form, each_alone(names), options)
    bodies = {"first": step_of(*parts, "first").body, "step": step_of(*parts).body, "loaded": loaded.body}
    return {**bodies, "springsAtRest": spring_parts_of(*parts, at_rest=True).body} if modes else bodies


def _data(functions: MachineFunctions, stem: str) -> dict[str, Any]:
    """Return the data of the page beside its programs."""
    machine = functions.machine
    columns = sample_points(functions)
    points = np.array(list(columns.values())).T
    rest = None
    if functions.rests:
        rest = {"states": functions.states, "steps": MOST_NEWTON_STEPS, "away": ONE_STEP_AWAY}
    forward = {"steps": STEPS_FORWARD, "shortest": SHORTEST_SHARE, "closed": CLOSED}
    return {
        "name": machine.name,
        "inputs": _sliders(functions),
        "actuators": [{"name": a.name, "si": a.unit} for a in functions.actuators],
        "drawing": _drawing(machine),
        "parts": functions.shares.parts,
        "quantities": [_quantity(functions, name) for name in functions.quantities],
        "planar": machine.family.planar,
        "components": machine.family.components,
        "length": functions.length,
        "forward": forward if functions.square else None,
        "rest": rest,
        "springs": asdict(functions.mode_counts) | asdict(functions.springs) if functions.mode_counts else None,
        "samples": [_sample(functions, row.tolist()) for row in points],
        "file": as_toml(machine),
        "fileName": f"{stem}.toml",
    }


def _sliders(functions: MachineFunctions) -> list[dict[str, Any]]:
    """Return a slider for each argument of the functions: its name, unit, value in the file, and ends, SI."""
    numbers = values(functions.machine)
    rows = []
    for path, kind in functions.arguments:
        home = float(numbers[path])
        ranges = {"length": LENGTH_RANGE * functions.length, "angle": ANGLE_RANGE}
        reach = ranges.get(kind, SHARE_RANGE * abs(home) or 1.0)  # a number that is 0 has no share: 1 in SI
        ends = {"home": home, "low": home - reach, "high": home + reach}
        rows.append({"name": path.removeprefix(POSE), "si": KINDS[kind].unit, **ends})
    return rows


def _quantity(functions: MachineFunctions, name: str) -> dict[str, Any]:
    """Return what the page must know of a quantity: whether it needs a state of rest, and whether it takes long."""
    row = QUANTITIES[name]
    return {"name": name, "si": row.unit, "loaded": functions.at_rest(name), "slow": functions.needs_modes(row)}


def _drawing(machine: Machine) -> dict[str, Any]:
    """Return the bodies of a machine by the points that they join, as the scene of the machine has them at its pose.

    Points count through the `drawn_points` of all legs.
    """
    configuration = respond(machine).configuration
    sizes = proportions_of(machine, configuration)
    parts = [anatomy(leg) for leg in configuration.legs]
    legs: list[dict[str, Any]] = []
    count = 0
    for leg, body in zip(configuration.legs, parts, strict=True):
        points = drawn_points(leg)
        legs.append(_leg_drawing(body, points, count, sizes))
        count += len(points)
    base, platform = plates(configuration, parts, sizes.leg)
    stands = base is not None and base.block is None and not has_open_frame(configuration)
    return {"radius": sizes.leg, "base": stands, "block": platform.block is not None, "points": count, "legs": legs}


def _leg_drawing(parts: Anatomy, points: Sequence[Vector], first: int, sizes: Proportions) -> dict[str, Any]:
    """Return the bodies of a leg by the numbers of the points that they join.

    A link is its kind, whether its leg is driven, its length at this pose (m), from which the cylinder of a telescope
    is drawn, and the points at its ends; of two bars, of both.

    Args:
        parts: the parts of the leg.
        points: the points that the page computes for the leg, base frame, m.
        first: number of the first of these points.
        sizes: the proportions of the machine.
    """

    def number_of(point: Vector) -> int:
        return first + min(range(len(points)), key=lambda k: (points[k] - point).norm())

    links = []
    for link in parts.links:
        sides = [ZERO] if link.side is None else [link.side, -link.side]
        ends = [(number_of(link.start + side), number_of(link.end + side)) for side in sides]
        links.append((link.kind, link.driven or parts.actuated, link.span.norm(), *ends))
    rails = [
        {"ends": [p.components() for p in rail_ends(r, sizes)], "at": number_of(r.point), "driven": r.driven}
        for r in parts.rails
    ]
    return {
        "links": links,
        "joints": sorted({number_of(joint.point) for joint in parts.joints}),
        "rails": rails,
        "stands": not parts.on_rail,
        "foot": number_of(parts.foot),
        "second": number_of(parts.second_point),
        "head": number_of(parts.head),
        "before": number_of(parts.last_but_one),
    }


def _sample(functions: MachineFunctions, point: list[float]) -> dict[str, object]:
    """Return a point, and the entries of C and K there as Python computes them; words where JSON has no numbers."""
    response = respond(with_values(functions.machine, dict(zip(functions.inputs, point, strict=True))))
    numbers = [float(QUANTITIES[name].value(response)) for name in ENTRIES]
    words = [n if math.isfinite(n) else None if math.isnan(n) else "inf" if n > 0.0 else "-inf" for n in numbers]
    return {"values": point, "expected": words}
