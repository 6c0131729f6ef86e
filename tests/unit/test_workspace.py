"""Workspaces of machines whose extent is known in closed form, and the verdict on single poses."""

import math

import numpy as np
import pytest

from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import build
from kinetostat.machine.parameters import with_values
from kinetostat.spec import document
from kinetostat.studies.datasets import field_of
from kinetostat.studies.workspace import workspace
from kinetostat.studies.workspace_verdicts import BEYOND, INSIDE, Judge, depth
from kinetostat.views.answers import plot
from machines import ARM
from machines import load_without_limits as load
from refusals import refused

ERRORS = 4
"""Standard errors within which an estimate lies all but surely."""

RIM = 1e-9
"""Distance from the end of the reach, m, within which rounding decides."""

SQUARE = ["x=-1 m:1 m:81", "y=-1 m:1 m:81"]
PLANE = ["x=-40 cm:40 cm:81", "y=-40 cm:40 cm:81"]
CENTRES = math.sqrt(0.25**2 + 0.08**2 - 2 * 0.25 * 0.08 * math.cos(math.radians(30)))
"""Planar 3-RPR: at a fixed angle P is a leg's length away from b - Q p, one of three points this far from O. The
lines of the legs meet in one point where P lies on the circle through these."""
SIDE = CENTRES * math.sqrt(3.0)
"""Distance of two of the three points."""


def near(found, value):
    assert abs(found.volume.value - value) < ERRORS * found.volume.standard_error
    assert found.volume.standard_error < 0.015 * value


def test_two_links_reach_a_ring():
    found = workspace(build(document.parse(ARM, "arm"), "arm"), SQUARE)
    near(found, math.pi * (0.8**2 - 0.2**2))
    assert found.connected == 1.0
    assert found.nodes["out of reach"] + found.nodes[INSIDE] == 81 * 81
    radius = np.hypot(*np.meshgrid(found.dataset["x"], found.dataset["y"], indexing="ij"))
    inside = found.dataset["verdict"].values == 0
    assert inside[(radius > 0.2 + RIM) & (radius < 0.8 - RIM)].all(), "also beside nodes at the very end of the reach"
    assert not inside[(radius < 0.2 - RIM) | (radius > 0.8 + RIM)].any()


def test_poses_at_the_end_of_the_reach_leave_the_joints_of_others_alone():
    """Where rounding decides whether a closed form exists, Newton's method tries; not in place of it elsewhere."""
    machine = build(document.parse(ARM, "arm"), "arm")
    angle = np.linspace(0.0, 6.0, 40)
    radius = np.where(np.arange(40) % 2, 0.8, 0.25)
    columns = {"pose.x": radius * np.cos(angle), "pose.y": radius * np.sin(angle)}
    together = solve_joints(with_values(machine, columns))
    for i in range(0, 40, 2):
        alone = solve_joints(with_values(machine, {path: float(column[i]) for path, column in columns.items()}))
        assert alone.status == together.status[i] == Status.OK
        assert [q[i] for q in together.coordinates] == pytest.approx(list(alone.coordinates), abs=1e-12)


def test_a_singular_circle_bounds_a_planar_machine():
    found = workspace(load("planar-3rpr"), PLANE)
    near(found, math.pi * CENTRES**2)
    assert found.singularities_divide
    assert found.nodes[BEYOND] > 0


def test_legs_of_equal_reach_leave_a_reuleaux_triangle():
    """Three discs about the corners of an equilateral triangle, their radius its side; inside the singular circle."""
    found = workspace(load("planar-3rpr", [f"limits.longest_leg={SIDE}"]), PLANE)
    near(found, 0.5 * (math.pi - math.sqrt(3.0)) * SIDE**2)
    assert found.connected == 1.0


def test_short_legs_take_discs_out_of_it():
    shortest = 0.2 * SIDE
    found = workspace(load("planar-3rpr", [f"limits.longest_leg={SIDE}", f"limits.shortest_leg={shortest}"]), PLANE)
    whole = 0.5 * (math.pi - math.sqrt(3.0)) * SIDE**2
    near(found, whole - 3 * corner(shortest, SIDE))


def corner(r, side):
    """Area that a disc of radius r about a corner of a Reuleaux triangle has in common with it.

    At the distance rho from the corner, two arcs leave an angle of 120 deg - 2 asin(rho / 2 side) between them.
    """
    rho = np.linspace(0.0, r, 20001)
    return float(np.trapezoid(rho * (2 * math.pi / 3 - 2 * np.arcsin(rho / (2 * side))), rho))


