"""How far the link models differ on the bundled Tripteron: the table of `docs/how-to-choose-a-link-model.md`.

Prints Markdown to stdout.

    python benchmarks/link_models.py > docs/measured/link-models.md
"""

import numpy as np
import numpy.typing as npt

from kinetostat.kinetostatics.response import respond
from kinetostat.machine.link import Beam
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Machine
from kinetostat.validation.pieces import end_compliance, section_axes

Array = npt.NDArray[np.float64]

LEGS, LINKS = ("x", "y", "z"), ("proximal", "distal")
DIAMETERS = ("15 cm", "8 cm", "30 cm")
MODELS = ("rigid", "lumped", "beam", "timoshenko", "matrix")


def tripteron(model: str, diameter: str) -> Machine:
    """The Tripteron with all its links of one model; "matrix" is the cantilever's 6x6 of a textbook."""
    section = f'sections.bar.diameter="{diameter}"'
    if model == "matrix":
        return load("tripteron", [section, *_matrices(load("tripteron", [section]))])
    links = [f"legs.{leg}.{link}.model={model}" for leg in LEGS for link in LINKS]
    return load("tripteron", [section, *links])


def _matrices(machine: Machine) -> list[str]:
    """Overrides that give each link the compliance of its end against its beginning, base axes."""
    found = []
    for steps in machine.chains().legs:
        for beam in (step.element for step in steps if isinstance(step.element, Beam)):
            turn = np.kron(np.eye(2), section_axes(beam)[0])
            matrix = turn @ end_compliance(beam) @ turn.T
            table = f'{{ model = "matrix", compliance = {(0.5 * (matrix + matrix.T)).tolist()} }}'
            found.append(f"legs.{beam.name.replace(' ', '.')}={table}")
    return found


def compliance(machine: Machine) -> Array:
    """C at the bundled pose [6 x 6]."""
    return np.array(respond(machine).compliance.rows(), dtype=float)


def row(model: str, diameter: str) -> list[str]:
    """Extremes of both blocks, and the relative difference of these blocks from the beam's."""
    own, beam = compliance(tripteron(model, diameter)), compliance(tripteron("beam", diameter))
    blocks = slice(0, 3), slice(3, 6)
    softest = [np.linalg.eigvalsh(own[b, b])[-1] for b in blocks]
    apart = [np.linalg.norm(own[b, b] - beam[b, b]) / np.linalg.norm(beam[b, b]) for b in blocks]
    return [*(f"{value:.4g}" for value in softest), *("0" if a < 1e-12 else f"{100 * a:.3g} %" for a in apart)]


def main() -> None:
    """Print the table."""
    blocks = "rotation", "translation"
    differences = tuple(f"difference in {block}" for block in blocks)
    header = ("diameter", "model", "softest rotation, rad/(N·m)", "softest translation, m/N", *differences)
    print(f"| {' | '.join(header)} |\n|---|---|{'---:|' * 4}")
    for diameter in DIAMETERS:
        for model in MODELS:
            print(f"| {diameter if model == 'rigid' else ''} | `{model}` | {' | '.join(row(model, diameter))} |")


if __name__ == "__main__":
    main()
