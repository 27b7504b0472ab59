from dataclasses import fields
from pathlib import Path

from cspm_ident.diagnosis.thresholds import GROUPS, Thresholds
from cspm_ident.diagnosis.thresholds_page import allowed, main, thresholds_page

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "thresholds.md"


def test_the_committed_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == thresholds_page(), (
        "run: python -m cspm_ident.diagnosis.thresholds_page > docs/reference/thresholds.md"
    )


def test_the_page_has_every_threshold_once_in_a_table_of_its_stage():
    page = thresholds_page()
    for each in fields(Thresholds):
        assert page.count(f"| `{each.name}` |") == 1
        assert each.metadata["meaning"] in page
        assert each.metadata["basis"] in page
    assert page.count("\n## ") == len(GROUPS)


def test_a_range_is_stated_with_its_ends():
    assert allowed({"low": 0.0, "high": 1.0}) == "0 to 1"
    assert allowed({"low": 1, "high": float("inf")}) == "1 or more"


def test_the_module_prints_the_page(capsys):
    main()
    assert capsys.readouterr().out == thresholds_page()
