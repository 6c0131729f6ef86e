"""A hexapod of telescopes: cylinders and rods that are rigid bodies, with inertia of their own, and massive rotors."""

import numpy as np

from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.machine.loading import build, load

CYLINDER, ROD = (0.8, 0.02), (0.5, -0.025)
"""Mass, kg, and distance of the centre along the leg from its base joint, or if negative from its platform joint, m."""
INERTIA = (4e-4, 5e-4, 3e-4, 1e-5, -2e-5, 3e-5)
"""Of each about its centre, base axes at the home pose: xx yy zz xy xz yz, kg·m²."""
TOOL = {"mass": 3.0, "inertia": [0.02, 0.03, 0.04, 0.001, 0.0, 0.002], "centre_of_mass": [0.02, 0.01, 0.03]}
ROTOR, LEAD = 1e-4, 0.01
GRAVITY = [1.0, 2.0, -9.81]


def ends(leg):
    """Joints of a leg at base and platform at the home pose [3], and the unit vector from one to the other."""
    first, last = (np.array(leg["joints"][k]["point"], dtype=float) for k in (0, 2))
    return first, last, (last - first) / np.linalg.norm(last - first)


def axes(along):
    """Both axes of the universal joint at the base: the first is level."""
    level = np.cross([0.0, 0.0, 1.0], along)
    level /= np.linalg.norm(level)
    return level, np.cross(along, level)


def document():
    """The machine file, leg by leg."""
    result = document_of(load("hexapod"))
    for leg in result["legs"]:
        first, last, along = ends(leg)
        one, other = axes(along)
        del leg["joints"][0]["axis"]
        leg["joints"][0] |= {"first_axis": one.tolist(), "second_axis": other.tolist()}
        places = {"body 1": (CYLINDER[0], first + CYLINDER[1] * along), "body 2": (ROD[0], last + ROD[1] * along)}
        leg["links"] = {
            name: {"model": "rigid", "mass": mass, "centre_of_mass": at.tolist(), "inertia": list(INERTIA)}
            for name, (mass, at) in places.items()
        }
    result |= {"tool": TOOL, "drives": {"rotor_inertia": ROTOR, "lead": LEAD}, "load": {"gravity": GRAVITY}}
    return result


def telescopes():
    """The machine."""
    return build(document(), "telescopes")
