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
from kinetostat.exchange.mjcf_pace import IMPEDANCE, LEAST_STEPS, SETTLING_PERIODS, Pace, pace_of, vibrating_pace
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text
from kinetostat.validation.pieces import Heavy

ROD_RADIUS = 0.008
"""Radius of a link in the picture, as a share of the machine's extent: thin enough that legs do not hide each other."""
BASE_BALL = 1.6
"""Radius of the balls where legs begin, in radii of a link: it hides the ends of rods."""
PLATFORM_BALL = 1.5
"""Radius of the ball in the middle of the platform, and of that of the tool point, in radii of a link."""
PIN = 1.2, 1.8
"""Radius and half length of the pin of a hinge, in radii of a link: it is seen on both sides of the link around it."""
SLEEVE = 1.4, 4.0
"""Radius and half length of a slide, in radii of a link: a sleeve around the link, longer than a pin."""
TOOL_RADIUS = 0.6
"""Radius of the line from the platform to the tool point, in radii of a link: thinner than a link."""
SHORTEST_ROD = 0.1
"""Length, in radii of a link, below which nothing is drawn: bodies with one origin have no rod between them."""
LIGHT_HEIGHT = 2.0
"""Height of the light over the middle of the machine, in extents: its cone of 45 deg then covers everything."""
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
    f"Masses are those of the machine file, nothing is damped: 'settling_time' is {SETTLING_PERIODS} periods of the "
    "slowest\n"
    "     motion. A part without a mass has very little here. A link that bends is heavy in two rigid halves."
)
LEAST_EXTENT = 1e-3
"""Smallest extent of a picture, m: a machine in a point has none, and the camera needs one."""
SOLVER_TOLERANCE = "1e-12"
"""Tolerance of the engine's solver. Its own, 1e-8, leaves errors that are seen beside deflections of micrometres."""
SOLVER_ITERATIONS = "200"
"""Most steps of the engine's solver: twice its own number, since the tolerance is smaller."""
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


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the model; errors are those of `text_of`."""
    write_text(path, text_of(analysis))
    return [path]


def write_vibrating(analysis: Analysis, path: Path) -> list[Path]:
    """Write the model with the machine's own masses and without damping; errors are those of `text_of`."""
    write_text(path, text_of(analysis, vibrating=True))
    return [path]


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
    root = Element("mujoco", model=one_line(analysis.machine.name))
    root.append(ElementTree.Comment(NOTES.format(VIBRATING if vibrating else SETTLING)))
    _settings(root, pace)
    SubElement(root, "statistic", extent=_numbers(extent), center=_numbers(*middle))
    _look(root)
    world = SubElement(root, "worldbody")
    light = middle + np.array([0.0, 0.0, LIGHT_HEIGHT * extent])
    SubElement(world, "light", pos=_numbers(*light), dir="0 0 -1", diffuse="0.8 0.8 0.8")
    _Bodies(pace, ROD_RADIUS * extent).add_all(world, model, np.array(reference_point(analysis)))
    _constraints(root, model)
    ElementTree.indent(root, " ")
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _settings(root: Element, pace: Pace) -> None:
    """Write the settings of the engine: its time step and solver, no contacts, constraints as stiff as they can be."""
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
    bodies = (model.platform, *model.world.subtree())
    points = np.array([point for body in bodies for point in (body.origin, *body.reach)])
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


