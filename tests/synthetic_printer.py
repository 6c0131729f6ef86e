"""A delta printer whose errors are known, probed on its bed: kinematics written here, from the points of its towers.

A controller commands carriages by the drawn machine. The probe finds the commanded height at which the true nozzle
touches the bed.
"""

from dataclasses import dataclass, field, replace

import numpy as np

RADIUS, PLATFORM, ROD, HEIGHT = 0.1456, 0.040, 0.215, 0.020
ANGLES = np.radians([210.0, 330.0, 90.0])


def turns(count, start=0.5):
    return 2.0 * np.pi * (np.arange(count) + start) / count


PROBED = [(0.0, 0.0)]
PROBED += [(0.08 * np.cos(a), 0.08 * np.sin(a)) for a in turns(6)]
PROBED += [(0.045 * np.cos(a), 0.045 * np.sin(a)) for a in turns(3, 0.0)]
"""Ten places on the bed, m."""


ENDSTOPS = np.array([0.24, 0.24, 0.24])
"""Heights of the nozzle at which the controller believes its carriages to be at their endstops, m."""


@dataclass
class Truth:
    """Errors of a printer, m and rad: by tower, or of all."""

    zeros: np.ndarray = field(default_factory=lambda: np.zeros(3))
    angles: np.ndarray = field(default_factory=lambda: np.zeros(3))
    radius: float = 0.0
    rod: float = 0.0
    lean_out: np.ndarray = field(default_factory=lambda: np.zeros(3))
    lean_aside: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gain: float = 0.0


def firmware_truth(truth):
    """The numbers of `FirmwareNumbers`, from the true printer, mm and deg."""
    radius, rod = RADIUS - PLATFORM, ROD
    rises = np.sqrt(rod**2 - radius**2) - np.sqrt((rod + truth.rod) ** 2 - (radius + truth.radius) ** 2)
    return {
        "radius": [1e3 * (radius + truth.radius)],
        "rods": [1e3 * (rod + truth.rod)] * 3,
        "angles": np.degrees(truth.angles).tolist(),
        "raised": (1e3 * (truth.zeros + rises)).tolist(),
    }


def commanded(point):
    """Heights of the carriages over the bed, as the drawn printer has them at a point of the nozzle."""
    towers = (RADIUS - PLATFORM) * np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
    apart = ((towers - point[:2]) ** 2).sum(axis=1)
    return point[2] + HEIGHT + np.sqrt(ROD**2 - apart)


def reached(heights, truth, start):
    """The point of the true nozzle with carriages at these heights along their towers."""
    angles = ANGLES + truth.angles
    outward = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    aside = np.stack([-np.sin(angles), np.cos(angles), 0.0 * angles], axis=1)
    tower = outward * np.tan(truth.lean_out)[:, None] + aside * np.tan(truth.lean_aside)[:, None] + [0.0, 0.0, 1.0]
    tower /= np.linalg.norm(tower, axis=1)[:, None]
    stands = heights * (1.0 + truth.gain) + truth.zeros
    joints = outward * (RADIUS + truth.radius) + tower * stands[:, None]

    point = np.array(start, dtype=float)
    for _ in range(8):  # Newton's method: three spheres about the joints of the carriages
        apart = joints - point - outward * PLATFORM - [0.0, 0.0, HEIGHT]
        point += np.linalg.solve(2.0 * apart, (apart**2).sum(axis=1) - (ROD + truth.rod) ** 2)
    return point


def probed_heights(truth):
    """The commanded height at which the true nozzle touches the bed, at each probed place, m."""
    result = []
    for x, y in PROBED:
        z = 0.0
        for _ in range(6):
            z -= reached(commanded(np.array([x, y, z])), truth, [x, y, 0.0])[2]
        result.append(z)
    return np.array(result)


def endstops(truth):
    """True heights of the carriages at their endstops, m."""
    return ENDSTOPS + np.sqrt(ROD**2 - (RADIUS - PLATFORM) ** 2) + HEIGHT + truth.zeros


def sent_height(truth, numbers, believed, true, place):
    """Height of the true nozzle that a controller sends to a place of the bed, m.

    Args:
        numbers: of the controller: its delta radius, lengths of rods, and angles of towers, m and rad.
        believed, true: heights of the carriages at their endstops, m.
        place: x and y, m.
    """
    radius, rods, angles = numbers
    towers = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    wanted = np.sqrt(rods**2 - ((towers - place) ** 2).sum(axis=1))
    carriages = true + wanted - believed
    return reached(carriages, replace(truth, zeros=np.zeros(3)), [*place, 0.0])[2]


def write_probes(path, heights):
    """A file of measurements: commanded nozzle, and its true height, which is the bed's."""
    rows = [f"{1e3 * x:.9f},{1e3 * y:.9f},{1e3 * z:.9f},0" for (x, y), z in zip(PROBED, heights, strict=True)]
    path.write_text("\n".join(["x [mm],y [mm],z [mm],measured.z [mm]", *rows]) + "\n", "utf-8")
