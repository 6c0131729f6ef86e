"""Tables, figures, data and files of each kind of result: one row a kind. Nothing is drawn here.

`plot`, `save` and notebooks look up here what they can show. A row names functions, whose modules are imported when
something of this kind is shown, so that the list costs nothing.
"""

import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinetostat.frozen import dataclass
from kinetostat.late import LateModule
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice
from kinetostat.views.question import Description, late
from kinetostat.views.questions import ANSWERS

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

    from kinetostat.studies import storage
else:
    storage = LateModule("kinetostat.studies.storage")


@dataclass(frozen=True)
class ResultKind:
    """Results of one kind and the description by which they are shown; a machine has no description.

    Attributes:
        type: class of the results, "module.Class".
        description: where the description lives; empty for a machine.
    """

    type: str
    description: str = ""

    @property
    def name(self) -> str:
        """Name of the class."""
        return self.type.rpartition(".")[2]

    def print_to(self, console: "Console", answer: object) -> None:
        """Print a result of this kind."""
        if self.description:
            late("views.tables.print_answer")(console, late(self.description), answer)
        else:
            late("views.tables.print_machine")(console, answer)

    def figures(self, answer: object) -> "Mapping[str, Callable[[], Figure]]":
        """Return the functions that draw a result, by name; the most telling one first."""
        if self.description:
            return description_of(answer).drawings(answer)
        drawings: Mapping[str, Callable[[], Figure]] = late("views.drawing.machine_figures")(answer)
        return drawings


RESULT_KINDS = (ResultKind("machine.machine.Machine"), *(ResultKind(name, place) for name, place in ANSWERS.items()))
"""All kinds of results that Python and notebooks show."""
GRID_TYPE = "xarray.Dataset"
"""Class of the answers over a grid, which are told from datasets of other programs by their variable "status"."""
FILES_OF_A_MACHINE = {
    ".toml": "machine.saving.as_file",
    ".png": "views.picture.machine_picture",
    ".glb": "exchange.solids.machine_glb",
}
"""Functions that make each file of a machine, a text or bytes."""


def description_of(answer: object) -> Description:
    """Look up the description of an answer.

    Raises:
        InputError: it is not an answer of kinetostat.
    """
    description: Description = late(kind_of(answer).description)
    return description


def _is_instance(answer: object, path: str) -> bool:
    """Return whether an object is of a class; its module has been imported if there is an object of it."""
    module, _, name = path.rpartition(".")
    home = sys.modules.get(f"kinetostat.{module}") or sys.modules.get(module)
    return home is not None and isinstance(answer, getattr(home, name))


def kind_of(answer: object) -> ResultKind:
    """Look up how a result is shown.

    Raises:
        InputError: it is not a result of kinetostat.
    """
    kind_of_answer = next((kind for kind in RESULT_KINDS if _is_instance(answer, kind.type)), None)
    if kind_of_answer is None or (kind_of_answer.type == GRID_TYPE and "status" not in answer):  # type: ignore[operator]
        kinds = ", ".join(kind.name for kind in RESULT_KINDS)
        raise InputError(
            f"An object of type {type(answer).__name__} is not a result of kinetostat; give one of: {kinds}."
        )
    return kind_of_answer


def plain_of(answer: object) -> Any:
    """Return an answer as plain data, as JSON has it."""
    return late("views.data_forms.json_of")(description_of(answer), answer)


@checked
def plot(answer: object, which: str | None = None) -> "Figure":
    """Draw a figure of a result; a notebook displays it, `save` writes it.

    Args:
        answer: a machine (front, side and plan, to scale), a grid over one or two fields, a workspace, sensitivities,
            guidelines, a comparison or an optimisation's result.
        which: name of one of its figures; the most telling one if None.

    Raises:
        InputError: there is no such figure; the message names the available ones.
    """
    figures = kind_of(answer).figures(answer)
    if not figures:
        raise InputError(
            f"There is no figure for a result of type {type(answer).__name__}; use its tables and its data instead."
        )
    return figures[next(iter(figures)) if which is None else choice(which, figures, "which")]()


Writer = Callable[[Path], None]
FORMS = {"json": "json_of", "csv": "csv_of", "nc": "netcdf_of"}
"""Function of `data_forms` that makes each form of an answer."""
FIGURE_SUFFIXES = (".png", ".svg", ".pdf")


@checked
def save(what: object, path: str | Path) -> Path:
    """Write a machine, a result or a figure to a file, completely or not at all; its suffix gives the format.

    Args:
        what: a machine (.toml; .png, a picture; .glb, its solids), an answer (.json), a grid or a workspace (.json,
            .nc), a figure (.png, .svg, .pdf), a picture (.png).
        path: the path of the file; an existing file is replaced.

    Returns:
        The path.

    Raises:
        InputError: the suffix does not fit what is saved, or the file cannot be written.
    """
    place = Path(path)
    writers = _writers(what)
    writers[choice(place.suffix.lower(), writers, f'the suffix of "{place}"')](place)
    return place


def _writers(what: object) -> dict[str, Writer]:
    """Return the ways to write it, by suffix."""
    if _is_instance(what, "matplotlib.figure.Figure"):
        return dict.fromkeys(FIGURE_SUFFIXES, partial(late("views.figures.save_figure"), what))
    if _is_instance(what, "views.picture.Picture"):
        return {".png": partial(write_content, what)}
    if not kind_of(what).description:
        files = FILES_OF_A_MACHINE.items()
        return {suffix: partial(write_made, late(maker), what) for suffix, maker in files}
    description = description_of(what)
    return {f".{form}": partial(write_form, description, what, form) for form in description.forms}


def write_made(maker: Callable[[Any], Any], what: object, path: Path) -> None:
    """Write what a function makes of a machine."""
    write_content(maker(what), path)


def write_form(description: Description, answer: object, form: str, path: Path) -> None:
    """Write an answer as "json", "csv" or "nc"."""
    maker = description.makers.get(form)
    content = late(maker)(answer) if maker else late(f"views.data_forms.{FORMS[form]}")(description, answer)
    if form == "json":
        storage.write_json(path, content)
    else:
        write_content(content, path)


def write_files(description: Description, answer: object, folder: Path) -> list[Path]:
    """Write the files of an answer that a folder of results gets, without figures; return their paths."""
    written = []
    for name, form in description.files.items():
        if form in FORMS:
            write_form(description, answer, str(form), folder / name)
        elif (content := late(form)(answer)) is not None:
            write_content(content, folder / name)
        else:
            continue
        written.append(folder / name)
    return written


def write_content(content: Any, path: Path) -> None:
    """Write a text, bytes, plain data or a dataset."""
    kinds: tuple[tuple[type, Callable[[Path, Any], None]], ...] = (
        (str, storage.write_text),
        (bytes, storage.write_bytes),
        (dict, storage.write_json),
    )
    next((write for kind, write in kinds if isinstance(content, kind)), storage.write_dataset)(path, content)
