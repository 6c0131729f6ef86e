"""Machines under large loads in independent engines: weights of links, preloads, cables, tangents; sag in MuJoCo.

Exudyn solves its own nonlinear statics of rigid bodies and springs, MuJoCo runs until the machine hangs still.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kinetostat import build, under_load
from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.mechanism import mechanism_of
from kinetostat.equilibrium.solving import Rest, at_rest
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loads import located_members
from kinetostat.validation import exudyn_machine
from kinetostat.validation.comparison import KNOWN
from kinetostat.validation.exudyn_machine import add_masses, modal_frequencies
from kinetostat.validation.machine_from_file import machine_from_file
from kinetostat.validation.pieces import bodies_before
from kinetostat.vibration.modes import frequencies
from machines import STRETCH, cable, load_without_limits, written

pytest.importorskip("exudyn")
EXUDYN = KNOWN[0]

DENSITIES = {
    "hexapod": {"legs": 3000.0},
    "hexapod-rus": {"cranks": 60.0, "rods": 30.0},
    "tricept": {"legs": 300.0, "tube": 900.0},
    "passive-leg-5dof-rus": {"cranks": 0.08, "rods": 0.03, "passive_links": 0.1},
    "planar-3rrr": {"proximal_links": 90.0, "distal_links": 60.0},
}
"""kg/m of the links: with them the weight of links moves the tool as much as its load does."""
SIZES = {
    "hexapod": 2e4,
    "hexapod-rus": 3e3,
    "tricept": 1e5,
    "passive-leg-5dof-rus": 3.0,
    "planar-3rrr": 2e3,
    "tripteron": 2e3,
    "delta": 300.0,
    "orthoglide": 3e3,
}
"""N: loads that move the tool by millimetres."""


class Engine:
    """A machine with its weights and preloads in Exudyn."""

    def __init__(self, machine):
        self.machine = machine
        self.joints = solve_joints(machine) if machine.family.chains else None
        self.response = respond(machine, self.joints)
        configuration, reference = self.response.configuration, self.response.reference
        model, _ = exudyn_machine.build(configuration, reference)
        model.system.Assemble()
        unit = float(np.max(np.abs(model.system.ComputeLinearizedSystem(exudyn_machine.settings_of(model))[1])))
        self.model, self.platform = exudyn_machine.build(configuration, reference, unit, preloaded=True)
        kinds = (self.model.items.Torque, self.model.items.Force)
        marker = self.model.add_marker(self.platform, self.platform.origin, np.eye(3))
        self.loads = [self.model.system.AddLoad(kind(markerNumber=marker, loadVector=[0.0] * 3)) for kind in kinds]
        self._weigh()
        self.model.system.Assemble()
        self.start = self.model.system.systemData.GetODE2Coordinates()

    def _weigh(self):
        gravity, tool = np.array(self.machine.tables["load"].gravity), self.machine.tables["tool"]
        configuration = self.response.configuration
        centre = configuration.platform.apply(Vector(*tool.centre_of_mass))
        self._pull(self.platform, centre, tool.mass * gravity)
        amounts = None if self.joints is None else self.joints.coordinates
        for link in located_members(self.machine, configuration, amounts):
            number = next((i for i, leg in enumerate(configuration.legs) if leg.name == link.leg), None)
            if number is None:
                number = next(i for i, leg in enumerate(configuration.legs) if leg.number is None)
            halves = [(*end, 0.5) for end in link.ends()] if link.centre is None else [(*link.centre(), 1.0)]
            for carried, point, share in halves:
                place = bodies_before(configuration.legs[number], (carried, point), configuration.plane)
                self._pull(self.model.chains[number][place], point, share * float(link.mass) * gravity)

    def _pull(self, body, point, force):
        if body.node is None or not np.any(force):
            return
        marker = self.model.add_marker(body, np.array(point.components(), dtype=float), np.eye(3))
        self.model.system.AddLoad(
            self.model.items.Force(markerNumber=marker, loadVector=(force / self.model.unit).tolist())
        )

    def displacement(self, wrench):
        """Rotation vector and displacement of the tool point under a wrench there [6]."""
        system, engine = self.model.system, self.model.engine
        for load, part in zip(self.loads, np.split(wrench / self.model.unit, 2), strict=True):
            system.SetLoadParameter(load, "loadVector", part)
        system.systemData.SetODE2Coordinates(self.start, engine.ConfigurationType.Initial)
        assert engine.MainSolverStatic().SolveSystem(system, exudyn_machine.settings_of(self.model))
        moved = np.array(system.GetNodeOutput(self.platform.node, engine.OutputVariableType.Coordinates))
        moved = moved[exudyn_machine.TRANSLATION_FIRST]
        return np.concatenate([Rotation.from_euler("XYZ", moved[:3]).as_rotvec(), moved[3:]])


def wrench_of(machine):
    return np.array(machine.load.components(), dtype=float)


def compare(machine, agreed):
    """Compare the state of rest, in the components that the machine has."""
    state, parts = under_load(machine), list(machine.family.components)
    assert state.rest is not Rest.NO_REST
    theirs = Engine(machine).displacement(wrench_of(machine))[parts]
    sizes = np.abs(state.displacement).max()
    assert theirs == pytest.approx(np.array(state.displacement), abs=agreed * sizes)
    return state


def loads(name, share=1.0):
    """Force and moment, a mass beside the platform's centre, and gravity at an angle."""
    size, planar = SIZES[name] * share, name.startswith("planar")
    force = np.array([0.3, 0.5, 0.0 if planar else -0.8]) * size
    moment = np.array([0.0, 0.0, 0.01] if planar else [0.02, 0.01, 0.015]) * size
    gravity = [2.0, -3.0, 0.0 if planar else -9.0]
    return [
        f"load.force={force.tolist()}",
        f"load.moment={moment.tolist()}",
        f"tool.mass={size / 20.0}",
        f"tool.centre_of_mass={[0.01, 0.02, 0.0 if planar else 0.05]}",
        f"load.gravity={gravity}",
    ]


