"""A metric over a varied value: means of runs with intervals that hold what they say."""

import numpy as np
import pytest

from cspm.campaign.metric_figures import group_means, metric_figure


def test_means_over_few_values_are_those_of_each_value():
    varied, metric = np.repeat([1.0, 2.0], 4), np.array([1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0, 5.0])
    found = group_means(varied, metric)
    assert found.at.tolist() == [1.0, 2.0]
    assert found.mean.tolist() == [2.5, 5.0]
    # Student's 97.5 % quantile of 3 degrees of freedom, from a printed table.
    assert found.half == pytest.approx([3.182446 * np.std([1, 2, 3, 4], ddof=1) / 2.0, 0.0])


def test_neighbours_are_grouped_where_every_run_has_its_own_value():
    rng = np.random.default_rng(1)
    varied = rng.uniform(0.0, 1.0, 400)
    found = group_means(varied, 3.0 * varied)
    assert len(found.at) == 8
    assert np.all(np.diff(found.at) > 0.0)
    np.testing.assert_allclose(found.mean, 3.0 * found.at)


def test_intervals_hold_the_mean_as_often_as_they_say():
    rng = np.random.default_rng(2)
    groups = [group_means(np.repeat([0.0, 1.0], 6), rng.normal(7.0, 2.0, 12)) for _ in range(500)]
    held = np.mean([np.abs(each.mean - 7.0) < each.half for each in groups])
    assert held == pytest.approx(0.95, abs=0.02)


def test_two_runs_have_a_mean_and_no_interval():
    found = group_means(np.array([1.0, 1.0]), np.array([2.0, 4.0]))
    assert found.mean.tolist() == [3.0]
    assert np.isnan(found.half).all()


def test_every_varied_value_has_its_axes_and_absent_effects_count_as_zero():
    rows = [{"run": i, "errors.sway.max": 1e-3 * i, "a": i, "b": i or None} for i in range(9)]
    figure = metric_figure(rows, "errors.sway.max", ["a", "b"])
    runs, means, *_ = figure.data
    assert list(runs.y) == pytest.approx(list(range(9)))
    assert next(iter(figure.data[2].x)) == 0.0
    assert means.error_y.array is not None
    assert [figure.layout.xaxis.title.text, figure.layout.xaxis2.title.text] == ["a", "b"]
    assert figure.layout.yaxis.title.text == "sway error, largest<br>[mm]"
