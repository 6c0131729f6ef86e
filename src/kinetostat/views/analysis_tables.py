"""An analysis as tables on a terminal, with units. Nothing is computed but rounding, percent and sums of shares."""

import math
from collections.abc import Sequence

from rich.console import Console

from kinetostat.kinetostatics.eigenscrews import Eigenscrew
from kinetostat.kinetostatics.indices import PrincipalStiffness
from kinetostat.studies.analysis import Analysis, Rows, SpringShare
from kinetostat.studies.indices import Along
from kinetostat.studies.loads import LoadCase
from kinetostat.views.display import ROUNDING, without_rounding
from kinetostat.views.tables import number, numeric_table

UNITS_OF_K = "N·m/rad, N/rad, N/m"
UNITS_OF_C = "rad/(N·m), rad/N, m/N"
MOST_NAMED = 4
"""Parts of unknown mass that are named."""


def print_analysis(console: Console, analysis: Analysis, along: Sequence[Along] = (), full: bool = False) -> None:
    """K, C, attribution, indices, mobility and loads at one pose; all springs and eigenscrews if `full`."""
    machine, names = analysis.machine, analysis.components
    console.print(f"[bold]{machine.name}[/bold]  {analysis.status.word}")
    console.print(analysis.message, highlight=False)
    point = "the tool point T" if any(machine.sections["tool"].offset) else "the platform point P"
    about = f"Components {' '.join(names)} at {point}, {analysis.axes} axes. Rank {analysis.rank}."
    console.print(about, style="dim", highlight=False)
    _print_matrix(
        console, f"Stiffness K ({UNITS_OF_K})", names, analysis.stiffness, analysis.stiffness_diagonal, "rigid"
    )
    _print_matrix(
        console, f"Compliance C ({UNITS_OF_C})", names, analysis.compliance, analysis.compliance_diagonal, "free"
    )
    _print_shares(console, analysis, full)
    _print_directions(console, analysis)
    _print_along(console, along)
    if full and analysis.indices:
        _print_eigenscrews(console, analysis.indices.eigenscrews)
    if analysis.load:
        _print_load(console, names, analysis.load)
    _print_summary(console, analysis)


def _print_matrix(
    console: Console, title: str, names: Sequence[str], rows: Rows | None, diagonal: Sequence[float], endless: str
) -> None:
    table = numeric_table(title, "", names)
    if rows is None:
        table.add_row("diagonal", *(number(value, endless) for value in diagonal))
    else:
        for name, row in zip(names, without_rounding(rows), strict=True):
            table.add_row(name, *(number(value) for value in row))
    console.print(table)


def _print_shares(console: Console, analysis: Analysis, full: bool) -> None:
    """Attribution, by default of joints and links as a whole."""
    table = numeric_table("Attribution: shares in the diagonal of C", "part", analysis.components)
    for name, shares in [(s.name, [s]) for s in analysis.shares] if full else _by_part(analysis.shares):
        columns = zip(*(share.compliance for share in shares), strict=True)
        parts = [None if None in column else sum(c for c in column if c is not None) for column in columns]
        table.add_row(name, *("–" if part is None else f"{100 * part:.1f} %" for part in parts))
    console.print(table)


def _by_part(shares: Sequence[SpringShare]) -> list[tuple[str, list[SpringShare]]]:
    found: dict[str, list[SpringShare]] = {}
    for share in shares:
        found.setdefault(share.part, []).append(share)
    return list(found.items())


def _print_directions(console: Console, analysis: Analysis) -> None:
    if analysis.indices is None:
        return
    columns = ["least", "largest", "softest direction", "stiffest direction"]
    table = numeric_table("Principal stiffnesses (N/m, N·m/rad)", "", columns)
    free, guided = analysis.indices.free or {}, analysis.indices.guided or {}
    for what, blocks, block in (
        ("force", free, "translation"),
        ("force, rotations held", guided, "translation"),
        ("moment", free, "rotation"),
        ("moment, point held", guided, "rotation"),
    ):
        if block in blocks:
            table.add_row(what, *_ellipsoid(blocks[block]))
    if table.row_count:
        console.print(table)


def _print_along(console: Console, along: Sequence[Along]) -> None:
    if not along:
        return
    columns = ["force", "rotations held", "moment", "point held"]
    table = numeric_table("Stiffness along and about directions (N/m, N·m/rad)", "direction", columns)
    for one in along:
        values = (one.force, one.force_held, one.moment, one.moment_held)
        table.add_row(_direction(one.direction), *(number(value, "rigid") for value in values))
    console.print(table)


