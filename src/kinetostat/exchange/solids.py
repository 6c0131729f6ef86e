"""The machine's solids at its pose as GLB (glTF 2.0) for 3-D viewers and slides, and as STEP for CAD programs.

The solids themselves are made by `views.scene`; Open CASCADE, which writes STEP, is imported only when STEP is wanted.

Source: Khronos Group, glTF 2.0 specification (2021), sections 3 (JSON) and 4 (GLB).
"""

import json
import math
import struct
from collections.abc import Collection
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.arrays import AnyArray
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.spec.installation import extra_command
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_bytes
from kinetostat.views.scene.machine_scene import scene_of
from kinetostat.views.scene.mesh import mesh_of
from kinetostat.views.scene.solids import LOOKS, Look, Scene, Shape, Solid, linear_rgb, matrix_columns

FLOAT, SHORT, INTEGER = 5126, 5123, 5125
"""Component types of glTF: float32, uint16, uint32 (section 3.6.2)."""
POINTS, INDICES = 34962, 34963
"""Targets of buffer views in glTF: attributes of points, and their indices (section 3.6.1)."""
ALIGNED = 4
"""Bytes at whose multiples parts of the file begin, as the format demands."""
GLB_VERSION = 2
"""Version of the container, which is that of glTF."""
HEADER_BYTES = 12
"""Bytes of the head of a GLB file: its mark, its version and its length, four each."""
Y_UP = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
"""Quaternion that turns the base frame's z, which is up, to glTF's y."""


def glb(scene: Scene, hidden: Collection[str] = ("frames",)) -> bytes:
    """Write a scene in metres with y up, one named node per solid; equal shapes share their triangles.

    Args:
        scene: solids to write; labels are left out.
        hidden: layers to leave out.
    """
    buffer = _Buffer()
    solids = [solid for solid in scene.solids if solid.layer not in hidden]
    materials = list(dict.fromkeys(solid.material for solid in solids))
    bodies = list(dict.fromkeys((solid.shape, solid.material) for solid in solids))
    primitives = {shape: buffer.primitive(shape) for shape in dict.fromkeys(solid.shape for solid in solids)}
    document = {
        "asset": {"version": "2.0", "generator": "kinetostat"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": "machine", "rotation": Y_UP, "children": list(range(1, len(solids) + 1))},
            *(_node(solid, bodies.index((solid.shape, solid.material))) for solid in solids),
        ],
        "meshes": [
            {"primitives": [{**primitives[shape], "material": materials.index(material)}]} for shape, material in bodies
        ],
        "materials": [_material(name, LOOKS[name]) for name in materials],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return _container(document, bytes(buffer.data))


class _Buffer:
    """Points and triangles as bytes, with their descriptions for glTF."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def primitive(self, shape: Shape) -> dict[str, Any]:
        """Return the triangles of a shape, without a material."""
        mesh = mesh_of(shape)
        points, indices = mesh.points.astype("<f4"), mesh.triangles.ravel()
        dtype, component = ("<u2", SHORT) if len(points) <= np.iinfo(np.uint16).max else ("<u4", INTEGER)
        extent = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        return {
            "attributes": {
                "POSITION": self._append(points, "VEC3", FLOAT, POINTS, **extent),
                "NORMAL": self._append(mesh.normals.astype("<f4"), "VEC3", FLOAT, POINTS),
            },
            "indices": self._append(indices.astype(dtype), "SCALAR", component, INDICES),
        }

    def _append(self, array: AnyArray, kind: str, component: int, target: int, **more: Any) -> int:
        """Append data, and return the number of its accessor."""
        content = array.tobytes()
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content), "target": target}
        self.views.append(view)
        self.data += content + bytes(-len(content) % ALIGNED)
        accessor = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(array), "type": kind}
        self.accessors.append({**accessor, **more})
        return len(self.accessors) - 1


def _node(solid: Solid, mesh: int) -> dict[str, Any]:
    """Return a solid at its place: the columns of its 4 x 4 matrix."""
    *axes, origin = (list(map(float, column.components())) for column in matrix_columns(solid))
    matrix = [number for axis in axes for number in (*axis, 0.0)]
    return {"name": solid.name, "mesh": mesh, "matrix": [*matrix, *origin, 1.0]}


def _material(name: str, look: Look) -> dict[str, Any]:
    surface = {
        "baseColorFactor": [*linear_rgb(look.color), look.opacity],
        "metallicFactor": look.metalness,
        "roughnessFactor": look.roughness,
    }
    translucent = look.opacity < 1.0
    return {
        "name": name,
        "pbrMetallicRoughness": surface,
        "alphaMode": "BLEND" if translucent else "OPAQUE",
        "doubleSided": not translucent,
    }


def _container(document: dict[str, Any], data: bytes) -> bytes:
    """Return JSON and one buffer as a GLB container."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % ALIGNED)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", GLB_VERSION, HEADER_BYTES + len(chunks)) + chunks


def machine_glb(machine: Machine) -> bytes:
    """Write the solids of a machine at its pose as glTF; see `glb`."""
    return glb(scene_of(machine))


def write_glb(analysis: Analysis, path: Path) -> list[Path]:
    """Write the machine at its pose as binary glTF: metres, y up."""
    return _write(machine_glb(analysis.machine), path)


def write_step(analysis: Analysis, path: Path) -> list[Path]:
    """Write the machine at its pose as STEP: mm, z up.

    Raises:
        InputError: Open CASCADE is not installed, or lacks a library of the system.
    """
    return _write(_step_writer().step_bytes(scene_of(analysis.machine), analysis.machine.name), path)


def _write(content: bytes, path: Path) -> list[Path]:
    write_bytes(path, content)
    return [path]


def _step_writer() -> Any:
    """Return the module that writes STEP, whose library is large and optional."""
    if find_spec("OCP") is None:
        command = extra_command("cad")
        raise InputError(f"STEP needs Open CASCADE, which is not installed; install it with `{command}`.")
    try:
        return import_module("kinetostat.exchange.step_file")
    except ImportError as error:
        raise InputError(
            f"STEP needs Open CASCADE, which does not start: {error}. On Debian and Ubuntu: apt-get install libgl1 "
            "libx11-6."
        ) from None
