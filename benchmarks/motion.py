"""Points of a motion per second: forces of all drives, beside MuJoCo's inverse dynamics, in one run.

MuJoCo is spared the closing of the loops: it is asked for `mj_inverse` at the model's own pose with speeds and
accelerations, point by point from Python. Both take turns; each counts by its best turn. It prints Markdown.

    python benchmarks/motion.py > docs/measured/motion.md
"""

import os
import platform
import time
from datetime import date

import mujoco
import numpy as np

from kinetostat.engine.moving import Path, forces_on_path, rigid_form
from kinetostat.equilibrium.state import state_of
from kinetostat.exchange.mjcf import text_of
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, parameters, values
from kinetostat.studies.analysis import analyze
from kinetostat.studies.diagnosis import processor

POINTS, ASKED, TURNS = 100_000, 2_000, 4
NAMES = ("hexapod", "hexapod-rus", "delta", "zhang-gosselin-4dof", "planar-3rrr", "tripteron")
MASSES = ("tool.mass=3 kg", "tool.inertia=[0.02, 0.03, 0.04, 0, 0, 0]", "drives.rotor_inertia=1e-4")
DRIVES = ("drives.lead=10 mm", "drives.ratio=5")


def massive(name: str) -> Machine:
    """A bundled machine with massive links and rotors."""
    links = [p.path for p in parameters(load(name).family) if p.path.startswith("linear_density.")]
    return load(name, [*MASSES, *DRIVES, *(f"{path}=2 kg/m" for path in links)])


def circle(machine: Machine, count: int) -> Path:
    """A motion through all coordinates of the pose."""
    time_ = np.linspace(0.0, 1.0, count)
    pose, rates, gains = {}, {}, {}
    for k, (path, here) in enumerate((p, float(v)) for p, v in values(machine).items() if p.startswith(POSE)):
        name, turning = path.removeprefix(POSE), 2.0 * np.pi * (1 + k % 3)
        angle = turning * time_ + k
        pose[name], rates[name] = here + 0.01 * np.sin(angle), 0.01 * turning * np.cos(angle)
        gains[name] = -0.01 * turning**2 * np.sin(angle)
    return Path(pose, rates, gains)


def mujoco_seconds(machine: Machine) -> float:
    """Seconds of MuJoCo for some points."""
    model = mujoco.MjModel.from_xml_string(text_of(analyze(machine), vibrating=True))
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    speeds, gains = rng.normal(0.0, 0.01, (2, ASKED, model.nv))
    begin = time.perf_counter()
    for speed, gain in zip(speeds, gains, strict=True):
        data.qvel[:], data.qacc[:] = speed, gain
        mujoco.mj_inverse(model, data)
    return time.perf_counter() - begin


def main() -> None:
    """Print the table."""
    print(f"Measured on {date.today()}: {processor()}, one of {os.cpu_count()} cores; ", end="")
    print(f"Python {platform.python_version()}, MuJoCo {mujoco.__version__}.\n")
    print(f"| machine | {POINTS:,} points | points/s | MuJoCo, points/s | ratio |")
    print("|---|---|---|---|---|")
    for name in NAMES:
        machine = massive(name)
        form, path = rigid_form(state_of(machine)), circle(machine, POINTS)
        ours, theirs = np.inf, np.inf
        for _ in range(TURNS):
            begin = time.perf_counter()
            forces_on_path(form, path)
            ours = min(ours, time.perf_counter() - begin)
            theirs = min(theirs, mujoco_seconds(machine))
        rates = POINTS / ours, ASKED / theirs
        print(
            f"| {machine.name} | {ours:.3g} s | {rates[0]:,.0f} | {rates[1]:,.0f} | {rates[0] / rates[1]:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