def _ellipsoid(found: PrincipalStiffness) -> list[str]:
    """Least and largest and their directions; once where there is but one."""
    values = [number(value, "rigid") for value in (found.stiffnesses[0], found.stiffnesses[-1])]
    directions = [_direction(found.directions[0]), _direction(found.directions[-1])]
    return [*values, *directions] if len(found.stiffnesses) > 1 else [values[0], "", directions[0], ""]


def _direction(vector: Sequence[float]) -> str:
    return " ".join(f"{component + 0.0:+.2f}" for component in vector)


def _print_eigenscrews(console: Console, screws: Sequence[Eigenscrew]) -> None:
    if not screws:
        return
    table = numeric_table("Eigenscrews", "", ["eigenvalue (N/rad)", "pitch (mm/rad)", "direction", "point from T (mm)"])
    for i, screw in enumerate(screws, 1):
        point = "–" if screw.point is None else " ".join(f"{1e3 * c:.4g}" for c in screw.point)
        pitch = "infinite" if math.isinf(screw.pitch) else number(1e3 * screw.pitch)
        table.add_row(str(i), number(screw.eigenvalue, "infinite"), pitch, _direction(screw.direction), point)
    console.print(table)


def _print_load(console: Console, names: Sequence[str], load: LoadCase) -> None:
    kept = [("rx", "ry", "rz", "x", "y", "z").index(name) for name in names]
    table = numeric_table("Load at the tool point (N·m, N) and its deflection (rad, m)", "", names)
    size = max(abs(c) for c in load.wrench)
    table.add_row("load", *(number(load.wrench[i] if abs(load.wrench[i]) > ROUNDING * size else 0.0) for i in kept))
    table.add_row("deflection", *(number(load.deflection[i], "free") for i in kept))
    console.print(table)
    table = numeric_table("Actuators under it", "", ["load", "", "deformation", ""])
    for spring in load.springs:
        if spring.actuated:
            units = ("N·m", "rad") if spring.turning else ("N", "m")
            table.add_row(spring.name, number(spring.load), units[0], number(spring.deformation), units[1])
    console.print(table)
    table = numeric_table(
        "Load passed on towards the base, at the joint (N·m, N)", "joint", ["mx", "my", "mz", "fx", "fy", "fz"]
    )
    for reaction in load.reactions:
        size = max(abs(float(c)) for c in reaction.wrench.components()) or 1.0
        parts = [float(c) for c in reaction.wrench.components()]
        table.add_row(reaction.joint, *(number(c if abs(c) > ROUNDING * size else 0.0) for c in parts))
    console.print(table)


def _print_summary(console: Console, analysis: Analysis) -> None:
    lines = []
    if analysis.mobility:
        found = analysis.mobility
        legs, platform = number(found.leg_distance), number(found.platform_distance)
        extra = f", {found.here.redundant} constraints redundant" if found.here.redundant else ""
        lines.append(
            f"Mobility: {found.full_cycle} freedoms, {found.actuators} actuators{extra}; {found.kind} pose, "
            f"distance from a singularity {legs} (legs), {platform} (platform) of 1."
        )
    if analysis.internal and analysis.internal.degree:
        legs = ", ".join(analysis.internal.legs)
        lines.append(
            f"Internal loads: {analysis.internal.degree} statically indeterminate, in {legs}; "
            f"{analysis.internal.undecided or 'none'} of them undecided by elasticity."
        )
    if analysis.indices:
        centre = analysis.indices.centres["stiffness"]
        if centre is not None:
            shown = " ".join(f"{1e3 * c if abs(c) > ROUNDING else 0.0:.4g}" for c in centre)
            lines.append(f"Centre of stiffness: {shown} mm from the point above.")
        lines.append(
            f"Condition of K: {number(analysis.indices.condition, 'infinite')}, of the leg wrenches: "
            f"{number(analysis.condition)}, of the actuators' Jacobian: "
            f"{number(analysis.jacobian_condition, 'infinite')}; "
            f"rotations compared through {number(analysis.length)} m."
        )
    if analysis.masses:
        lines.append(_moving(analysis))
    for line in lines:
        console.print(line, highlight=False, markup=False)


def _moving(analysis: Analysis) -> str:
    """What moves, and what of it is not counted."""
    unknown = [one.name for one in analysis.masses if one.mass is None]
    if analysis.mass is None:
        return "Moving mass: not known; give links a cross-section, and the platform [tool] mass."
    shown = ", ".join(unknown[:MOST_NAMED])
    more = f" and {len(unknown) - MOST_NAMED} more" if len(unknown) > MOST_NAMED else ""
    without = f"; without {shown}{more}, of which no mass is given" if unknown else ", all links and the platform"
    return f"Moving mass: {number(analysis.mass)} kg{without}."
