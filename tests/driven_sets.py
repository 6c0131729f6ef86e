"""Machines with limits of their drives, and linear programmes over forces of legs and rates of joints.

The programmes know passive and actuated joints of each leg and nothing else: no wrenches of legs, no faces.
"""

from functools import cache

import numpy as np
from scipy.optimize import linprog

from kinetostat import build, load
from kinetostat.equilibrium.state import state_of
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.machine.parameters import values, with_values
from kinetostat.motion.rates import PoseRates
from machines import cable, written

EQUAL = 1e-9
"""Between a set and a linear programme, relative."""


@cache
def cables(top=1.6, twisted=-0.3):
    """A platform in eight cables, two more than its freedoms; they pull between 5 and 500 N."""
    pose = {"x": 0.1, "y": 0.05, "z": 0.8, "roll": 0.05, "pitch": 0, "yaw": 0.02}
    text = written("cables", (0, 0, 0.8), pose, planar=False)
    for number in range(8):
        corner, upper = np.pi * (0.25 + 0.5 * (number % 4)), number > 3
        base = [1.4 * np.cos(corner), 1.2 * np.sin(corner), top if upper else 0.0]
        turned = corner + (twisted if upper else -twisted)
        eye = [0.2 * np.cos(turned), 0.2 * np.sin(turned), 0.7 if upper else 0.9]
        text += cable(f"c{number}", [float(c) for c in base], [float(c) for c in eye])
    weight = '[tool]\nmass = "4 kg"\n[load]\nmin_tension = 5\nmax_tension = 500\ngravity = [0, 0, -9.81]\n'
    return build(f"{text}{weight}[limits]\nactuator_speed = 2.0\n")


def tripteron_with_a_cable():
    """One drive more than freedoms, beside structure that is overconstrained three times."""
    document = document_of(load("tripteron", LINEAR))
    document["legs"].append(
        {"name": "rope", "type": "cable", "from": [0.3, 0.2, 0.9], "to": [0.0, 0.0, 0.0], "stiffness": 1e6}
    )
    return build(document, "tripteron with a cable")


LINEAR = ["limits.actuator_force=500 N", "limits.actuator_speed=0.3 m/s", "load.force=[20, -10, -60]"]
ROTARY = ["limits.actuator_moment=50 N*m", "limits.actuator_turning_speed=3 rad/s", "load.force=[20, -10, -60]"]
MACHINES = {
    "hexapod": lambda: load("hexapod", LINEAR),
    "delta": lambda: load("delta", ROTARY),
    "passive-leg-4dof-rus": lambda: load("passive-leg-4dof-rus", ["limits.actuator_moment=50 N*m", *ROTARY[1:2]]),
    "planar-3rrr": lambda: load("planar-3rrr", ["limits.actuator_moment=50 N*m", *ROTARY[1:2]]),
    "tripteron": lambda: load("tripteron", LINEAR),
    "tripteron with a cable": lambda: tripteron_with_a_cable(),
    "cables": cables,
}


def poses(machine, count):
    """The free machine at random poses around its own."""
    return (state.free for state in states(machine, count))


def states(machine, count):
    """States of the machine at random poses around its own."""
    rng = np.random.default_rng(count)
    table = machine.tables["pose"]
    names = [name for name in vars(table) if isinstance(getattr(table, name), float)]
    while count:
        moved = {f"pose.{name}": getattr(table, name) + rng.uniform(-0.03, 0.03) for name in names}
        state = state_of(with_values(machine, moved))
        if state.status.word == "ok":
            count -= 1
            yield state


def screws(response):
    """Twists of the passive joints and of the drives of every leg [6 x n], without what a plane takes away."""
    passive, driven = [], []
    for leg, placed in zip(response.legs, response.configuration.legs, strict=True):
        own = np.array([joint.twist(response.reference).components() for joint in placed.passive], dtype=float)
        passive.append(own.reshape(-1, 6).T)
        pairs = zip(placed.springs, leg.elastic, strict=True)
        rows = [twist.components() for spring, twist in pairs if spring.actuated and spring.stiffness > 0.0]
        driven.append(np.array(rows, dtype=float).reshape(-1, 6).T)
    return passive, driven