def test_slides_leave_a_box():
    ranges = [f"{name}=0.25 m:0.75 m:15" for name in "xyz"]
    found = workspace(load("tripteron", ["limits.travel_from=-0.12 m", "limits.travel_to=0.17 m"]), ranges)
    near(found, 0.29**3)
    assert not found.singularities_divide
    demand = {d.name: d for d in found.demands}["travel_to"]
    assert -0.12 <= demand.least < -0.08
    assert 0.12 < demand.greatest <= 0.17


class TestVerdicts:
    SETTINGS = ("limits.longest_leg=18 cm", "limits.shortest_leg=8 cm", "limits.base_joint_angle=55 deg",
                "limits.actuator_force=180 N", "load.force=[0, 0, 500]")  # fmt: skip
    RANGES = ("x=-6 cm:6 cm:7", "y=-6 cm:6 cm:7", "z=6 cm:22 cm:9")
    WHERE = ("stiffness_z > 50 N/um", "singularity_margin > 0.1")

    @pytest.fixture(scope="class")
    @classmethod
    def found(cls):
        return workspace(load("hexapod", cls.SETTINGS), cls.RANGES, cls.WHERE)

    def test_every_node_has_the_verdict_of_its_pose(self, found):
        """Node by node on floats: the first of status, limit and condition that is against it."""
        machine, labels = load("hexapod", self.SETTINGS), found.verdicts
        for index in np.ndindex(found.dataset["verdict"].shape):
            pose = {
                field_of(found.dataset[dim]): float(found.dataset[dim].values[i])
                for dim, i in zip(found.dataset["verdict"].dims, index, strict=True)
            }
            response = respond(with_values(machine, pose))
            expected = INSIDE
            if response.status == Status.JOINT_LIMIT:
                expected = "limits." + next(check.limit.name for check in response.checks if not check.kept)
            elif response.stiffness.entry(5, 5) <= 5e7:
                expected = f"fails {self.WHERE[0]}"
            elif response.singularity_margin <= 0.1:
                expected = f"fails {self.WHERE[1]}"
            assert labels[int(found.dataset["verdict"].values[index])] == expected

    def test_counts_are_those_of_the_nodes(self, found):
        assert sum(found.nodes.values()) == found.dataset["verdict"].size
        assert found.nodes[INSIDE] == int((found.dataset["verdict"] == 0).sum()) > 0
        assert sum(count > 0 for count in found.nodes.values()) >= 4

    def test_demands_keep_within_the_limits(self, found):
        told = {demand.name: demand for demand in found.demands}
        assert 0.08 <= told["longest_leg"].least < told["longest_leg"].greatest <= 0.18
        assert told["base_joint_angle"].greatest <= 55.0
        assert 0.0 < told["actuator_force"].greatest <= 180.0

    def test_a_seed_gives_the_same_volume_again(self, found):
        again = workspace(load("hexapod", self.SETTINGS), self.RANGES, self.WHERE)
        other = workspace(load("hexapod", self.SETTINGS), self.RANGES, self.WHERE, seed=1)
        assert again.volume == found.volume
        assert again.dataset.identical(found.dataset)
        assert other.volume != found.volume
        assert abs(other.volume.value - found.volume.value) < ERRORS * 1.5 * found.volume.standard_error


@pytest.mark.numbers
def test_a_grid_has_the_verdicts_that_it_has_within_a_larger_one():
    """The same grid, once alone and once as a part of one of several slabs."""
    settings = (*TestVerdicts.SETTINGS, "limits.leg_diameter=20 mm", "limits.platform_joint_angle=54 deg")
    machine = load("hexapod", settings)
    ranges = ["x=-6 cm:6 cm:41", "z=6 cm:22 cm:41"]
    small = workspace(machine, ranges, TestVerdicts.WHERE)
    large = workspace(machine, [*ranges, "y=0:1 mm:40"], TestVerdicts.WHERE)
    assert np.array_equal(large.dataset["verdict"].values[:, :, 0], small.dataset["verdict"].values)
    assert len(np.unique(small.dataset["verdict"])) >= 5


def test_regions_apart_are_told():
    """Beyond the singular circle another region of the same side does not exist; a ring of short legs cuts one off."""
    machine = load("planar-3rpr", ["pose.x=0", "pose.y=0"])
    found = workspace(machine, PLANE, [f"stiffness_x > {0.5 * respond(machine).stiffness.entry(3, 3)} N/m"])
    assert found.connected == 1.0


def test_a_pose_that_is_not_inside_joins_nothing():
    found = workspace(load("planar-3rpr"), ["x=0.3 m:0.4 m:5", "y=0.3 m:0.4 m:5"])
    assert found.connected is None
    assert not found.exists
    assert found.demands == ()
    assert found.extents == {}


