"""The same machine written otherwise: turned and shifted, in other units, legs in another order, links as matrices.

Works on documents of `grown_machines`, numbers in SI; what must come out the same is `laws`' business.
"""

import copy
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from grown_legs import rotation, unit

from kinetostat.arrays import Array
from kinetostat.machine.cross_section import MATERIALS
from kinetostat.machine.written.joints import stiffness_kind

Document = dict[str, Any]

POINTS = ("point", "far", "centre_of_mass", "from", "to")
DIRECTIONS = ("axis", "first_axis", "second_axis", "up")
OF_PLATFORM = ("offset", "centre_of_mass", "payload_centre")
"""Points of the table [tool], in platform axes."""


def turned(document: Document, placement: tuple[Any, Any], turn: Array, shift: Array) -> Document:
    """The machine in a base frame that is turned and shifted.

    Args:
        document: of the machine.
        placement: position (m) and rows of the rotation of its platform at its pose.
        turn: the rotation [3 x 3].
        shift: of what is turned, m.
    """
    result = copy.deepcopy(document)
    result["platform"]["point"] = (turn @ result["platform"]["point"] + shift).tolist()
    position, orientation = turn @ placement[0] + shift, turn @ np.array(placement[1]) @ turn.T
    names = ("x", "y", "yaw") if document.get("space") == "planar" else ("x", "y", "z", "roll", "pitch", "yaw")
    pose = dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), [*position.tolist(), *angles(orientation)], strict=True))
    result["pose"] = {name: pose[name] for name in names}
    for table in _tables(result):
        for name in table.keys() & {*POINTS}:
            table[name] = (turn @ table[name] + shift).tolist()
        for name in table.keys() & {*DIRECTIONS}:
            table[name] = (turn @ table[name]).tolist()
        if "compliance" in table:
            both = np.kron(np.eye(2), turn)
            table["compliance"] = symmetric(both @ full(table["compliance"]) @ both.T)
        if "inertia" in table:
            table["inertia"] = _turned_tensor(table["inertia"], turn)
    tool, load = result.get("tool", {}), result.get("load", {})
    for table, names in ((tool, OF_PLATFORM), (load, ("force", "moment", "gravity"))):
        for name in table.keys() & {*names}:
            table[name] = (turn @ table[name]).tolist()
    if "inertia" in tool:
        tool["inertia"] = _turned_tensor(tool["inertia"], turn)
    return result


def _tables(document: Document) -> list[Document]:
    """Tables of all cables, joints and links."""
    ropes = [leg for leg in document["legs"] if "type" in leg]
    chains = [leg for leg in document["legs"] if "joints" in leg]
    return [*ropes, *(t for leg in chains for t in (*leg["joints"], *leg.get("links", {}).values()))]


