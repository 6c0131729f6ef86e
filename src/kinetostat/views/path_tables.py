"""Quantities at poses on a terminal: the extremes of each, where they are, and the poses without a result."""

import numpy as np
from rich.console import Console

from kinetostat.display import number
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.evaluation import PoseAnswers
from kinetostat.views.tables import numeric_table


def print_path(console: Console, answers: PoseAnswers) -> None:
    """Print how many poses have a result, and the extremes of each quantity with the numbers of their poses, from 1."""
    count, failed, display = answers.poses.count, answers.failures, answers.machine.display
    inside = count - sum(len(numbers) for numbers in failed.values())
    console.print(f"{answers.machine.name}: {inside:,} of {count:,} poses have a result.", highlight=False)
    for status, numbers in failed.items():
        first = (
            f"pose {numbers[0] + 1}" if len(numbers) == 1 else f"{len(numbers):,} poses, the first is {numbers[0] + 1}"
        )
        console.print(f"{status.word.replace('_', ' ')}: {first}. {status.sentence}", highlight=False)
    if not inside:
        return
    table = numeric_table(
        "Extremes and the numbers of their poses", "quantity", ["unit", "least", "at", "largest", "at"]
    )
    for name, values in answers.values.items():
        low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
        scale = display.fitting(QUANTITIES[name].unit, (values[low], values[high]))
        least, largest = (number(float(values[k]) * scale.factor, digits=display.digits) for k in (low, high))
        table.add_row(name, scale.head, least, str(low + 1), largest, str(high + 1))
    console.print(table)
