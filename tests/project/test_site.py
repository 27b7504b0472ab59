"""The site is built from the pages without a warning, and its commands are documented."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_of_the_command_line_is_up_to_date(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "scripts"))
    command_line = importlib.import_module("command_line_page")
    committed = command_line.PAGE.read_text(encoding="utf-8")
    assert committed == command_line.page(), "run: python docs/scripts/command_line_page.py"


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="pip install -e '.[docs]'")
    words = ["mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    found = subprocess.run(
        [sys.executable, "-m", *words], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr
    assert (tmp_path / "search" / "search_index.json").exists()
    python = (tmp_path / "reference" / "python.html").read_text(encoding="utf-8")
    cspm = importlib.import_module("cspm")
    assert [name for name in cspm.__all__ if f'id="cspm.{name}"' not in python] == []
