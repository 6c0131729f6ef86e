"""The notebooks are the tutorials, are stored with their answers, and run from the first cell to the last."""

import json
import os
import subprocess
import sys
from pathlib import Path

import nbclient
import nbformat
import pytest

from pages import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("*.ipynb"))
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


def bare(text):
    """The cells of a notebook without their answers."""
    return [(cell["cell_type"], "".join(cell["source"])) for cell in json.loads(text)["cells"]]


def test_they_are_what_the_tutorials_make(tmp_path):
    kept = {path.name: bare(path.read_text("utf-8")) for path in EXAMPLES}
    code = (
        "import runpy, sys, pathlib; made = runpy.run_path(sys.argv[1]);"
        "[pathlib.Path(f'{name}.ipynb').write_text(made['written'](name), 'utf-8') for name in made['NOTEBOOKS']]"
    )
    subprocess.run([sys.executable, "-c", code, str(ROOT / "docs/site_build/notebooks.py")], cwd=tmp_path, check=True)
    made = {path.name: bare(path.read_text("utf-8")) for path in tmp_path.iterdir()}
    assert made == kept, "run `python docs/site_build/notebooks.py`"


def kinds(notebook):
    """The kinds of cells: programs, commands (!), files (%%)."""
    return {cell.source[0] if cell.source[0] in "!%" else "program" for cell in code_of(notebook)}


def code_of(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_a_notebook_is_stored_with_its_answers(path):
    notebook = nbformat.read(path, as_version=4)
    assert all(cell.outputs for cell in code_of(notebook) if "print(" in cell.source)
    said = [output.get("text", "") for cell in code_of(notebook) for output in cell.outputs]
    assert not [text for text in said if "\u2501" in text or "\x1b[K" in text]  # bars of progress, which were erased


def test_a_notebook_runs(tmp_path, monkeypatch):
    """One that has every kind of cell: the cells of all are those of pages, which `test_documents` runs and checks."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    notebook = nbformat.read(ROOT / "examples" / "read-a-map.ipynb", as_version=4)
    assert kinds(notebook) == set().union(*(kinds(nbformat.read(path, as_version=4)) for path in EXAMPLES))
    nbclient.NotebookClient(notebook, timeout=None, resources={"metadata": {"path": str(tmp_path)}}).execute()
    said = [output for cell in code_of(notebook) for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in said)
    assert not [output for output in said if "kinetostat: " in output.get("text", "")]
