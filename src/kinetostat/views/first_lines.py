"""The answer first: an analysis in five lines, before its reasons and its matrices.

Nothing is computed but 1/C and lengths of vectors; every view that begins with the answer takes its lines from here.
"""

import math
from collections.abc import Iterator, Mapping, Sequence

from kinetostat.algebra.scalar import reciprocal
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.display import Display
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.attribution import Softest, largest_contributors
from kinetostat.studies.loads import LoadCase
from kinetostat.studies.setting import pose_of

BLOCKS = (("translation", "along", "N/m"), ("rotation", "about", "N·m/rad"))


def first_lines(analysis: Analysis) -> list[tuple[str, str]]:
    """Return label and text of each line: pose and verdict, stiffness, softest direction, margin, and the load."""
    pose = pose_of(analysis.machine)
    lines = [("Pose", f"{pose}. {analysis.message}" if pose else analysis.message)]
    if analysis.compliance_diagonal.size:
        felt = stiffness_sentence(analysis.components, analysis.compliance_diagonal.tolist(), analysis.machine.display)
        lines.append(("Stiffness", f"{felt} (1/C at the {analysis.machine.reference}, {analysis.axes} axes)."))
    if analysis.softest:
        lines.append(("Softest", softest_sentence(analysis.softest, analysis.machine.display)))
    if analysis.singularity_margin is not None:
        lines.append(("Margin", margins(analysis)))
    if analysis.load:
        lines.append(("To first order" if analysis.machine.loaded else "Load", _load_sentence(analysis, analysis.load)))
    return lines


def margins(analysis: Analysis) -> str:
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
    for _, word, unit in BLOCKS:
        of_block = [
            (name, compliance)
            for name, compliance in zip(components, compliances, strict=True)
            if (name in COMPONENTS[:3]) == (word == "about")
        ]
        values = [f"{name[-1]} {display.number(reciprocal(c), unit, 'rigid')}" for name, c in of_block]
        sentences.append(f"{word} {', '.join(values)} {display.scale(unit).unit}")
    return "; ".join(sentences)


def softest_sentence(softest: Mapping[str, Softest], display: Display) -> str:
    """Say for forces and for moments in which direction the machine is softest, how soft, and what makes it so."""
    return "; ".join(_softest(softest, display)) + "."


def _softest(softest: Mapping[str, Softest], display: Display) -> Iterator[str]:
    for block, word, unit in BLOCKS:
        if (direction := softest.get(block)) is not None:
            stiffness = display.show(direction.stiffness, unit, "rigid") if direction.stiffness else "free"
            yield f"{word} {_where(direction)} {stiffness}{_mainly(direction)}"


def _where(direction: Softest) -> str:
    """Name the softest direction: an axis, a vector, or the plane or space of all that are equally soft."""
    if len(direction.directions) == 3:
        return "any direction"
    vectors = [_vector(way) for way in direction.directions]
    return vectors[0] if len(vectors) == 1 else f"any direction between {' and '.join(vectors)}"


def _vector(way: Sequence[float]) -> str:
    """Return an axis by its name, any other unit vector by its components; a direction has no sign."""
    largest = max(range(3), key=lambda i: abs(way[i]))
    rounded = [round(c * math.copysign(1.0, way[largest]), 2) + 0.0 for c in way]
    return "xyz"[largest] if abs(rounded[largest]) == 1.0 else f"({', '.join(f'{c:g}' for c in rounded)})"


def _mainly(direction: Softest) -> str:
    named = largest_contributors(direction.shares, direction.kinds)
    return f", mainly from {named}" if named else ""


def _load_sentence(analysis: Analysis, load: LoadCase) -> str:
    """Say how far the load moves the tool, and which actuator carries most."""
    display = analysis.machine.display
    turned, moved = math.hypot(*load.deflection[:3]), math.hypot(*load.deflection[3:])
    sentence = (
        f"Under the load the {analysis.machine.reference} moves {display.show_deflection(moved, 'm')} and turns "
        f"{display.show_deflection(turned, 'rad')}"
    )
    most = []
    for turning, unit in ((False, "N"), (True, "N·m")):
        springs = [spring for spring in load.springs if spring.actuated and spring.turning is turning]
        if springs:
            worst = max(springs, key=lambda spring: abs(spring.load))
            most.append(f"{worst.name} carries {display.show(worst.load, unit)}")
    return f"{sentence}; {', '.join(most)}, the most of all actuators." if most else f"{sentence}."
