"""A URDF file as links, joints and loops with their places at zero joint coordinates.

Files may come from anywhere: no document type is accepted, so that no entity can be defined, let alone expanded, and
size and counts are bounded. What a machine makes of the data is decided in `urdf_import`.
"""

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.common_tables import is_tensor_of_body
from kinetostat.machine.parameters import TENSOR
from kinetostat.spec.document import LARGEST_FILE
from kinetostat.spec.errors import InputError, shorten
from kinetostat.validation.pieces import Heavy, matrix_of

MOST_JOINTS = 2000
"""Most joints of a file: a hundred times those of a hexapod, so that more is a mistake or an attack."""
AXISLESS = ("fixed", "spherical")
"""Kinds of joints whose axis, often written as 0 0 0, has no meaning."""
LARGEST_NUMBER = 1e100
"""Bound of the size of every number in a file: products of three, such as a mass times a squared length, are finite."""


@dataclass(frozen=True)
class FileJoint:
    """A joint of the file, placed at zero joint coordinates.

    Attributes:
        name, kind: its name and kind as written.
        parent, child: names of its links.
        frame: its frame, which is that of its child as well, in the root link's frame, m [4 x 4].
        axis: unit vector in the root link's frame; without meaning for a fixed joint.
        actuated: whether it is driven, by a <transmission>, `independent`, or as its extension says.
        mimics: name and multiplier of the joint that it follows, None if it follows none.
        extension: attributes of its element <kinetostat>.
    """

    name: str
    kind: str
    parent: str
    child: str
    frame: Array
    axis: Array
    actuated: bool
    mimics: tuple[str, float] | None
    extension: dict[str, str]


@dataclass(frozen=True)
class FileLoop:
    """A closed loop: two links, the frame of the joint between them as seen from each [4 x 4], and its axis."""

    name: str
    kind: str
    links: tuple[str, str]
    frames: tuple[Array, Array]
    axis: Array


@dataclass(frozen=True)
class UrdfFile:
    """The content of a file.

    Attributes:
        origin: name of the file, for messages.
        name: the name of the robot.
        extension: attributes of the element <kinetostat> of the robot.
        root: name of the link that hangs on no joint.
        joints: the joints by name of their child link.
        frames: the frames of every link in the root link's frame, m [4 x 4].
        loops: the loops in the order of the file.
        masses: the masses of the links that have one, in the root link's frame, by name.
    """

    origin: str
    name: str
    extension: dict[str, str]
    root: str
    joints: dict[str, FileJoint]
    frames: dict[str, Array]
    loops: tuple[FileLoop, ...]
    masses: dict[str, Heavy]


class _NoDocumentType(TreeBuilder):
    """Build elements, and refuse a document type, in which entities could be defined."""

    def doctype(self, name: str, *_identifiers: str | None) -> None:
        """Refuse it."""
        raise InputError(f"The file declares a document type ({shorten(name)}); remove the line <!DOCTYPE ...>.")


