"""How a hostile case is judged: a clear refusal or an answer without silent NaN, within bounded processor time."""

import contextlib
import io
import math
import signal
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import grown_machines
import numpy as np
from hostile import toml
from laws import Case, broken_law, response_of
from tables import GOOD_ENTRIES, MACHINE

from kinetostat.cli import main
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.exchange import urdf_import
from kinetostat.kinematics.status import Status
from kinetostat.machine.loading import as_toml, build, load
from kinetostat.machine.machine import Machine
from kinetostat.spec import document as documents
from kinetostat.spec.errors import InputError
from kinetostat.spec.study import read_study
from kinetostat.studies.analysis import analyze
from kinetostat.studies.budget import budget
from kinetostat.studies.datasets import evaluate
from kinetostat.studies.identification.identification import identify
from kinetostat.studies.measured_stiffness import validate_measured
from kinetostat.studies.optimisation.problem import build_problem
from kinetostat.studies.under_load import under_load
from kinetostat.studies.vibration import modes

REFERENCE = 0.06
"""Processor time of the reference work on two idle cores of a server, s."""
LONGEST_MESSAGE = 4000
CODES = {0, 1, 2}
FEW = 16
"""Machines that are drawn of a budget."""
SHARE_OF_JUDGES = 0.05
"""Of the machines that close, those that are judged as all files are as well."""


class TooLong(BaseException):
    """The case has used up its processor time. No handler of ordinary errors catches it."""


def allowed(longest: float) -> float:
    """Processor time of one case on this machine now, s: more where a neighbour on the core makes it slow."""
    matrix, begin = np.eye(6) + 0.1, time.process_time()
    for number in range(4000):
        f"{np.linalg.solve(matrix, matrix[:, number % 6]).sum():.6g}".split(".")
    return longest * max((time.process_time() - begin) / REFERENCE, 1.0)


@contextlib.contextmanager
def bounded(seconds: float) -> Iterator[None]:
    """Stop what takes more processor time; other work on the machine does not count."""

    def stop(*_: Any) -> None:
        raise TooLong

    previous = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, previous)


def judged(case: Callable[[], str | None], seconds: float) -> str | None:
    """What is wrong with how a case ended; None where nothing is. It may take so many seconds of processor time."""
    try:
        with bounded(seconds), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return case()
    except InputError as error:
        return unclear(str(error))
    except TooLong:
        return f"takes more than {seconds:g} s of processor time"
    except MemoryError:
        return "memory is exhausted"
    except Exception:  # every other one is a finding
        return traceback.format_exc(limit=-4)


def unclear(message: str) -> str | None:
    """What is wrong with a refusal."""
    if not message.isprintable():
        return f"a refusal of several lines, or with control characters: {message[:300]!r}"
    if len(message) > LONGEST_MESSAGE:
        return f"a refusal of {len(message)} characters: {message[:300]!r}"
    return None if message.rstrip()[-1:] in (".", "?", ")", "`") else f"a refusal that does not end: {message!r}"


def _judge_loaded(state: MachineState) -> None:
    """Look for a state of rest that is not one."""
    answer = under_load(state)
    if answer.has_rest and not all(map(math.isfinite, answer.displacement)):
        raise AssertionError(f"at rest at {answer.displacement}")


def _judge_vibration(state: MachineState) -> None:
    """Look for a frequency or a share of energy that is none."""
    for mode in modes(state).modes:
        numbers = [mode.frequency, mode.ratio, *mode.strain.values(), *mode.kinetic.values()]
        if not all(math.isfinite(number) for number in numbers) or mode.frequency < 0.0:
            raise AssertionError(f"a mode of {mode.frequency} Hz: {numbers}")


def _judge_budget(state: MachineState) -> None:
    """Look for an error of the tool that is none."""
    answer = budget(state, samples=FEW, exact=FEW)
    if not np.isfinite(answer.spread.usual[answer.settled]).all() or np.isnan(answer.shares).any():
        raise AssertionError(f"errors of {answer.spread.usual}, shares {answer.shares}")


def machine_case(text: str) -> str | None:
    """A machine file: read, analysed, written, read again."""
    machine = build(text, "file.toml")
    return wrong_answer(machine) or _lost_in_writing(machine)


