"""The tables of docs/results.md: from the runs that are kept, and these from the code as it is."""

import re
from dataclasses import replace

import numpy as np
import pytest

from bench.results.outcome import measure, read_csv, write_csv
from bench.results.reproduction import PAGE, PAST, TABLE, WORST, blocks, jobs, main
from bench.results.reproduction_tables import PRINTED, published_factors, spread_block

# Relative; processors round differently, and an unstable loop carries that along.
TOLERANCE = 0.01


@pytest.fixture(scope="module")
def kept():
    return read_csv(TABLE)


def on_the_page(name):
    marks = rf"<!-- {re.escape(name)} -->\n(.*?)\n<!-- end -->"
    return re.search(marks, PAGE.read_text("utf-8"), re.DOTALL)[1]


def test_tables_of_the_page_are_those_of_the_runs_that_are_kept(kept):
    for name, text in blocks(kept).items():
        assert on_the_page(name) == text, "run: python -m bench.results.reproduction --cases"


@pytest.mark.compiled
def test_every_run_of_the_page_is_kept(kept):
    assert sorted((o.case, o.seed) for o in kept) == sorted((j.case, j.seed) for j in jobs())


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("case", ["worst case, 4 m", "100 rad/s", WORST])
def test_a_run_gives_what_is_kept_of_it(kept, case):
    job = next(j for j in jobs() if (j.case, j.seed) == (case, 1))
    found, was = measure(*job), next(o for o in kept if (o.case, o.seed) == (case, 1))
    assert found.duration == pytest.approx(was.duration, rel=TOLERANCE)
    np.testing.assert_allclose(found.rms, was.rms, rtol=TOLERANCE)
    np.testing.assert_allclose(found.largest, was.largest, rtol=TOLERANCE)
    assert found.least == pytest.approx(was.least, rel=TOLERANCE)
    assert bool(found.failure) is bool(was.failure) is (case == "worst case, 4 m")


def test_factors_of_the_conclusions_follow_from_the_tables():
    """Its tables have three digits."""
    np.testing.assert_allclose(published_factors(), [float(each) for each in PRINTED], rtol=2e-3)


def test_a_table_of_runs_is_read_as_it_was_written(kept, tmp_path):
    write_csv(tmp_path / "runs.csv", kept)
    assert (tmp_path / "runs.csv").read_bytes() == TABLE.read_bytes()


def test_a_spread_counts_seeds_below_the_thesis(kept):
    one = next(o for o in kept if o.case == WORST)
    for factor, said in ((1e-3, "1 of 1"), (1e3, "0 of 1")):
        rows = spread_block([replace(one, rms=factor * one.rms)]).splitlines()[2:]
        assert [row.split(" | ")[-1] for row in rows] == [f"{said} |"] * 6


@pytest.mark.compiled
def test_cases_that_are_named_are_run_and_other_rows_kept(monkeypatch, tmp_path, kept):
    from bench.results import reproduction

    page, table = tmp_path / "page.md", tmp_path / "runs.csv"
    page.write_text(PAGE.read_text("utf-8"), encoding="utf-8")
    table.write_bytes(TABLE.read_bytes())
    monkeypatch.setattr(reproduction, "PAGE", page)
    monkeypatch.setattr(reproduction, "TABLE", table)
    monkeypatch.setattr("sys.argv", ["reproduction", "--cases"])
    main()
    assert table.read_bytes() == TABLE.read_bytes()
    assert page.read_text("utf-8") == PAGE.read_text("utf-8")
    assert PAST in {each.case for each in kept}