def read(path: Path) -> UrdfFile:
    """Return the links, joints and loops of a file.

    Raises:
        InputError: there is no such file, it is too large, not XML or not URDF, or a joint or number makes no sense.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f'"{path}" cannot be read: {error.strerror}.') from None
    if len(data) > LARGEST_FILE:
        raise InputError(f'"{path}" is larger than {LARGEST_FILE >> 20} MiB; keep meshes out of the file.')
    return parse(data, str(path))


def parse(data: bytes, origin: str) -> UrdfFile:
    """Return the links, joints and loops from the bytes of a file; `origin` names it in messages.

    Raises:
        InputError: it is not XML or not URDF, or a joint or number makes no sense.
    """
    parser = XMLParser(target=_NoDocumentType())
    try:
        parser.feed(data)
        robot = parser.close()
    except (ParseError, LookupError, ValueError) as error:
        reason = str(error) if isinstance(error, InputError) else f"it is not XML: {error}."
        raise InputError(f'"{origin}": {reason}') from None
    if robot.tag != "robot":
        raise InputError(f'"{origin}" is not a URDF: its root is <{robot.tag}>, not <robot>.')
    return _Reader(robot, origin).read()


class _Reader:
    """A file while it is read."""

    def __init__(self, robot: Element, origin: str) -> None:
        self._robot, self._origin = robot, origin
        self._links = [self._text(link, "name", "a link") for link in robot.findall("link")]
        name, count = next(iter(Counter(self._links).most_common(1)), ("", 0))
        if count > 1:
            raise InputError(f'"{origin}" defines the link {shorten(name)} twice; give each link a name of its own.')
        self._elements = robot.findall("joint")
        self._joints_with_transmission = {joint.get("name") for joint in robot.findall("transmission/joint")}
        if not 1 <= len(self._elements) <= MOST_JOINTS:
            raise InputError(f'"{origin}" has {len(self._elements)} joints; it needs 1 to {MOST_JOINTS:,}.')

    def read(self) -> UrdfFile:
        """Return everything, placed from the root outwards."""
        root, children = self._tree()
        joints, frames = self._place_joints(root, children)
        return UrdfFile(
            origin=self._origin,
            name=self._robot.get("name", "machine"),
            extension=_extension(self._robot),
            root=root,
            joints=joints,
            frames=frames,
            loops=tuple(self._loops(frames)),
            masses=dict(self._masses(frames)),
        )

    def _tree(self) -> tuple[str, dict[str, list[Element]]]:
        """Return the link that hangs on no joint, and the joints that hang on each link.

        Raises:
            InputError: a link hangs on two joints, or several on none.
        """
        children: dict[str, list[Element]] = {}
        all_children: set[str] = set()
        for element in self._elements:
            where = self._where(element)
            parent, child = (self._link(element, end, where) for end in ("parent", "child"))
            if child in all_children:
                raise InputError(
                    f"{where}: link {shorten(child)} is the child of two joints; close the loop with <loop>."
                )
            all_children.add(child)
            children.setdefault(parent, []).append(element)
        roots = [link for link in self._links if link not in all_children]
        if len(roots) != 1:
            raise InputError(
                f'"{self._origin}" has {len(roots)} links that are not the child of a joint; it needs one, the base.'
            )
        return roots[0], children

    def _place_joints(
        self, root: str, children: dict[str, list[Element]]
    ) -> tuple[dict[str, FileJoint], dict[str, Array]]:
        """Place joints and links from the root outwards; return the joints by their children, and all frames.

        Raises:
            InputError: a link cannot be reached from the root.
        """
        frames: dict[str, Array] = {root: np.eye(4)}
        joints: dict[str, FileJoint] = {}
        pending = [root]
        while pending:
            parent = pending.pop()
            for element in children.get(parent, ()):
                joint = self._joint(element, parent, frames[parent])
                joints[joint.child], frames[joint.child] = joint, joint.frame
                pending.append(joint.child)
        if len(frames) < len(self._links):
            unreached = next(link for link in self._links if link not in frames)
            raise InputError(
                f'"{self._origin}": link {shorten(unreached)} is on a closed chain of joints; joints must form a tree, '
                "and a loop is closed with <loop>."
            )
        return joints, frames

    def _masses(self, frames: dict[str, Array]) -> Iterator[tuple[str, Heavy]]:
        """Give the mass of each link that has one, from its element <inertial>."""
        for link, name in zip(self._robot.findall("link"), self._links, strict=True):
            where = f'"{self._origin}": link {shorten(name)}: inertial'
            inertial = link.find("inertial")
            if inertial is None:
                continue
            frame = frames[name] @ self._placement(inertial.find("origin"), where)
            mass_element, inertia = inertial.find("mass"), inertial.find("inertia")
            mass_text = "0" if mass_element is None else mass_element.get("value", "0")
            (mass,) = numbers(mass_text, 1, f"{where}: mass")
            entries = " ".join("0" if inertia is None else inertia.get(f"i{entry}", "0") for entry in TENSOR)
            tensor = numbers(entries, 6, f"{where}: inertia")
            if mass < 0.0 or not is_tensor_of_body(tensor):
                raise InputError(
                    f"{where} has the mass {mass:g} and the inertia {shorten(entries)} ({' '.join(TENSOR)}), which no "
                    "body has; correct them, or remove <inertial>."
                )
            if mass > 0.0:
                rotation = frame[:3, :3]
                yield name, Heavy(mass, frame[:3, 3], rotation @ matrix_of(tensor) @ rotation.T)

    def _joint(self, element: Element, parent: str, parent_frame: Array) -> FileJoint:
        where = self._where(element)
        frame = parent_frame @ self._placement(element.find("origin"), where)
        extension = _extension(element)
        name = self._text(element, "name", "a joint")
        is_marked = "true" in (element.get("independent"), extension.get("actuated"))
        return FileJoint(
            name=name,
            kind=self._text(element, "type", where),
            parent=parent,
            child=self._link(element, "child", where),
            frame=frame,
            axis=frame[:3, :3] @ self._axis(element, where),
            actuated=name in self._joints_with_transmission or is_marked,
            mimics=self._mimics(element, where),
            extension=extension,
        )

    def _mimics(self, element: Element, where: str) -> tuple[str, float] | None:
        mimic = element.find("mimic")
        if mimic is None:
            return None
        return self._text(mimic, "joint", where), numbers(mimic.get("multiplier", "1"), 1, f"{where}: multiplier")[0]

    def _loops(self, frames: dict[str, Array]) -> Iterator[FileLoop]:
        for element in self._robot.findall("loop"):
            where = f'"{self._origin}": loop {shorten(element.get("name", ""))}'
            links, loop_frames = [], []
            for end in map(element.find, ("predecessor", "successor")):
                link = None if end is None else end.get("link", end.get("name"))
                if end is None or link not in frames:
                    raise InputError(f"{where} must name two links of the file, as <predecessor> and <successor>.")
                links.append(link)
                loop_frames.append(frames[link] @ self._placement(end.find("origin"), where))
            yield FileLoop(
                name=self._text(element, "name", "a loop"),
                kind=element.get("type", "fixed"),
                links=(links[0], links[1]),
                frames=(loop_frames[0], loop_frames[1]),
                axis=loop_frames[0][:3, :3] @ self._axis(element, where),
            )

    def _where(self, element: Element) -> str:
        return f'"{self._origin}": joint {shorten(element.get("name", ""))}'

    def _text(self, element: Element, key: str, where: str) -> str:
        value = element.get(key, "").strip()
        if not value:
            prefix = where if where.startswith('"') else f'"{self._origin}": {where}'
            raise InputError(f"{prefix} has no {key}; please add it.")
        return value

    def _link(self, element: Element, end: str, where: str) -> str:
        reference = element.find(end)
        link = "" if reference is None else reference.get("link", "")
        if link not in self._links:
            raise InputError(f"{where}: its {end} link is {shorten(link)}, which the file does not define.")
        return link

    def _axis(self, element: Element, where: str) -> Array:
        child = element.find("axis")
        axis = np.array(numbers("1 0 0" if child is None else child.get("xyz", "1 0 0"), 3, f"{where}: axis"))
        size = float(np.linalg.norm(axis))
        if size == 0.0 and element.get("type") not in AXISLESS:
            raise InputError(f'{where}: its axis has no length; give a direction, e.g. <axis xyz="0 0 1"/>.')
        return axis / (size or 1.0)

    def _placement(self, element: Element | None, where: str) -> Array:
        """Return the frame that xyz (m) and rpy (rad, fixed axes) describe [4 x 4]."""
        frame = np.eye(4)
        if element is not None:
            frame[:3, 3] = numbers(element.get("xyz", "0 0 0"), 3, f"{where}: xyz")
            frame[:3, :3] = _rotation(*numbers(element.get("rpy", "0 0 0"), 3, f"{where}: rpy"))
        return frame


def _extension(element: Element) -> dict[str, str]:
    """Return the attributes of the element <kinetostat> within another one."""
    extension = element.find("kinetostat")
    return {} if extension is None else dict(extension.attrib)


def numbers(text: str, count: int, where: str) -> list[float]:
    """Read `count` finite numbers from a text with blanks between them.

    Raises:
        InputError: other words, or more or fewer numbers.
    """
    try:
        result = [float(word) for word in text.split()]
    except ValueError:
        result = []
    if len(result) != count or not all(math.isfinite(c) and abs(c) < LARGEST_NUMBER for c in result):
        wanted = "a number" if count == 1 else f"{count} numbers"
        raise InputError(f"{where} is {shorten(text)}; it must be {wanted} in SI units.")
    return result


def _rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Return Rz(yaw) Ry(pitch) Rx(roll) [3 x 3]."""
    (cos_x, sin_x), (cos_y, sin_y), (cos_z, sin_z) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cos_x, -sin_x], [0, sin_x, cos_x]])
    about_y = np.array([[cos_y, 0, sin_y], [0, 1, 0], [-sin_y, 0, cos_y]])
    about_z = np.array([[cos_z, -sin_z, 0], [sin_z, cos_z, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)
