"""Heights by which a controller raises the tool of a loaded machine: maps for Klipper and RepRapFirmware.

These controllers have their own kinematics and take no others; what they take is a table over x and y that is added to
z. So displacements along x and y, rotations, and other heights than that of the file are left as they are.
"""

from collections.abc import Sequence
from pathlib import Path
from string import Template
from textwrap import wrap

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.exchange.formats import ascii_line
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.datasets import usual_ranges
from kinetostat.studies.poses import chosen_axes, grid_of
from kinetostat.studies.storage import write_text

X, Y, HEIGHT = "pose.x", "pose.y", "pose.z"
"""Coordinates of the columns and of the rows of a map, and the one that is corrected."""
ROUNDS = 3
"""Times that the sag is computed, each time at the height to which the last one raised the tool: it changes little."""
POINTS = 9
"""Points along each axis where no ranges are given: sag bends smoothly, and splines go between the points."""
FEWEST_POINTS = 3
"""Points along each axis at least: both controllers refuse a mesh of fewer."""
MILLIMETRES = 1e3
"""Millimetres of a metre: both controllers take these."""
NAME_WIDTH = 100
"""Characters of the machine's name in a line of comment, which people read in an editor."""
FEWEST_BICUBIC = 4
"""Points along an axis from which Klipper interpolates by cubic splines; it takes Lagrange's polynomials below."""
KLIPPER = Template("""\
# $name: heights that keep the loaded tool at its z. Made by kinetostat.
# Displacements along x and y, rotations, and heights other than z = $height mm are not corrected.
# Include this file in printer.cfg, which must have a section [bed_mesh]; then BED_MESH_PROFILE LOAD=$profile
[bed_mesh $profile]
version: 1
points:
$points
x_count: $across
y_count: $upwards
min_x: $min_x
max_x: $max_x
min_y: $min_y
max_y: $max_y
mesh_x_pps: 2
mesh_y_pps: 2
algo: $algorithm
tension: 0.2
""")


@dataclass(frozen=True)
class HeightMap:
    """Heights over a grid of x and y.

    Attributes:
        x, y: the coordinates of the columns and of the rows, m.
        heights: the rise of the tool, m [rows x columns]; NaN where the machine has no state of rest.
    """

    x: Array
    y: Array
    heights: Array


def write_klipper(analysis: Analysis, path: Path, over: Sequence[str] | None = None) -> list[Path]:
    """Write the heights as a saved mesh of Klipper.

    Args:
        analysis: the analysis of the machine at its pose; its z is the height of the map.
        path: the path of NAME.cfg; the mesh has the name NAME.
        over: ranges of x and of y, as "x=-100 mm:100 mm:9"; about the pose, as far as a report shows, if None.

    Raises:
        InputError: nothing loads the machine, other axes than x and y, fewer than three points along one or uneven
            ones, or no rest.
    """
    chart = height_map(analysis, over or ())
    if not np.isfinite(chart.heights).all():
        raise InputError(
            f"at {int((~np.isfinite(chart.heights)).sum())} of {chart.heights.size} points the machine is not at rest, "
            f"and Klipper takes no mesh with holes; choose narrower ranges with --over{_narrower_ranges(chart)}."
        )
    lines = [", ".join(f"{MILLIMETRES * height:.6f}" for height in row) for row in chart.heights]
    ends = {f"{side}_{name}": f"{MILLIMETRES * value:.6g}" for name, axis in (("x", chart.x), ("y", chart.y))
            for side, value in (("min", axis[0]), ("max", axis[-1]))}  # fmt: skip
    words = {
        "name": "\n# ".join(wrap(ascii_line(analysis.machine.name), NAME_WIDTH)),
        "height": f"{MILLIMETRES * float(values(analysis.machine)[HEIGHT]):.6g}",
        "profile": "".join(c if c.isalnum() and c.isascii() else "_" for c in path.stem),
        "points": "\n".join(f"  {line}" for line in lines),
        "across": len(chart.x),
        "upwards": len(chart.y),
        "algorithm": "bicubic" if min(chart.heights.shape) >= FEWEST_BICUBIC else "lagrange",
    }
    write_text(path, KLIPPER.substitute(words | ends))
    return [path]


