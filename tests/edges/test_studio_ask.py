"""The studio's Ask tab: every question has its form, and its answer is that of the command; it can be stopped."""

import asyncio
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browser import browser, needs_chromium, served
from studio_page import on_page

from kinetostat.machine.loading import load
from kinetostat.spec.errors import InputError
from kinetostat.studies.vibration import modes
from kinetostat.studio import question_tab as tab
from kinetostat.studio.question_process import answer_html, in_words_of_the_page, values_of
from kinetostat.views.data_forms import json_of
from kinetostat.views.question import Option, Question, late
from kinetostat.views.questions import QUESTIONS
from kinetostat.views.vibration import VIBRATION

MACHINE = "hexapod"
HEAVY = "tool.mass=12 kg"


async def asking(page, word="modes"):
    """Bring the tab to the front and choose a question."""
    await page.send("control tool.mass", "write", "12 kg")
    await page.choose("mode", "Ask")
    await page.choose("question", word)


async def downloaded(page, form) -> tuple[str, Any]:
    """The name and the content of the file that a button sends."""
    sent = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            type(page.user.download), "file", lambda _, path, name: sent.append((name, path.read_text("utf-8")))
        )
        await page.send(f"question-{form}", "click")
    ((name, text),) = sent
    return name, json.loads(text)


def test_a_question_is_answered_about_the_machine_as_it_is():
    async def steps(page):
        await asking(page)
        await page.choose("option lowest", "10 Hz")
        await page.send("question-ask", "click")
        assert not page.one("question-problem").text
        text = page.one("question-answer").content
        assert modes(load(MACHINE, [HEAVY])).message in text
        assert text.count("<table") == 3
        assert re.search(r'<img alt="[A-Z][^"]{20,}" src="data:image/svg', text)
        await page.choose("question", "sweep")  # the answer that is shown keeps its name
        assert await downloaded(page, "json") == ("modes.json", json_of(VIBRATION, modes(load(MACHINE, [HEAVY]))))
        assert [page.one(f"question-{form}").visible for form in ("json", "csv", "nc")] == [True] * 3
        assert not page.one("question-line").text
        await page.send("control pose.z", "write", "140 mm")
        assert page.one("question-line").text == tab.CHANGED
        await page.send("undo", "click")
        assert not page.one("question-line").text

    on_page(steps, MACHINE)


def test_what_is_refused_is_one_sentence_in_the_words_of_the_page():
    async def steps(page):
        await asking(page)
        for option, text, reason in (
            ("lowest", "10 kg", 'lowest is "10 kg": "kg" is not a unit of frequency'),
            ("along", "0,1", "along: 0,1 is not a direction; give three numbers, e.g. 0,0,1."),
        ):
            await page.choose(f"option {option}", text)
            await page.send("question-ask", "click")
            assert page.one("question-problem").text.startswith(reason)
            assert page.one("question-answer").content.count(tab.NOTHING_ASKED)
            await page.choose(f"option {option}", "")
        assert page.one("question-ask").enabled

    on_page(steps, MACHINE)


def test_a_question_can_be_stopped_and_asked_again():
    async def steps(page):
        await asking(page)
        answering = asyncio.ensure_future(page.send("question-ask", "click"))
        await asyncio.sleep(0)
        assert not page.one("question-ask").enabled
        await page.send("question-stop", "click")
        await answering
        assert page.one("question-problem").text == tab.STOPPED
        assert tab.NOTHING_ASKED in page.one("question-answer").content
        await page.send("question-ask", "click")
        assert "<table" in page.one("question-answer").content

    on_page(steps, MACHINE)


@pytest.mark.parametrize("word", QUESTIONS)
def test_every_question_has_a_form_whose_defaults_are_those_of_the_command(word):
    question: Question = late(QUESTIONS[word][1])
    given = {option.name: "x" for option in question.options if option.required}
    readable = {"count": "3", "number": "1.5", "direction": "0,0,1"}
    for option in question.options:
        if option.required:
            text = option.choices[0] if option.choices else readable.get(option.kind, "x")
            given[option.name] = [text] if option.many else text
    values = values_of(question, given)
    for option in question.options:
        if not option.required:
            assert values[option.name] == (list(option.default or ()) if option.many else option.default)
        assert not re.search(r"(^|\s)--\w", in_words_of_the_page(question, option.meaning))


