"""Points of a motion per second: forces of all drives, beside inverse dynamics of MuJoCo and Pinocchio, in one run.

Both are spared the loops: they are asked for the inverse dynamics of the same open trees at the model's own pose with
speeds and accelerations, point by point from Python: MuJoCo for `mj_inverse`, Pinocchio for `rnea`. Neither finds a
pose, and Pinocchio nothing that closes a loop, so that its numbers are not yet forces of drives. All take turns; each
counts by the processor time of its best turn. It prints Markdown.

    python benchmarks/motion.py > docs/measured/motion.md
"""

import os
import platform
import time
from datetime import date

import mujoco
import numpy as np
import pinocchio

from kinetostat.engine.moving import PosePath, forces_on_path, rigid_form
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


def circle(machine: Machine, count: int) -> PosePath:
    """A motion through all coordinates of the pose."""
    time_ = np.linspace(0.0, 1.0, count)
    pose, rates, gains = {}, {}, {}
    for k, (path, here) in enumerate((p, float(v)) for p, v in values(machine).items() if p.startswith(POSE)):
        name, turning = path.removeprefix(POSE), 2.0 * np.pi * (1 + k % 3)
        angle = turning * time_ + k
        pose[name], rates[name] = here + 0.01 * np.sin(angle), 0.01 * turning * np.cos(angle)
        gains[name] = -0.01 * turning**2 * np.sin(angle)
    return PosePath(pose, rates, gains)


def mujoco_seconds(model: mujoco.MjModel) -> float:
    """Seconds of MuJoCo for some points."""
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    speeds, gains = rng.normal(0.0, 0.01, (2, ASKED, model.nv))
    begin = time.process_time()
    for speed, gain in zip(speeds, gains, strict=True):
        data.qvel[:], data.qacc[:] = speed, gain
        mujoco.mj_inverse(model, data)
    return time.process_time() - begin


KINDS = {
    mujoco.mjtJoint.mjJNT_FREE: lambda _: pinocchio.JointModelFreeFlyer(),
    mujoco.mjtJoint.mjJNT_HINGE: pinocchio.JointModelRevoluteUnaligned,
    mujoco.mjtJoint.mjJNT_SLIDE: pinocchio.JointModelPrismaticUnaligned,
}
"""Joints of Pinocchio by those of MuJoCo, from their axis."""


def trees_of(model: mujoco.MjModel) -> pinocchio.Model:
    """The bodies, joints and rotors of a MuJoCo model as trees in Pinocchio; loops stay open."""
    trees, carriers = pinocchio.Model(), {0: (0, pinocchio.SE3.Identity())}
    trees.gravity = pinocchio.Motion(np.array(model.opt.gravity), np.zeros(3))
    for body in range(1, model.nbody):
        joint, place = carriers[model.body_parentid[body]]
        place = place * placement(model.body_pos[body], model.body_quat[body])
        first = model.body_jntadr[body]
        for number in range(first, first + model.body_jntnum[body]):
            free = model.jnt_type[number] == mujoco.mjtJoint.mjJNT_FREE
            anchor = np.zeros(3) if free else model.jnt_pos[number]
            kind = KINDS[mujoco.mjtJoint(model.jnt_type[number])](model.jnt_axis[number])
            joint = trees.addJoint(joint, kind, place * pinocchio.SE3(np.eye(3), anchor), f"joint {number}")
            place = pinocchio.SE3(np.eye(3), -anchor)
        heavy = placement(model.body_ipos[body], model.body_iquat[body])
        inertia = pinocchio.Inertia(model.body_mass[body], np.zeros(3), np.diag(model.body_inertia[body]))
        trees.appendBodyToJoint(joint, inertia, place * heavy)
        carriers[body] = joint, place
    trees.armature = np.array(model.dof_armature)
    return trees


def placement(point: np.ndarray, quaternion: np.ndarray) -> pinocchio.SE3:
    """The placement at a point with MuJoCo's quaternion w, x, y, z."""
    return pinocchio.SE3(pinocchio.Quaternion(*quaternion).matrix(), np.array(point))


def pinocchio_seconds(trees: pinocchio.Model) -> float:
    """Seconds of Pinocchio for some points."""
    data, here = trees.createData(), pinocchio.neutral(trees)
    speeds, gains = np.random.default_rng(0).normal(0.0, 0.01, (2, ASKED, trees.nv))
    begin = time.process_time()
    for speed, gain in zip(speeds, gains, strict=True):
        pinocchio.rnea(trees, data, here, speed, gain)
    return time.process_time() - begin


def check_trees(model: mujoco.MjModel, trees: pinocchio.Model) -> None:
    """Refuse trees that Pinocchio does not move as MuJoCo does without constraints and springs.

    Of a free body both say speeds alike where its axes are those of the world, but Pinocchio's acceleration is that of
    the speed in the body's axes.
    """
    disabled = model.opt.disableflags
    model.opt.disableflags = disabled | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    data.qvel[:], data.qacc[:] = np.random.default_rng(1).normal(0.0, 1.0, (2, model.nv))
    mujoco.mj_inverse(model, data)
    expected = data.qfrc_inverse + data.qfrc_passive
    gains = np.array(data.qacc)
    for start in model.jnt_dofadr[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]:
        gains[start : start + 3] -= np.cross(data.qvel[start + 3 : start + 6], data.qvel[start : start + 3])
    forces = pinocchio.rnea(trees, trees.createData(), pinocchio.neutral(trees), data.qvel, gains)
    if not np.allclose(forces, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max()):
        raise ValueError(f"Pinocchio and MuJoCo differ by {np.abs(forces - expected).max():g}")
    model.opt.disableflags = disabled


def main() -> None:
    """Print the table."""
    print(f"Measured on {date.today()}: {processor()}, one of {os.cpu_count()} cores; ", end="")
    versions = f"MuJoCo {mujoco.__version__}, Pinocchio {pinocchio.__version__}"
    print(f"Python {platform.python_version()}, {versions}; processor time.\n")
    print(f"| machine | {POINTS:,} points | points/s | MuJoCo, points/s | ratio | Pinocchio, open, points/s | ratio |")
    print("|---|---|---|---|---|---|---|")
    for name in NAMES:
        machine = massive(name)
        form, path = rigid_form(state_of(machine)), circle(machine, POINTS)
        model = mujoco.MjModel.from_xml_string(text_of(analyze(machine), vibrating=True))
        trees = trees_of(model)
        check_trees(model, trees)
        seconds = np.full(3, np.inf)
        for _ in range(TURNS):
            begin = time.process_time()
            forces_on_path(form, path)
            turn = time.process_time() - begin, mujoco_seconds(model), pinocchio_seconds(trees)
            seconds = np.minimum(seconds, turn)
        ours, *others = np.array([POINTS, ASKED, ASKED]) / seconds
        columns = [f"{rate:,.0f} | {ours / rate:.0f}" for rate in others]
        print(f"| {machine.name} | {seconds[0]:.3g} s | {ours:,.0f} | {' | '.join(columns)} |", flush=True)


if __name__ == "__main__":
    main()