def weighing(name):
    return [f"linear_density.{link}={density}" for link, density in DENSITIES[name].items()]


@pytest.mark.parametrize("name", DENSITIES)
def test_exudyn_comes_to_the_same_state_with_weights_of_links(name):
    machine = load_without_limits(name, [*loads(name), *weighing(name)])
    state = compare(machine, 1e-6)
    assert state.linear != pytest.approx(state.displacement, rel=1e-5), "geometry matters here"
    light = under_load(load_without_limits(name, loads(name)))
    assert light.displacement != pytest.approx(state.displacement, rel=0.02), "and the links do"


def test_exudyn_comes_to_the_same_state_with_centres_of_mass_beside_the_links():
    document = document_of(load_without_limits("planar-3rrr", loads("planar-3rrr")))
    for number, leg in enumerate(document["legs"]):
        for body in {body for joint in leg["joints"] for body in joint["joins"]} - {"base", "platform"}:
            known = leg.setdefault("links", {}).setdefault(body, {"model": "rigid"})
            known |= {"mass": 30.0, "centre_of_mass": [0.1 * number, 0.05, 0.0]}
    machine = build(document, "legs")
    state = compare(machine, 1e-6)
    light = under_load(load_without_limits("planar-3rrr", loads("planar-3rrr")))
    assert light.displacement != pytest.approx(state.displacement, rel=0.02)


@pytest.mark.parametrize("name", DENSITIES)
def test_exudyn_comes_to_the_same_state_with_preloads(name):
    """Each leg by another preload, so that they do not balance: they move the tool, and stiffen it."""
    document = document_of(load_without_limits(name, loads(name)))
    driven = [joint for leg in document["legs"] for joint in leg["joints"] if joint.get("actuated")]
    for number, joint in enumerate(driven):
        arm = 0.1 if joint["type"] == "revolute" else 1.0
        joint["preload"] = (0.4 - 0.15 * number) * SIZES[name] * arm
    state = compare(build(document, "legs"), 1e-6)
    relaxed = under_load(load_without_limits(name, loads(name)))
    assert relaxed.displacement != pytest.approx(state.displacement, rel=0.02)


@pytest.mark.parametrize("name", DENSITIES)
def test_the_tangent_is_that_of_exudyn(name):
    """Central differences of the engine's loaded states, extrapolated to no step; of translations, which have no frame.

    A moment that keeps its axis has no potential, so that the engine's compliance is not symmetric; ours is its
    symmetric part.
    """
    machine = load_without_limits(name, [*loads(name), *weighing(name)])
    state, engine, here = under_load(machine), Engine(machine), wrench_of(machine)
    parts = [i for i in machine.family.components if i > 2]
    rows = [list(machine.family.components).index(i) for i in parts]
    step = 0.02 * np.linalg.norm(here[3:])
    columns = []
    for i in parts:
        unit = np.eye(6)[i]
        wide, narrow = (
            (engine.displacement(here + h * unit) - engine.displacement(here - h * unit)) / (2.0 * h)
            for h in (step, 0.5 * step)
        )
        columns.append(((4.0 * narrow - wide) / 3.0)[parts])
    theirs, ours = np.array(columns), np.array(state.compliance)[np.ix_(rows, rows)]
    assert 0.5 * (theirs + theirs.T) == pytest.approx(ours, abs=1e-6 * np.abs(ours).max())


PULLS = {
    "force": ["load.force=[4000, 6000, -10000]"],
    "weight": ["load.gravity=[300, -200, -900]"],
    "preloads": [],
}