QUESTION = Question(
    "",
    modes,
    (
        Option("count", "count", "how many, see --poses"),
        Option("load", "number", "how much"),
        Option("quick", "flag", "whether in a hurry"),
        Option("way", "choice", "by which way", choices=("one", "other")),
        Option("poses", "file", "a file of poses", many=True),
        Option("name", "text", "what it is called", required=True),
    ),
)


def test_what_was_given_is_read_by_the_kind_of_the_option():
    given = {"count": "12", "load": "1.5", "quick": True, "way": "other", "poses": ["../a.csv"], "name": "a"}
    values = values_of(QUESTION, given)
    assert values == {
        "count": 12, "load": 1.5, "quick": True, "way": "other", "poses": [Path("sent/poses/a.csv")], "name": "a",
    }  # fmt: skip
    assert in_words_of_the_page(QUESTION, "load is low; give --count") == 'load is low; give "count"'


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("count", "1e9", "count: 1e9 is not a number"),
        ("load", "__import__('os')", "load is"),
        ("way", "third", "way is"),
        ("name", "", "name is missing; it is what it is called."),
    ],
)
def test_what_cannot_be_read_is_refused(name, text, reason):
    with pytest.raises(InputError, match=re.escape(reason)):
        values_of(QUESTION, {"name": "a", name: text})


@pytest.mark.parametrize("name", ["../../etc/passwd", "a b<c>.csv", ".hidden", "-o", "x" * 300, "", "\0"])
def test_the_name_of_a_file_that_was_sent_leads_nowhere_else(name):
    safe = tab._safe(name)
    assert Path(safe).name == safe
    assert 0 < len(safe) <= 80
    assert safe[0] not in ".-"


def test_files_that_were_sent_are_listed():
    async def steps(page):
        await asking(page)
        with page.user.client:
            form = tab.QuestionForm(QUESTION)
            ui_tab = tab.AskTab.__new__(tab.AskTab)
            ui_tab._file_row(form, QUESTION.options[4], "a file of poses")
        for name in ("../a.csv", "b.csv"):
            await page.upload(name, b"1", "upload poses")
        assert form.files["poses"] == {"a.csv": b"1", "b.csv": b"1"}
        assert page.one("sent poses").text == "a.csv, b.csv"
        for i in range(2, tab.MOST_FILES):
            await page.upload(f"{i}.csv", b"1", "upload poses")
        await page.upload("b.csv", b"2", "upload poses")  # again, where there is no room for another one
        assert len(form.files["poses"]) == tab.MOST_FILES
        assert form.files["poses"]["b.csv"] == b"2"

    on_page(steps, MACHINE)


def test_files_of_one_name_for_two_options_are_two_files():
    poses, fit = Option("poses", "file", "a file of poses"), Option("fit", "file", "a record of a fit")
    form = tab.QuestionForm(Question("", modes, (poses, fit)))
    form.files = {"poses": {"data": b"1"}, "fit": {"data": b"2"}}
    values = values_of(form.question, form.entries())
    assert [form.sent_files()[values[name]] for name in ("poses", "fit")] == [b"1", b"2"]


def test_texts_of_a_machine_file_never_become_markup():
    machine = load(MACHINE, [HEAVY])
    answer = modes(replace(machine, name="<script>"))
    shown = answer_html(
        replace(VIBRATION, title="<b>", lines=lambda given: [("<i>", given.machine.name)]), answer, False
    )
    assert "&lt;script&gt;" in shown
    assert not re.search("<(script|i)>", shown)


@needs_chromium
@pytest.mark.browser
def test_the_tab_in_a_browser():
    with browser() as new_tab, served(MACHINE) as address:
        page = new_tab()
        page.open(f"{address}?machine=hexapod&tool.mass=12+kg")
        page.tab.get_by_role("button", name="Ask", exact=True).first.click()
        page.tab.locator(".of-asking .form-about").wait_for()
        page.choose("question", f"modes: {QUESTIONS['modes'][0]}")
        page.tab.get_by_label("lowest").fill("10 Hz")
        page.tab.locator(".of-asking .design-foot").get_by_role("button", name="Ask", exact=True).click()
        page.tab.wait_for_function("document.querySelector('.answer')?.innerText.includes('first natural frequency')")
        page.tab.wait_for_function("[...document.querySelectorAll('.answer img')].every((i) => i.naturalWidth > 100)")
        with page.tab.expect_download() as download:
            page.tab.get_by_role("button", name="JSON").click()
        assert download.value.suggested_filename == "modes.json"
        assert json.loads(Path(download.value.path()).read_text("utf-8"))["moving_mass"] == 12.0
        page.blameless(address)
