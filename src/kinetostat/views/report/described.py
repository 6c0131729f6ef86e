"""The section of a report on any answer, made of its description: sentences, tables, figures. Nothing is computed."""

from collections.abc import Iterable, Iterator
from typing import Any

from kinetostat.views.question import Description
from kinetostat.views.report.content import Block, Paragraph, Section
from kinetostat.views.report.pictures import drawn
from kinetostat.views.report.typesetting import printed, typeset

SAID_BEFORE = "Pose"
"""Line that a report has on its first page."""


def described_section(description: Description, answer: Any, more: Iterable[Block] = ()) -> Section:
    """Write the section on an answer.

    Args:
        description: of answers of this kind.
        answer: at the pose of the report.
        more: blocks that stand behind it.
    """
    return Section(description.title, (*_blocks(description, answer), *more))


def _blocks(description: Description, answer: Any) -> Iterator[Block]:
    if not description.answered(answer):
        yield Paragraph(typeset(answer.message))
        return
    for head, sentence in description.lines(answer):
        if head != SAID_BEFORE:
            yield Paragraph(typeset(sentence), f"{head}:")
    for table in description.tables(answer, False):
        yield printed(table, f"{table.title}.")
    for drawing in description.drawings(answer).values():
        if not drawing.minor:
            yield drawn(drawing(title=""), drawing.caption)
