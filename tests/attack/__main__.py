"""Attack kinetostat: `python tests/attack --files 100000 --machines 2000 --lines 10000 --kills 20 --tabs 50`.

Files are hostile. Machines are sound ones of every joint, motor and link model, whose answers must keep the laws of
`laws`. Every case has a number, drawn from the seed; `--case KIND:NUMBER` repeats one alone. Findings are printed with
their cases, one of each sort; the exit code is 1 where there is any.
"""

import argparse
import os
import resource
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command does

from grown_machines import machine, parts
from hostile import file, toml
from judging import FILES, allowed, grown_case, judged, line_case
from kills import COMMANDS, kill_and_resume, undisturbed
from lines import command_line
from tables import record, table

MEMORY = 3 << 30
"""Address space of a process, bytes: a case that wants more is a finding, not the end of the computer."""
BLOCK = 50
LAWS_TAKE = 12.0
"""Times the processor time of another case that a machine takes with all laws and an independent engine."""
GROWN = {"table": table, "record": record}
"""Kinds of files that are not TOML or XML."""


def attack(kind: str, number: int, seed: int, seconds: float, answered: Counter[str]) -> str | None:
    """Make the case of a number and judge it, in a folder of its own; count what is answered of the grown machines."""
    os.chdir(tempfile.mkdtemp())
    rng = Random(f"{seed} {kind} {number}")
    if kind == "grown":
        return judged(partial(grown_case, rng, answered), LAWS_TAKE * seconds)
    if kind == "line":
        return judged(partial(line_case, command_line(rng)), seconds)
    return judged(partial(FILES[kind], GROWN.get(kind, partial(file, kind=kind))(rng)), seconds)


def block(kind: str, seed: int, numbers: range, longest: float) -> tuple[list[tuple[str, int, str]], Counter[str]]:
    """Findings of some cases, and what was answered of the grown machines."""
    _bound_memory()
    seconds, answered = allowed(longest), Counter[str]()
    results = [(kind, number, attack(kind, number, seed, seconds, answered)) for number in numbers]
    return [(kind, number, finding) for kind, number, finding in results if finding], answered


def _bound_memory() -> None:
    most = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY if most < 0 else min(MEMORY, most), most))


def blocks(files: int, machines: int, lines: int) -> Iterator[tuple[str, range]]:
    """Kinds and numbers of the cases: half of the files are machines."""
    shares = {"machine": 0.5, "study": 0.2, "urdf": 0.1, "table": 0.15, "record": 0.05}
    counts = {"grown": machines, **{kind: int(files * share) for kind, share in shares.items()}, "line": lines}
    for kind, count in counts.items():
        for first in range(0, count, BLOCK):
            yield kind, range(first, min(first + BLOCK, count))


def kills(count: int, seed: int) -> Iterator[str]:
    """Findings of stopped and resumed commands."""
    for name in COMMANDS if count else ():
        with tempfile.TemporaryDirectory() as folder:
            whole, seconds = undisturbed(name, Path(folder))
            for number in range(count):
                rng = Random(f"{seed} {name} {number}")
                finding = kill_and_resume(rng, name, whole, seconds)
                if finding:
                    yield finding


def crowd(count: int, seconds: float) -> Iterator[str]:
    """Findings of many tabs; what the studio needs is imported only here."""
    from tabs import tabs

    return tabs(count, seconds)


def show(kind: str, number: int, seed: int, longest: float) -> None:
    """Print a case and how it ends."""
    os.chdir(tempfile.mkdtemp())  # a command line brings files
    rng = Random(f"{seed} {kind} {number}")
    if kind == "grown":
        print(toml(machine(rng)))
    else:
        print(command_line(rng) if kind == "line" else GROWN.get(kind, partial(file, kind=kind))(rng))
    print("->", attack(kind, number, seed, allowed(longest), Counter()) or "well answered")


def main() -> int:
    """Run the attack, or one case of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=1000)
    parser.add_argument("--machines", type=int, default=100, help="machines that close, judged by laws")
    parser.add_argument("--lines", type=int, default=100)
    parser.add_argument("--kills", type=int, default=0, help="how often each long command is killed")
    parser.add_argument("--tabs", type=int, default=0, help="so many tabs of a studio, beside one that is hostile")
    parser.add_argument("--seconds", type=float, default=180.0, help="how long the tabs move the machine")
    parser.add_argument("--longest", type=float, default=5.0, help="processor time of a case on an idle machine, s")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--case", metavar="KIND:NUMBER", help="show one case and its end")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tempfile.tempdir = folder
        if options.case:
            kind, _, number = options.case.partition(":")
            show(kind, int(number), options.seed, options.longest)
            return 0
        return report(options)


def answered_of(machines: int, answered: Counter[str]) -> str:
    """How many machines were answered, and how many of those had each part."""
    statuses = ", ".join(
        f"{count} {name.removeprefix('status ')}" for name, count in answered.most_common() if "status " in name
    )
    rows = "\n".join(f"  {answered[part]:6} {part}" for part in parts())
    return f"{machines} machines: {statuses}; machines with an answer that have a part:\n{rows}"


def report(options: argparse.Namespace) -> int:
    """Print the findings of a whole attack, one of each sort; 1 where there is any."""
    sorts: Counter[str] = Counter()
    answered: Counter[str] = Counter()
    with ProcessPoolExecutor(options.jobs, get_context("fork")) as pool:
        drawn = blocks(options.files, options.machines, options.lines)
        runs = [pool.submit(block, kind, options.seed, numbers, options.longest) for kind, numbers in drawn]
        for run in runs:
            findings, parts_answered = run.result()
            answered += parts_answered
            for kind, number, finding in findings:
                last = finding.strip().splitlines()[-1][:160]
                sorts[f"{kind}: {last}"] += 1
                if sorts[f"{kind}: {last}"] == 1:
                    print(f"--case {kind}:{number} --seed {options.seed}\n{finding}\n", flush=True)
    crowded = crowd(options.tabs, options.seconds) if options.tabs else iter(())
    for finding in (*kills(options.kills, options.seed), *crowded):
        print(finding + "\n", flush=True)
        sorts[finding] += 1
    if options.machines:
        print(answered_of(options.machines, answered))
    total = sum(sorts.values())
    cases = f"{options.files} files, {options.machines} machines, {options.lines} command lines"
    cases += f", {options.kills} kills of each long command"
    print(f"{cases}, {options.tabs} tabs: {total} findings of {len(sorts)} sorts")
    return 1 if total else 0


if __name__ == "__main__":
    sys.exit(main())
