"""Moving mass: by hand, over every family, traced, and what is not counted."""

import math

import numpy as np
import pytest

from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import PointTable
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.catalogue import families
from kinetostat.machine.loading import as_toml, build, bundled, load
from kinetostat.machine.loads import PLATFORM, moving_masses
from kinetostat.spec.document import parse
from kinetostat.spec.fields import quantities
from kinetostat.studies.analysis import analyze
from kinetostat.studies.datasets import evaluate_grid
from machines import every_machine
from refusals import refused

TUBE = '{ shape = "tube", outer_diameter = "40 mm", inner_diameter = "30 mm", material = "steel" }'
PER_METRE = 7850.0 * math.pi / 4 * (0.040**2 - 0.030**2)
OWN = '{ shape = "round", diameter = "20 mm", youngs_modulus = "70 GPa", shear_modulus = "27 GPa" }'


def masses(machine):
    return {one.name: one.mass for one in moving_masses(machine, respond(machine).configuration)}


def test_written_links_weigh_density_times_area_times_length():
    machine = load("tripteron", ["sections.bar.density=2700 kg/m**3", "tool.mass=4 kg"])
    weight = 2700.0 * math.pi / 4 * 0.15**2
    start, elbow, wrist = (
        np.array(p) for p in ([0, 0, 0.5], [0.7177071733467426, -0.2177071733467426, 0.5], [0.5] * 3)
    )
    found = masses(machine)
    assert found["z proximal"] == pytest.approx(weight * np.linalg.norm(elbow - start), rel=1e-12)
    assert found["z distal"] == pytest.approx(weight * np.linalg.norm(wrist - elbow), rel=1e-12)
    assert found["z carriage"] is None
    assert found[PLATFORM] == 4.0
    assert analyze(machine).moving_mass == pytest.approx(weight * 6 * 0.75 + 4.0, rel=1e-9)


def test_a_telescopic_leg_is_as_long_as_the_pose_makes_it():
    settings = [f"stiffness.leg_axial={TUBE}", "tool.mass=2 kg"]
    for z in (0.12, 0.15):
        machine = load("hexapod", [*settings, f"pose.z={z}"])
        legs = [leg.passive for leg in respond(machine).configuration.legs]
        lengths = [math.dist(own[0].point.components(), own[-1].point.components()) for own in legs]
        assert analyze(machine).moving_mass == pytest.approx(2.0 + PER_METRE * sum(lengths), rel=1e-12)


def test_links_that_a_family_has_in_pairs_count_twice():
    machine = load("delta", [f"stiffness.bar_axial={TUBE}"])
    assert analyze(machine).moving_mass == pytest.approx(6 * 0.8 * PER_METRE, rel=1e-12)


def test_a_removed_leg_weighs_nothing():
    machine = load("passive-leg-4dof-driven", [f"stiffness.leg_axial={TUBE}"])
    assert [name for name, mass in masses(machine).items() if mass] == ["leg 2", "leg 3", "leg 4"]


@pytest.mark.parametrize("family", families().values(), ids=lambda family: family.name)
def test_every_rigidity_belongs_to_a_link_that_has_a_length(family):
    """A new family cannot forget its links, and each of them weighs what its length says."""
    rigid = {name for name, q in quantities(family.tables["stiffness"]).items() if q.kind.endswith("rigidity")}
    assert {name for link in family.links for name in link.rigidities} == rigid


@every_machine
def test_each_link_weighs_its_length(case):
    densities = [f"linear_density.{link.name}=3 kg/m" for link in case.machine.family.links]
    if not densities:
        return
    response = respond(load(case.name, densities))
    weights = [one for one in moving_masses(load(case.name, densities), response.configuration) if one.mass]
    placed = [spring.actuated for leg in response.configuration.legs for spring in leg.springs]
    assert len(weights) >= sum(placed) - 1
    assert all(0.0 < one.mass / 3.0 < 3.0 for one in weights)
    assert response.mass == pytest.approx(sum(one.mass for one in weights))


