"""Random overconstrained machines: six mechanisms with rigid, elastic and contrasting parts, as texts of machine files.

A draw changes what each link, bearing, hinge and drive is made of, where the tool is, how the machine is turned and how
large it is, the order of its legs, and the pose. All numbers are exact decimals, so that what is parallel in the
mechanism is parallel in the file.
"""

import tomllib
from collections.abc import Mapping, Sequence
from decimal import Decimal
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from exact_engine import POSE, Closed, Machine, UnsuitablePoseError, exactly, numbers

CASES = Path(__file__).parent / "cases"
MECHANISMS = {
    "agile eye": ("ideal-links-agile-eye", 3),
    "Exechon": ("ideal-links-exechon", 3),
    "R-Pa-R Delta": ("ideal-links-delta", 3),
    "Tripteron": ("loaded-tripteron", 3),
    "Bennett loop": ("bennett", 1),
    "three P-U-U": ("three-puu", 3),
}
"""Files with their geometry, and the freedoms of their platforms."""
TURNS = [
    (w, x, y, z)
    for w in range(7)
    for x in range(-6, 7)
    for y in range(-6, 7)
    for z in range(-6, 7)
    if w * w + x * x + y * y + z * z in (10, 20, 25, 40, 50)
]
"""Quaternions of rotations whose matrices are finite decimals."""
SEATS = {
    "revolute": ("radial", "axial", "tilt"),
    "universal": ("radial", "axial", "torsion"),
    "prismatic": ("radial", "tilt", "torsion"),
}
TRIES = 40
LEAST_MODULUS = 10.0
"""Pa; files may not say less than 1."""


