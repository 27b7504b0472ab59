"""The report page of `cspm compare` in a browser, at any width and driven by anything."""

from dataclasses import replace

import pytest
from browser import look
from run_samples import run_to

from cspm_ident.block_simulation import Input
from cspm_ident.comparison.compare import compare
from cspm_ident.comparison.page import write_page
from cspm_ident.signals.measurement import read_measurement

DURATION = 3.0


@pytest.fixture(scope="module")
def measurement(tmp_path_factory):
    place = tmp_path_factory.mktemp("page") / "bag"
    run_to(place, "calm", f"duration={DURATION}")
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
    assert shown["plots"] >= 2 * len(kinds)
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
    zoomed, whole = look(page, 1280, ZOOM)["told"]
    assert zoomed == [[1, 2]] * len(kinds)
    assert all(high - low > 0.9 * DURATION for low, high in whole)


@pytest.mark.slow
def test_a_part_that_is_wider_than_the_screen_is_seen(tmp_path):
    page = tmp_path / "wide.html"
    page.write_text("<!doctype html><div style='width:900px'>wide</div>", encoding="utf-8")
    assert look(page, 400)["wide"] >= 900
    found = look(page, 1280)
    assert found["wide"] == found["seen"]
