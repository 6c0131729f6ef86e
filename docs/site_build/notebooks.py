"""Tutorials as notebooks: pages with programs are their only source, and each is stored with what its cells answer.

python docs/site_build/notebooks.py
"""

import json
import os
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).parents[2]
TUTORIALS = ROOT / "docs" / "tutorials"
NOTEBOOKS = ("paper-machine", "read-a-map", "optimise", "calibrate")
FENCE = re.compile(r"^```(\w*)([^\n]*)\n(.*?)^```$\n?", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:|#)((?:\.\./)*)([^)]+)\)")
CURSOR = re.compile(r"\x1b\[\?25[lh]")
"""Hides and shows the cursor of a terminal."""
ERASED = re.compile(r"[^\n]*\n\r?\x1b\[1A\x1b\[2K|[^\n]*\x1b\[2?K")
"""Lines that a terminal has erased again."""
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def notebook(page: str) -> dict[str, Any]:
    """A page as a notebook: programs are cells, files are cells that write them, commands are cells that run them."""
    cells: list[dict[str, Any]] = []
    at = 0
    for fence in FENCE.finditer(page):
        cells += _prose(page[at : fence.start()])
        cells += _code(fence[1], fence[2].strip(), fence[3])
        at = fence.end()
    cells += _prose(page[at:])
    numbered = [cell | {"id": f"cell-{i}"} for i, cell in enumerate(cells)]
    return {"cells": numbered, "metadata": {"kernelspec": KERNEL}, "nbformat": 4, "nbformat_minor": 5}


def _code(kind: str, name: str, text: str) -> list[dict[str, Any]]:
    source = {
        "python": text,
        "toml": f"%%writefile {name}\n{text}",
        "sh": "".join(f"!{line}\n" for line in text.splitlines()),
    }.get(kind)
    if source is None:  # an answer, which the cell before will give by itself
        return []
    return [{"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [], "source": source.rstrip()}]


def _prose(text: str) -> list[dict[str, Any]]:
    source = LINK.sub(_from_examples, text.strip())
    return [{"cell_type": "markdown", "metadata": {}, "source": source}] if source else []


def _from_examples(link: re.Match[str]) -> str:
    return f"](../docs/{'' if link[1] else 'tutorials/'}{link[2]})"


def written(name: str) -> str:
    """The text of a notebook's file, without answers."""
    page = (TUTORIALS / f"{name}.md").read_text("utf-8")
    return json.dumps(notebook(page), ensure_ascii=False, indent=1) + "\n"


def answered(name: str) -> str:
    """The text of a notebook's file with the answer of each cell, from a run in an empty folder."""
    import nbclient
    import nbformat

    cells: Any = nbformat.reads(written(name), as_version=4)
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # `kinetostat` of this Python
    with TemporaryDirectory() as folder:
        nbclient.NotebookClient(cells, timeout=None, resources={"metadata": {"path": folder}}).execute()
    for cell in cells.cells:
        cell.metadata = {}  # times of the run
        if "outputs" in cell:
            cell.outputs = _settled(cell.outputs)
    cells.metadata = {"kernelspec": KERNEL}
    return str(nbformat.writes(cells)) + "\n"


def _settled(outputs: list[Any]) -> list[Any]:
    """Answers of a cell as a terminal shows them at the end: what a progress bar wrote and erased is gone."""
    kept: list[Any] = []
    for output in outputs:
        if kept and output.output_type == kept[-1].output_type == "stream" and output.name == kept[-1].name:
            kept[-1].text += output.text
        else:
            kept.append(output)
    for output in kept:
        if output.output_type == "stream":
            output.text = ERASED.sub("", CURSOR.sub("", output.text.replace("\r\n", "\n")))
    return [output for output in kept if output.get("text", "shown")]


if __name__ == "__main__":
    (ROOT / "examples").mkdir(exist_ok=True)
    for name in NOTEBOOKS:
        (ROOT / "examples" / f"{name}.ipynb").write_text(answered(name), "utf-8")
