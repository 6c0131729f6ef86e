"""A question that the studio asks in a process of its own, so that it can be stopped and its memory is limited.

The process is `python -m kinetostat.studio.question_process`, with a request as JSON on its standard input. It runs in
a folder with the machine and the files that were sent, prints its progress as JSON, and writes its answer there.
"""

import argparse
import base64
import json
import sys
from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path
from typing import Any

from kinetostat.commands.asking import READERS
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import doubts
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.studies.storage import write_text
from kinetostat.studio.processes import REFUSED, limit_process
from kinetostat.studio.wording import heading, paragraph, table
from kinetostat.views.answers import description_of, write_form
from kinetostat.views.figures import as_svg
from kinetostat.views.question import Description, Drawing, Option, Question, late
from kinetostat.views.questions import QUESTIONS
from kinetostat.views.report.content import as_table, typeset

ASKING_PROGRAM = "kinetostat.studio.question_process"
SECONDS_TO_ANSWER = 3600
"""Processor time of a question, s: an hour, after which nobody waits in front of a page."""
MEMORY_TO_ANSWER = 4 << 30
"""Address space of the process, bytes: that of a large map with room to spare; a hostile one ends there."""
ANSWER_PAGE = "shown.html"
"""File of the answer as the page shows it."""
ANSWER_STEM = "answer"
"""Stem of the names of the answer's other files."""
MACHINE_FILE = "machine.toml"
UPLOAD_FOLDER = "sent"
"""Folder of the files that were sent, within that of the process; each option has a folder in it."""


def label_of(option: Option) -> str:
    """Return the name of an option as the page writes it."""
    return option.name.replace("_", " ")


def upload_path(option: Option, name: str) -> Path:
    """Return the path of a file that was sent for an option, within the folder of the process."""
    return Path(UPLOAD_FOLDER) / option.name / Path(name).name


def in_words_of_the_page(question: Question, text: str) -> str:
    """Return a text in which options have their names on the page, not those of the command line or of Python."""
    # The longest flag first, because a shorter one may be its beginning.
    for option in sorted(question.options, key=lambda option: -len(option.flag)):
        text = text.replace(option.flag, f'"{label_of(option)}"')
        if text.startswith(f"{option.name} "):  # messages begin with the name of the argument in Python
            text = label_of(option) + text.removeprefix(option.name)
    return text


def values_of(question: Question, entries: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a question takes besides the machine, from what was filled in.

    Args:
        question: the question whose options they are.
        entries: a text, a flag or a list of texts by the name of an option; one that is missing has its default.

    Raises:
        InputError: a text cannot be read, or something that is required is missing.
    """
    values = {}
    for option in question.options:
        entry = entries.get(option.name)
        if entry in (None, "", []):
            if option.required:
                raise InputError(f"{label_of(option)} is missing; it is {option.meaning}.")
            values[option.name] = list(option.default or ()) if option.many else option.default
        elif option.many:
            values[option.name] = [_value(option, str(text)) for text in entry]
        else:
            values[option.name] = bool(entry) if option.kind == "flag" else _value(option, str(entry))
    return values


def _value(option: Option, text: str) -> Any:
    if option.choices:
        return choice(text, option.choices, label_of(option))
    if option.kind == "file":
        return upload_path(option, text)
    reader: Callable[[str], Any] = READERS.get(option.kind, str)  # type: ignore[assignment]
    try:
        return reader(text)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"{label_of(option)}: {error}.") from None
    except ValueError:
        raise InputError(f"{label_of(option)} is {shorten(text)}; it must be a number.") from None


def answer_html(description: Description, answer: Any, full: bool) -> str:
    """Return an answer as HTML: its sentences, its tables, and its figures with their captions."""
    if not description.answered(answer):
        return paragraph(str(answer.message), "lead")
    parts = [
        f'<p class="note"><b>{escape(head)}</b> {escape(typeset(sentence))}</p>'
        for head, sentence in description.sentences(answer)
    ]
    parts += [paragraph(f"Note: {doubt}") for doubt in doubts(description.machine_of(answer))]
    for part in description.tables(answer, full):
        if isinstance(part, str):
            parts.append(paragraph(part))
            continue
        title = str(part.title or description.title)
        rows = as_table(part, title)
        parts.append(heading(title) + table(title, rows.heads, rows.rows, "of-answer", rows.numeric))
    return "".join(parts) + "".join(figure_html(drawing) for drawing in description.drawings(answer).values())


def figure_html(drawing: Drawing) -> str:
    """Return a figure with its caption as HTML."""
    data = base64.b64encode(as_svg(drawing(title="")).encode()).decode()
    image = f'<img alt="{escape(drawing.caption)}" src="data:image/svg+xml;base64,{data}">'
    return f"<figure>{image}<figcaption>{escape(drawing.caption)}</figcaption></figure>"


def ask(request: Mapping[str, Any], progress: Callable[..., None]) -> None:
    """Ask a question about the machine in this folder, and write its answer there as a page and in every other form.

    Args:
        request: its `word`, the `options` that were given, and whether tables show every row (`full`).
        progress: called as progress(done, total), or as progress(done, total, words), while it is being answered.

    Raises:
        InputError: what the question refuses.
    """
    question: Question = late(QUESTIONS[choice(request["word"], QUESTIONS, "the question")][1])
    reports = {"progress": progress} if question.reports_progress else {}
    overrides, arguments = question.arguments(values_of(question, request["options"]))
    try:
        answer = question.answer(load(MACHINE_FILE, overrides), **arguments, **reports)
    except InputError as error:
        raise InputError(in_words_of_the_page(question, str(error))) from None
    description = description_of(answer)
    if description.answered(answer):
        for form in description.forms:
            write_form(description, answer, form, Path(f"{ANSWER_STEM}.{form}"))
    write_text(Path(ANSWER_PAGE), answer_html(description, answer, bool(request["full"])))


def _print_progress(done: int, total: int, _words: str = "") -> None:
    print(json.dumps({"done": done, "total": total}), flush=True)


if __name__ == "__main__":
    limit_process(SECONDS_TO_ANSWER, MEMORY_TO_ANSWER)
    try:
        ask(json.load(sys.stdin), _print_progress)
    except InputError as refusal:
        print(json.dumps({"refused": str(refusal)}), flush=True)
        sys.exit(REFUSED)
