"""Answers for grids of any size: chunk by chunk into a folder, so that nothing is lost when the work is stopped.

The numbers lie in one NetCDF file at fixed places; a history beside it notes each chunk that is whole, with a checksum.
Resuming computes the chunks that are missing or damaged. The format of the file is in `result_file`.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from kinetostat.display import ENGINEERING
from kinetostat.engine.batch import Evaluation, Progress, silent
from kinetostat.engine.chunks import Compute, Work, in_chunks, in_this_process
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.loading import as_toml, build
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.datasets import ABOUT_STATUS, GridQuestion, about_quantity
from kinetostat.studies.result_file import (
    UNKNOWN,
    Layout,
    ResultFile,
    check_space,
    copy_run,
    create,
    frame_is_whole,
    run_checksum,
)
from kinetostat.studies.storage import settle, writing
from kinetostat.studies.study_folder import DATA, Record, StudyFolder, holds_study, read_question, study_folder

MOST_NUMBERS = 10_000_000_000
"""Greatest number of points times quantities of one grid: more than 80 GB are a slip of the pen in a count."""
GRID_STUDY_VERSION = 1
"""Version of the question that a folder keeps."""
LAYOUT = "layout"
"""Key under which the question of a folder has the layout of its file."""


@dataclass(frozen=True)
class Extremes:
    """Extremes and mean of a quantity, SI, over the points where it has a value; NaN where there is none."""

    least: float
    mean: float
    largest: float


@dataclass(frozen=True)
class Tally:
    """Counts and extremes over all points of a grid.

    Attributes:
        statuses: number of points that have each status.
        extremes: extremes of each quantity, by name.
    """

    statuses: dict[Status, int]
    extremes: dict[str, Extremes]

    @property
    def answered(self) -> bool:
        """Whether any point has results."""
        return self.statuses.get(Status.OK, 0) > 0


@dataclass(frozen=True)
class StoredGrid:
    """The answer to a question about a grid, in a file.

    Attributes:
        question: the question that is answered.
        path: path of the NetCDF file.
        tally: counts and extremes over all points.
        chunks: number of all chunks.
        computed: number of chunks that were computed now; the others were in the folder.
        repaired: the parts of the folder that were damaged and were computed again, in words; empty if none were.
        unchecked: whether the folder was begun without checksums.
    """

    question: GridQuestion
    path: Path
    tally: Tally
    chunks: int
    computed: int
    repaired: str = ""
    unchecked: bool = False


def answer_into(
    question: GridQuestion,
    folder: Path,
    stem: str,
    progress: Progress = silent,
    compute: Compute = in_this_process,
    resume: bool = False,
) -> StoredGrid:
    """Answer a question about a grid into FOLDER/STEM.nc; continue if the folder holds a part of the same answer.

    The file is called STEM.partial.nc until it is whole; in it, status -1 marks points that are not computed yet.

    Args:
        question: a question of any size that the disk holds.
        folder: a folder for this study alone.
        stem: name of the file.
        progress: receives the number of points done, and that of all.
        compute: computes chunks, here or in other processes; results are the same bit for bit.
        resume: refuse a folder that holds no part of the answer.

    Raises:
        InputError: too many points, no space, another study or another process in the folder, nothing to resume.
    """
    _check_size(question)
    if resume and not holds_study(folder):
        raise InputError(f'"{folder}" does not hold a study that could be resumed; check -o, or leave out --resume.')
    final = folder / f"{stem}.nc"
    if not holds_study(folder):
        _check_room(question, final)
    with study_folder(folder) as study:
        work, layout = _begin_or_continue(question, study, final)
        repaired = "" if layout is None else _repair(question, study, final, work, layout)
        records_before = study.records()
        missing = [number for number in range(work.count) if number not in records_before]
        if missing:
            if final.exists():
                final.replace(partial_of(final))
            _compute_missing(work, missing, partial_of(final), study, progress, compute)
        if partial_of(final).exists():
            partial_of(final).replace(final)
        records = study.records()
        return StoredGrid(
            question=question,
            path=final,
            tally=_tally_of([records[number] for number in range(work.count)], question.names),
            chunks=work.count,
            computed=len(missing),
            repaired=repaired,
            unchecked=layout is None,
        )


def _check_size(question: GridQuestion) -> None:
    numbers = question.grid.size * len(question.names)
    if numbers > MOST_NUMBERS:
        raise InputError(
            f"the grid has {question.grid.size:,} points of {len(question.names)} quantities, {numbers:,} numbers; "
            f"at most {MOST_NUMBERS:,} are allowed: lower the counts or name fewer quantities."
        )


def _check_room(question: GridQuestion, final: Path) -> None:
    if final.exists():
        raise InputError(f'"{final}" exists already; choose another folder with -o, or remove the file.')
    check_space(final.parent, question.grid.size, len(question.names))


def partial_of(final: Path) -> Path:
    """Return the path of a result until it is whole."""
    return final.with_suffix(f".partial{final.suffix}")


def _begin_or_continue(question: GridQuestion, study: StudyFolder, final: Path) -> tuple[Work, Layout | None]:
    """Begin the study, or take its work from the folder; the layout is None in a folder from before layouts."""
    work = in_chunks(question.machine, question.grid, question.names)
    record = _question_record(question, final.name)
    stored = study.checked_question(record, _in_this_version)
    if stored is None:
        layout = _create(question, final)
        study.begin({**record, "chunk": work.chunk, LAYOUT: layout})
        return work, layout
    if not final.exists() and not partial_of(final).exists():
        raise InputError(f'"{final}" was removed from its study; remove the folder "{study.path}" to begin again.')
    return Work(work.machine, work.points, work.quantities, int(stored["chunk"])), stored.get(LAYOUT)


def _create(question: GridQuestion, final: Path) -> Layout:
    """Make the file of a grid in which nothing is computed yet, at the path of a partial result."""
    quantities = {name: about_quantity(name) for name in question.names}
    return create(partial_of(final), question.labels, question.dims, quantities, _about_status())


def _repair(question: GridQuestion, study: StudyFolder, final: Path, work: Work, layout: Layout) -> str:
    """Forget damaged chunks, so that they are computed again, and return what was damaged in words.

    A file whose structure is damaged is made again, and the numbers of its sound chunks are copied.
    """
    path, broken = final if final.exists() else partial_of(final), final.with_suffix(f".damaged{final.suffix}")
    records = study.records()
    lost_notes = study.damaged
    damaged = damaged_chunks(path, layout, records, work.chunk)
    frame_is_sound = frame_is_whole(path, layout)
    if not frame_is_sound:
        path.replace(broken)
        fresh = _create(question, final)  # of an earlier version's file, another layout
        with writing(path), broken.open("rb") as source, partial_of(final).open("r+b") as target:
            for number in records.keys() - damaged:
                copy_run(source, layout, target, fresh, work.part(number))
            settle(target)
        study.write_question(read_question(study.path) | {LAYOUT: fresh})
    broken.unlink(missing_ok=True)
    repaired = []
    if damaged or lost_notes:
        study.keep(record for number, record in records.items() if number not in damaged)
        repaired.append(f"{len(damaged) + lost_notes:,} of {work.count:,} chunks")
    if not frame_is_sound:
        repaired.append("the structure of its file")
    return " and ".join(repaired)


def damaged_chunks(path: Path, layout: Layout, records: Mapping[int, Record], chunk: int) -> set[int]:
    """Return the numbers of the chunks whose numbers in a file are not those that were written.

    Args:
        path: path of the file.
        layout: its layout.
        records: the notes about its chunks, by number.
        chunk: number of points of a chunk.
    """
    with path.open("rb") as stream:
        return {
            number
            for number, record in records.items()
            if run_checksum(stream, layout, range(number * chunk, min((number + 1) * chunk, layout["points"])))
            != record.get(DATA)
        }


def _about_status() -> Mapping[str, Any]:
    meanings = f"not_computed {ABOUT_STATUS['flag_meanings']}"
    return {"flag_values": [UNKNOWN, *(int(status) for status in Status)], "flag_meanings": meanings}


def _question_record(question: GridQuestion, file: str) -> Record:
    """Everything on which the numbers depend: a folder with another record holds another study."""
    attributes = question.labels.attrs
    axes = [
        {"field": field, "from": float(axis.values[0]), "to": float(axis.values[-1]), "count": len(axis.values)}
        | {"log": question.labels[dim].attrs["log"]}
        for dim, field, axis in zip(question.dims, question.fields, question.grid.axes, strict=True)
    ]
    return {
        "study": GRID_STUDY_VERSION,
        "kinetostat": attributes["kinetostat"],
        "file": file,
        "machine": _text_of(question.machine),
        "axes": axes,
        "quantities": list(question.names),
    }


def _in_this_version(stored: Record) -> Record:
    """A stored question as this version writes it."""
    if "machine" not in stored:
        return stored
    return {**stored, "machine": _text_of(build(stored["machine"], "study.json"))}


def _text_of(machine: Machine) -> str:
    """A machine as text for the question, without its units of display: these do not make it another study."""
    return as_toml(replace(machine, display=ENGINEERING))


def _compute_missing(
    work: Work, missing: Sequence[int], path: Path, study: StudyFolder, progress: Progress, compute: Compute
) -> None:
    """Compute chunks; a thread writes each of them while the next one is computed."""
    total = work.points.size
    done = total - sum(len(work.part(number)) for number in missing)
    progress(done, total)
    with closing(ResultFile(path, work.quantities)) as file, ThreadPoolExecutor(1) as writer:
        pending: Future[None] | None = None
        for number, evaluation in compute(work, missing):
            if pending:
                pending.result()
            pending = writer.submit(_write_chunk, file, study, number, work.part(number).start, evaluation)
            done += len(evaluation.status)
            progress(done, total)
        if pending:
            pending.result()


def _write_chunk(file: ResultFile, study: StudyFolder, number: int, start: int, evaluation: Evaluation) -> None:
    """Write the numbers first, and then the note that they are there."""
    written = file.write(start, evaluation.values, evaluation.status)
    study.note({"chunk": number, **_chunk_tally(evaluation), DATA: written})


class _QuantityTally(TypedDict):
    """Counts and extremes of a quantity over a chunk, as its note has them: NaN where the quantity has no value."""

    count: int
    least: float
    sum: float
    largest: float


class _ChunkTally(TypedDict):
    """The numbers in the note about a chunk: counts of points by the word of their status, and each quantity."""

    status: dict[str, int]
    quantities: dict[str, _QuantityTally]


def _chunk_tally(evaluation: Evaluation) -> _ChunkTally:
    codes, counts = np.unique(evaluation.status, return_counts=True)
    quantities = {}
    for name, values in evaluation.values.items():
        numbers = values[~np.isnan(values)]
        least, largest = (float(numbers.min()), float(numbers.max())) if len(numbers) else (np.nan, np.nan)
        quantities[name] = _QuantityTally(count=len(numbers), least=least, sum=float(numbers.sum()), largest=largest)
    statuses = {Status(int(code)).word: int(count) for code, count in zip(codes, counts, strict=True)}
    return _ChunkTally(status=statuses, quantities=quantities)


def _tally_of(records: Sequence[Record], names: Sequence[str]) -> Tally:
    """Combine what the notes about all chunks say."""
    words: Counter[str] = Counter()
    for record in records:
        words.update(record["status"])
    statuses = {status: words[status.word] for status in Status if words[status.word]}
    return Tally(statuses, {name: _extremes([record["quantities"][name] for record in records]) for name in names})


def _extremes(chunks: Sequence[_QuantityTally]) -> Extremes:
    filled = [chunk for chunk in chunks if chunk["count"]]
    if not filled:
        return Extremes(np.nan, np.nan, np.nan)
    mean = sum(chunk["sum"] for chunk in filled) / sum(chunk["count"] for chunk in filled)
    return Extremes(min(chunk["least"] for chunk in filled), mean, max(chunk["largest"] for chunk in filled))
