"""The table of machines: one row per bundled machine, over which every property test runs.

A bundled machine is in the table by itself: its lengths vary by `SHARE` and its angles by `TURN` about the values in
its file. A row of `ROWS` says where one may vary more widely. Stiffnesses need no range; each test says which it wants.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from math import cos, isfinite, pi, radians, sin

import pytest
from hypothesis import settings
from hypothesis import strategies as st

from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import build, bundled, load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.spec import document

REGULAR = 0.02
"""Least singularity margin of a drawn pose. Statics solve W; there they lose less than three digits of 16."""
SHARE = 0.1
"""How far a size varies about its value in the file, as a share of it; of the machine's length where it is 0."""
TURN = radians(6)
"""How far an angle varies about its value in the file."""
TOOL = 0.1
"""How far the tool point lies from the platform point P along each axis, m: what holds, holds at a tool as well."""
UNCHANGED = ("load.", "limits.", "linear_density.", "tool.mass")
"""Sections on which neither K nor C depends."""
ELASTIC = 1e5
"""A stiffness between rigid and free, in any unit of SI."""
TINY = 1e-12
"""Lengths (m) and angles (rad) below which a drawn one is 0."""
SIZES = {"length", "area", "second moment of area", "elastic modulus"}
"""Kinds of what varies by a share of itself."""

Range = float | tuple[float, float]


@dataclass(frozen=True, eq=False)
class Case:
    """A bundled machine and where its geometry and pose may vary.

    Attributes:
        name: of the bundled machine.
        given: by path of a field, or of one entry of it: least and greatest value, or how far it varies about its value
            in the file; SI.
    """

    name: str
    given: Mapping[str, Range] = field(default_factory=dict)

    def __repr__(self) -> str:
        return self.name

    @cached_property
    def machine(self) -> Machine:
        """As bundled, without limits and loads: neither K nor C depends on them, and a drawn pose may lie beyond."""
        return load_without_limits(self.name)

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Least and greatest value of every scalar that is varied, by its path."""
        written, length = values(self.machine), float(respond(self.machine).configuration.length)
        found: dict[str, tuple[float, float]] = {}
        paths = [(p, path) for p in parameters(self.machine.family) for path in p.leaves]
        for parameter, path in paths:
            kind, here = parameter.quantity.kind, written[path]
            wanted: Range = 0.0
            if path.startswith("tool.offset"):
                wanted = TOOL
            elif path.startswith(UNCHANGED):
                wanted = 0.0
            elif kind == "angle":
                wanted = TURN
            elif kind in SIZES:
                wanted = SHARE * abs(here or length)
            wanted = self.given.get(path, self.given.get(parameter.path, wanted))
            low, high = wanted if isinstance(wanted, tuple) else (here - wanted, here + wanted)
            if low < high and (path not in found or path in self.given):
                found[path] = (low, high)
        assert all(any(path == g or path.startswith(f"{g}.") for path in found) for g in self.given), self.name
        return found

    @property
    def freedoms(self) -> int:
        """Of the platform when all links are rigid and the actuators free: as many as task coordinates."""
        return sum(path.startswith("pose.") for path in values(self.machine))

    @cached_property
    def is_elastic(self) -> bool:
        """Whether K is finite once every spring of the file is elastic: no rigid joint holds the platform alone."""
        springs = dict.fromkeys(stiffness_paths(self.machine), ELASTIC)
        return all(map(isfinite, respond(with_values(self.machine, springs)).stiffness.upper))


def stiffness_paths(machine: Machine) -> list[str]:
    """The leaf paths of all stiffnesses and rigidities."""
    return [leaf for p in parameters(machine.family) if p.quantity.stiff and len(p.leaves) == 1 for leaf in p.leaves]


def elastic_paths(machine: Machine) -> list[str]:
    """Likewise, with the moduli of materials: all that K is proportional to."""
    moduli = [p.path for p in parameters(machine.family) if p.quantity.kind == "elastic modulus"]
    return stiffness_paths(machine) + moduli


def load_without_limits(name: str, settings: Sequence[str] = ()) -> Machine:
    """A bundled machine with those limits and loads alone that the settings give it."""
    tables = document.parse(bundled()[name], name)
    return build({key: table for key, table in tables.items() if key not in ("limits", "load")}, name, settings)


def degrees(low: float, high: float) -> tuple[float, float]:
    return radians(low), radians(high)


EIGHT = radians(8)
ROWS = [
    Case(
        "zhang-gosselin-4dof",
        {
            "geometry.base_radius": (0.15, 0.40),
            "geometry.platform_radius": (0.06, 0.20),
            "geometry.base_angle": degrees(10, 60),
            "geometry.platform_angle": degrees(30, 80),
            "geometry.passive_links": (0.45, 0.80),
            "geometry.passive_leg_offset": (-0.10, 0.10),
            "pose.x": (-0.20, 0.20),
            "pose.z": (0.40, 0.85),
            "pose.theta5": degrees(-85, 0),
            "pose.theta6": degrees(80, 160),
        },
    ),
    Case(
        "passive-leg-3dof-pu",
        {
            "geometry.base_radius": (0.15, 0.40),
            "geometry.platform_radius": (0.06, 0.14),
            "geometry.base_angles": EIGHT,
            "geometry.platform_angles": EIGHT,
            "pose.z": (0.40, 0.85),
            "pose.theta1": degrees(-30, 30),
            "pose.theta2": degrees(-30, 30),
        },
    ),
    Case(
        "tricept",
        {
            "geometry.base_radius": (0.30, 0.70),
            "geometry.platform_radius": (0.10, 0.25),
            "geometry.base_angles": EIGHT,
            "geometry.platform_angles": EIGHT,
            "pose.theta1": degrees(-30, 30),
            "pose.theta2": degrees(-30, 30),
            "pose.length": (0.8, 1.5),
        },
    ),
    Case(
        "hexapod",
        {
            "geometry.base_radius": (0.09, 0.15),
            "geometry.platform_radius": (0.06, 0.12),
            "geometry.base_height": (0.0, 0.03),
            "geometry.platform_height": (-0.08, 0.05),
            "pose.x": 0.03,
            "pose.y": 0.03,
            "pose.z": (0.10, 0.20),
            "pose.roll": degrees(-15, 15),
            "pose.pitch": degrees(-15, 15),
            "pose.yaw": degrees(-15, 15),
        },
    ),
]
"""Machines whose designs and poses vary widely: one of each family the paper's theory was written for."""

