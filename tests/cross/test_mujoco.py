"""The exported model in MuJoCo: it loads, stands still at the pose, and deflects under a load as we predict.

MuJoCo is stepped through time until a load has settled. Its constraints are soft by design and give way by about 1e-5
of the machine's own compliance (`exchange.mjcf_pace`); the load is small but finite.
"""

from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.exchange import mjcf_model
from kinetostat.exchange.mjcf import text_of
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import build, bundled, load
from kinetostat.machine.written.plan import NAME
from kinetostat.studies.analysis import analyze
from kinetostat.studies.under_load import under_load

AGREED = 1e-4
"""Of the deflection: ten times what the constraints give way; largest found 7e-5."""
SMALL = 1e-6
"""Deflection, rad or machine lengths: its square is below the tolerance."""


class Loaded:
    """A model at rest, and what a wrench does to its tool."""

    def __init__(self, found):
        self.model = mujoco.MjModel.from_xml_string(found if isinstance(found, str) else text_of(found))
        self.settled = self.model.numeric("settling_time").data[0]
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def placement(self):
        mujoco.mj_forward(self.model, self.data)
        site = self.data.site("tool")
        return np.array(site.xpos), np.array(site.xmat).reshape(3, 3)

    def run(self, seconds):
        for _ in range(int(seconds / self.model.opt.timestep)):
            mujoco.mj_step(self.model, self.data)

    def deflection(self, wrench):
        """Of the tool, rx ry rz x y z, under [moment; force] there."""
        before, axes = self.placement()
        self.data.body("platform").xfrc_applied[:] = [*wrench[3:], *wrench[:3]]
        self.run(self.settled)
        after, turned = self.placement()
        spin = turned @ axes.T
        turn = [spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]
        return np.array([*(0.5 * c for c in turn), *(after - before)])


def load_case(found):
    """A small wrench with all components that exist, and the deflection C w, rx ry rz x y z."""
    places = [COMPONENTS.index(name) for name in found.components]
    compliance = np.zeros((6, 6))
    compliance[np.ix_(places, places)] = found.compliance
    sizes = np.repeat([1.0, found.characteristic_length], 3)
    wrench = np.zeros(6)
    wrench[places] = (np.random.default_rng(5).uniform(0.5, 1.0, 6) / sizes[::-1])[places]
    largest = np.max(np.abs(compliance @ wrench) / sizes)
    wrench *= SMALL / largest
    return wrench, compliance @ wrench, sizes


def compare(found, model):
    wrench, wanted, sizes = load_case(found)
    assert np.linalg.norm(wanted / sizes) > 0.9 * SMALL
    for block in (slice(0, 3), slice(3, 6)):
        moved = np.linalg.norm(wanted[block])
        assert moved > 0.0
    deflection = model.deflection(wrench)
    for block in (slice(0, 3), slice(3, 6)):
        assert np.linalg.norm(deflection[block] - wanted[block]) < AGREED * np.linalg.norm(wanted[block])


@pytest.mark.parametrize("name", bundled())
def test_mujoco_deflects_as_predicted(name):
    found = analyze(load(name))
    model = Loaded(found)
    assert model.model.opt.gravity.tolist() == [0.0, 0.0, 0.0]
    model.run(50 * model.model.opt.timestep)
    assert np.max(np.abs(model.data.qvel)) < 1e-9, "without a load nothing moves"
    compare(found, model)


def test_a_load_acts_at_the_tool():
    found = analyze(load("hexapod", ['tool.offset=["30 mm", "0 mm", "80 mm"]']))
    compare(found, Loaded(found))


def test_rigid_parts_have_no_joint_and_free_ones_no_spring():
    soft, rigid = (
        Loaded(analyze(load("zhang-gosselin-4dof", [f"stiffness.passive_links={k}"]))).model for k in ("1e3", "rigid")
    )
    assert soft.nv == rigid.nv + 2
    free = Loaded(analyze(load("hexapod", ["stiffness.actuator.0=0"]))).model
    assert (free.jnt_stiffness > 0).sum() == 5


def arm(joints, pose, **more):
    """A machine with one leg."""
    document = {"schema": 1, "name": "arm", "family": NAME, "platform": {"point": [0.5, 0, 0]}, "pose": pose}
    return build({**document, "legs": [{"name": "leg", "joints": joints, **more.pop("leg", {})}], **more}, "arm")