class _Bodies:
    """The bodies while they are written, with masses and dampings of a pace and links of a radius (m)."""

    def __init__(self, pace: Pace, radius: float) -> None:
        self._pace, self._radius = pace, radius

    def add_all(self, world: Element, model: Model, tool: Array) -> None:
        """Add all bodies of a machine, whose tool point is given in the base frame, m."""
        for point in model.world.reach:
            self._ball(world, BASE_BALL, "base", point)
        for child in model.world.children:
            self._add_body(world, child, model.world.origin)
        self._add_platform(world, model.platform, tool)

    def _add_body(self, parent: Element, body: Body, parent_origin: Array) -> None:
        element = SubElement(parent, "body", name=body.name, pos=_numbers(*(body.origin - parent_origin)))
        _add_inertia(element, self._pace.inertias[body.name], body.origin)
        for freedom in body.freedoms:
            self._add_joint(element, freedom, body)
        for point in body.reach:
            self._rod(element, np.zeros(3), point - body.origin, "link")
        for freedom in body.freedoms:
            self._draw_joint(element, freedom, body)
        for child in body.children:
            self._add_body(element, child, body.origin)

    def _add_platform(self, world: Element, body: Body, tool: Array) -> None:
        """Add the platform, which is free, and what it carries; its mass is at the tool point, where loads act."""
        element = SubElement(world, "body", name=body.name, pos=_numbers(*body.origin))
        SubElement(element, "freejoint", name=body.name)
        _add_inertia(element, self._pace.inertias[body.name], body.origin)
        for number, part in enumerate(self._pace.carried, 1):
            _add_inertia(SubElement(element, "body", name=f"mass {number}"), part, body.origin)
        corners = [point - body.origin for point in body.reach]
        for corner in corners:
            self._rod(element, np.zeros(3), corner, "platform")
        self._ball(element, PLATFORM_BALL, "platform")
        for start, end in pairwise([*corners, corners[0]]):
            self._rod(element, start, end, "platform")
        arm = tool - body.origin
        self._rod(element, np.zeros(3), arm, "tool", TOOL_RADIUS)
        size = _numbers(PLATFORM_BALL * self._radius)
        SubElement(element, "site", name="tool", pos=_numbers(*arm), size=size, material="tool")

    def _add_joint(self, element: Element, freedom: Freedom, body: Body) -> None:
        joint = SubElement(element, "joint", name=freedom.name, axis=_numbers(*freedom.axis))
        joint.set("type", "hinge" if freedom.is_hinge else "slide")
        if freedom.point is not None:
            joint.set("pos", _numbers(*(freedom.point - body.origin)))
        if freedom.stiffness > 0.0:
            joint.set("stiffness", _numbers(freedom.stiffness))
            joint.set("damping", _numbers(self._pace.damping(freedom.stiffness)))
        if (
            armature := self._pace.armatures.get(freedom.name, 0.0)
        ) != 0.0:  # also of a passive slide, along which a link stretches
            joint.set("armature", _numbers(armature))

    def _draw_joint(self, element: Element, freedom: Freedom, body: Body) -> None:
        """Draw a hinge as a pin and a slide as a sleeve; springs are coloured."""
        material = "actuator" if freedom.drive else "spring" if freedom.stiffness > 0.0 else "joint"
        width, half_length = PIN if freedom.is_hinge else SLEEVE
        middle = np.zeros(3) if freedom.point is None else freedom.point - body.origin
        half = freedom.axis * self._radius * half_length
        self._stick(element, "cylinder", (middle - half, middle + half), material, width)

    def _rod(self, element: Element, start: Array, end: Array, material: str, width: float = 1.0) -> None:
        if float(np.linalg.norm(end - start)) > SHORTEST_ROD * width * self._radius:
            self._stick(element, "capsule", (start, end), material, width)

    def _stick(self, element: Element, kind: str, ends: tuple[Array, Array], material: str, width: float) -> None:
        """Draw a capsule or a cylinder between two points of a body, of a radius in radii of a link."""
        size = _numbers(width * self._radius)
        start, end = ends
        SubElement(element, "geom", type=kind, fromto=_numbers(*start, *end), size=size, material=material)

    def _ball(self, element: Element, width: float, material: str, centre: Array | None = None) -> None:
        place = {} if centre is None else {"pos": _numbers(*centre)}
        size = _numbers(width * self._radius)
        SubElement(element, "geom", {"type": "sphere", "size": size, **place, "material": material})


def _add_inertia(element: Element, part: Heavy, origin: Array) -> None:
    inertial = SubElement(element, "inertial", pos=_numbers(*(part.centre - origin)), mass=_numbers(part.mass))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = part.inertia
    if xy == 0.0 and xz == 0.0 and yz == 0.0:
        inertial.set("diaginertia", _numbers(xx, yy, zz))
    else:
        inertial.set("fullinertia", _numbers(xx, yy, zz, xy, xz, yz))


def _constraints(root: Element, model: Model) -> None:
    equality = SubElement(root, "equality")
    origins = {body.name: body.origin for body in [*model.world.subtree(), model.platform]}
    for closing in model.closings:
        first, second = closing.bodies
        # MuJoCo wants the anchor of `connect` in the first body, of `weld` in the second.
        kind, carrier = ("connect", first) if closing.ball else ("weld", second)
        anchor = _numbers(*(closing.point - origins[carrier]))
        SubElement(equality, kind, body1=first, body2=second, anchor=anchor)
    for thread in model.threads:
        polynomial = _numbers(0.0, thread.pitch, 0, 0, 0)
        SubElement(equality, "joint", joint1=thread.slide, joint2=thread.hinge, polycoef=polynomial)


def _numbers(*numbers: float) -> str:
    """Write numbers with all their digits, separated by blanks."""
    return " ".join(repr(float(number)).removesuffix(".0") for number in numbers)