CASES = [*ROWS, *(Case(name) for name in bundled() if name not in {row.name for row in ROWS})]

ONE_SIDED = ("cogiro",)
"""Those whose legs go slack under some loads, so that no linear equations hold."""

KINDS = ("zhang-gosselin-4dof", "passive-leg-5dof-driven", "delta", "planar-3rrr", "tripteron")
"""One machine of each kind: isostatic, springs in a row and redundant, beams, planar, without a closed form."""

one_of_each = pytest.mark.parametrize("case", [case for case in CASES if case.name in KINDS], ids=repr)
"""For what takes long and is about arithmetic rather than about machines."""
every_machine = pytest.mark.parametrize("case", CASES, ids=repr)
elastic_machine = pytest.mark.parametrize("case", [case for case in CASES if case.is_elastic], ids=repr)
"""For what asks K to be finite: a plate on feet of rigid joints, written leg by leg, is rigid along some directions."""
two_sided = pytest.mark.parametrize("case", [case for case in CASES if case.name not in ONE_SIDED], ids=repr)
"""For what holds where every leg pulls and pushes."""
few = settings(max_examples=min(settings.default.max_examples, max(8, settings.default.max_examples * 2 // 5)))
"""For a test over every machine: what one machine hides, another shows."""


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """Stiffnesses from 10^low to 10^high, evenly over the decades."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


MODERATE = decades(3, 6)
"""Stiffnesses within a contrast of 1e3, as between actuators and links that are built to match."""
CONTRASTING = decades(1, 11)
"""Stiffnesses as different as a soft servo and a link that is all but rigid."""


@cache  # a strategy is checked anew each time it is made, which takes longer than the drawing of a number
def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Lengths and angles, dense at the ends and at 0; what is nearly 0 is 0, to keep squares far from underflow."""
    return st.floats(low, high).map(lambda c: c if abs(c) > TINY else min(max(0.0, low), high))


@st.composite
def machines(draw: st.DrawFn, case: Case, stiffness: st.SearchStrategy[float] = MODERATE) -> Machine:
    """A random design of the machine at a random pose with a random tool; every stiffness is drawn, rigid ones too."""
    drawn = {path: draw(numbers(low, high), label=path) for path, (low, high) in case.ranges.items()}
    drawn |= {path: draw(stiffness, label=path) for path in stiffness_paths(case.machine)}
    return with_values(case.machine, drawn)


def is_regular(machine: Machine) -> bool:
    """Whether the pose can be reached and is not near a singularity."""
    return answers_regularly(respond(machine))


def answers_regularly(response: Response) -> bool:
    """Whether a machine that answers so can reach its pose and is not near a singularity."""
    return response.status == Status.OK and response.singularity_margin > REGULAR


def regular_machines(case: Case, stiffness: st.SearchStrategy[float] = MODERATE) -> st.SearchStrategy[Machine]:
    """Random designs at poses that can be reached and are not near a singularity."""
    return machines(case, stiffness).filter(is_regular)


def regular(case: Case, stiffness: st.SearchStrategy[float] = MODERATE) -> st.SearchStrategy[Response]:
    """What they answer: each is asked once."""
    return machines(case, stiffness).map(respond).filter(answers_regularly)


def written(name: str, point: Sequence[float], pose: Mapping[str, float], planar: bool = True) -> str:
    """The beginning of a machine file leg by leg: name, platform point and pose, SI. Its legs are added as text."""
    space = 'space = "planar"\n' if planar else ""
    coordinates = "".join(f"{key} = {value}\n" for key, value in pose.items())
    head = f'schema = 1\nname = "{name}"\nfamily = "legs"\n{space}'
    return f"{head}[platform]\npoint = {[*point]}\n[pose]\n{coordinates}"


def cable(name: str, base: Sequence[float], eye: Sequence[float], preload: float = 0.0) -> str:
    """A leg that only pulls, from a point of the base to one of the platform, m; with `STRETCH` and a preload, N."""
    ends = f"from = {[*base]}\nto = {[*eye]}\n"
    return f'[[legs]]\nname = "{name}"\ntype = "cable"\n{ends}stiffness = {STRETCH}\npreload = {preload}\n'


STRETCH = 2e5
"""Stiffness of these cables, N/m."""


ARM = """
schema = 1
name = "arm"
family = "legs"
space = "planar"
[platform]
point = ["0.5 m", "0.3 m", 0]
[pose]
x = "0.5 m"
y = "0.3 m"
yaw = 0
[[legs]]
name = "arm"
joints = [
  { name = "shoulder", type = "revolute", joins = ["base", "upper"], point = [0, 0, 0], axis = [0, 0, 1], actuated = true, stiffness = 1e5 },
  { name = "elbow", type = "revolute", joins = ["upper", "lower"], point = [0.5, 0, 0], axis = [0, 0, 1], actuated = true, stiffness = 1e5 },
  { name = "wrist", type = "revolute", joins = ["lower", "platform"], point = [0.5, 0.3, 0], axis = [0, 0, 1], actuated = true, stiffness = 1e5 },
]
"""  # noqa: E501
"""Two links, 0.5 m and 0.3 m long, and a wrist, all driven: it reaches a ring, whatever the yaw."""


def column(force: float) -> Machine:
    """A column of 2 m on a hinge of 5 kN·m/rad, which a force (N) presses: it stands up to 2500 N."""
    hinge = (
        '{ name = "hinge", type = "revolute", joins = ["base", "platform"], point = [0, 0, 0], axis = [1, 0, 0], '
        "actuated = true, stiffness = 5e3 }"
    )
    text = written("column", (0, 0, 2), {"roll": 0}, planar=False)
    return build(f'{text}[[legs]]\nname = "column"\njoints = [{hinge}]\n[load]\nforce = [0, 0, {-force}]\n')


def with_bodies(name, settings):
    """A bundled machine leg by leg, each of its links a rigid body with a mass, a centre and an inertia of its own."""
    document = document_of(load(name, settings))
    for number, leg in enumerate(document["legs"]):
        for body in sorted({body for joint in leg["joints"] for body in joint["joins"]} - {"base", "platform"}):
            given = leg.setdefault("links", {}).setdefault(body, {"model": "rigid"})
            given |= {"mass": 3.0, "centre_of_mass": [0.1 * number, 0.05, 0.02]}
            given |= {"inertia": [0.3, 0.4, 0.5, 0.02, -0.03, 0.04]}
    return build(document, "bodies")


def hangprinter():
    """A printer that hangs on cables: three pairs of parallel ones from low anchors, and three from the ceiling."""

    def turned(angle, x, y, z):
        cosine, sine = cos(angle), sin(angle)
        return [cosine * x - sine * y, sine * x + cosine * y, z]

    rows = []
    for k in range(3):
        low, high = 2.0 * pi * k / 3.0 - 0.5 * pi, 2.0 * pi * k / 3.0 + pi / 6.0
        rows += [(turned(low, 1.8, y, -0.12), turned(low, 0.12, y, 0.0), 25.0) for y in (-0.16, 0.16)]
        rows.append((turned(high, 0.15, 0.0, 2.6), turned(high, 0.15, 0.0, 0.0), 18.0))
    cables = [
        f'[[legs]]\nname = "cable {k}"\ntype = "cable"\nfrom = {near}\nto = {far}\nstiffness = 20000\npreload = {pull}'
        for k, (near, far, pull) in enumerate(rows, 1)
    ]
    head = """
        schema = 1
        name = "Hangprinter"
        family = "legs"
        platform.point = [0, 0, 0]
        tool = {offset = [0, 0, -0.1], mass = "1.1 kg", centre_of_mass = [0, 0, 0.05]}
        load.gravity = [0, 0, -9.81]
        pose = {x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0}
    """
    return build("\n".join([head, *cables]))