def angles(turn: Array) -> list[float]:
    """Roll, pitch and yaw of Q = Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0]))
    return [math.atan2(turn[2, 1], turn[2, 2]), pitch, math.atan2(turn[1, 0], turn[0, 0])]


def full(compliance: list[Any]) -> Array:
    """A compliance as 6x6, written as that or as its diagonal."""
    array = np.array(compliance, dtype=float)
    return np.diag(array) if array.ndim == 1 else array


def symmetric(matrix: Array) -> list[list[float]]:
    """A matrix without the round-off that makes it unsymmetric, as rows."""
    return ((matrix + matrix.T) / 2.0).tolist()


def _turned_tensor(entries: list[float], turn: Array) -> list[float]:
    xx, yy, zz, xy, xz, yz = entries
    t = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    return [float(t[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


POWERS = {
    "pitch": (1, 0), "width": (1, 0), "bar_stiffness": (-1, 1), "height": (1, 0), "diameter": (1, 0),
    "outer_diameter": (1, 0), "inner_diameter": (1, 0), "area": (2, 0), "second_moment_y": (4, 0),
    "second_moment_z": (4, 0), "torsion_constant": (4, 0), "youngs_modulus": (-2, 1), "shear_modulus": (-2, 1),
    "density": (-4, 1), "mass": (-1, 1), "inertia": (1, 1), "stiffness_radial": (-1, 1), "stiffness_axial": (-1, 1),
    "stiffness_tilt": (1, 1), "stiffness_torsion": (1, 1), "offset": (1, 0), "force": (0, 1), "moment": (1, 1),
    "gravity": (1, 0), **dict.fromkeys((*POINTS, *OF_PLATFORM), (1, 0)),
}  # fmt: skip
"""Powers of the units of length and of force in what a file says; the second stays, so that masses follow."""
PRELOADS = {"linear stiffness": (0, 1), "torsional stiffness": (1, 1)}
STIFFNESSES = {"linear stiffness": (-1, 1), "torsional stiffness": (1, 1)}


def in_other_units(document: Document, metre: float, newton: float) -> Document:
    """The machine in units of length and force that are so many times as small."""
    result = copy.deepcopy(document)
    result["pose"] |= {name: result["pose"][name] * metre for name in result["pose"].keys() & {"x", "y", "z"}}
    sections = result.get("sections", {}).values()
    for table in sections:
        if "material" in table:
            known = MATERIALS[table.pop("material")]
            moduli = {name: getattr(known, name) for name in ("youngs_modulus", "shear_modulus", "density")}
            table |= {**moduli, **table}
    for table in (result["platform"], *sections, *_tables(result), result.get("tool", {}), result.get("load", {})):
        table |= _sized_table(table, metre, newton)
    return result


def _sized_table(table: Document, metre: float, newton: float) -> Document:
    """What changes of a table."""
    powers = {name: POWERS[name] for name in table.keys() & POWERS.keys()}
    if "stiffness" in table:
        powers |= {"stiffness": STIFFNESSES[_kind(table)], "preload": PRELOADS[_kind(table)]}
    sized = {name: _sized(table[name], metre**m * newton**n) for name, (m, n) in powers.items() if name in table}
    if "compliance" in table:
        unit_of = np.repeat([1.0, metre], 3)
        sized["compliance"] = symmetric(full(table["compliance"]) * np.outer(unit_of, unit_of) / (metre * newton))
    return sized


def _sized(value: Any, factor: float) -> Any:
    if isinstance(value, list):
        return [_sized(entry, factor) for entry in value]
    if isinstance(value, dict):
        return {name: _sized(entry, factor) for name, entry in value.items()}
    return value if isinstance(value, str) else value * factor


def _kind(table: Document) -> str:
    """Kind of the stiffness of a joint or a cable."""
    if table["type"] == "cable":
        return "linear stiffness"
    motor = table.get("actuated", "")
    return stiffness_kind(table["type"], motor if isinstance(motor, str) else "")


def with_matrices(document: Document) -> Document:
    """The machine with the 6x6 of each beam in its place, by formulas of its own; masses stay."""
    result = copy.deepcopy(document)
    for leg in result["legs"]:
        for k, joint in enumerate(leg.get("joints", [])[:-1]):
            link = leg.get("links", {}).get(joint["joins"][1], {})
            if link.get("model") in ("lumped", "beam", "timoshenko"):
                start, end = np.array(joint.get("far", joint["point"])), np.array(leg["joints"][k + 1]["point"])
                stiff = _moduli(result["sections"][link["section"]])
                up = link.pop("up", np.eye(3)[int(np.argmin(abs(end - start)))])
                link["compliance"] = symmetric(beam(end - start, np.array(up), stiff, link["model"]))
                link["model"] = "matrix"
    return result


def _moduli(section: Document) -> dict[str, float]:
    """E A, G J, E I about y and z, and the shear stiffness of a cross-section."""
    known = MATERIALS.get(section.get("material", ""))
    young = section.get("youngs_modulus", known and known.youngs_modulus)
    shear = section.get("shear_modulus", known and known.shear_modulus)
    poisson, factor = young / (2.0 * shear) - 1.0, 5.0 / 6.0
    if section["shape"] == "own":
        names = ("area", "second_moment_y", "second_moment_z", "torsion_constant")
        area, about_y, about_z, torsion = (section[name] for name in names)
    elif section["shape"] == "rectangle":
        width, height = section["width"], section["height"]
        area, about_y, about_z = width * height, width * height**3 / 12.0, height * width**3 / 12.0
        a, b = max(width, height) / 2.0, min(width, height) / 2.0
        torsion = a * b**3 * (16.0 / 3.0 - 3.36 * b / a * (1.0 - b**4 / (12.0 * a**4)))
    else:
        outer, inner = section.get("diameter", section.get("outer_diameter")), section.get("inner_diameter", 0.0)
        area, about_y = math.pi / 4.0 * (outer**2 - inner**2), math.pi / 64.0 * (outer**4 - inner**4)
        about_z, torsion, m = about_y, 2.0 * about_y, (inner / outer) ** 2
        below = (7.0 + 6.0 * poisson) * (1.0 + m) ** 2 + (20.0 + 12.0 * poisson) * m
        factor = 6.0 * (1.0 + poisson) * (1.0 + m) ** 2 / below
    bending = {"y": young * about_y, "z": young * about_z}
    return {"axial": young * area, "torsion": shear * torsion, "shear": factor * shear * area, **bending}


def beam(span: Array, up: Array, stiff: dict[str, float], model: str) -> Array:
    """The compliance of the end of a beam against its clamped beginning, at the end, base axes [6 x 6]."""
    length, along = float(np.linalg.norm(span)), unit(span)
    side = unit(np.cross(up, along))
    axes = np.array([along, side, np.cross(along, side)]).T
    c = np.zeros((6, 6))
    c[0, 0], c[3, 3] = length / stiff["torsion"], length / stiff["axial"]
    turns, bends = (3.0, 3.0) if model == "lumped" else (1.0, 2.0)  # as springs where it begins, or along its length
    for tip, about, sign in ((4, 2, 1.0), (5, 1, -1.0)):
        flexible = stiff["z"] if about == 2 else stiff["y"]
        c[about, about] = length / (turns * flexible)
        c[tip, about] = c[about, tip] = sign * length**2 / (bends * flexible)
        c[tip, tip] = length**3 / (3.0 * flexible) + (length / stiff["shear"] if model == "timoshenko" else 0.0)
    both = np.kron(np.eye(2), axes)
    return both @ c @ both.T


def reordered(document: Document, order: Callable[[list[Any]], None]) -> Document:
    """The machine with its legs in another order."""
    result = copy.deepcopy(document)
    order(result["legs"])
    return result


def quarter(rng: Any, planar: bool) -> Array:
    """A random rotation; about z where the machine is planar."""
    axis = np.array([0.0, 0.0, 1.0]) if planar else np.array([rng.gauss(0.0, 1.0) for _ in range(3)])
    return rotation(axis, rng.uniform(-math.pi, math.pi))
