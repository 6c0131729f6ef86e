"""A URDF file with its loops as a machine written leg by leg: its home pose is the one of zero joint coordinates.

What a chain of its joints becomes is `urdf_legs`' business.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kinetostat.exchange.urdf_file import Array, FileJoint, FileLoop, UrdfFile, read
from kinetostat.exchange.urdf_joints import TIP
from kinetostat.exchange.urdf_legs import LONGEST_NAME, leg_joints
from kinetostat.kinematics.mobility import task_coordinates
from kinetostat.machine.loading import as_toml, build
from kinetostat.machine.machine import Machine
from kinetostat.machine.written.family import NAME
from kinetostat.machine.written.plan import PLANAR_POSE, PLATFORM, SPATIAL_POSE
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.validation import SCHEMA_VERSION

OPEN = 1e-6
"""Gap, m, and angle, rad, of a loop above which it is open."""
CLOSING = ("fixed", "revolute", "continuous", "prismatic", "spherical")
"""Kinds of joints that may close a loop."""


def read_machine(path: Path) -> Machine:
    """The machine of a URDF file.

    Raises:
        InputError: what the file lacks, or what a machine of legs between a base and a platform cannot be.
    """
    file = read(path)
    document = document_of(file)
    machine = build(document, file.origin)
    home = machine.configure([0.0] * machine.chains().size)
    kept = [SPATIAL_POSE[number] for number in task_coordinates(home, home.platform.translation)] or ["x"]
    return build({**document, "pose": {name: document["pose"][name] for name in kept}}, file.origin)


def machine_text(path: Path) -> str:
    """A machine file that says the same as a URDF file.

    Raises:
        InputError: as `read_machine`.
    """
    return (
        f"# Read from {path.name}. The home pose is the one of zero joint coordinates; actuators of which the URDF\n"
        f"# gives no stiffness are rigid here.\n{as_toml(read_machine(path))}"
    )


def document_of(file: UrdfFile) -> Document:
    """The document of the machine, with all coordinates of its pose.

    Raises:
        InputError: if the file is not legs between the root link and a platform.
    """
    space = choice(file.about.get("space", "spatial"), ("spatial", "planar"), f'"{file.origin}": space')
    platform = file.about.get("platform", PLATFORM)
    if platform not in file.frames or platform == file.root:
        raise InputError(
            f'"{file.origin}": no link is called {shorten(platform)}; call the platform so, or name it with '
            '<kinetostat platform="..."/> in <robot>.'
        )
    rigid = _rigid_with(file, platform)
    ways = [(_path(file, platform), None), *((_path(file, _tip(file, loop, rigid)), loop) for loop in file.loops)]
    _check_apart(file, [path for path, _ in ways])
    names = [_leg_name(path, number) for number, (path, _) in enumerate(ways, 1)]
    legs = [
        {"name": name, "joints": leg_joints(name, path, loop, file.origin)}
        for name, (path, loop) in zip(names, ways, strict=True)
    ]
    point = file.frames[platform][:3, 3]
    given = PLANAR_POSE if space == "planar" else SPATIAL_POSE
    pose = {name: float(point["xyz".index(name)]) if name in "xyz" else 0.0 for name in given}
    document: Document = {"schema": SCHEMA_VERSION, "name": file.name, "family": NAME, "space": space, "pose": pose}
    document |= {"platform": {"point": point.tolist()}, "legs": legs}
    tool = file.about.get("tool", "tool")
    if tool in file.frames:
        document["tool"] = {"offset": _tool(file, tool, rigid, point)}
    return document


def _tool(file: UrdfFile, tool: str, rigid: set[str], point: Array) -> list[float]:
    if tool not in rigid:
        raise InputError(f'"{file.origin}": link {shorten(tool)}, the tool, must be fixed to the platform.')
    return [float(c) for c in file.frames[tool][:3, 3] - point]


def _path(file: UrdfFile, link: str) -> list[FileJoint]:
    """The joints from the root to a link."""
    found = []
    while link != file.root:
        found.append(file.joints[link])
        link = file.joints[link].parent
    return found[::-1]


def _rigid_with(file: UrdfFile, platform: str) -> set[str]:
    """The links that are fixed to the platform, itself among them."""
    found = {platform}
    growing = True
    while growing:
        fixed = [joint for joint in file.joints.values() if joint.kind == "fixed" and not joint.extension]
        pairs = [{joint.parent, joint.child} for joint in fixed]
        larger = found.union(*(pair for pair in pairs if pair & found))
        growing, found = larger != found, larger
    return found


def _tip(file: UrdfFile, loop: FileLoop, rigid: set[str]) -> str:
    """The link at the end of the leg that a loop holds to the platform."""
    where = f'"{file.origin}": loop {shorten(loop.name)}'
    tips = [link for link in loop.links if link not in rigid]
    if len(tips) != 1:
        raise InputError(
            f"{where} must close a leg onto the platform; a loop within a leg can only be a parallelogram, written as "
            'two revolutes, the second with <mimic multiplier="-1"/>.'
        )
    if loop.kind not in CLOSING:
        raise InputError(f"{where} is {shorten(loop.kind)}; it may be {', '.join(CLOSING)}.")
    first, second = loop.frames
    gap = float(np.linalg.norm(first[:3, 3] - second[:3, 3]))
    angle = float(np.linalg.norm(first[:3, :3] - second[:3, :3])) if loop.kind == "fixed" else 0.0
    if gap > OPEN or angle > OPEN:
        raise InputError(
            f"{where} is open by {gap:.3g} m and {angle:.3g} rad at zero joint coordinates; write the file at a pose "
            "in which its loops close."
        )
    return tips[0]


def _check_apart(file: UrdfFile, paths: Sequence[Sequence[FileJoint]]) -> None:
    """Refuse joints that move and that two legs share."""
    seen: set[str] = set()
    for path in paths:
        own = {joint.name for joint in path if joint.kind != "fixed" or joint.extension}
        if own & seen:
            raise InputError(
                f'"{file.origin}": joint {shorten(min(own & seen))} belongs to two legs; legs may share the base and '
                "the platform only."
            )
        seen |= own


def _leg_name(path: Sequence[FileJoint], number: int) -> str:
    """What our own files call the tip of a leg, else its number."""
    links = [joint.child for joint in path if joint.child.endswith(TIP)]
    return links[-1].removesuffix(TIP).replace(".", "-")[:LONGEST_NAME] if links else f"leg {number}"
