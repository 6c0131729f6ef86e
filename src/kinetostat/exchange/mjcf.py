"""A machine as MuJoCo's XML (MJCF): bodies, joints with springs, closed loops by `connect` and `weld`, and colours.

`mjcf_model` decides of which bodies the machine consists, `mjcf_pace` how fast it moves; here this becomes text.
"""

from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from kinetostat.arrays import Array
from kinetostat.exchange.formats import one_line, reference_point
from kinetostat.exchange.mjcf_model import Body, Freedom, Model, build
from kinetostat.exchange.mjcf_pace import IMPEDANCE, LEAST_STEPS, Pace, pace_of, vibrating_pace
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text
from kinetostat.validation.pieces import Heavy

ROD_RADIUS = 0.008
"""Radius of a link in the picture, as a share of the machine's extent: thin enough that legs do not hide each other."""
NOTES = (
    " Written by kinetostat; SI, axes of the machine's base. Springs are stiffnesses of joints, rigid parts have\n"
    "     none. No gravity. xfrc_applied on the body 'platform': force, moment at the tool point (site 'tool').\n"
    "     {}\n"
    "     Constraints are soft: keep timestep, solref and solimp as they are. "
)
"""Comment at the top of the file, for its reader."""
SETTLING = (
    "A load has settled after 'settling_time', s. Masses decide nothing that is static; those that the\n"
    "     machine file does not say are as great as those it says, or 1 kg."
)
VIBRATING = (
    "Masses are those of the machine file, nothing is damped: 'settling_time' is ten periods of the slowest\n"
    "     motion. A part without a mass has very little here. A link that bends is heavy in two rigid halves."
)
LEAST_EXTENT = 1e-3
"""Smallest extent of a picture, m: a machine in a point has none, and the camera needs one."""
SOLVER_TOLERANCE, SOLVER_ITERATIONS = "1e-12", "200"
"""Accuracy at which the engine's solver ends, near round-off, and its steps at most, twice MuJoCo's usual number."""
CRITICAL_DAMPING = 1.0
"""Damping ratio of constraints: they close as soon as they can without swinging."""
CONSTANT_IMPEDANCE = (IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0)
"""Impedance of constraints that are kept and that are violated, equal so that the other three (width, midpoint and
power of the way between, as MuJoCo has them) do not count."""
COLOURS = {
    "link": "0.75 0.78 0.82 1",
    "joint": "0.25 0.28 0.32 1",
    "actuator": "0.90 0.49 0.13 1",
    "spring": "0.20 0.55 0.75 1",
    "platform": "0.16 0.44 0.36 1",
    "base": "0.35 0.37 0.40 1",
    "tool": "0.85 0.15 0.15 1",
}
"""Red, green, blue and opacity of the materials."""