def test_it_can_be_differentiated_and_mapped():
    machine = load("hexapod", [f"stiffness.leg_axial={TUBE}"])
    paths = ["pose.z", "geometry.base_radius", "linear_density.legs"]
    answer = evaluate_gradient(machine, PointTable({"pose.z": np.array([0.135])}), "mass", paths)
    step = 1e-6
    for path, slope in zip(paths, answer.gradients[0, :, 0], strict=True):
        size = {"pose.z": 0.135, "geometry.base_radius": 0.115, "linear_density.legs": PER_METRE}[path]
        ends = [load("hexapod", [f"linear_density.legs={PER_METRE!r}", f"{path}={size + s!r}"]) for s in (-step, step)]
        low, high = (float(respond(end).mass) for end in ends)
        assert slope == pytest.approx((high - low) / (2 * step), rel=1e-7)
    grid = evaluate_grid(machine, ["pose.z=0.12:0.15:3"], ["mass"])
    assert float(grid["mass"][-1]) == pytest.approx(
        analyze(load("hexapod", [f"stiffness.leg_axial={TUBE}", "pose.z=0.15"])).moving_mass
    )


def test_a_file_of_it_reads_back():
    machine = load("delta", [f"stiffness.arm_bending={TUBE}", "tool.mass=1.5 kg"])
    text = as_toml(machine)
    assert analyze(build(parse(text, "x"), "x")).moving_mass == analyze(machine).moving_mass
    assert "linear_density" not in as_toml(load("delta"))


def test_a_number_of_ones_own_comes_before_that_of_the_section():
    settings = [f"stiffness.leg_axial={TUBE}", "linear_density.legs=1 kg/m"]
    assert load("hexapod", settings).tables["linear_density"].legs == 1.0


def test_a_section_with_moduli_of_its_own_may_give_its_density():
    assert load("hexapod", [f"stiffness.leg_axial={OWN}"]).tables["linear_density"].legs == 0.0
    heavy = OWN.replace(" }", ', density = "2700 kg/m**3" }')
    found = load("hexapod", [f"stiffness.leg_axial={heavy}"]).tables["linear_density"].legs
    assert found == pytest.approx(2700 * math.pi / 4 * 0.02**2)


@pytest.mark.parametrize(
    ("machine", "settings", "said"),
    [
        ("delta", [f"stiffness.arm_bending={TUBE}", f"stiffness.arm_torsion={TUBE.replace('40', '45')}"], "same arms"),
        ("hexapod", ["tool.mass=-1 kg"], "cannot be negative"),
        ("hexapod", ["linear_density.legs=-1 kg/m"], "cannot be negative"),
        ("tripteron", ["sections.bar.density=-1"], "cannot be negative"),
    ],
)
def test_mistakes_are_refused(machine, settings, said):
    with refused(said):
        load(machine, settings)


def test_nothing_known_is_not_zero():
    assert analyze(load("zhang-gosselin-4dof")).moving_mass is None


def test_a_post_on_the_base_does_not_move():
    """What comes after a fixed joint from the base is clamped to it: it bends, and weighs nothing here."""
    text = bundled()["tripteron"]
    slide = '{ name = "slide",    type = "prismatic", joins = ["base", "carriage"],     point = [0, 0, 0.5]'
    post = '{ name = "clamp", type = "fixed", joins = ["base", "post"], point = [0, 0, 0] },\n  '
    text = text.replace(slide, post + slide.replace('"base"', '"post"'))
    text = text.replace("links = { proximal", 'links = { post = { model = "beam", section = "bar" }, proximal', 1)
    found = masses(build(parse(text, "x"), "x"))
    assert "z post" not in found
    assert found["z proximal"] == pytest.approx(masses(load("tripteron"))["z proximal"])


def test_a_rigid_link_weighs_what_its_section_says():
    rigid = load("tripteron", ["legs.z.proximal.model=rigid"])
    assert masses(rigid) == pytest.approx(masses(load("tripteron")))
