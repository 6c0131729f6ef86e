"""An analysis for people: the answer first, in a few lines; then its reasons and matrices, as tables with units.

Nothing is computed but 1/C, lengths of vectors, percentages and sums of shares. Every view that begins with the answer
takes its lines from here.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from kinetostat.algebra.scalar import reciprocal
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.display import DASH, ENGINEERING, Display, number
from kinetostat.kinematics.mobility import SortOfPose
from kinetostat.kinetostatics.eigenscrews import Eigenscrew
from kinetostat.kinetostatics.indices import PrincipalStiffness
from kinetostat.machine.machine import pose_of
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.analysis_parts import LoadCase
from kinetostat.studies.attribution import Softest, by_part, largest_contributors
from kinetostat.studies.directions import DirectionalStiffness
from kinetostat.tolerances import EQUAL_STIFFNESSES, ROUND_OFF_OF_ENTRY
from kinetostat.units import load_unit, motion_unit
from kinetostat.views.tables import FittedTable, numeric_table

BLOCKS = (("translation", "along", "N/m"), ("rotation", "about", "N·m/rad"))
"""Blocks of C, each with the word for its directions and the unit of its stiffness."""
MATRIX_UNITS = {"stiffness": ("N·m/rad", "N/rad", "N/m"), "compliance": ("rad/(N·m)", "rad/N", "m/N")}
"""SI units of the blocks of K and C: rotation, coupling, translation."""
ROTATION_NAMES = COMPONENTS[:3]
"""Names of the components that are rotations or moments: rx, ry, rz."""
MOST_NAMED = 4
"""Parts of unknown mass that are named at most, on one line."""


def first_lines(analysis: Analysis) -> list[tuple[str, str]]:
    """Return label and text of each line: pose and verdict, stiffness, softest direction, margin, and the load."""
    pose = pose_of(analysis.machine)
    lines = [("Pose", f"{pose}. {analysis.message}" if pose else analysis.message)]
    if analysis.compliance_diagonal.size:
        text = stiffness_sentence(analysis.components, analysis.compliance_diagonal.tolist(), analysis.machine.display)
        lines.append(("Stiffness", f"{text} (1/C at the {analysis.machine.reference}, {analysis.axes} axes)."))
    if analysis.softest:
        lines.append(("Softest", softest_sentence(analysis.softest, analysis.machine.display)))
    if analysis.singularity_margin is not None:
        lines.append(("Margin", margin_sentence(analysis)))
    if analysis.load:
        lines.append(("To first order" if analysis.machine.loaded else "Load", _load_sentence(analysis, analysis.load)))
    return lines


def margin_sentence(analysis: Analysis) -> str:
    """Return a sentence with the singularity margin of an analysed pose and the two of which it is the least."""
    number = analysis.machine.display.number
    legs, platform = number(analysis.leg_singularity_margin), number(analysis.platform_singularity_margin)
    least = number(analysis.singularity_margin)
    return f"Singularity margin {least} (0 singular, 1 best): legs {legs}, platform {platform}."


def stiffness_sentence(components: Sequence[str], compliances: Sequence[float], display: Display) -> str:
    """Say what stiffness a tool feels along and about each axis, with all other motions free to follow.

    Args:
        components: names of the diagonal entries of C.
        compliances: these entries, SI.
        display: units and digits.
    """
    sentences = []
    for block, word, unit in BLOCKS:
        values = [
            f"{name[-1]} {display.number(reciprocal(compliance), unit, 'rigid')}"
            for name, compliance in zip(components, compliances, strict=True)
            if (name in ROTATION_NAMES) == (block == "rotation")
        ]
        sentences.append(f"{word} {', '.join(values)} {display.scale(unit).unit}")
    return "; ".join(sentences)


def softest_sentence(softest: Mapping[str, Softest], display: Display) -> str:
    """Say for forces and for moments in which direction the machine is softest, how soft, and what makes it so."""
    clauses = []
    for block, word, unit in BLOCKS:
        if (direction := softest.get(block)) is not None:
            stiffness = display.show(direction.stiffness, unit, "rigid") if direction.stiffness else "free"
            contributors = largest_contributors(direction.shares, direction.kinds)
            reason = f", mainly from {contributors}" if contributors else ""
            clauses.append(f"{word} {_direction_name(direction)} {stiffness}{reason}")
    return "; ".join(clauses) + "."


def _direction_name(direction: Softest) -> str:
    """Name the softest direction: an axis, a vector, or the plane or space of all that are equally soft."""
    if len(direction.directions) == 3:
        return "any direction"
    names = [_axis_name(vector) for vector in direction.directions]
    return names[0] if len(names) == 1 else f"any direction between {' and '.join(names)}"


def _axis_name(vector: Sequence[float]) -> str:
    """Return an axis by its name, any other unit vector by its components; a direction has no sign."""
    largest = max(range(3), key=lambda i: abs(vector[i]))
    rounded = [round(c * math.copysign(1.0, vector[largest]), 2) + 0.0 for c in vector]
    return "xyz"[largest] if abs(rounded[largest]) == 1.0 else f"({', '.join(f'{c:g}' for c in rounded)})"


def _load_sentence(analysis: Analysis, load: LoadCase) -> str:
    """Say how far the load moves the tool, and which actuator carries most."""
    display = analysis.machine.display
    amounts = [*zip(load.components, load.deflection.tolist(), strict=True)]
    rotation = math.hypot(*(amount for name, amount in amounts if name in ROTATION_NAMES))
    displacement = math.hypot(*(amount for name, amount in amounts if name not in ROTATION_NAMES))
    sentence = (
        f"Under the load the {analysis.machine.reference} moves {display.show_deflection(displacement, 'm')} and turns "
        f"{display.show_deflection(rotation, 'rad')}"
    )
    greatest = []
    for turning in (False, True):
        springs = [spring for spring in load.springs if spring.actuated and spring.turning is turning]
        if springs:
            worst = max(springs, key=lambda spring: abs(spring.load))
            greatest.append(f"{worst.name} carries {display.show(worst.load, load_unit(turning))}")
    return f"{sentence}; {', '.join(greatest)}, the most of all actuators." if greatest else f"{sentence}."


def matrix_units(kind: str, display: Display = ENGINEERING) -> str:
    """Return the units of the blocks of K ("stiffness") or C ("compliance") in a list; see `block_units`."""
    return ", ".join(block_units(kind, display))


def block_units(kind: str, display: Display = ENGINEERING) -> tuple[str, str, str]:
    """Return the units that people read of the blocks of K or C: rotation, coupling, translation."""
    rotation, coupling, translation = (display.scale(unit).unit for unit in MATRIX_UNITS[kind])
    return rotation, coupling, translation


def stiffness_table(analysis: Analysis) -> FittedTable:
    """Return K, or its diagonal where a direction is rigid."""
    display = analysis.machine.display
    rows = analysis.stiffness_diagonal[None] if analysis.stiffness is None else analysis.stiffness
    return matrix_table("Stiffness K", "stiffness", analysis.components, rows, display, "rigid")


def compliance_table(analysis: Analysis) -> FittedTable:
    """Return C, or its diagonal where a direction is free."""
    display = analysis.machine.display
    rows = analysis.compliance_diagonal[None] if analysis.compliance is None else analysis.compliance
    return matrix_table("Compliance C", "compliance", analysis.components, rows, display, "free")


def matrix_table(
    title: str,
    kind: str,
    names: Sequence[str],
    rows: Sequence[Sequence[float]] | Array,
    display: Display = ENGINEERING,
    endless: str = "∞",
) -> FittedTable:
    """Return K ("stiffness") or C ("compliance"), each entry in the unit of its block; one row is the diagonal.

    Args:
        title: title, to which the units are added.
        kind: "stiffness" or "compliance".
        names: names of rows and columns.
        rows: the matrix, SI [n x n], or its diagonal [1 x n].
        display: units and digits.
        endless: word for infinity.
    """
    table = numeric_table(f"{title} ({matrix_units(kind, display)})", "", names)
    whole = len(rows) == len(names)
    for i, row in enumerate(rows):
        pairs = [(names[i] if whole else name, name) for name in names]
        cells = (display.number(c, entry_unit(kind, *pair), endless) for c, pair in zip(row, pairs, strict=True))
        table.add_row(names[i] if whole else "diagonal", *cells)
    return table


def entry_unit(kind: str, row: str, column: str) -> str:
    """Return the SI unit of an entry of K or C by its block."""
    rotation, coupling, translation = MATRIX_UNITS[kind]
    turns = [name in ROTATION_NAMES for name in (row, column)]
    return rotation if all(turns) else coupling if any(turns) else translation


def shares_table(analysis: Analysis, full: bool = False) -> FittedTable:
    """Return the attribution: shares of joints and links as a whole, or of single springs if `full`."""
    table = numeric_table("Attribution: share of each part in the diagonal of C", "part", analysis.components)
    springs = {share.spring: [share] for share in analysis.attribution}
    for name, contributions in (springs if full else by_part(analysis.attribution)).items():
        parts = np.sum([contribution.compliance_share for contribution in contributions], axis=0)
        table.add_row(name, *(DASH if math.isnan(part) else f"{100 * part:.1f} %" for part in parts))
    return table


def principal_table(analysis: Analysis) -> FittedTable:
    """Return the least and largest stiffness of each block, free to follow and held; empty where there is none."""
    display = analysis.machine.display
    columns = ["least", "largest", "softest direction", "stiffest direction"]
    table = numeric_table(f"Principal stiffnesses ({display.names(['N/m', 'N·m/rad'])})", "", columns)
    indices = analysis.indices
    free, guided = (indices.free or {}, indices.guided or {}) if indices else ({}, {})
    for name, blocks, block, unit in (
        ("force", free, "translation", "N/m"),
        ("force, rotations held", guided, "translation", "N/m"),
        ("moment", free, "rotation", "N·m/rad"),
        ("moment, point held", guided, "rotation", "N·m/rad"),
    ):
        if block in blocks:
            table.add_row(name, *_end_cells(blocks[block], unit, display))
    return table


def along_table(along: Sequence[DirectionalStiffness], display: Display = ENGINEERING) -> FittedTable:
    """Return the stiffness along and about directions."""
    columns = ["force", "rotations held", "moment", "point held"]
    title = f"Stiffness along and about directions ({display.names(['N/m', 'N·m/rad'])})"
    table = numeric_table(title, "direction", columns)
    for stiffness in along:
        forces = (display.number(k, "N/m", "rigid") for k in (stiffness.force, stiffness.force_held))
        moments = (display.number(k, "N·m/rad", "rigid") for k in (stiffness.moment, stiffness.moment_held))
        table.add_row(direction_words(stiffness.direction), *forces, *moments)
    return table


def _end_cells(block: PrincipalStiffness, unit: str, display: Display) -> list[str]:
    """Return the least and the largest stiffness and their directions; a block of one stiffness has two empty cells."""
    ends = block.stiffnesses[0], block.stiffnesses[-1]
    values = [display.number(stiffness, unit, "rigid") for stiffness in ends]
    directions = [_directions_text(block, stiffness) for stiffness in ends]
    return [*values, *directions] if len(block.stiffnesses) > 1 else [values[0], "", directions[0], ""]


def _directions_text(block: PrincipalStiffness, stiffness: float) -> str:
    """Return the direction of a principal stiffness; where several are alike, all that have it."""
    alike: list[Sequence[float]] = []
    others: list[Sequence[float]] = []
    for k, direction in zip(block.stiffnesses, block.directions, strict=True):
        (alike if math.isclose(k, stiffness, rel_tol=EQUAL_STIFFNESSES) else others).append(direction)
    if len(alike) == 1:
        return direction_words(alike[0])
    return f"any ⊥ {direction_words(others[0])}" if others else "any"


def direction_words(vector: Sequence[float] | Array) -> str:
    """Return a direction by its three numbers, "+0.71 +0.00 -0.71"."""
    return " ".join(f"{round(component, 2) + 0.0:+.2f}" for component in vector)


def eigenscrew_table(screws: Sequence[Eigenscrew], reference: str, display: Display = ENGINEERING) -> FittedTable:
    """Return eigenvalue, pitch, direction and point of each eigenscrew; points are seen from the reference point."""
    length = display.scale("m")
    heads = [
        display.scale("N/rad").label("eigenvalue"),
        f"pitch ({length.unit}/rad)",
        "direction",
        length.label(f"point from {reference[-1]}"),
    ]
    table = numeric_table("Eigenscrews", "", heads)
    for i, screw in enumerate(screws, 1):
        point = DASH if screw.point is None else _point_text(screw.point, display)
        cells = (display.number(screw.eigenvalue, "N/rad", "infinite"), display.number(screw.pitch, "m", "infinite"))
        table.add_row(str(i), *cells, direction_words(screw.direction), point)
    return table


def _point_text(point: Array, display: Display) -> str:
    """Return the coordinates of a point in m, with 0 for those that are round-off."""
    return " ".join(display.number(c if abs(c) > ROUND_OFF_OF_ENTRY else 0.0, "m") for c in point)


def load_table(load: LoadCase, display: Display = ENGINEERING) -> FittedTable:
    """Return the load and the deflection of the reference point."""
    turning = [name in ROTATION_NAMES for name in load.components]
    units = [load_unit(turns) for turns in turning]
    scales = [display.deflection(motion_unit(turns)) for turns in turning]
    motions = ", ".join(dict.fromkeys(scale.unit for scale in scales))
    title = f"Load ({display.names(units)}) and the deflection under it ({motions})"
    table = numeric_table(title, "", load.components)
    table.add_row("load", *(display.number(c, unit) for c, unit in zip(load.wrench, units, strict=True)))
    pairs = zip(load.deflection, scales, strict=True)
    table.add_row("deflection", *(number(motion * scale.factor, "free", display.digits) for motion, scale in pairs))
    return table


def actuator_table(load: LoadCase, display: Display = ENGINEERING) -> FittedTable:
    """Return the load and deformation of each actuator."""
    table = numeric_table("Actuators under this load", "", ["load", "deformation"])
    for spring in load.springs:
        if spring.actuated:
            load_shown = display.show(spring.load, load_unit(spring.turning))
            deformation = display.show_deflection(spring.deformation, motion_unit(spring.turning))
            table.add_row(spring.name, load_shown, deformation)
    return table


def reaction_table(load: LoadCase, axes: str, display: Display = ENGINEERING) -> FittedTable:
    """Return the wrench in each joint, in base or platform axes."""
    units = display.names(["N·m", "N"])
    title = f"Joint reactions: load that each joint passes on towards the base ({units}; {axes} axes)"
    turns = [name in ROTATION_NAMES for name in load.components]
    heads = [f"{'m' if turning else 'f'}{name[-1]}" for name, turning in zip(load.components, turns, strict=True)]
    table = numeric_table(title, "joint", heads)
    for reaction in load.reactions:
        pairs = zip(reaction.wrench, turns, strict=True)
        table.add_row(reaction.joint, *(display.number(c, load_unit(turning)) for c, turning in pairs))
    return table


def remarks(analysis: Analysis) -> list[str]:
    """Return a sentence each on mobility, internal loads, centre of stiffness, condition numbers and mass."""
    lines, display = [], analysis.machine.display
    if analysis.mobility:
        mobility = analysis.mobility
        extra = f", {mobility.here.redundant} redundant constraints" if mobility.here.redundant else ""
        lines.append(f"Mobility: {mobility.full_cycle} freedoms, {mobility.actuators} actuators{extra}.")
        regular = mobility.kind is SortOfPose.REGULAR
        lines.append("Regular pose." if regular else f"Singular pose ({mobility.kind}).")
    if analysis.internal_loads and analysis.internal_loads.degree:
        legs, undecided = ", ".join(analysis.internal_loads.legs), analysis.internal_loads.undecided
        verdict = f"leaves {undecided} of them undetermined" if undecided else "determines all of them"
        lines.append(
            f"Statically indeterminate internal loads: {analysis.internal_loads.degree}, in {legs}; "
            f"elasticity {verdict}."
        )
    if analysis.indices:
        centre = analysis.indices.centres["stiffness"]
        if centre is not None:
            place = f"{_point_text(centre, display)} {display.scale('m').unit}"
            lines.append(f"Centre of stiffness: {place} from the {analysis.machine.reference}.")
        lines.append(
            f"Condition numbers: {number(analysis.indices.stiffness_condition, 'infinite')} of K, "
            f"{number(analysis.wrench_condition)} of the leg wrenches, "
            f"{number(analysis.jacobian_condition, 'infinite')} of the Jacobian of the actuators; "
            f"rotations are scaled by the characteristic length, {display.show(analysis.characteristic_length, 'm')}."
        )
    if analysis.masses:
        lines.append(_mass_sentence(analysis))
    return lines


def first_names(parts: Sequence[str]) -> str:
    """Return the names of parts, of many the first ones: "leg 1, leg 2, leg 3, leg 4 and 2 more"."""
    others = f" and {len(parts) - MOST_NAMED} more" if len(parts) > MOST_NAMED else ""
    return f"{', '.join(parts[:MOST_NAMED])}{others}"


def _mass_sentence(analysis: Analysis) -> str:
    """Return the moving mass, and name the parts that are not counted because their mass is unknown."""
    unknown = [part.name for part in analysis.masses if part.mass is None]
    if analysis.moving_mass is None:
        return "Moving mass: unknown; give links a cross-section, and the platform a mass in [tool]."
    without = (
        f"; not counted, as no mass is given: {first_names(unknown)}" if unknown else ", all links and the platform"
    )
    return f"Moving mass: {analysis.machine.display.show(analysis.moving_mass, 'kg')}{without}."
