"""A folder against the checksums of what was written into it: is all of it still there, bit for bit? Mends nothing."""

from math import ceil
from pathlib import Path

from kinetostat.frozen import dataclass
from kinetostat.studies.optimisation.log import ROWS, RowFile
from kinetostat.studies.result_file import frame_is_whole
from kinetostat.studies.storage import LIST, differing, is_damaged, read_list
from kinetostat.studies.stored_grid import LAYOUT, damaged_chunks, partial_of
from kinetostat.studies.study_folder import (
    DATA,
    HISTORY,
    Record,
    damaged_questions,
    has_checksums,
    holds_study,
    in_use,
    read_history,
    read_question,
)

RESULT_FILE = "result.json"
"""File that a search writes last but for tables and figures: where it lies, all steps have been done."""


def has_checks(folder: Path) -> bool:
    """Whether a folder can be checked: it is that of a long study, or has a list of its files."""
    return holds_study(folder) or (folder / LIST).exists()


@dataclass(frozen=True)
class StepsCheck:
    """Result of checking the steps of a search, or the chunks of a grid.

    Attributes:
        parts: "chunks" of a grid, or "steps" of a search.
        intact: number of those that are as they were written.
        damaged: number of those that are not, or have been lost; the same command, or `optimize FOLDER`, computes them
            again.
        missing: number of those that are still to be computed, since the study was stopped.
        frame: whether names, attributes and coordinates of a grid's file are as they were written.
        checked: whether there are checksums; without them only missing data is seen.
        removed: whether a grid's file is no longer there.
    """

    parts: str
    intact: int
    damaged: int
    missing: int
    frame: bool
    checked: bool
    removed: bool = False

    @property
    def whole(self) -> bool:
        """Whether nothing is damaged."""
        return not self.damaged and self.frame

    @property
    def sentence(self) -> str:
        """The result in words."""
        missing = f" {self.missing:,} are still to be computed." if self.missing else ""
        if self.removed:
            return f"The file of the grid is no longer there; {self.damaged:,} {self.parts} were in it."
        if not self.whole:
            frame = "" if self.frame else " The structure of its file is damaged."
            return f"{self.damaged:,} {self.parts} are damaged or lost, {self.intact:,} are there.{frame}"
        if not self.checked:
            return (
                f"{self.intact:,} {self.parts} are there; the folder was begun without checksums, by an earlier "
                f"version, so damage in them cannot be seen.{missing}"
            )
        return f"{self.intact:,} {self.parts} are there, and all of them are as they were written.{missing}"


@dataclass(frozen=True)
class FolderCheck:
    """Result of checking a folder.

    Attributes:
        steps: steps of the folder's long study; None if it has none.
        files: number of files that are listed; None if there is no list.
        changed: names of listed files that are missing or not as they were written, the list itself among them.
    """

    steps: StepsCheck | None
    files: int | None
    changed: tuple[str, ...]

    @property
    def whole(self) -> bool:
        """Whether nothing is damaged."""
        return not self.changed and (self.steps is None or self.steps.whole)

    @property
    def sentence(self) -> str:
        """The result in words."""
        sentences = [self.steps.sentence] if self.steps else []
        if self.changed:
            sentences.append(f"Missing, damaged or changed since: {', '.join(self.changed)}.")
        elif self.files:
            sentences.append(f"All {self.files:,} files that {LIST} lists are as they were written.")
        elif self.steps and not self.steps.missing:
            sentences.append(f"There is no {LIST}, so damage in files of results cannot be seen.")
        if self.steps and self.steps.removed:
            sentences.append("Remove the folder, and give the command of this study again.")
        elif not self.whole:
            sentences.append("Give the command of this study again: it computes and writes what is damaged.")
        return " ".join(sentences)


def check_folder(folder: Path) -> FolderCheck:
    """Compare everything in a folder with the checksums that were written with it.

    Args:
        folder: the folder of a grid or a search, in which another process may be at work, or with a list of files.

    Raises:
        InputError: its question and the copy of it cannot be read.
    """
    steps = _check_of_study(folder) if holds_study(folder) else None
    changed = [LIST] if is_damaged(folder) else differing(folder)
    changed += [name for name in (damaged_questions(folder) if steps else ()) if name not in changed]
    listed = read_list(folder)
    return FolderCheck(steps, None if listed is None else len(listed), tuple(changed))


def _check_of_study(folder: Path) -> StepsCheck:
    """Compare the steps of a search, or the chunks of a grid, with what was noted about them."""
    question = read_question(folder)
    records = {record["chunk"]: record for record in read_history(folder)[0]}
    history = (folder / HISTORY).read_bytes() if (folder / HISTORY).exists() else b""
    # A last line without an end is one that another process is writing now, or one that was cut short.
    cut_short = bool(history) and not history.endswith(b"\n") and not in_use(folder)
    broken = history.count(b"\n") + cut_short - len(records)
    if "optimisation" in question:
        return _check_of_search(folder, question, records, broken)
    return _check_of_grid(folder, question, records, broken)


def _check_of_search(folder: Path, question: Record, records: dict[int, Record], broken: int) -> StepsCheck:
    """The check of the steps of a search.

    Args:
        folder: its folder.
        question: the study, as it was noted when it began.
        records: what was noted about each step that is done, by its number.
        broken: number of lines of its history that cannot be read.
    """
    total = max((record.get("of", 0) for record in records.values()), default=0)
    damaged = _damaged_steps(folder, question, records)
    intact, finished = len(records) - damaged, (folder / RESULT_FILE).exists()
    return _steps_check("steps", intact, damaged + broken, total, finished, question)


def _check_of_grid(folder: Path, question: Record, records: dict[int, Record], broken: int) -> StepsCheck:
    """The check of the chunks of a grid; arguments as for `_check_of_search`."""
    if LAYOUT not in question:  # begun by a version without checksums of the file
        return StepsCheck(parts="chunks", intact=len(records), damaged=broken, missing=0, frame=True, checked=False)
    final = folder / str(question.get("file"))
    path = final if final.exists() else partial_of(final)
    if not path.exists():
        return StepsCheck(
            parts="chunks",
            intact=0,
            damaged=len(records) + broken,
            missing=0,
            frame=False,
            checked=True,
            removed=True,
        )
    layout, chunk = question[LAYOUT], question["chunk"]
    damaged, total = len(damaged_chunks(path, layout, records, chunk)), ceil(layout["points"] / chunk)
    intact, frame = len(records) - damaged, frame_is_whole(path, layout)
    return _steps_check("chunks", intact, damaged + broken, total, final.exists(), question, frame)


def _steps_check(
    parts: str, intact: int, damaged: int, total: int, finished: bool, question: Record, frame: bool = True
) -> StepsCheck:
    """The check of `total` parts: those that are neither intact nor damaged are lost if the study is finished."""
    others = max(total - intact - damaged, 0)
    return StepsCheck(
        parts=parts,
        intact=intact,
        damaged=damaged + (others if finished else 0),
        missing=0 if finished else others,
        frame=frame,
        checked=has_checksums(question),
    )


def _damaged_steps(folder: Path, question: Record, records: dict[int, Record]) -> int:
    """Count the steps whose designs are not those that were written."""
    damaged = start = 0
    if not (folder / ROWS).exists():
        return len(records)
    with RowFile(folder / ROWS, question["numbers in a row"]) as file:
        for _, record in sorted(records.items()):
            damaged += file.read(start, record["designs"], record.get(DATA)) is None
            start += record["designs"]
    return damaged
