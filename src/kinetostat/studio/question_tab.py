"""The Ask tab: a choice of the question and its form on the left, its answer with its files on the right.

Forms follow from the options of a question (`views.question`); answers are computed in `question_process`.
"""

import asyncio
import json
import re
import sys
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from nicegui import background_tasks, events, run, ui

from kinetostat.machine.machine import Machine
from kinetostat.machine.saving import as_file
from kinetostat.spec.errors import InputError
from kinetostat.studio.elements import MAIN_BUTTON, choice, icon_button, upload_field
from kinetostat.studio.lanes import Lane
from kinetostat.studio.processes import REFUSED, Turns, make_modest
from kinetostat.studio.question_process import (
    ANSWER_PAGE,
    ANSWER_STEM,
    ASKING_PROGRAM,
    MACHINE_FILE,
    MEMORY_TO_ANSWER,
    SECONDS_TO_ANSWER,
    in_words_of_the_page,
    label_of,
    upload_path,
)
from kinetostat.studio.session import Session
from kinetostat.studio.wording import paragraph
from kinetostat.views.question import Option, Question, late
from kinetostat.views.questions import QUESTIONS

ASKING = Turns(2, "The question before is still being answered; stop it, then ask again.")
"""Questions of all tabs that are answered at a time."""
NOTHING_ASKED = "Choose a question and ask it; its answer is about the machine as it is then."
CHANGED = "The machine has been changed since; ask again for its new answer."
STOPPED = "The question was stopped."
MOST_FILES = 8
"""Files that an option takes at most: designs to compare, of which no more fit side by side."""
LARGEST_ANSWER = 24 << 20
"""Bytes of an answer that the page shows; a larger one would stop the browser, and is only downloaded."""
LONGEST_FILE_NAME = 80
"""Characters of the name of a file that was sent, the last ones, so that its suffix is kept."""
NAMES_OF_FORMS = {"json": "JSON", "csv": "CSV", "nc": "NetCDF"}
"""Kinds of files in which an answer can be downloaded, by their suffixes."""
EVERY_ROW = "full"
"""Name of the switch for tables with every row, which is not an option of a question."""


@dataclass
class QuestionForm:
    """The form of one question.

    Attributes:
        question: the question.
        fields: its elements by the name of an option; `EVERY_ROW` has one, too.
        files: the files that were sent, by the name of an option and their own.
    """

    question: Question
    fields: dict[str, Any] = field(default_factory=dict)
    files: dict[str, dict[str, bytes]] = field(default_factory=dict)

    def entries(self) -> dict[str, Any]:
        """Return what was filled in: a text, a flag or a list of texts by the name of an option."""
        texts = {}
        for option in self.question.options:
            if option.kind == "file":
                names = list(self.files.get(option.name, ()))
                texts[option.name] = names if option.many else (names or [""])[0]
            elif option.many:
                lines = str(self.fields[option.name].value or "").splitlines()
                texts[option.name] = [line.strip() for line in lines if line.strip()]
            else:
                texts[option.name] = self.fields[option.name].value
        return texts

    def sent_files(self) -> dict[Path, bytes]:
        """Return the files that were sent, by their paths within the folder of the process."""
        return {
            upload_path(option, name): data
            for option in self.question.options
            for name, data in self.files.get(option.name, {}).items()
        }

    @property
    def full(self) -> bool:
        """Whether tables show every row."""
        return EVERY_ROW in self.fields and bool(self.fields[EVERY_ROW].value)