class Draw:
    """A random machine of a mechanism.

    Attributes:
        text: of its file.
        closed: the same, closed by the exact engine.
    """

    @exactly
    def __init__(self, mechanism: str, seed: int, hinges: bool = True) -> None:
        name, self.freedoms = MECHANISMS[mechanism]
        self.random = np.random.default_rng([seed, *map(ord, mechanism)])
        tables = tomllib.loads((CASES / f"{name}.toml").read_text("utf-8"), parse_float=Decimal)
        self.turn = self._rotation() if self.random.random() < 0.7 else numbers(np.eye(3, dtype=int).tolist())
        self.scale = self._decimal(10 ** self.random.uniform(-1.5, 1.5)) if self.random.random() < 0.5 else Decimal(1)
        style = self.random.choice(["drives", "few", "many"])
        self.hinges = hinges
        self.chance = {"drives": 0.0, "few": 0.2, "many": 0.7}[style]
        self.force = 10 ** self.random.uniform(4, 8)
        self.reach = float(self.scale) * 0.5
        self.sections: dict[str, dict[str, Any]] = {}
        legs = [self._leg(_exact(leg)) for leg in tables["legs"]]
        self.random.shuffle(legs)
        tool = [self._decimal(c) for c in self.random.uniform(-0.5, 0.5, 3) * self.reach]
        self.tables = {
            "schema": 1,
            "name": f"{mechanism} {seed}",
            "family": "legs",
            "platform": {"point": self._placed(tables["platform"]["point"])},
            "sections": self.sections,
            "tool": {"offset": tool if self.random.random() < 0.8 else [Decimal(0)] * 3},
            "legs": legs,
        }
        self.closed = self._pose()
        given = self.closed.pose if self.random.random() < 0.4 else self.closed.given
        self.text = written(self.tables | {"pose": given})

    @staticmethod
    def _decimal(value: float) -> Decimal:
        return Decimal(f"{value:.6g}")

    def _rotation(self) -> Any:
        w, x, y, z = TURNS[self.random.integers(len(TURNS))]
        rows = [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
        return numbers(rows) / (w * w + x * x + y * y + z * z)

    def _placed(self, point: Sequence[Any]) -> Any:
        return list(self.turn @ numbers(point) * self.scale)

    def _turned(self, axis: Sequence[Any]) -> Any:
        return list(self.turn @ numbers(axis))

    def _stiffness(self, turning: bool, chance: float) -> Decimal | None:
        """Of a part in N/m or N m/rad; None if it is rigid."""
        if self.random.random() >= chance:
            return None
        contrast = self.random.uniform(-6, 6) if self.random.random() < 0.5 else self.random.uniform(-0.5, 0.5)
        return self._decimal(self.force * 10**contrast * (self.reach**2 if turning else 1.0))

    def _leg(self, leg: Mapping[str, Any]) -> dict[str, Any]:
        joints = [self._joint(joint) for joint in leg["joints"]]
        links = {}
        for joint, following in pairwise(joints):
            start = joint.get("far", joint["point"])
            if start != following["point"] and self.random.random() < self.chance:
                links[joint["joins"][1]] = self._link()
        return {"name": leg["name"], "joints": joints} | ({"links": links} if links else {})

    def _joint(self, old: Mapping[str, Any]) -> dict[str, Any]:
        kind = old["type"]
        joint = {key: old[key] for key in ("name", "type", "joins")}
        joint |= {key: self._placed(old[key]) for key in ("point", "far") if key in old}
        joint |= {key: self._turned(old[key]) for key in ("axis", "first_axis", "second_axis") if key in old}
        if kind == "parallelogram":
            joint["width"] = Decimal(old["width"]) * self.scale
            joint["bar_stiffness"] = self._stiffness(False, self.chance) or "rigid"
        elif old.get("actuated"):
            joint |= {"actuated": True, "stiffness": self._stiffness(kind == "revolute", 0.8) or "rigid"}
        elif kind == "revolute" and self.random.random() < 0.2 * self.chance * self.hinges:
            joint["stiffness"] = self._stiffness(True, 1.0)
        if self.random.random() < self.chance and kind != "parallelogram":
            joint |= self._bearings(joint)
        return joint

    def _bearings(self, joint: Mapping[str, Any]) -> dict[str, Any]:
        kind = joint["type"]
        if kind in SEATS and self.random.random() < 0.7:
            ways = [way for way in SEATS[kind] if self.random.random() < 0.6]
            return {f"stiffness_{way}": self._stiffness(way in ("tilt", "torsion"), 1.0) for way in ways}
        if kind == "prismatic":
            return {}
        common = self._stiffness(False, 1.0)
        assert common is not None
        units = [1 / Decimal(self.reach) ** 2] * 3 + [Decimal(1)] * 3
        sizes = [self._decimal(c) for c in self.random.uniform(0.1, 10, 6) * (self.random.random(6) < 0.6)]
        soft = [+(a * b / common) for a, b in zip(sizes, units, strict=True)]
        if (self.turn == numbers(np.eye(3, dtype=int).tolist())).all():
            return {"compliance": [self._decimal(float(c)) for c in soft]}
        whole = numbers(np.zeros((6, 6), dtype=int).tolist())
        for block, part in ((slice(3), soft[:3]), (slice(3, 6), soft[3:])):
            whole[block, block] = self.turn @ (np.diag(numbers([self._decimal(float(c)) for c in part])) @ self.turn.T)
        return {"compliance": whole.tolist()}

    def _link(self) -> dict[str, Any]:
        name = f"bar{len(self.sections)}"
        model = str(self.random.choice(["lumped", "beam", "timoshenko"]))
        diameter = self.reach * self.random.uniform(0.02, 0.2)
        stiffness = self._stiffness(False, 1.0)
        assert stiffness is not None
        young = float(stiffness) * self.reach / diameter**2
        section: dict[str, Any] = {
            "youngs_modulus": self._decimal(max(young, LEAST_MODULUS)),
            "shear_modulus": self._decimal(max(young, LEAST_MODULUS) / self.random.uniform(2.2, 3.0)),
        }
        shape = str(self.random.choice(["round", "tube", "own"]))
        if shape == "round":
            section |= {"diameter": self._decimal(diameter)}
        elif shape == "tube":
            section |= {
                "outer_diameter": self._decimal(diameter),
                "inner_diameter": self._decimal(diameter * self.random.uniform(0.3, 0.95)),
            }
        else:
            sizes = self.random.uniform(0.2, 1.0, 3) * diameter**4
            names = ("second_moment_y", "second_moment_z", "torsion_constant")
            section |= {"area": self._decimal(diameter**2)}
            section |= {key: self._decimal(size) for key, size in zip(names, sizes, strict=True)}
        self.sections[name] = {"shape": shape} | section
        return {"model": model, "section": name, "up": [self._decimal(c) for c in self.random.normal(size=3)]}

    def _pose(self) -> Closed:
        """The legs closed at a random pose that is away from singularities."""
        machine = Machine(written(self.tables))
        motions = Closed(machine, {}, steps=0).motions()
        assert motions.shape[1] == self.freedoms
        ways = {chosen: np.linalg.svd(motions[list(chosen)])[1][-1] for chosen in combinations(range(6), self.freedoms)}
        good = [chosen for chosen, least in ways.items() if least > 0.5 * max(ways.values())]
        size = float(machine.size)
        for attempt in range(TRIES):
            amplitude = 0.8 * 0.92**attempt
            chosen = good[self.random.integers(len(good))]
            pose = {}
            for i in chosen:
                amount = amplitude * self.random.uniform(-1, 1) * (0.5 * size if i < 3 else 1.0)
                pose[POSE[i]] = self._decimal(amount + (float(machine.home[i]) if i < 3 else 0.0))
            try:
                return Closed(machine, pose)
            except UnsuitablePoseError:
                continue
        raise UnsuitablePoseError(f"no pose of {self.tables['name']} in {TRIES} tries")


def _exact(leg: Mapping[str, Any]) -> Mapping[str, Any]:
    """A leg whose slide between two joints lies exactly on the line between them, as a rounded axis does not."""
    joints = [dict(joint) for joint in leg["joints"]]
    for before, slide, after in zip(joints, joints[1:], joints[2:], strict=False):
        if slide["type"] == "prismatic":
            start, end = numbers(before["point"]), numbers(after["point"])
            slide |= {"point": list((start + end) / 2), "axis": list(end - start)}
    return {"name": leg["name"], "joints": joints}


def written(value: Any, path: str = "") -> str:
    """The text of a machine file."""
    plain = {key: entry for key, entry in value.items() if not isinstance(entry, dict) and key != "legs"}
    lines = [f"{key} = {_inline(entry)}" for key, entry in plain.items()]
    for key, entry in value.items():
        if key == "legs":
            for leg in entry:
                lines += ["", "[[legs]]", *(f"{name} = {_inline(part)}" for name, part in leg.items())]
        elif isinstance(entry, dict) and entry:
            name = f"{path}{key}"
            if any(isinstance(part, dict) for part in entry.values()):
                lines.append(written(entry, f"{name}."))
            else:
                lines += ["", f"[{name}]", *(f"{part} = {_inline(content)}" for part, content in entry.items())]
    return "\n".join(lines)


def _inline(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_inline(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list | tuple | np.ndarray):
        return "[" + ", ".join(_inline(entry) for entry in value) + "]"
    return str(value)