@pytest.mark.parametrize("what", PULLS)
def test_frequencies_about_the_loaded_state_are_those_of_exudyn(what):
    """Of struts as bars and loads without a lever: the engine linearises neither levers nor constraints that turn."""
    machine = load_without_limits("hexapod", ["tool.mass=20", "tool.inertia=[0.05, 0.06, 0.07, 0, 0, 0]", *PULLS[what]])
    if what == "preloads":
        document = document_of(machine)
        driven = [joint for leg in document["legs"] for joint in leg["joints"] if joint.get("actuated")]
        for number, joint in enumerate(driven):
            joint["preload"] = 3000.0 - 900.0 * number
        machine = build(document, "legs")
    free = EXUDYN.frequencies(machine)
    joints = solve_joints(machine) if machine.family.chains else None
    loaded = frequencies(at_rest(mechanism_of(machine, respond(machine, joints).configuration, joints)).balance)[0]
    engine = Engine(machine)
    add_masses(engine.model, engine.platform, machine, machine_from_file(machine, engine.response, engine.joints))
    engine.model.system.Assemble()
    engine.start = engine.model.system.systemData.GetODE2Coordinates()
    engine.displacement(wrench_of(machine))
    data, begin = engine.model.system.systemData, engine.model.engine.ConfigurationType.Initial
    data.SetODE2Coordinates(data.GetODE2Coordinates(), begin)
    assert loaded == pytest.approx(modal_frequencies(engine.model), rel=1e-9)
    assert loaded != pytest.approx(free, rel=1e-5), "the load does matter"


@pytest.mark.parametrize("name", ["delta", "orthoglide", "tripteron"])
def test_other_models_of_parallelograms_and_beams_differ_by_the_square_of_the_load(name):
    """The engine has two bars in a parallelogram, and a beam's springs at its end; here both are at the middle."""
    errors, moved = [], []
    for share in (1.0, 0.5, 0.25):
        gravity = f"load.gravity={(np.array([2.0, -3.0, -9.0]) * share).tolist()}"
        machine = load_without_limits(name, [*loads(name, share)[:2], *loads(name)[2:4], gravity])
        state = np.array(under_load(machine).displacement)
        errors.append(np.abs(Engine(machine).displacement(wrench_of(machine)) - state).max())
        moved.append(np.abs(state).max())
    assert moved[0] > 1e-3
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.3)


ROOM = """
[tool]
mass = 60
centre_of_mass = [0.02, 0.01, 0.05]
[load]
force = [150, -40, 0]
gravity = [0, 0, -9.81]
"""
PRELOAD = 60.0
CORNERS = np.array([[x, y, z] for x in (-3.0, 3.0) for y in (-2.0, 2.0) for z in (0.0, 4.0)])
EYES = np.array([[x, y, z] for x in (-0.2, 0.25) for y in (-0.3, 0.35) for z in (2.3, 1.8)])


def test_cables_that_go_slack_are_those_of_exudyn():
    """Eight cables in a room, in the engine as forces of its own between points of two bodies, which never push."""
    ends = zip(CORNERS.tolist(), EYES.tolist(), strict=True)
    legs = "".join(cable(f"c{i}", corner, eye, PRELOAD) for i, (corner, eye) in enumerate(ends))
    head = written("room", (0, 0, 2), {"x": 0, "y": 0, "z": 2, "roll": 0, "pitch": 0, "yaw": 0}, planar=False)
    machine = build(head + ROOM + legs)
    state = under_load(machine)
    assert state.rest is Rest.OK
    assert 1 <= len(state.slack_legs) <= 4
    at = np.array([0.0, 0.0, 2.0])
    model = exudyn_machine.Multibody(STRETCH)
    platform = model.add_body(at)

    def tension(mbs, t, item, stretch, speed, stiffness, damping, force):
        return max(stiffness * stretch + force, 0.0)

    for corner, eye in zip(CORNERS, EYES, strict=True):
        markers = [model.add_marker(body, p, np.eye(3)) for body, p in ((model.ground, corner), (platform, eye))]
        model.system.AddObject(
            model.items.SpringDamper(
                markerNumbers=markers,
                referenceLength=float(np.linalg.norm(eye - corner)),
                stiffness=1.0,
                force=PRELOAD / STRETCH,
                springForceUserFunction=tension,
            )
        )
    tip = model.add_marker(platform, at, np.eye(3))
    heavy = model.add_marker(platform, np.add(at, [0.02, 0.01, 0.05]), np.eye(3))
    loads = [
        model.system.AddLoad(kind(markerNumber=tip, loadVector=[0.0] * 3))
        for kind in (model.items.Torque, model.items.Force)
    ]
    weight = [0.0, 0.0, -60 * 9.81 / STRETCH]
    model.system.AddLoad(model.items.Force(markerNumber=heavy, loadVector=weight))
    model.system.Assemble()
    settings = exudyn_machine.settings_of(model)
    settings.staticSolver.numberOfLoadSteps = 10
    force, torque = wrench_of(machine)[3:], wrench_of(machine)[:3]
    for load, part in zip(loads, (torque, force), strict=True):
        model.system.SetLoadParameter(load, "loadVector", part / STRETCH)
    assert model.engine.MainSolverStatic().SolveSystem(model.system, settings)
    moved = np.array(model.system.GetNodeOutput(platform.node, model.engine.OutputVariableType.Coordinates))
    turned = Rotation.from_euler("XYZ", moved[3:]).as_rotvec()
    theirs = np.concatenate([turned, moved[:3]])
    assert theirs == pytest.approx(np.array(state.displacement), abs=1e-6 * np.abs(state.displacement).max())
