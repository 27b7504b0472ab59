"""Usual accuracies: those of the page."""

from pathlib import Path

import pytest

from cspm_model.accuracies import ACCURACIES

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "accuracies.md"


def test_the_page_has_the_same_numbers():
    rows = [line.strip("| ").split(" | ") for line in PAGE.read_text("utf-8").splitlines()]
    shown = {row[0]: row[1].split() for row in rows if len(row) == 3 and row[1][0].isdigit()}
    assert list(shown) == list(ACCURACIES)
    for name, (size, unit) in shown.items():
        share = 0.01 if unit == "%" else 1.0
        assert ACCURACIES[name].sd == pytest.approx(share * float(size))
        assert ACCURACIES[name].unit == ("1" if unit == "%" else unit)
