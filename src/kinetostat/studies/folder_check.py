"""The folder of a long study against its checksums: is what was written still there, bit for bit? Mends nothing."""

from dataclasses import dataclass
from pathlib import Path

from kinetostat.studies.grid.stored_grid import LAYOUT, damaged_chunks
from kinetostat.studies.optimisation.search import ROWS
from kinetostat.studies.result_file import RowFile, frame_is_whole
from kinetostat.studies.study_folder import DATA, HISTORY, Record, has_checksums, noted, read_question


@dataclass(frozen=True)
class FolderCheck:
    """What became of a folder.

    Attributes:
        parts: "chunks" of a grid, or "steps" of a search.
        intact: how many of them are as they were written.
        damaged: how many are not; the same command, or `optimize FOLDER`, computes them again.
        frame: whether names, attributes and coordinates of a grid's file are as they were written.
        checked: whether there are checksums; without them only missing data is seen.
    """

    parts: str
    intact: int
    damaged: int
    frame: bool
    checked: bool

    @property
    def whole(self) -> bool:
        """Whether nothing is damaged."""
        return not self.damaged and self.frame

    @property
    def sentence(self) -> str:
        """The result in words."""
        if not self.checked:
            return (
                f"{self.intact:,} {self.parts} are there; the folder was begun without checksums, by an earlier "
                "version, so damage in them cannot be seen."
            )
        if self.whole:
            return f"{self.intact:,} {self.parts} are there, and all of them are as they were written."
        frame = "" if self.frame else " The structure of its file is damaged."
        return (
            f"{self.damaged:,} {self.parts} are damaged, {self.intact:,} are as they were written.{frame} Give the "
            "command of this study again: it computes what is damaged."
        )


def check_folder(folder: Path) -> FolderCheck:
    """Compare everything in the folder of a long study with the checksums that were noted with it.

    Args:
        folder: of a grid or a search; another process may be at work in it.

    Raises:
        InputError: its question cannot be read.
    """
    question = read_question(folder)
    records = {record["chunk"]: record for record in noted(folder)[0]}
    lines = (folder / HISTORY).read_bytes().count(b"\n") if (folder / HISTORY).exists() else 0
    lost = max(lines - len(records), 0)
    if "optimisation" in question:
        damaged = _damaged_steps(folder, question, records)
        return FolderCheck("steps", len(records) - damaged, damaged + lost, True, has_checksums(question))
    final = folder / str(question.get("file"))
    path = final if final.exists() else final.with_suffix(f".partial{final.suffix}")
    if LAYOUT not in question:
        return FolderCheck("chunks", len(records), lost, True, False)
    if not path.exists():
        return FolderCheck("chunks", 0, len(records) + lost, False, True)
    bad = len(damaged_chunks(path, question[LAYOUT], records, question["chunk"]))
    return FolderCheck("chunks", len(records) - bad, bad + lost, frame_is_whole(path, question[LAYOUT]), True)


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
