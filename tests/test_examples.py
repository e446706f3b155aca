"""The examples run as they are."""

import subprocess
import sys
from pathlib import Path

import nbclient
import nbformat
import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.mark.parametrize("script", sorted(EXAMPLES.glob("*.py")), ids=lambda p: p.stem)
def test_a_script_runs_and_prints(script, tmp_path):
    done = subprocess.run([sys.executable, script, *([str(tmp_path)] if "FOLDER" in script.read_text() else [])],
                          capture_output=True, text=True, cwd=tmp_path, timeout=300)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


@pytest.mark.parametrize("notebook", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda p: p.stem)
def test_a_notebook_runs_and_shows_tables_and_pictures(notebook, tmp_path):
    book = nbformat.read(notebook, as_version=4)
    assert not any(cell.get("outputs") for cell in book.cells), "results are not kept in the repository"
    nbclient.NotebookClient(book, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [out["data"] for cell in book.cells for out in cell.get("outputs", ()) if "data" in out]
    shown = [data["text/html"] for data in outputs if "text/html" in data]
    assert any("<table" in page for page in shown)
    assert any("data-plot" in page for page in shown)
