"""Tutorials as notebooks: pages with programs are their only source, and each is stored with what its cells answer.

python docs/site_build/notebooks.py
"""

import json
import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).parents[2]
TUTORIALS = ROOT / "docs" / "tutorials"
NOTEBOOKS = ("paper-machine", "read-a-map", "optimise", "calibrate")
FENCE = re.compile(r"^```(\w*)([^\n]*)\n(.*?)^```$\n?", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:|#)((?:\.\./)*)([^)]+)\)")
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
    with TemporaryDirectory() as folder:
        nbclient.NotebookClient(cells, timeout=None, resources={"metadata": {"path": folder}}).execute()
    for cell in cells.cells:
        cell.metadata = {}  # times of the run
    cells.metadata = {"kernelspec": KERNEL}
    return str(nbformat.writes(cells)) + "\n"


if __name__ == "__main__":
    (ROOT / "examples").mkdir(exist_ok=True)
    for name in NOTEBOOKS:
        (ROOT / "examples" / f"{name}.ipynb").write_text(answered(name), "utf-8")