def write_reprapfirmware(analysis: Analysis, path: Path, over: Sequence[str] | None = None) -> list[Path]:
    """Write the heights as a height map of RepRapFirmware, for `G29 S1 P"NAME.csv"`.

    Arguments and errors are those of `write_klipper`, but points without rest are holes of the map.
    """
    chart = height_map(analysis, over or ())
    heights = chart.heights[np.isfinite(chart.heights)]
    steps = [MILLIMETRES * (axis[1] - axis[0]) for axis in (chart.x, chart.y)]
    ends = [MILLIMETRES * value for axis in (chart.x, chart.y) for value in (axis[0], axis[-1])]
    sizes = [f"{value:.3f}" for value in (*ends, -1.0, *steps)] + [str(len(chart.x)), str(len(chart.y))]
    # RepRapFirmware reads a bare 0, without a decimal point, as a point that was not measured.
    rows = [", ".join(f"{MILLIMETRES * h:.4f}" if np.isfinite(h) else "0" for h in row) for row in chart.heights]
    lines = [
        "RepRapFirmware height map file v2 generated by kinetostat, "
        f"mean error {MILLIMETRES * heights.mean():.3f}, deviation {MILLIMETRES * heights.std():.3f}",
        "xmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum",
        ",".join(sizes),
        *rows,
    ]
    write_text(path, "\n".join([*lines, ""]))
    return [path]


def _narrower_ranges(chart: HeightMap) -> str:
    """Write as options the widest ranges in which a map has no hole, narrower by as many points on all sides."""
    for margin in range(1, (min(chart.heights.shape) - 1) // 2):
        inside = slice(margin, -margin)
        if np.isfinite(chart.heights[inside, inside]).all():
            ends = {name: MILLIMETRES * axis[inside][[0, -1]] for name, axis in (("x", chart.x), ("y", chart.y))}
            ranges = [f'--over "{name}={low:.4g} mm:{high:.4g} mm:{POINTS}"' for name, (low, high) in ends.items()]
            return f", for instance {' '.join(ranges)}"
    return ""


def height_map(analysis: Analysis, over: Sequence[str]) -> HeightMap:
    """Compute by how much the tool must be raised so that, at rest under its loads, it is at the height of the pose.

    Args:
        analysis: the analysis of the machine at its pose.
        over: ranges of x and of y; those that a report takes if there are none.

    Raises:
        InputError: nothing loads the machine, other axes than x and y, fewer than three points along one or uneven
            ones, or no rest.
    """
    machine = analysis.machine
    x, y = _map_axes(machine, over)
    heights = _raised_heights(machine, x, y)
    if not np.isfinite(heights).any():
        raise InputError("At no point of these ranges is the machine at rest; choose other ranges with --over.")
    if not np.nan_to_num(heights).any():
        raise InputError(
            "Nothing loads the machine, so that no height needs a correction; give it a load, for instance "
            "with --set tool.mass=\"2 kg\" --set 'load.gravity=[0, 0, -9.81]'."
        )
    return HeightMap(x, y, heights)


def _map_axes(machine: Machine, over: Sequence[str]) -> tuple[Array, Array]:
    """Return the coordinates of the columns and the rows of a map, m, increasing.

    Raises:
        InputError: as `height_map` about axes.
    """
    missing = [path.removeprefix(POSE) for path in (X, Y, HEIGHT) if path not in values(machine)]
    if missing:
        raise InputError(
            f"The pose of {machine.name} has no {' and no '.join(missing)}, and a map of heights corrects z over x and "
            "y; kinetostat command computes the corrections of any pose."
        )
    chosen = chosen_axes(machine, over or usual_ranges(machine, POINTS))
    if any(span.logarithmic for span, _ in chosen):
        raise InputError("A map of heights needs evenly spaced points; leave out :log.")
    grid = grid_of(chosen)
    axes = {path: axis.values for axis in grid.axes for path in axis.paths}
    if set(axes) != {X, Y} or min(map(len, axes.values())) < FEWEST_POINTS:
        raise InputError(
            "A map of heights needs ranges of x and of y with at least three points each: "
            '--over "x=-100 mm:100 mm:9" --over "y=-100 mm:100 mm:9".'
        )
    return np.sort(axes[X]), np.sort(axes[Y])


def _raised_heights(machine: Machine, x: Array, y: Array) -> Array:
    """Compute by how much the tool must be raised at each point, m [rows x columns]; NaN without a state of rest."""
    x_of_points, y_of_points = (part.ravel() for part in np.meshgrid(x, y))
    height = float(values(machine)[HEIGHT])
    rises = np.zeros(x_of_points.size)
    for _ in range(ROUNDS):
        columns = {X: x_of_points, Y: y_of_points, HEIGHT: height + np.nan_to_num(rises)}
        answers = evaluate(machine, PointTable(columns), ["displacement_z"])
        rises = np.where(answers.status == Status.OK, -answers.values["displacement_z"], np.nan)
    return rises.reshape(len(y), len(x))
