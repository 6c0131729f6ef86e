"""The plan of a machine written leg by leg, which is all but its numbers: legs, joints, links and their models."""

from collections.abc import Mapping
from typing import Any

from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Inverse
from kinetostat.spec.immutable import Immutable

NAME = "legs"
"""The name of this family in machine files."""

SUMMARY = "any machine, written leg by leg: joints by point and axis at the home pose, and the links between them"

BASE, PLATFORM = "base", "platform"
"""Names of the two bodies that every leg joins."""

LINK_MODELS = {
    "rigid": "rigid: it does not deflect",
    "lumped": "torsional and linear springs where the link is built in, at its first joint",
    "beam": "Euler-Bernoulli beam between its two joints",
    "timoshenko": "beam that deflects in shear as well",
    "matrix": "a 6x6 compliance of its own, of its end against its beginning, at the end",
}
"""Models of a link, by which it deflects."""

CABLE = "cable"
"""The only word that `type` of a leg may have; a leg without it is a chain of joints and links."""
ONE_SIDED = ("pulls", "pushes")
"""Words of `acts`: a cable pulls its ends together, a prop pushes them apart; neither does the other."""

SPATIAL_POSE = ("x", "y", "z", "roll", "pitch", "yaw")
PLANAR_POSE = ("x", "y", "yaw")
"""Coordinates of the platform: P in the base frame, and Q = Rz(yaw) Ry(pitch) Rx(roll) against the home pose."""

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class JointPlan:
    """A joint of a leg.

    Attributes:
        name: unique within the leg.
        kind: a key of `joints.JOINT_TYPES`.
        joins: names of the bodies on its base side and on its platform side.
        actuated: whether a servo holds it.
        sprung: whether it has a stiffness, as an actuator or a flexure hinge.
        compliance: its own compliance, rows rx ry rz x y z at its point, base axes at the home pose, SI; empty
            if it is stiff.
        series: keys of the parts that this stiffness is made of, in a row; empty if it is one number.
        seat: directions in which its bearings have a stiffness: some of `joints.SEAT`.
        motor: the freedom that is actuated, of a joint with several: a key of its type's `motors`; empty otherwise.
        preloaded: whether the file gives a preload of its spring.
        acts: "pulls" or "pushes" if its spring carries loads of one sign only; empty otherwise.
        rod: whether it is a strut whose rod stretches (`struts`).
        cross_section: name of the rod's cross-section; empty if its axial rigidity is given, or if there is no rod.
    """

    name: str
    kind: str
    joins: tuple[str, str]
    actuated: bool
    sprung: bool
    compliance: Matrix
    series: tuple[str, ...] = ()
    seat: tuple[str, ...] = ()
    motor: str = ""
    preloaded: bool = False
    acts: str = ""
    rod: bool = False
    cross_section: str = ""


@dataclass(frozen=True)
class LinkPlan:
    """A link between two consecutive joints of a leg.

    Attributes:
        name: the name of the body.
        model: a key of `LINK_MODELS`.
        cross_section: name of its cross-section, or empty.
        up: direction in which the cross-section's z axis points, base axes at the home pose; None to leave the choice.
        compliance: the compliance of model "matrix", as for a joint, at the link's end.
        weight: what the file gives of its mass, its centre and its inertia: keys of `tables.WEIGHT`.
    """

    name: str
    model: str
    cross_section: str
    up: tuple[float, float, float] | None
    compliance: Matrix
    weight: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Copies(Immutable):
    """Copies of a leg, as a file has them.

    Attributes:
        count: how many legs there are.
        angles: the angles by which they are turned about the z axis of the base, as written; empty for equal steps.
        mirrored: whether every other one is the mirror image of the one before.
    """

    count: int
    angles: tuple[object, ...]
    mirrored: bool


@dataclass(frozen=True, eq=False)
class LegPlan(Immutable):
    """A leg: its joints from base to platform, and those of its links that are flexible, by name.

    Attributes:
        name: unique within the machine.
        joints, links: its joints and links.
        idle, centred: see `leg.Leg`.
        inverse: closed form of its joint coordinates, if it has one.
        copy_of: name of the leg of the file that it is a copy of; empty if it is not a copy.
        copies: what the file says about that leg's copies.
        placement: the way the copy lies: a `copies.CopyPlacement`, whose file imports this one; None if not a copy.
    """

    name: str
    joints: tuple[JointPlan, ...]
    links: Mapping[str, LinkPlan]
    idle: tuple[int, ...] = ()
    centred: tuple[tuple[int, ...], ...] = ()
    inverse: Inverse | None = None
    copy_of: str = ""
    copies: Copies | None = None
    placement: Any = None

    def table(self, part: str) -> str:
        """Name of the table with the numbers of one of its joints or links."""
        return f"legs.{self.copy_of or self.name}.{part}"


@dataclass(frozen=True, eq=False)
class Plan(Immutable):
    """A machine written leg by leg.

    Attributes:
        legs: the legs in the order of the file.
        shapes: the shapes of the cross-sections, by name: keys of `cross_section.SHAPES`.
        materials: the materials of the cross-sections, by name: keys of `cross_section.MATERIALS`, or empty where E and
            G are given.
        pose: coordinates that the pose gives; the others follow from the legs.
        planar: whether the platform moves in the x-y plane only.
    """

    legs: tuple[LegPlan, ...]
    shapes: Mapping[str, str]
    materials: Mapping[str, str]
    pose: tuple[str, ...]
    planar: bool

    @property
    def legs_of_file(self) -> tuple[LegPlan, ...]:
        """The legs of the file, each once; its first copy stands for a leg that is copied."""
        first: dict[str, LegPlan] = {}
        for leg in self.legs:
            first.setdefault(leg.copy_of or leg.name, leg)
        return tuple(first.values())

    def __hash__(self) -> int:
        # A dictionary of machines asks often, and names tell most plans apart; equality compares all of them.
        return hash((tuple(leg.name for leg in self.legs), self.pose, self.planar))


def literals(plan: Plan) -> dict[str, dict[str, object]]:
    """Everything but numbers in machine files with this plan, by table, for writing such a file."""
    tables: dict[str, dict[str, object]] = {"": {"space": "planar" if plan.planar else "spatial"}}
    for name, shape in plan.shapes.items():
        material = plan.materials[name]
        tables[f"sections.{name}"] = {"shape": shape, **({"material": material} if material else {})}
    for leg in plan.legs_of_file:
        if leg.copies is not None:
            angles = {"angles": list(leg.copies.angles)} if leg.copies.angles else {}
            tables[f"legs.{leg.copy_of}"] = {"copies": leg.copies.count, **angles, "mirrored": leg.copies.mirrored}
        for joint in leg.joints:
            tables[leg.table(joint.name)] = _joint_literals(joint)
        for link in leg.links.values():
            tables[leg.table(link.name)] = _link_literals(link)
    return tables


def _joint_literals(joint: JointPlan) -> dict[str, object]:
    written: dict[str, object] = {"type": joint.kind, "joins": list(joint.joins)}
    if joint.actuated:
        written["actuated"] = joint.motor or True
    if joint.acts:
        written["acts"] = joint.acts
    if joint.compliance:
        written["compliance"] = [list(row) for row in joint.compliance]
    if joint.cross_section:
        written["section"] = joint.cross_section
    return written


def _link_literals(link: LinkPlan) -> dict[str, object]:
    written: dict[str, object] = {"model": link.model}
    if link.cross_section:
        written["section"] = link.cross_section
    if link.up:
        written["up"] = list(link.up)
    if link.compliance:
        written["compliance"] = [list(row) for row in link.compliance]
    return written
