"""An analysis as tables on a terminal, with units. Nothing is computed but rounding, percent and sums of shares."""

import math
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kinetostat.kinematics.mobility import Kind, Mobility
from kinetostat.kinetostatics.eigenscrews import Eigenscrew
from kinetostat.kinetostatics.indices import PrincipalStiffness
from kinetostat.studies.analysis import Analysis, Rows
from kinetostat.studies.attribution import by_part
from kinetostat.studies.indices import Along
from kinetostat.studies.loads import LoadCase
from kinetostat.tolerances import ROUND_OFF_OF_ENTRY
from kinetostat.views.tables import number, numeric_table, print_doubts

UNITS_OF_K = "N·m/rad, N/rad, N/m"
UNITS_OF_C = "rad/(N·m), rad/N, m/N"
ALIKE = 1e-9
"""Relative difference of principal stiffnesses below which they are one, and their directions a matter of rounding."""
MOST_NAMED = 4
"""Parts of unknown mass that are named."""


def print_analysis(console: Console, analysis: Analysis, along: Sequence[Along] = (), full: bool = False) -> None:
    """K, C, attribution, indices, mobility and loads at one pose; all springs and eigenscrews if `full`."""
    machine, names = analysis.machine, analysis.components
    console.print(Text.assemble((machine.name, "bold"), f"  {analysis.status.word}"))
    console.print(analysis.message, highlight=False)
    print_doubts(console, machine)
    about = f"Components {' '.join(names)} at the {machine.reference}, {analysis.axes} axes. Rank {analysis.rank}."
    console.print(about, style="dim", highlight=False)
    console.print(stiffness_table(analysis))
    console.print(compliance_table(analysis))
    console.print(shares_table(analysis, full))
    shown = [principal_table(analysis), along_table(along)]
    if full and analysis.indices:
        shown.append(eigenscrew_table(analysis.indices.eigenscrews, machine.reference))
    if analysis.load:
        shown += [load_table(names, analysis.load), actuator_table(analysis.load)]
        shown.append(reaction_table(analysis.load, analysis.axes))
    for table in shown:
        if table.row_count:
            console.print(table)
    for line in remarks(analysis):
        console.print(line, highlight=False)


def stiffness_table(analysis: Analysis) -> Table:
    """K, or its diagonal where a direction is rigid."""
    title = f"Stiffness K ({UNITS_OF_K})"
    return _matrix_table(title, analysis.components, analysis.stiffness, analysis.stiffness_diagonal, "rigid")


def compliance_table(analysis: Analysis) -> Table:
    """C, or its diagonal where a direction is free."""
    title = f"Compliance C ({UNITS_OF_C})"
    return _matrix_table(title, analysis.components, analysis.compliance, analysis.compliance_diagonal, "free")


def _matrix_table(
    title: str, names: Sequence[str], rows: Rows | None, diagonal: Sequence[float], endless: str
) -> Table:
    table = numeric_table(title, "", names)
    if rows is None:
        table.add_row("diagonal", *(number(value, endless) for value in diagonal))
    else:
        for name, row in zip(names, rows, strict=True):
            table.add_row(name, *(number(value) for value in row))
    return table


def shares_table(analysis: Analysis, full: bool = False) -> Table:
    """Attribution, by default of joints and links as a whole."""
    table = numeric_table("Attribution: share of each part in the diagonal of C", "part", analysis.components)
    springs = {share.spring: [share] for share in analysis.attribution}
    for name, contributions in (springs if full else by_part(analysis.attribution)).items():
        columns = zip(*(contribution.compliance_share for contribution in contributions), strict=True)
        parts = [None if None in column else sum(c for c in column if c is not None) for column in columns]
        table.add_row(name, *("–" if part is None else f"{100 * part:.1f} %" for part in parts))
    return table


def principal_table(analysis: Analysis) -> Table:
    """Least and largest stiffness of each block, free to follow and held; empty where there is none."""
    columns = ["least", "largest", "softest direction", "stiffest direction"]
    table = numeric_table("Principal stiffnesses (N/m, N·m/rad)", "", columns)
    indices = analysis.indices
    free, guided = (indices.free or {}, indices.guided or {}) if indices else ({}, {})
    for what, blocks, block in (
        ("force", free, "translation"),
        ("force, rotations held", guided, "translation"),
        ("moment", free, "rotation"),
        ("moment, point held", guided, "rotation"),
    ):
        if block in blocks:
            table.add_row(what, *_ellipsoid(blocks[block]))
    return table


def along_table(along: Sequence[Along]) -> Table:
    """Stiffness along and about directions."""
    columns = ["force", "rotations held", "moment", "point held"]
    table = numeric_table("Stiffness along and about directions (N/m, N·m/rad)", "direction", columns)
    for stiffness in along:
        values = (stiffness.force, stiffness.force_held, stiffness.moment, stiffness.moment_held)
        table.add_row(_direction(stiffness.direction), *(number(value, "rigid") for value in values))
    return table


def _ellipsoid(block: PrincipalStiffness) -> list[str]:
    """Least and largest and their directions; once where there is but one."""
    values = [number(value, "rigid") for value in (block.stiffnesses[0], block.stiffnesses[-1])]
    directions = [_directions(block, block.stiffnesses[0]), _directions(block, block.stiffnesses[-1])]
    return [*values, *directions] if len(block.stiffnesses) > 1 else [values[0], "", directions[0], ""]