def greatest_wrench(response, direction):
    """By a linear programme: how far a wrench in a direction may grow beside the load. One wrench for every leg."""
    passive, driven = screws(response)
    legs, bounds = len(passive), [(drive.lower, drive.upper) for drive in response.drives]
    load = np.array(response.load.components(), dtype=float)
    plane = np.array([w.components() for w in response.guide], dtype=float).reshape(-1, 6).T
    size = 6 * legs + plane.shape[1]
    equal, right = np.zeros((6, size + 1)), load
    for leg in range(legs):
        equal[:, 6 * leg : 6 * leg + 6] = np.eye(6)
    equal[:, 6 * legs : size], equal[:, size] = plane, -np.asarray(direction)
    rows, limits = [equal], [right]
    below, most = [], []
    drive = iter(bounds)
    for leg, (free, held) in enumerate(zip(passive, driven, strict=True)):
        for column in free.T:
            row = np.zeros((1, size + 1))
            row[0, 6 * leg : 6 * leg + 6] = column
            rows.append(row)
            limits.append([0.0])
        for column in held.T:
            row = np.zeros(size + 1)
            row[6 * leg : 6 * leg + 6] = column
            least, greatest = next(drive)
            below += [row, -row]
            most += [greatest, -least]
    goal = np.zeros(size + 1)
    goal[-1] = -1.0
    solved = linprog(goal, below, most, np.vstack(rows), np.concatenate(limits), [(None, None)] * (size + 1))
    return solved.x[-1] if solved.status == 0 else np.inf if solved.status == 3 else -np.inf


def greatest_motion(response, direction):
    """By a linear programme over all rates of joints: how fast the platform may move along a direction."""
    passive, driven = screws(response)
    absent = [] if response.configuration.plane is None else response.configuration.plane.missing_freedoms
    away = np.array([joint.twist(response.reference).components() for joint in absent], dtype=float).reshape(-1, 6).T
    blocks = [np.hstack([free, held, away]) for free, held in zip(passive, driven, strict=True)]
    size = sum(block.shape[1] for block in blocks)
    equal, at, bounds = np.zeros((6 * len(blocks), size + 1)), 0, []
    speeds = iter(drive.speed for drive in response.drives)
    for leg, (block, held) in enumerate(zip(blocks, driven, strict=True)):
        equal[6 * leg : 6 * leg + 6, at : at + block.shape[1]] = block
        equal[6 * leg : 6 * leg + 6, size] = -np.asarray(direction)
        at += block.shape[1]
        limited = [next(speeds) for _ in held.T]
        bounds += [(None, None)] * passive[leg].shape[1] + [(-s, s) for s in limited] + [(None, None)] * away.shape[1]
    goal = np.zeros(size + 1)
    goal[-1] = -1.0
    solved = linprog(goal, A_eq=equal, b_eq=np.zeros(len(equal)), bounds=[*bounds, (None, None)])
    return solved.x[-1] if solved.status == 0 else np.inf if solved.status == 3 else -np.inf


def by_faces(faces, direction):
    """How far a wrench, or an acceleration, may grow within the faces of the set."""
    reach = np.inf
    for face in faces:
        rate = float(np.dot(face.normal.components(), direction))
        if abs(rate) > 1e-12:
            reach = min(reach, (face.upper if rate > 0 else face.lower) / rate)
    return reach


def massive(machine):
    """The machine with masses of all its parts and without gravity, so that links weigh nothing."""
    known = values(machine)
    given = {path: 2.0 for path in known if path.startswith("linear_density.")}
    given |= {"tool.mass": 3.0, "drives.rotor_inertia": 1e-4, "drives.lead": 0.01, "drives.ratio": 5.0}
    given |= {f"tool.inertia.{place}": size for place, size in enumerate((0.02, 0.03, 0.04))}
    given |= {f"tool.centre_of_mass.{place}": size for place, size in enumerate((0.02, 0.01))}
    given |= {f"load.gravity.{place}": 0.0 for place in range(3)}
    return with_values(machine, {path: value for path, value in given.items() if path in known})


def greatest_gain(equations, gains):
    """By a linear programme over the forces of the drives: how fast the coordinates may gain speed along gains.

    The equations of motion over the coordinates of the pose know no faces and no screws of legs.
    """
    held = equations.forces([0.0] * len(gains), [0.0] * len(gains))["process"] @ equations.jacobian
    drives = equations.state.free.drives
    bounds = [
        (d.lower, d.upper) if s < 0.0 else (-d.upper, -d.lower) for d, s in zip(drives, equations.senses, strict=True)
    ]
    equal = np.column_stack([equations.jacobian.T, -equations.mass @ gains])
    solved = linprog([0.0] * len(drives) + [-1.0], A_eq=equal, b_eq=held, bounds=[*bounds, (None, None)])
    return solved.x[-1] if solved.status == 0 else np.inf if solved.status == 3 else -np.inf


def twist_of(equations, gains):
    """The acceleration of the tool point from rest by those of the coordinates of the pose [6], rad/s² and m/s²."""
    here = equations._at_pose
    still = dict.fromkeys(here.names, 0.0)
    twist = here.along(PoseRates(dict(zip(here.names, gains, strict=True)), still)).platform.twist
    size = float(here.rigid.length)
    return np.array([*twist.rotational.components(), *(c * size for c in twist.translational.components())], float)