class AskTab:
    """The questions of one page; a page asks one at a time."""

    def __init__(self, session: Session) -> None:
        """Build the tab; questions are imported when it first comes to the front.

        Args:
            session: the session whose machine a question is about.
        """
        self._session = session
        self._forms: dict[str, QuestionForm] = {}
        self._asked: Machine | None = None  # the machine of the answer that is shown or being computed
        self._process: asyncio.subprocess.Process | None = None
        self._folder: TemporaryDirectory[str] | None = None  # with the files of the answer that is shown
        self._answered_word = ""  # the question of that answer
        self._stopped = self._busy = False
        self._questions = Lane(_import_questions, self._offer)
        with ui.element("section").classes("design of-asking left").props('aria-label="question"'):
            with ui.element("div").classes("design-head"):
                self.choice = choice({}, "question", self._fill, "question", searchable=True).classes("grow")
            self._body = ui.element("div").classes("design-form")
            with ui.element("div").classes("design-foot"):
                self.problem = ui.label("").classes("form-problem").props('role="alert"').mark("question-problem")
                self.stop = icon_button("stop", "Stop", self._stop, "question-stop")
                self.button = ui.button("Ask", icon="play_arrow", on_click=self._ask).props(MAIN_BUTTON)
                self.button.mark("question-ask")
        with (
            ui.element("section").classes("design of-asking right").props('aria-label="answer"'),
            ui.element("div").classes("card answer-card question-card"),
        ):
            with ui.element("div").classes("design-head"):
                self.line = ui.label("").classes("run-line grow").props('role="status"').mark("question-line")
                self.files = {form: self._download(form, name) for form, name in NAMES_OF_FORMS.items()}
            self.bar = ui.linear_progress(0.0, show_value=False, size="4px").props('aria-label="progress"')
            self.answer = ui.html(paragraph(NOTHING_ASKED), sanitize=False).classes("answer").mark("question-answer")
            self.answer.props('tabindex="0" role="region" aria-label="answer"')
        self._show_busy(False)

    def set_front(self, is_in_front: bool) -> None:
        """Offer the questions once the tab has come to the front."""
        if is_in_front and not self._forms:
            self._questions.ask(tuple(QUESTIONS))

    def note_change(self) -> None:
        """Say that an answer is about the machine before its last change."""
        if self._asked is not None and not self._busy:
            self.line.set_text("" if self._asked is self._session.machine else CHANGED)

    def close(self) -> None:
        """Stop what is being computed, and forget the answer, because the page is gone."""
        self._questions.close()
        self._stop()
        self._forget()

    def _download(self, form: str, name: str) -> ui.button:
        button = ui.button(name, icon="download", on_click=partial(self._send, form)).props("flat dense no-caps")
        button.tooltip(f"download the answer as {name}").mark(f"question-{form}").set_visibility(False)
        return button

    def _offer(self, _words: tuple[str, ...], questions: dict[str, Question]) -> None:
        self._forms = {word: QuestionForm(question) for word, question in questions.items()}
        self.choice.set_options(
            {word: f"{word}: {QUESTIONS[word][0]}" for word in questions}, value=next(iter(questions))
        )

    def _fill(self) -> None:
        """Build the form of the question that is chosen; what was filled in before is kept."""
        form = self._forms.get(str(self.choice.value))
        if form is None:
            return
        kept = {name: element.value for name, element in form.fields.items()}
        self._clear_problem()
        self._body.clear()
        with self._body:
            summary = QUESTIONS[str(self.choice.value)][0]
            ui.label(f"{summary[0].upper()}{summary[1:]}.").classes("form-about").mark("question-about")
            for option in form.question.options:
                self._row(form, option)
            if form.question.full:
                form.fields[EVERY_ROW] = ui.checkbox("every row").props("dense").tooltip(form.question.full)
                form.fields[EVERY_ROW].mark(f"option {EVERY_ROW}")
        for name, value in kept.items():
            form.fields[name].set_value(value)

    def _row(self, form: QuestionForm, option: Option) -> None:
        """Build the field of an option by its kind."""
        label, meaning = label_of(option), in_words_of_the_page(form.question, option.meaning)
        if option.kind == "file":
            self._file_row(form, option, meaning)
            return
        element: Any
        if option.kind == "flag":
            element = ui.checkbox(label, value=bool(option.default)).props("dense")
        elif option.choices:
            element = ui.select(list(option.choices), label=label, value=option.default, clearable=not option.required)
        elif option.many:
            element = ui.textarea(f"{label}, one in each line").props("autogrow")
        else:
            element = ui.input(label, value="" if option.default in (None, ()) else str(option.default))
        if option.kind != "flag":
            element.props("dense outlined").classes("field")
        form.fields[option.name] = element.tooltip(meaning).mark(f"option {option.name}")

    def _file_row(self, form: QuestionForm, option: Option, meaning: str) -> None:
        """Build the field of an option that takes a file: the names of those that were sent, and a button for more."""
        with ui.element("div").classes("form-row"):
            ui.label(label_of(option)).classes("form-name").tooltip(meaning)
            names = ui.label(", ".join(form.files.get(option.name, ()))).classes("form-fixed")
            names.mark(f"sent {option.name}")
            upload = upload_field(
                partial(self._take, form, option, names), self._show_problem, f"upload {option.name}", ""
            )
            icon_button("upload_file", f"Send a file: {label_of(option)}", lambda: upload.run_method("pickFiles"), "")

    async def _take(
        self, form: QuestionForm, option: Option, names: ui.label, event: events.UploadEventArguments
    ) -> None:
        """Keep a file that was sent until the question is asked; where there is no room, the first one goes."""
        sent = form.files.setdefault(option.name, {})
        name = _safe(event.file.name)
        if name not in sent and len(sent) == (MOST_FILES if option.many else 1):
            sent.pop(next(iter(sent)))
        sent[name] = await event.file.read()
        names.set_text(", ".join(sent))
        if isinstance(event.sender, ui.upload):
            event.sender.reset()

    def _show_problem(self, message: str) -> None:
        self.problem.set_text(message)

    def _clear_problem(self) -> None:
        self.problem.set_text("")

    def _ask(self) -> None:
        form = self._forms.get(str(self.choice.value))
        if form is None or self._busy:
            return
        self._clear_problem()
        machine = self._session.machine
        self._asked, self._stopped = machine, False
        request = {"word": str(self.choice.value), "options": form.entries(), EVERY_ROW: form.full}
        self._show_busy(True)
        if self._folder is None:  # nothing has been answered yet
            self.answer.set_content("")
        background_tasks.create(self._answer(machine, request, form.sent_files()), name="studio question")

    async def _answer(self, machine: Machine, request: dict[str, Any], files: dict[Path, bytes]) -> None:
        """Ask about a machine in a process, and show its answer or why there is none."""
        folder = TemporaryDirectory()
        try:
            place = Path(folder.name)
            (place / MACHINE_FILE).write_text(as_file(machine), "utf-8")
            for path, data in files.items():
                (place / path).parent.mkdir(parents=True, exist_ok=True)
                (place / path).write_bytes(data)
            async with ASKING.turn(self.button.client.id):
                problem = await self._run(place, json.dumps(request).encode())
            content = "" if problem else await run.io_bound(_read_answer, place / ANSWER_PAGE)
        except InputError as error:
            problem, content = str(error), ""
        finally:
            self._process = None
            self._show_busy(False)
        if problem:
            folder.cleanup()
            self._show_problem(problem)
            self._asked = None
            if self._folder is None:
                self.answer.set_content(paragraph(NOTHING_ASKED))
            return
        self._forget()
        self._folder, self._answered_word = folder, str(request["word"])
        self.answer.set_content(str(content))
        for form, button in self.files.items():
            button.set_visibility((place / f"{ANSWER_STEM}.{form}").exists())
        self.note_change()

    async def _run(self, folder: Path, request: bytes) -> str:
        """Run the process in its folder; return why there is no answer, empty if there is one."""
        self._process = process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", ASKING_PROGRAM, cwd=folder,
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL,
        )  # fmt: skip
        if self._stopped:
            process.kill()
        make_modest(process.pid)
        requests, reports = process.stdin, process.stdout
        if requests is None or reports is None:
            raise RuntimeError("the process has no pipes")
        requests.write(request)
        requests.write_eof()
        refusal = ""
        async for line in reports:
            report = json.loads(line)
            refusal = report.get("refused", "")
            if report.get("total"):
                self.bar.set_value(report["done"] / report["total"])
        await process.wait()
        if self._stopped:
            return STOPPED
        if process.returncode == REFUSED:
            return str(refusal)
        if process.returncode != 0:
            return (
                f"The question takes more than {SECONDS_TO_ANSWER // 60} minutes or {MEMORY_TO_ANSWER >> 30} GiB, or "
                "stops the program; ask for less, or use the command on a larger computer."
            )
        return ""

    def _stop(self) -> None:
        self._stopped = True
        if self._process is not None and self._process.returncode is None:
            self._process.kill()

    def _show_busy(self, is_busy: bool) -> None:
        self._busy = is_busy
        self.button.set_enabled(not is_busy)
        self.stop.set_enabled(is_busy)
        self.bar.set_value(0.0)
        self.bar.set_visibility(is_busy)
        self.line.set_text("computing ..." if is_busy else "")

    def _forget(self) -> None:
        """Delete the files of the answer that was shown."""
        if self._folder is not None:
            self._folder.cleanup()
        self._folder = None

    def _send(self, form: str) -> None:
        if self._folder is not None:
            ui.download.file(Path(self._folder.name) / f"{ANSWER_STEM}.{form}", f"{self._answered_word}.{form}")


def _import_questions(words: tuple[str, ...]) -> dict[str, Question]:
    """Import questions, in a thread: some bring large libraries."""
    return {word: late(QUESTIONS[word][1]) for word in words}


def _safe(name: str) -> str:
    """Return the name of a file that was sent without anything that could lead out of its folder."""
    return re.sub(r"[^\w.-]", "_", Path(name).name).lstrip(".-")[-LONGEST_FILE_NAME:] or "file"


def _read_answer(path: Path) -> str:
    """Read the answer as the page shows it, unless it is too large for that."""
    if path.stat().st_size > LARGEST_ANSWER:
        return paragraph(f"The answer has more than {LARGEST_ANSWER >> 20} MiB; download it instead.")
    return path.read_text("utf-8")