REFUSED = [
    (["x=0:1:3"], (), ["two to six"]),
    (
        ["x=0:1:3", "geometry.base_radius=1:2:3"],
        (),
        ["geometry.base_radius is not a coordinate", "pose.x", "kinetostat map"],
    ),
    (["x=0:1:3", "x=0:1:3"], (), ["varied twice"]),
    (["x=1:0:3", "y=0:1:3"], (), ["pose.x", "upwards"]),
    (["x=1:10:3:log", "y=0:1:3"], (), ["pose.x", "leave out :log"]),
    (["x=0:1:3000", "y=0:1:3000"], (), ["9,000,000", "5,000,000", "lower the counts"]),
    (["x=0:1:3", "y=0:1:3"], ["stiffness_z > 3 N/m"], ["not a quantity"]),
]


@pytest.mark.parametrize(("ranges", "conditions", "words"), REFUSED)
def test_bad_questions_are_refused(ranges, conditions, words):
    with refused() as caught:
        workspace(load("planar-3rpr"), ranges, conditions)
    for word in words:
        assert word in str(caught.value)


def test_sections_are_equally_spaced_and_the_legend_has_the_lines_that_are_drawn():
    ranges = ["theta1=-40 deg:40 deg:9", "theta2=-40 deg:40 deg:9", "length=35 cm:60 cm:18"]
    asked = ["stiffness_z > 5000 N/um", "compliance_z < 1 um/N"]
    figure = plot(workspace(load("tricept"), ranges, asked))
    lengths = [float(panel.get_title().split()[2]) for panel in figure.axes]
    assert 5 <= len(lengths) <= 9
    assert np.ptp(np.diff(lengths)) < 0.2
    told = {text.get_text() for text in figure.legends[0].get_texts()}
    assert "stiffness_z = 5000 N/um" not in told, "no panel has that edge"


class TestBorders:
    """Where the verdict changes between two nodes, to a fraction of a step, whatever bounds the workspace."""

    def test_on_either_side_of_a_border_the_verdict_is_another(self):
        machine = load("hexapod", ["limits.longest_leg=20 cm"])
        result = workspace(machine, ["pose.x=-8 cm:8 cm:9", "pose.z=14 cm:26 cm:9"], ["free_stiffness_z > 30 N/um"])
        judge = Judge(state_of(machine), result.conditions)
        data = result.dataset
        border = data["border_x"].values
        verdict, x, z = data["verdict"].values, data["x"].values, data["z"].values
        nodes = np.argwhere(np.isfinite(border))
        assert len(nodes) > 8
        assert (verdict[:-1] != verdict[1:]).sum() == len(nodes)
        for i, k in nodes[(border[tuple(nodes.T)] > 0.02) & (border[tuple(nodes.T)] < 0.98)]:
            for side, wanted in ((-0.01, True), (0.01, False)):
                share = border[i, k] + side
                poses = {"pose.x": np.array([x[i] + share * (x[1] - x[0])]), "pose.z": np.array([z[k]])}
                answer = evaluate(machine, PointTable(poses), judge.quantities)
                code = judge.verdicts(answer.status, answer.values, lambda _, poses=poses: poses)[0]
                assert bool(code == verdict[i, k]) is wanted

    def test_a_pose_at_its_limit_is_beyond_no_singularity(self):
        """Machine code may call a pose beyond a limit that its check, computed again, keeps to the last digit."""
        judge = Judge(state_of(load("hexapod", ["limits.longest_leg=20 cm"])), ())
        at_home = {"pose.z": np.array([0.135])}
        (code,) = judge.verdicts(
            np.array([Status.JOINT_LIMIT]), {"aspect": np.array([judge.aspect])}, lambda _: at_home
        )
        assert judge.labels[code] == "limits.longest_leg"

    def test_the_depth_vanishes_on_a_straight_border(self):
        """A border at any slope: linear interpolation between nodes on either side gives it back."""
        x, y = np.meshgrid(np.arange(12.0), np.arange(12.0), indexing="ij")
        signed = 0.6 * x + 0.8 * y - 7.3
        region = signed <= 0.0
        shares = [np.full(signed.shape, np.nan) for _ in range(2)]
        for k, slope in enumerate((0.6, 0.8)):
            shares[k] = np.where((signed <= 0.0) != (signed + slope <= 0.0), -signed / slope, np.nan)
        field = depth(region, shares)
        assert ((field > 0.0) == region).all()
        inner, outer = field[:-1], field[1:]
        crossing = region[:-1] & ~region[1:]
        at = inner[crossing] / (inner[crossing] - outer[crossing])
        assert np.abs(at - shares[0][:-1][crossing]).max() < 0.2