def test_a_planar_machine_moves_in_its_plane_only():
    motor = {"name": "motor", "type": "revolute", "joins": ["base", "crank"], "point": [0, 0, 0], "axis": [0, 0, 1]}
    motor |= {"actuated": True, "stiffness": "5e3 N*m/rad"}
    end = {"name": "end", "type": "fixed", "joins": ["crank", "platform"], "point": [0.5, 0, 0]}
    beam = {"links": {"crank": {"model": "beam", "section": "bar"}}}
    bar = {"bar": {"shape": "round", "diameter": "20 mm", "material": "steel"}}
    found = analyze(arm([motor, end], {"y": 0.0}, leg=beam, sections=bar, space="planar"))
    loaded = Loaded(found)
    compare(found, loaded)
    model = loaded.model
    assert model.nv == 6 + 1 + 3, "the free platform, the motor, and the beam's bending, tension and shear in the plane"
    hinges = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
    slides = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
    assert np.allclose(np.abs(model.jnt_axis[hinges]), [0.0, 0.0, 1.0])
    assert np.allclose(model.jnt_axis[slides][:, 2], 0.0)


def test_a_screw_turns_as_it_advances():
    """One leg that is one screw: a force F along it turns the platform by pitch F / k."""
    screw = {"name": "nut", "type": "helical", "joins": ["base", "platform"], "point": [0.1, 0, 0], "axis": [0, 0, 1]}
    screw |= {"pitch": "5 mm", "actuated": True, "stiffness": "2e3 N*m/rad"}
    found = analyze(arm([screw], {"z": 0.0}))
    compare(found, Loaded(found))


def test_known_masses_are_those_of_the_machine():
    found = analyze(load("tripteron", ["tool.mass=12 kg"]))
    model = Loaded(found).model
    assert model.body("platform").mass[0] == 12.0
    legs = sum(model.body_mass) - 12.0
    assert legs == pytest.approx(found.moving_mass - 12.0)


@pytest.mark.parametrize(
    ("name", "weights"),
    [("hexapod", ["tool.mass=2000 kg", "linear_density.legs=1000 kg/m"]), ("tricept", ["tool.mass=8000 kg"])],
)
def test_mujoco_sags_as_a_loaded_machine(name, weights):
    """Gravity at an angle, millimetres of sag: the geometry of the loaded machine, and weight of platform and legs.

    Masses of the exported links say nothing, so that gravity leaves them alone, but for half of each strut at its end.
    """
    gravity = [3.0, -2.0, -9.0]
    machine = load(name, [*weights, f"load.gravity={gravity}", "limits.actuator_force=none"])
    state = under_load(machine)
    root = ElementTree.fromstring(text_of(analyze(machine)))
    bodies = {body.name: body for body in mjcf_model.build(respond(machine).configuration).world.subtree()}
    for element in root.iter("body"):
        body = bodies.get(element.get("name"))
        density = machine.tables["linear_density"].legs
        if body is not None and body.name.endswith(" rod") and density:
            end, start = body.reach[-1], bodies[body.name.removesuffix(" rod")].origin
            inertial = element.find("inertial")
            inertial.set("mass", repr(0.5 * density * float(np.linalg.norm(end - start))))
            inertial.set("pos", " ".join(map(repr, (end - body.origin).tolist())))
        elif body is not None:
            element.set("gravcomp", "1")
    root.find("option").set("gravity", " ".join(map(str, gravity)))
    hanging = Loaded(ElementTree.tostring(root, encoding="unicode"))
    before, axes = hanging.placement()
    hanging.run(hanging.settled)
    after, turned = hanging.placement()
    sag = np.concatenate([Rotation.from_matrix(turned @ axes.T).as_rotvec(), after - before])
    ours = np.array(state.displacement)
    assert sag == pytest.approx(ours, abs=1e-5 * np.abs(ours).max())
    assert state.linear != pytest.approx(ours, abs=1e-3 * np.abs(ours).max()), "geometry matters here"


@pytest.mark.parametrize("radius", ["30 cm", "6 m"])
def test_the_light_stands_above_a_machine_of_any_size(radius):
    """Its cone of 45 deg covers the machine: it stood 4 m above the base, within a large machine."""
    text = text_of(analyze(load("hexapod", [f'geometry.base_radius="{radius}"'])))
    light = np.array(ElementTree.fromstring(text).find("worldbody/light").get("pos").split(), dtype=float)
    for place in Loaded(text).data.xanchor:
        down = light - place
        assert np.hypot(down[0], down[1]) < down[2]
