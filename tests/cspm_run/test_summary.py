"""What a run amounts to: statistics, summary, figure."""

import json
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from matplotlib.image import imread
from rich.console import Console
from run_samples import THESIS_CABLES, bundle_of, recorded

from cspm.plots.run_figure import draw_run
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.scenario import Requirement
from cspm_msgs_py.stepping.delay_histogram import UP_TO_MS, DelayHistogram
from cspm_run.output.json_file import write_json
from cspm_run.output.summary import print_summary, summary_data
from cspm_run.recorded_run import run
from cspm_run.run_statistics import BINS, KEPT, RunStatistics

REQUIREMENT = Requirement()
UNWINDING = "control={mode: torque, torque: {surge_1: {offset: -0.2}}}"


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A run of the literal worst case, and its true rows."""
    folder = tmp_path_factory.mktemp("summary") / "bag"
    result = run(bundle_of("worst_case_literal", "winch_frame.motion.ramp=0.5"), folder, steps=600)
    return result, recorded(folder)


def pose_errors(rows):
    reference, truth = rows["/bar/reference"].rows, rows["/truth/bar/pose"].rows
    angles = [
        np.array([euler_from_quaternion(row[3:7]) for row in found]) for found in (reference, truth)
    ]
    return np.hstack([reference[:, :3] - truth[:, :3], angles[0] - angles[1]])


def test_errors_and_tensions_are_those_of_the_recorded_truth(measured):
    result, rows = measured
    errors, tensions = pose_errors(rows), rows["/truth/cables/tension"].rows
    data = summary_data(result)
    for d, dof in enumerate(DOFS):
        found = data["errors"][dof]
        assert found["max"] == pytest.approx(np.abs(errors[:, d]).max(), abs=1e-12)
        assert found["rms"] == pytest.approx(np.sqrt((errors[:, d] ** 2).mean()), abs=1e-12)
        assert found["max"] >= found["rms"] > 0.0
    assert data["tension"] == {"min": tensions.min(), "max": tensions.max()}


def test_slack_share_is_that_of_the_recorded_truth(tmp_path):
    result = run(bundle_of("rest", UNWINDING), tmp_path / "bag", steps=400)
    slack = (recorded(tmp_path / "bag")["/truth/cables/tension"].rows <= 0.0).any(axis=1)
    assert 0.2 < slack.mean() < 1.0
    assert summary_data(result)["slack_share"] == slack.mean()
    assert result.statistics.tension_range[0] == 0.0


def test_infeasible_share_is_that_of_the_saturated_commands(measured):
    """A tension command at a limit misses the wrench, and the state stays so until the next."""
    result, rows = measured
    limits = np.array([c.tension_limits for c in bundle_of("rest").testbed.testbed.cables])
    commands = rows["/tension_command"].rows
    at_limit = ((commands == limits[:, 0]) | (commands == limits[:, 1])).any(axis=1)
    assert 0.0 < at_limit.mean() < 1.0
    assert summary_data(result)["infeasible_share"] == pytest.approx(at_limit.mean())


def test_summary_has_the_contracts_keys_and_survives_json(measured, tmp_path):
    result, rows = measured
    data = summary_data(result)
    assert list(data) == [
        "scenario",
        "seed",
        "mode",
        "duration_s",
        "real_time_factor",
        "errors",
        "tension",
        "slack_share",
        "infeasible_share",
        "saturation",
        "controlled",
        "messages",
        "warnings",
    ]
    assert (data["scenario"], data["seed"], data["mode"]) == ("worst_case_literal", 1, "inprocess")
    assert data["duration_s"] == pytest.approx(0.6)
    assert list(data["errors"]) == list(DOFS)
    assert data["warnings"] == []
    assert all(set(each) == {"share", "longest_s"} for each in data["saturation"].values())
    assert len(data["saturation"]) == 8
    assert data["controlled"] == ["surge", "sway", "heave", "pitch", "yaw"]
    counts = {name: len(found.stamp_ns) for name, found in rows.items()}
    shown = {"/tf_static": 1, "/robot_description": 1, "/tf": 12, "/markers": 6}
    assert data["messages"] == counts | shown | {"/diagnostics": 5 * 6}  # five nodes report
    write_json(tmp_path / "summary.json", data)
    assert json.loads((tmp_path / "summary.json").read_text()) == data


def printed(result, width=100):
    text = StringIO()
    print_summary(Console(file=text, width=width), result, REQUIREMENT)
    return text.getvalue()


def test_delays_are_shown_and_kept_where_there_are_any(measured):
    result, _ = measured
    delays = DelayHistogram()
    for delay_ns in (200_000, 700_000, 1_500_000, 30_000_000):
        delays.add(delay_ns)
    late = replace(result, delays=delays)
    line = "torque commands after their measurement: 50.00% within 1 ms, 75.00% within 2 ms,"
    assert f"{line} 75.00% within 5 ms, 75.00% within 20 ms\n" in printed(late)
    kept = summary_data(late)["torque_delays"]
    assert dict(zip(kept["up_to_ms"], kept["commands"], strict=True)) == {
        **dict.fromkeys([*UP_TO_MS, None], 0),
        **dict.fromkeys([0.25, 1.0, 2.0, 50.0], 1),
    }
    none = replace(result, delays=DelayHistogram())
    assert "after their measurement" not in printed(none) + printed(result)
    assert "torque_delays" not in summary_data(result)


def lines_of(text):
    rows = [line.split("│")[1:-1] for line in text.splitlines() if line.startswith("│")]
    return {cells[0].strip(): [cell.strip() for cell in cells[1:]] for cells in rows}


def test_the_table_judges_each_dof_against_the_requirement(measured):
    result, _ = measured
    rms = result.statistics.rms_error
    cells = lines_of(printed(result))
    assert list(cells) == list(DOFS)
    for i, dof in enumerate(DOFS):
        limit, unit = (0.002, "mm") if i < 3 else (0.004, "mrad")
        peak, mean, required, verdict = cells[dof]
        assert peak == f"{1e3 * result.statistics.max_error[i]:.3f} {unit}"
        assert mean == f"{1e3 * rms[i]:.3f} {unit}"
        assert required == f"± {1e3 * limit:g} {unit}"
        worst = result.statistics.max_error[i]
        within = "always" if worst <= limit else "RMS only" if rms[i] <= limit else "no"
        assert verdict == within
    # With another requirement every verdict turns.
    text = StringIO()
    strict = Requirement(position=1e-9, angle=1e-9)
    print_summary(Console(file=text, width=100), result, strict)
    assert {found[-1] for found in lines_of(text.getvalue()).values()} == {"no"}
    text = StringIO()
    print_summary(Console(file=text, width=100), result, Requirement(position=9.0, angle=9.0))
    assert {found[-1] for found in lines_of(text.getvalue()).values()} == {"always"}
    surge = result.statistics.max_error[0], rms[0]
    text = StringIO()
    between = Requirement(position=sum(surge) / 2, angle=9.0)
    print_summary(Console(file=text, width=100), result, between)
    assert surge[0] > surge[1]
    assert lines_of(text.getvalue())["surge"][-1] == "RMS only"


def test_without_a_controller_nothing_is_judged():
    text = printed(run(bundle_of("verification_mid"), None, steps=20))
    assert "nothing controls it" in text
    assert "required" not in text
    assert {len(cells) for cells in lines_of(text).values()} == {2}


def test_without_a_bar_there_are_only_tensions():
    text = printed(run(bundle_of("one_winch"), None, steps=20))
    assert "│" not in text
    first, second = text.strip().splitlines()
    assert first.startswith("tensions 33.06 to 34.54 N")
    assert "any cable slack 0.00% of the time" in first
    assert second.startswith("simulated 0.02 s at ")


def test_a_name_is_no_markup(measured):
    odd = replace(measured[0], scenario="[red]odd")
    assert "[red]odd, seed 1" in printed(odd)


def test_tally_against_numpy():
    rng = np.random.default_rng(1)
    steps = 2 * BINS + 345
    errors, tensions = rng.normal(size=(steps, 6)), rng.uniform(1.0, 9.0, (steps, 3))
    slack, infeasible = rng.random(steps) < 0.3, rng.random(steps) < 0.6
    saturated = rng.random(steps) < 0.2
    statistics = RunStatistics(steps, 3)
    assert statistics.bin_steps == 3
    for i in range(steps):
        met = bool(slack[i]), bool(infeasible[i]), bool(saturated[i])
        statistics.add(errors[i], tensions[i], *met)
    np.testing.assert_array_equal(statistics.max_error, np.abs(errors).max(axis=0))
    np.testing.assert_allclose(statistics.rms_error, np.sqrt((errors**2).mean(axis=0)), rtol=1e-12)
    assert statistics.tension_range == (tensions.min(), tensions.max())
    assert (statistics.slack_share, statistics.infeasible_share) == (
        slack.mean(),
        infeasible.mean(),
    )
    assert statistics.saturated_share == saturated.mean()
    # The figure's envelope: lowest and highest of every three steps, also of the unfinished bin.
    for i in (0, 7, steps // 3):
        part = slice(3 * i, 3 * i + 3)
        both = np.hstack([errors[part], tensions[part]])
        np.testing.assert_array_equal(statistics.envelope[i], [both.min(axis=0), both.max(axis=0)])


@pytest.mark.parametrize(
    ("steps", "period", "every"), [(9000, 1e-3, 1), (9001, 1e-4, 10), (300, 1e-4, 10), (7, 0.01, 1)]
)
def test_the_tensions_of_the_end_are_kept(steps, period, every):
    tensions = np.random.default_rng(2).uniform(1.0, 9.0, (steps, 2))
    statistics = RunStatistics(steps, 2, period)
    for row in tensions:
        statistics.add(np.zeros(6), row, False, False)
    np.testing.assert_array_equal(statistics.last_tensions, tensions[::every][-KEPT:])
    assert statistics.kept_period == pytest.approx(every * period)
    assert statistics.span == pytest.approx(steps * period)


def test_a_tally_of_nothing():
    statistics = RunStatistics(10, 2)
    assert statistics.last_tensions.shape == (0, 2)
    assert statistics.saturated_share == 0.0
    np.testing.assert_array_equal(statistics.max_error, np.zeros(6))
    np.testing.assert_array_equal(statistics.rms_error, np.zeros(6))
    assert statistics.tension_range == (0.0, 0.0)
    assert (statistics.slack_share, statistics.infeasible_share) == (0.0, 0.0)


@pytest.mark.parametrize("steps", [1, 2, 2 * BINS + 1])
def test_a_tally_has_room_for_its_steps(steps):
    statistics = RunStatistics(steps, 1)
    for _ in range(steps):
        statistics.add(np.ones(6), np.ones(1), False, False)
    assert statistics.tension_range == (1.0, 1.0)


def draw(path, result, cables):
    draw_run(path, result, REQUIREMENT, cables, 1e-3)
    return imread(path)


@pytest.mark.slow
def test_the_figure_shows_every_signal(measured, tmp_path):
    result, _ = measured
    picture = draw(tmp_path / "run.png", result, THESIS_CABLES)
    assert picture.shape[0] > 600
    assert picture.shape[1] > 800
    colours = np.unique((picture[..., :3] * 255).astype(int).reshape(-1, 3), axis=0)
    assert len(colours) > 100
    # Another run looks different, the same run the same.
    other = run(bundle_of("rest"), None, steps=600)
    assert (draw(tmp_path / "rest.png", other, THESIS_CABLES) != picture).any()
    assert (draw(tmp_path / "again.png", result, THESIS_CABLES) == picture).all()


def test_a_spike_of_one_step_is_drawn(tmp_path):
    """Among 40 000 steps a spike is narrower than a pixel."""
    result = run(bundle_of("one_winch"), None, steps=1)
    pictures = []
    for spike in (0.0, 5.0):
        statistics = RunStatistics(40_000, 1)
        for i in range(40_000):
            statistics.add(
                np.zeros(6), np.array([1.0 + (i % 2) + spike * (i == 20_001)]), False, False
            )
        path = tmp_path / f"{spike}.png"
        pictures.append(draw(path, replace(result, statistics=statistics), ("surge",)))
    assert statistics.tension_range == (1.0, 7.0)
    assert (pictures[0] != pictures[1]).mean() > 0.01


def test_a_run_that_ended_at_once_can_be_drawn(tmp_path):
    result = replace(run(bundle_of("rest"), None, steps=1), statistics=RunStatistics(10, 8))
    assert draw(tmp_path / "run.png", result, THESIS_CABLES).size > 0
    assert "│" not in printed(result)