def text_of(analysis: Analysis, vibrating: bool = False) -> str:
    """Return the model: unstressed and at rest at the pose; a wrench on the platform acts at the tool point.

    Args:
        analysis: the analysis of the machine.
        vibrating: whether it has the machine's own masses and no damping, so that it vibrates as the machine does;
            otherwise masses and damping let it come to rest soon.

    Raises:
        InputError: if the machine has a part that MuJoCo has no counterpart for, or no mass that could vibrate.
    """
    model = build(analysis.state.configuration)
    pace = vibrating_pace(analysis, model) if vibrating else pace_of(analysis, model)
    middle, extent = _middle_and_extent(model)
    radius = ROD_RADIUS * extent
    root = Element("mujoco", model=one_line(analysis.machine.name))
    root.append(ElementTree.Comment(NOTES.format(VIBRATING if vibrating else SETTLING)))
    _settings(root, pace)
    SubElement(root, "statistic", extent=_numbers(extent), center=_numbers(*middle))
    _look(root)
    world = SubElement(root, "worldbody")
    SubElement(world, "light", pos="0 0 4", dir="0 0 -1", diffuse="0.8 0.8 0.8")
    _shapes(world, model.world, radius, "base")
    for child in model.world.children:
        _body(world, child, model.world, pace, radius)
    _platform(world, model, pace, radius, np.array(reference_point(analysis)))
    _constraints(root, model)
    ElementTree.indent(root, " ")
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _settings(root: Element, pace: Pace) -> None:
    """Write the settings of the engine: its time step and solver, no contacts, and constraints as stiff as they can be.

    Newton's solver ends far above its tolerance where this is left at MuJoCo's own 1e-8, which would be seen beside
    deflections of micrometres.
    """
    SubElement(root, "compiler", angle="radian", autolimits="false", inertiafromgeom="false")
    option = SubElement(root, "option", timestep=_numbers(pace.step), gravity="0 0 0", integrator="Euler")
    option.set("solver", "Newton")
    option.set("tolerance", SOLVER_TOLERANCE)
    option.set("iterations", SOLVER_ITERATIONS)
    SubElement(option, "flag", contact="disable")
    SubElement(SubElement(root, "custom"), "numeric", name="settling_time", data=_numbers(pace.settling))
    defaults = SubElement(root, "default")
    SubElement(defaults, "geom", contype="0", conaffinity="0", mass="0")
    time_constant = _numbers(LEAST_STEPS * pace.step, CRITICAL_DAMPING)
    SubElement(defaults, "equality", {"solref": time_constant, "solimp": _numbers(*CONSTANT_IMPEDANCE)})


def _middle_and_extent(model: Model) -> tuple[Array, float]:
    """Return the middle and the diagonal of the box that holds the machine, m."""
    points = np.array([point for body in (model.platform, *model.world.every()) for point in (body.at, *body.reach)])
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2.0, max(float(np.linalg.norm(high - low)), LEAST_EXTENT)


def _look(root: Element) -> None:
    """Write light, background and colours."""
    SubElement(root, "visual").append(Element("headlight", ambient="0.4 0.4 0.4", diffuse="0.5 0.5 0.5"))
    asset = SubElement(root, "asset")
    SubElement(
        asset, "texture", type="skybox", builtin="gradient", rgb1="0.95 0.97 1", rgb2="0.75 0.8 0.88", width="64",
        height="64",
    )  # fmt: skip
    for name, colour in COLOURS.items():
        SubElement(asset, "material", name=name, rgba=colour)


def _body(parent: Element, body: Body, before: Body, pace: Pace, radius: float) -> None:
    element = SubElement(parent, "body", name=body.name, pos=_numbers(*(body.at - before.at)))
    _inertia(element, pace.inertias[body.name], body.at)
    for freedom in body.freedoms:
        _joint(element, freedom, body, pace)
    _shapes(element, body, radius, "link")
    for freedom in body.freedoms:
        _joint_shape(element, freedom, body, radius)
    for child in body.children:
        _body(element, child, body, pace, radius)


def _inertia(element: Element, part: Heavy, origin: Array) -> None:
    inertial = SubElement(element, "inertial", pos=_numbers(*(part.centre - origin)), mass=_numbers(part.mass))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = part.inertia
    if xy == 0.0 and xz == 0.0 and yz == 0.0:
        inertial.set("diaginertia", _numbers(xx, yy, zz))
    else:
        inertial.set("fullinertia", _numbers(xx, yy, zz, xy, xz, yz))


def _joint(element: Element, freedom: Freedom, body: Body, pace: Pace) -> None:
    joint = SubElement(element, "joint", name=freedom.name, axis=_numbers(*freedom.axis))
    joint.set("type", "slide" if freedom.point is None else "hinge")
    if freedom.point is not None:
        joint.set("pos", _numbers(*(freedom.point - body.at)))
    if freedom.stiffness > 0.0:
        joint.set("stiffness", _numbers(freedom.stiffness))
        joint.set("damping", _numbers(pace.damping(freedom.stiffness)))
    if (armature := pace.armature(freedom)) != 0.0:  # of a passive slide as well, along which a link stretches
        joint.set("armature", _numbers(armature))