def _directions(block: PrincipalStiffness, stiffness: float) -> str:
    """The direction of a principal stiffness; where several are alike, all that have it."""
    pairs = list(zip(block.stiffnesses, block.directions, strict=True))
    others = [way for k, way in pairs if not math.isclose(k, stiffness, rel_tol=ALIKE)]
    alike = len(pairs) - len(others)
    if alike == 1:
        return next(_direction(way) for k, way in pairs if math.isclose(k, stiffness, rel_tol=ALIKE))
    return f"any ⊥ {_direction(others[0])}" if others else "any"


def _direction(vector: Sequence[float]) -> str:
    return " ".join(f"{round(component, 2) + 0.0:+.2f}" for component in vector)


def eigenscrew_table(screws: Sequence[Eigenscrew], reference: str) -> Table:
    """Eigenvalue, pitch, direction and point of each, the point from the reference point."""
    heads = ["eigenvalue (N/rad)", "pitch (mm/rad)", "direction", f"point from {reference[-1]} (mm)"]
    table = numeric_table("Eigenscrews", "", heads)
    for i, screw in enumerate(screws, 1):
        point = "–" if screw.point is None else _millimetres(screw.point)
        pitch = "infinite" if math.isinf(screw.pitch) else number(1e3 * screw.pitch)
        table.add_row(str(i), number(screw.eigenvalue, "infinite"), pitch, _direction(screw.direction), point)
    return table


def _millimetres(point: Sequence[float]) -> str:
    """A point given in m, without rounding."""
    return " ".join(f"{1e3 * c if abs(c) > ROUND_OFF_OF_ENTRY else 0.0:.4g}" for c in point)


def load_table(names: Sequence[str], load: LoadCase) -> Table:
    """The load and the deflection of the reference point."""
    kept = [("rx", "ry", "rz", "x", "y", "z").index(name) for name in names]
    table = numeric_table("Load (N·m, N) and the deflection under it (rad, m)", "", names)
    table.add_row("load", *(number(load.wrench[i]) for i in kept))
    table.add_row("deflection", *(number(load.deflection[i], "free") for i in kept))
    return table


def actuator_table(load: LoadCase) -> Table:
    """What each actuator bears, and how far it gives."""
    table = numeric_table("Actuators under this load", "", ["load", "", "deformation", ""])
    for spring in load.springs:
        if spring.actuated:
            units = ("N·m", "rad") if spring.turning else ("N", "m")
            table.add_row(spring.name, number(spring.load), units[0], number(spring.deformation, "free"), units[1])
    return table


def reaction_table(load: LoadCase, axes: str) -> Table:
    """The wrench in each joint, in base or platform axes."""
    title = f"Joint reactions: load that each joint passes on towards the base (N·m, N; {axes} axes)"
    table = numeric_table(title, "joint", ["mx", "my", "mz", "fx", "fy", "fz"])
    for reaction in load.reactions:
        table.add_row(reaction.joint, *(number(float(c)) for c in reaction.wrench.components()))
    return table


def remarks(analysis: Analysis) -> list[str]:
    """Mobility, internal loads, centre, condition and mass, a sentence each."""
    lines = []
    if analysis.mobility:
        mobility = analysis.mobility
        extra = f", {mobility.here.redundant} redundant constraints" if mobility.here.redundant else ""
        lines.append(f"Mobility: {mobility.full_cycle} freedoms, {mobility.actuators} actuators{extra}.")
        lines.append(f"{_sort_of_pose(mobility.kind)}. {margins(mobility)}")
    if analysis.internal_loads and analysis.internal_loads.degree:
        legs = ", ".join(analysis.internal_loads.legs)
        lines.append(
            f"Statically indeterminate internal loads: {analysis.internal_loads.degree}, in {legs}; "
            f"elasticity {_decided(analysis.internal_loads.undecided)}."
        )
    if analysis.indices:
        centre = analysis.indices.centres["stiffness"]
        if centre is not None:
            lines.append(f"Centre of stiffness: {_millimetres(centre)} mm from the {analysis.machine.reference}.")
        lines.append(
            f"Condition numbers: {number(analysis.indices.stiffness_condition, 'infinite')} of K, "
            f"{number(analysis.wrench_condition)} of the leg wrenches, "
            f"{number(analysis.jacobian_condition, 'infinite')} of the Jacobian of the actuators; "
            f"rotations are scaled by the characteristic length, {number(analysis.characteristic_length)} m."
        )
    if analysis.masses:
        lines.append(_moving(analysis))
    return lines


def margins(mobility: Mobility) -> str:
    """Return a sentence with the singularity margins of a pose, to two digits."""
    legs, platform = mobility.leg_distance, mobility.platform_distance
    return f"Singularity margin (0 to 1): legs {legs:.2g}, platform {platform:.2g}."


def _sort_of_pose(kind: Kind) -> str:
    return "Regular pose" if kind is Kind.REGULAR else f"Singular pose ({kind})"


def _decided(undecided: int) -> str:
    """Return how many internal loads follow from the compliance of the legs."""
    return f"leaves {undecided} of them undetermined" if undecided else "determines all of them"


def _moving(analysis: Analysis) -> str:
    """Return the moving mass, and name the parts that are not counted because their mass is unknown."""
    unknown = [part.name for part in analysis.masses if part.mass is None]
    if analysis.moving_mass is None:
        return "Moving mass: unknown; give links a cross-section, and the platform a mass in [tool]."
    shown = ", ".join(unknown[:MOST_NAMED])
    more = f" and {len(unknown) - MOST_NAMED} more" if len(unknown) > MOST_NAMED else ""
    without = f"; not counted, as no mass is given: {shown}{more}" if unknown else ", all links and the platform"
    return f"Moving mass: {number(analysis.moving_mass)} kg{without}."
