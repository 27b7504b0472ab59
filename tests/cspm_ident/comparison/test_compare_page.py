"""The report page of `cspm compare` in a browser, at any width and driven by anything."""

import re
from dataclasses import replace

import pytest
from browser import find_browser, look
from run_samples import run_to

from cspm_ident.block_simulation import Input
from cspm_ident.channel_words import channel_words
from cspm_ident.comparison.compare import compare
from cspm_ident.comparison.page import write_page
from cspm_ident.signals.measurement import read_measurement

DURATION = 3.0
OPEN = 5


@pytest.fixture(scope="module")
def measurement(tmp_path_factory):
    find_browser()
    place = tmp_path_factory.mktemp("page") / "bag"
    run_to(place, "calm_broadband", f"duration={DURATION}")
    return read_measurement(place)


@pytest.mark.slow
@pytest.mark.parametrize("drive", list(Input)[:3])
def test_no_part_of_the_page_but_tables_is_wider_than_the_screen(measurement, drive, tmp_path):
    page = tmp_path / "report.html"
    found = compare(measurement, drive=drive)
    # One of each kind, since a browser on a busy machine draws hundreds of lines in minutes.
    kinds = {(c.block, c.name.rsplit("/", 1)[0]): c for c in found.channels}
    write_page(page, replace(found, channels=list(kinds.values())))
    assert "time_s" not in page.read_text(encoding="utf-8")
    shown = look(page, 400)
    assert shown["errors"] == []
    # Two rows of each channel that is not folded.
    assert shown["plots"] == 2 * min(len(kinds), OPEN)
    assert shown["wide"] <= shown["seen"] <= 400


ZOOM = """
const plots = [...document.querySelectorAll(".over-time .plotly-graph-div")];
const ranges = () => plots.map(plot => plot.layout.xaxis.range.map(Number));
const shown = async change => {
  await Plotly.relayout(plots[0], change);
  await new Promise(done => setTimeout(done, 1000));
  return ranges();
};
const zoomed = await shown({"xaxis.range": [1, 2], "xaxis2.range": [1, 2]});
return [zoomed, await shown({"xaxis.autorange": true, "xaxis2.autorange": true})];
"""


@pytest.mark.slow
def test_who_zooms_one_plot_over_time_zooms_all(measurement, tmp_path):
    page = tmp_path / "report.html"
    found = compare(measurement)
    kinds = {c.block: c for c in found.channels}
    assert len(kinds) > 2
    write_page(page, replace(found, channels=list(kinds.values())))
    zoomed, whole = look(page, 1280, ZOOM)["reported"]
    assert zoomed == [[1, 2]] * len(kinds)
    assert all(high - low > 0.9 * DURATION for low, high in whole)


UNFOLD = """
const drawn = () => document.querySelectorAll("section .main-svg .scatterlayer").length;
const before = drawn();
const folds = [...document.querySelectorAll("details")];
for (const fold of folds) fold.open = true;
for (let tries = 0; tries < 50 && drawn() <= before; tries++) {
  await new Promise(done => setTimeout(done, 200));
}
const links = [...document.querySelectorAll("td a")].map(a => a.getAttribute("href"));
return [before, drawn(), folds.length, links.every(link => document.querySelector(link) !== null)];
"""


def times_of(page):
    """Errors in multiples of their floors, as both tables have them from top to bottom."""
    rows = re.findall(r"<tr><td class=text><a.*?</tr>", page)
    return [float(re.findall(r"<td[^>]*>(.*?)</td>", row)[2]) for row in rows]


@pytest.mark.slow
def test_the_worst_come_first_and_the_others_are_drawn_when_unfolded(measurement, tmp_path):
    page = tmp_path / "report.html"
    whole = compare(measurement)
    some = whole.channels[: OPEN + 1]
    # One channel that does not agree at all, at the end of the list.
    wrong = replace(some[-1], simulated=some[-1].measured + 100.0 * some[-1].floor)
    write_page(page, replace(whole, channels=[*some[:-1], wrong]))
    text = page.read_text(encoding="utf-8")
    times = times_of(text)
    worst, times = times[:OPEN], times[OPEN:]
    assert len(times) == OPEN + 1
    assert times == sorted(times, reverse=True)
    assert worst == times[:OPEN]
    assert times[0] == pytest.approx(100.0, rel=0.01)
    assert f"The worst is {channel_words(wrong.name)} ({wrong.block}): its error is 100" in text
    before, after, folds, linked = look(page, 1000, UNFOLD)["reported"]
    assert before == 2 * OPEN
    assert after == 2 * OPEN + 2
    assert folds == 3 + len({c.block for c in some})
    assert linked


@pytest.mark.slow
def test_the_page_of_all_channels_is_small(measurement, tmp_path):
    page = tmp_path / "report.html"
    found = compare(measurement)
    write_page(page, found)
    assert len(found.channels) > 30
    assert page.stat().st_size < 5e6


@pytest.mark.slow
def test_a_part_that_is_wider_than_the_screen_is_seen(tmp_path):
    page = tmp_path / "wide.html"
    page.write_text("<!doctype html><div style='width:900px'>wide</div>", encoding="utf-8")
    assert look(page, 400)["wide"] >= 900
    found = look(page, 1280)
    assert found["wide"] == found["seen"]