def _shapes(element: Element, body: Body, radius: float, material: str) -> None:
    """Draw a body: balls of the base where other bodies begin, else links as rods from its origin to these points."""
    for point in body.reach:
        if material == "base":
            SubElement(
                element, "geom", type="sphere", size=_numbers(1.6 * radius), pos=_numbers(*point), material=material
            )
        else:
            _rod(element, np.zeros(3), point - body.at, radius, material)


def _rod(element: Element, start: Array, end: Array, radius: float, material: str) -> None:
    if float(np.linalg.norm(end - start)) > 0.1 * radius:
        SubElement(
            element, "geom", type="capsule", fromto=_numbers(*start, *end), size=_numbers(radius), material=material
        )


def _joint_shape(element: Element, freedom: Freedom, body: Body, radius: float) -> None:
    """Draw a hinge as a pin and a slide as a longer one; springs are coloured."""
    material = "actuator" if freedom.drive else "spring" if freedom.stiffness > 0.0 else "joint"
    middle = np.zeros(3) if freedom.point is None else freedom.point - body.at
    half = freedom.axis * radius * (4.0 if freedom.point is None else 1.8)
    size = _numbers((1.4 if freedom.point is None else 1.2) * radius)
    SubElement(element, "geom", type="cylinder", fromto=_numbers(*(middle - half), *(middle + half)), size=size).set(
        "material", material
    )


def _platform(world: Element, model: Model, pace: Pace, radius: float, tool: Array) -> None:
    """Add the platform: free, its centre of mass at the tool point, so that loads on it act there; what it carries."""
    body = model.platform
    element = SubElement(world, "body", name=body.name, pos=_numbers(*body.at))
    SubElement(element, "freejoint", name=body.name)
    _inertia(element, pace.inertias[body.name], body.at)
    for number, part in enumerate(pace.carried, 1):
        _inertia(SubElement(element, "body", name=f"mass {number}"), part, body.at)
    _shapes(element, body, radius, "platform")
    SubElement(element, "geom", type="sphere", size=_numbers(1.5 * radius), material="platform")
    ring = [*body.reach, body.reach[0]]
    for start, end in pairwise(ring):
        _rod(element, start - body.at, end - body.at, radius, "platform")
    _rod(element, np.zeros(3), tool - body.at, 0.6 * radius, "tool")
    SubElement(
        element, "site", name="tool", pos=_numbers(*(tool - body.at)), size=_numbers(1.5 * radius), material="tool"
    )


def _constraints(root: Element, model: Model) -> None:
    equality = SubElement(root, "equality")
    places = {body.name: body.at for body in [*model.world.every(), model.platform]}
    for closing in model.closings:  # MuJoCo wants the anchor of `connect` in the first body, of `weld` in the second
        first, second = closing.bodies
        if closing.ball:
            anchor = closing.point - places[first]
            SubElement(equality, "connect", body1=first, body2=second, anchor=_numbers(*anchor))
        else:
            anchor = closing.point - places[second]
            SubElement(equality, "weld", body1=first, body2=second, anchor=_numbers(*anchor))
    for thread in model.threads:
        SubElement(
            equality, "joint", joint1=thread.slide, joint2=thread.hinge, polycoef=_numbers(0.0, thread.pitch, 0, 0, 0)
        )


def _numbers(*numbers: float) -> str:
    """Write numbers with all their digits, separated by blanks."""
    return " ".join(repr(float(number)).removesuffix(".0") for number in numbers)


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the model.

    Raises:
        InputError: if the machine has a part that MuJoCo has no counterpart for.
    """
    write_text(path, text_of(analysis))
    return [path]


def write_vibrating(analysis: Analysis, path: Path) -> list[Path]:
    """Write the model with the machine's own masses and without damping.

    Raises:
        InputError: if the machine has a part that MuJoCo has no counterpart for, or no mass that could vibrate.
    """
    write_text(path, text_of(analysis, vibrating=True))
    return [path]
