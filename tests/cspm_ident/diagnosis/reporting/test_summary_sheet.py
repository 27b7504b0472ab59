"""The first sheet of a diagnosis: verdict, drawing, residual, numbers, next step, on one page."""

import re

import pytest
from accessibility import serious_findings
from diagnosis_samples import diagnosis
from driven_browser import driven_browser

from cspm_ident.diagnosis.reporting.diagnosis_page import write_diagnosis_page
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data


@pytest.fixture
def page(tmp_path):
    found = diagnosis()
    path = tmp_path / "diagnosis.html"
    write_diagnosis_page(path, found, diagnosis_data(found))
    return path


def test_the_sheet_has_all_that_one_forwards_before_any_script(page):
    text = page.read_text(encoding="utf-8")
    sheet = text[text.index("<div class=sheet>") : text.index("<div class=details>")]
    assert "<script" not in sheet
    assert "Winch surge 2 has dry friction" in sheet
    assert "winch surge 2 marked" in sheet
    assert "torque of dry friction" in sheet
    assert "29 mN·m to 31 mN·m" in sheet
    assert re.search(r"\d+ % likely, compared with the rival explanations\.", sheet)
    assert "<b>Next:</b> <code>cspm run SCENARIO" in sheet
    assert "residual of the torque of winch surge 2 before and after" in sheet
    assert "<polyline" in sheet
    assert " class=before " in sheet
    assert " class=after " in sheet


def test_without_findings_there_is_no_number_and_no_after(tmp_path):
    found = diagnosis(named=False)
    path = tmp_path / "diagnosis.html"
    write_diagnosis_page(path, found, diagnosis_data(found))
    text = path.read_text(encoding="utf-8")
    sheet = text[text.index("<div class=sheet>") : text.index("<div class=details>")]
    assert "95 % interval" not in sheet
    assert "<b>Next:</b>" in sheet


@pytest.mark.slow
def test_it_prints_to_one_sheet_and_shows_before_plots_are_drawn(page, tmp_path):
    with driven_browser(tmp_path / "profile") as browser:
        browser.open(page.as_uri())
        assert browser.pages() == 1
        paints = (
            "return performance.getEntriesByName('first-contentful-paint').map(e => e.startTime)"
        )
        (first,) = browser.run(paints)
        assert first > 0.0
        while not browser.run("return document.querySelectorAll('.main-svg').length"):
            browser.drawn()
        assert serious_findings(browser) == []
        assert browser.errors() == []


@pytest.mark.slow
def test_a_picture_without_words_is_a_serious_finding(tmp_path):
    page = tmp_path / "page.html"
    page.write_text("<html lang=en><title>A</title><h1>A</h1><img src=a.png>", encoding="utf-8")
    with driven_browser(tmp_path / "profile") as browser:
        browser.open(page.as_uri())
        assert [rule for rule, _ in serious_findings(browser)] == ["image-alt"]
