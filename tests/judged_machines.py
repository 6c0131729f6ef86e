"""kinetostat's answers about a machine file beside those of the exact engine; as a script, about thousands of them.

python tests/judged_machines.py --poses 1000 --first 0 [MECHANISM ...]
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from exact_engine import Answer, UndecidedRankError, UnsuitablePoseError, answer
from ideal_machines import MECHANISMS, Draw
from kinetostat import analyze, load
from kinetostat.equilibrium.mechanism import mechanism_of
from kinetostat.equilibrium.solving import at_rest, stability, with_share
from kinetostat.equilibrium.tangent import platform_compliance
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond

AGREED = 1e-9
"""Share of an entry's scale by which both engines may differ."""
SEEN_IN_DOUBLES = 1e-12
"""Share of the largest diagonal entry, in one unit, that the scale of a diagonal entry is at least: the numbers of a
file are rounded to doubles, and 1e-16 of the softest direction is 1e-10 of one 1e12 times as stiff."""


REPORTED = 100
"""Machines after which the script says how far it is."""


@dataclass(frozen=True)
class Verdict:
    """How far kinetostat is from the exact engine.

    Attributes:
        status: of its answer.
        differences: of C, K and the compliance at rest without a load, as shares of their scales; of the rank, in
            ranks; and 1 for `rest` where it says that the unloaded machine is not at rest, or not stable.
    """

    status: Status
    differences: Mapping[str, float]

    @property
    def agreed(self) -> bool:
        """Whether both are alike."""
        return self.status is Status.OK and all(value <= AGREED for value in self.differences.values())


def share(answered: Any, exact: Any, length: float) -> float:
    """The largest difference of two matrices as a share of the scale of each entry; infinite entries must be the same.

    Args:
        answered, exact: 6 x 6; what is NaN in the exact one is not compared.
        length: by which rotations and translations compare, m, or its inverse for K.
    """
    known = np.isfinite(np.diag(exact))
    if (np.isfinite(np.diag(answered)) != known).any():
        return np.inf
    units = np.array([1.0] * 3 + [1.0 / length] * 3)[known]
    both = [np.asarray(matrix)[np.ix_(known, known)] * np.outer(units, units) for matrix in (answered, exact)]
    sizes = np.sqrt(np.maximum(np.diag(both[1]), SEEN_IN_DOUBLES * np.diag(both[1]).max(initial=0.0)))
    scales = np.outer(sizes, sizes)
    differences = np.abs(both[0] - both[1])
    if not scales.any():
        return np.inf if differences.any() else 0.0
    return float((differences / np.where(scales > 0.0, scales, 1.0)).max(initial=0.0))


def judge(path: Path, exact: Answer, length: float) -> Verdict:
    """Ask kinetostat for C, its rank, K, and the compliance at rest without a load, and compare them.

    Args:
        path: of the machine file.
        exact: what the exact engine says.
        length: of the machine, m.
    """
    machine = load(path)
    joints = solve_joints(machine)
    # Mobility at other poses is not compared and takes most of the time of an analysis.
    with (
        patch("kinetostat.kinematics.closure.solve_joints", return_value=joints),
        patch("kinetostat.equilibrium.state._nearby", return_value=[]),
    ):
        analysis = analyze(machine)
    if analysis.status is not Status.OK:
        return Verdict(analysis.status, {})
    response = respond(machine, joints)
    stiffness = np.array(response.stiffness.rows(), dtype=float)
    mechanism = with_share(mechanism_of(machine, response.configuration, joints), 0.0)
    solution = at_rest(mechanism)
    stands = bool(solution.settled.all()) and stability(solution.balance).stable
    at_zero_load = platform_compliance(solution.balance)[0] * mechanism.compliance_units[0]
    return Verdict(
        analysis.status,
        {
            "C": share(analysis.C, exact.compliance, length),
            "K": share(stiffness, exact.stiffness, 1.0 / length),
            "rank": abs((analysis.rank or 0) - exact.rank),
            "tangent": share(at_zero_load, exact.compliance, length),
            "rest": 0.0 if stands else 1.0,
        },
    )


def judged(mechanism: str, seed: int, folder: Path) -> tuple[Verdict, Path]:
    """Draw a machine, write its file and judge it.

    Raises:
        UnsuitablePoseError, UndecidedRankError: the exact engine has no answer about it.
    """
    draw = Draw(mechanism, seed)
    path = folder / f"{mechanism.replace(' ', '-')}-{seed}.toml"
    path.write_text(draw.text, "utf-8")
    return judge(path, answer(draw.closed), float(draw.closed.machine.size)), path


def main() -> None:
    """Judge machines and print what differs, a line per machine and a summary per mechanism."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mechanisms", nargs="*", default=list(MECHANISMS))
    parser.add_argument("--poses", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    words = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="judged-"))
    for mechanism in words.mechanisms:
        counts: Counter[str] = Counter()
        worst: dict[str, float] = {}
        for seed in range(words.first, words.first + words.poses):
            try:
                verdict, path = judged(mechanism, seed, folder)
            except (UnsuitablePoseError, UndecidedRankError) as reason:
                counts[f"not judged: {reason}"] += 1
                continue
            counts[verdict.status.word] += 1
            for name, value in verdict.differences.items():
                worst[name] = max(worst.get(name, 0.0), value)
            if verdict.agreed:
                path.unlink()
            else:
                print(f"  {path} {verdict.status.word}", rounded(verdict.differences), flush=True)
            if sum(counts.values()) % REPORTED == 0:
                print(f"{mechanism}: {dict(counts)}", rounded(worst), flush=True)


def rounded(values: Mapping[str, float]) -> dict[str, str]:
    return {name: f"{value:.1e}" for name, value in values.items()}


if __name__ == "__main__":
    main()