def grown_case(rng: Random, answered: Counter[str]) -> str | None:
    """A machine that closes: it is built, and where it has an answer, this answer keeps all laws.

    Args:
        rng: from which the machine and the laws that judge it are drawn.
        answered: counts the parts of the machines that are answered, and the status of all.
    """
    document = grown_machines.machine(rng)
    text = toml(document)
    machine = build(text, "grown.toml")
    response = response_of(machine)
    status = Status(int(response.status))
    answered[f"status {status.word}"] += 1
    if status is not Status.OK:
        return None if analyze(machine).message else f"status {status} without a reason"
    answered.update(grown_machines.parts_of(document))
    if rng.random() < SHARE_OF_JUDGES:
        finding = wrong_answer(machine) or _lost_in_writing(machine)
        if finding:
            return finding
    return broken_law(Case(document, machine, response, rng))


def wrong_answer(machine: Machine) -> str | None:
    """What is wrong with what is said of a machine; its state is solved for once, as a report does."""
    state = state_of(machine)
    analysis = analyze(state)
    # Gravity without a mass, bounds of tensions without cables, no mass, no tolerances.
    for judge in (_judge_loaded, _judge_vibration, _judge_budget):
        try:
            judge(state)
        except InputError as error:
            if unclear(str(error)):
                return unclear(str(error))
    if analysis.status is not Status.OK:
        return None if analysis.message else f"status {analysis.status} without a reason"
    for name in ("stiffness", "compliance", "stiffness_diagonal", "compliance_diagonal"):
        entries = getattr(analysis, name)
        if entries is not None and np.isnan(np.asarray(entries, dtype=float)).any():
            return f"NaN in the {name} of a pose that is ok"
    if all(c == 0.0 for c in analysis.compliance_diagonal) and not analysis.rigid:
        return "a compliance of zeros, and no spring is rigid"
    # Where nothing is compliant, or something is free, there is nothing to share.
    diagonal = np.asarray(analysis.compliance_diagonal, dtype=float)
    shared = np.isfinite(diagonal) & (diagonal != 0.0)
    shares = [np.asarray(entry.compliance_share, dtype=float) for entry in analysis.attribution]
    return "NaN in a share" if any(np.isnan(share[shared]).any() for share in shares) else None


def _lost_in_writing(machine: Machine) -> str | None:
    again = build(as_toml(machine), "again.toml")
    return None if as_toml(again) == as_toml(machine) else "the machine that is written is another one"


def study_case(text: str) -> str | None:
    """A study file, up to the problem that it states."""
    build_problem(read_study(documents.parse(text, "study.toml"), "study.toml"))
    return None


def urdf_case(text: str) -> str | None:
    """A URDF file, converted."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "robot.urdf")
        path.write_bytes(text.encode(errors="surrogatepass"))
        build(urdf_import.machine_text(path), "robot.toml")
    return None


def table_case(text: str) -> str | None:
    """A file of poses, of measurements and of entries of a stiffness: read as each of these."""
    readers: tuple[Callable[[Path], object], ...] = (_identified, _evaluated, _compared)
    return _first_finding([partial(reader, _file_of("table.csv", text)) for reader in readers])


def record_case(text: str) -> str | None:
    """The record of a fit."""
    entries = _file_of("entries.csv", GOOD_ENTRIES)
    return _first_finding([lambda: validate_measured(load(MACHINE), entries, fit=_file_of("fit.json", text))])


def _first_finding(cases: Sequence[Callable[[], object]]) -> str | None:
    for case in cases:
        try:
            finding = case()
        except InputError as error:
            finding = unclear(str(error))
        if isinstance(finding, str):
            return finding
    return None


def _file_of(name: str, text: str) -> Path:
    path = Path(name)
    path.write_bytes(text.encode(errors="surrogatepass"))
    return path


def _identified(path: Path) -> str | None:
    answer = identify(load(MACHINE), path, ["zeros", "gains"])
    return None if np.isfinite(answer.fit.values).all() else f"identified {answer.fit.values}"


def _evaluated(path: Path) -> None:
    evaluate(load(MACHINE), path, ["stiffness_x"])


def _compared(path: Path) -> None:
    validate_measured(load(MACHINE), path)


FILES = {
    "machine": machine_case, "study": study_case, "urdf": urdf_case, "table": table_case, "record": record_case,
}  # fmt: skip


def line_case(arguments: list[str]) -> str | None:
    """A command line: it ends with a known code, and refusals are one paragraph on standard error."""
    out, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        try:
            code = main(arguments)
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else 2
    printed = errors.getvalue()
    if code not in CODES:
        return f"exit code {code}"
    if "Traceback" in printed:
        return f"standard error: {printed[:400]!r}"
    return f"refused without a word, code {code}" if code == 2 and not printed.strip() else None
