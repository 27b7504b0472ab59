"""The tutorial's notebook runs as it stands, and shows what it is said to show."""

import re
from pathlib import Path

import nbclient
import nbformat
import pytest

NOTEBOOK = Path(__file__).parents[2] / "docs" / "tutorials" / "from-recording-to-model.ipynb"


def shown(notebook):
    """The text of all outputs, and how many pictures there are."""
    outputs = [each for cell in notebook.cells for each in cell.get("outputs", ())]
    texts = [
        each.get("text") or each.get("data", {}).get("text/html", "") or "" for each in outputs
    ]
    return "\n".join(texts), sum("image/png" in each.get("data", {}) for each in outputs)


def claims(text):
    """What was found, and how many times its noise the worst error is before and after."""
    found = re.search(r"winch_coulomb_friction on sway_3:\n  torque (0\.0\d+) N·m", text)
    ratios = re.search(r": ([\d.]+) times its noise before, ([\d.]+) after", text)
    return float(found[1]), *(float(each) for each in ratios.groups())


@pytest.mark.slow
@pytest.mark.compiled
def test_the_notebook_runs_and_finds_what_it_planted(tmp_path):
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    client = nbclient.NotebookClient(
        notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}
    )
    client.execute()
    text, pictures = shown(notebook)
    torque, before, after = claims(text)
    assert torque == pytest.approx(0.03, rel=0.1)
    assert after < 2.0 < 100.0 < before
    assert pictures == 1
    assert "Diagnosis: effect" in text
    assert (tmp_path / "verdict" / "testbed.improved.yaml").exists()


def test_the_notebook_is_kept_with_what_it_shows():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    text, pictures = shown(notebook)
    assert claims(text)[0] == pytest.approx(0.03, rel=0.1)
    assert pictures == 1
    assert NOTEBOOK.stat().st_size < 200_000
    assert "/home" not in NOTEBOOK.read_text()
    assert "/root" not in NOTEBOOK.read_text()
