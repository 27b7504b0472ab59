"""A recording held against its simulation from measured inputs."""

import json
import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from browser import look
from error_lines import said
from machines import THESIS
from run_samples import run_to

from cspm.cli import main as cli
from cspm_ident.block_simulation import BlockSimulation, Input
from cspm_ident.comparison import floor
from cspm_ident.comparison.compare import compare
from cspm_ident.comparison.metrics import best_lag, coherence_of, error_bins, nrmse
from cspm_ident.comparison.page import write_page
from cspm_ident.offline_page import POINTS, thinned
from cspm_ident.signals.delays import RESOLUTION_S, find_delays
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.noise import with_more_noise
from cspm_ident.signals.noise_source import noise_of
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.errors import InputError

DURATION = 14.0
# Channels that the page does not fold.
OPEN = 5
PULLED = """
name: pulled
testbed: fixed_frame.yaml
duration: 8.0
rates: {motion_capture: 1000, motion_controller: 1000, tension_distribution: 1000}
target:
  mean_pose: [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
  motion:
    type: moves
    moves:
      - {at: 1.0, duration: 1.5, by: [0.08, 0.0, -0.05, 0.0, 0.02, 0.0]}
      - {at: 5.0, duration: 1.5, by: [-0.08, 0.04, 0.05, 0.0, 0.0, 0.02]}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The frame moves in surge, winches locked."""
    place = tmp_path_factory.mktemp("compare") / "bag"
    run_to(place, "verification_mid", f"duration={DURATION}")
    return place


@pytest.fixture(scope="module")
def measurement(folder):
    return read_measurement(folder)


@pytest.fixture(scope="module")
def comparison(measurement):
    return compare(measurement)


def of(comparison, name, block="whole"):
    return next(c for c in comparison.channels if (c.name, c.block) == (name, block))


def heavier(measurement, factor):
    machine = measurement.machine
    bar = machine.bar.model_copy(update={"mass": machine.bar.mass * factor})
    return measurement.with_machine(machine.model_copy(update={"bar": bar}))


def test_the_machine_itself_is_at_the_noise_floor(comparison):
    for channel in comparison.channels:
        # A minute of one draw against another: what the floor is known to, and the smoothing of
        # the inputs, which is not in it.
        assert channel.rms < 1.5 * channel.floor, (channel.block, channel.name)
    assert of(comparison, "bar/pose/surge").vaf > 99.9
    assert {c.block for c in comparison.channels} == {"whole", "cable", "bar"}
    assert comparison.left_out == {
        "winch": "all winches stand still: a brake or friction takes any torque"
    }


def test_another_mass_shows_where_tensions_drive_the_bar(measurement, comparison):
    wrong = compare(heavier(measurement, 1.1), delays={})
    before, after = (of(c, "bar/pose/heave", "bar") for c in (comparison, wrong))
    # A tenth more weight in half a second: 0.05·g·0.5² = 0.12 m at the end of each window.
    assert after.rms > 20 * before.rms
    assert after.bias < 0.0


def test_what_does_not_move_has_no_share_of_variance(comparison):
    still = of(comparison, "bar/pose/yaw")
    assert (still.vaf, still.nrmse, still.lag) == (None, None, None)


@pytest.mark.parametrize("late", [0.0, 0.012])
def test_a_late_camera_is_found(measurement, late):
    moved = replace(measurement, bar_pose=measurement.bar_pose.shifted(late))
    found = {d.topic: d for d in find_delays(Timeline(moved), moved.machine)}
    bar, frame = found["/bar/pose"], found["/winch_frame/pose"]
    assert bar.seconds - frame.seconds == pytest.approx(late, abs=RESOLUTION_S)
    assert bar.matters == (late > 0.0)
    assert bar.interval[0] <= late <= bar.interval[1]


def test_a_recording_without_cameras_says_what_is_missing(measurement):
    blind = replace(measurement, bar_pose=None)
    with pytest.raises(InputError, match=r"--drive tension needs /bar/pose, allowed: a recording"):
        compare(blind, Input.TENSION)


def test_without_load_cells_the_bar_is_simulated_all_the_same(measurement, comparison):
    """The zero of the lengths is then where the bar hangs on average as it was measured."""
    found = compare(replace(measurement, tension=None))
    assert {c.block for c in found.channels} == {"whole"}
    assert found.left_out == {
        "winch": "/cables/tension not recorded",
        "cable": "nothing that it simulates was measured",
        "bar": "/cables/tension not recorded",
    }
    with_cells, without = (of(c, "bar/pose/surge") for c in (comparison, found))
    assert without.vaf > 99.9
    assert without.rms < 2.0 * with_cells.rms


def test_without_drives_speeds_and_torques_the_angles_drive_alone(measurement, comparison):
    found = compare(replace(measurement, speed=None, torque=None), delays={})
    assert found.left_out == {"winch": "/winches/state effort not recorded"}
    for name in ("bar/pose/surge", "bar/pose/heave"):
        assert of(found, name).rms < 1.5 * of(comparison, name).rms


@pytest.mark.slow
def test_a_bar_under_a_fixed_frame_needs_no_camera_on_it(tmp_path):
    """Exits in the world's axes; the winches pull the bar about."""
    text = THESIS.read_text(encoding="utf-8")
    frame = re.search(r"^winch_frame:\n  .*\n", text, re.MULTILINE)[0]
    text = text.replace(frame, "").replace("  /winch_frame/pose:", "  /bar/pose:")
    text = text.replace("  /bar/pose: *motion_capture\n", "")
    (tmp_path / "fixed_frame.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "pulled.yaml").write_text(PULLED, encoding="utf-8")
    run_to(tmp_path / "bag", tmp_path / "pulled.yaml")
    found = compare(read_measurement(tmp_path / "bag"), delays={})
    assert found.left_out == {}
    assert {c.block for c in found.channels} == {"whole", "winch", "cable", "bar"}
    # Each block at its floor, with what a bad draw of it makes.
    assert max(c.rms / c.floor for c in found.channels) < 3.0
    assert of(found, "bar/pose/surge").vaf > 99.9


def test_windows_begin_anew_and_leave_holes_out(measurement):
    samples = measurement.bar_pose
    seen = (samples.times < 4.0) | (samples.times > 6.0)
    torn = replace(measurement, bar_pose=type(samples)(samples.times[seen], samples.values[seen]))
    simulation = BlockSimulation(Timeline(torn), torn.machine)
    windows = simulation.windows(Input.TENSION, 0.5)
    line = simulation.timeline
    assert len(windows) >= 20
    for start, end in windows:
        times = line.times[[start, end]]
        assert times[1] <= 4.0 or times[0] >= 6.0
        assert end - start <= 1.5 * 500


def test_metrics_of_a_long_record_are_those_of_all_of_it():
    generator = np.random.default_rng(5)
    times = np.arange(0, 400, 0.002)
    common = np.convolve(generator.standard_normal(len(times)), np.ones(25) / 5, "same")
    late = np.roll(common, 7) + 0.01 * generator.standard_normal(len(times))
    assert best_lag(late, common, 0.002) == pytest.approx(0.014, abs=2e-4)
    frequencies, found = coherence_of(common, 2.0 * common, 500.0)
    assert found.min() > 0.999
    assert frequencies[-1] > 240.0


def test_metrics_of_a_delayed_and_scaled_signal():
    times = np.arange(0, 20, 0.01)
    signal = np.sin(2 * np.pi * 0.7 * times)
    late = np.sin(2 * np.pi * 0.7 * (times - 0.034))
    assert best_lag(late, signal, 0.01) == pytest.approx(0.034, abs=1e-3)
    assert best_lag(signal, late, 0.01) == pytest.approx(-0.034, abs=1e-3)
    assert nrmse(signal, np.zeros_like(signal)) == pytest.approx(1.0, abs=0.01)
    assert nrmse(signal, signal) == 0.0


def test_coherence_distinguishes_common_from_foreign_frequencies():
    generator = np.random.default_rng(3)
    common, foreign = generator.standard_normal((2, 40_000))
    frequencies, same = coherence_of(common, 2.0 * common, 100.0)
    _, other = coherence_of(common, foreign, 100.0)
    assert frequencies[-1] <= 50.0
    assert same.min() > 0.999
    assert other.mean() < 0.1


def test_error_bins_show_what_drives_an_error():
    speed = np.linspace(-1, 1, 1001)
    bins = error_bins(0.3 * np.sign(speed), speed)
    assert [np.sign(each.bias) for each in bins] == [np.sign(each.centre) for each in bins]
    assert error_bins(speed, np.ones_like(speed)) == []


def test_noise_alone_is_no_slope_of_the_error(comparison):
    """A measured value has its noise in common with its error."""
    assert "value" not in of(comparison, "bar/pose/yaw").bins
    moves = of(comparison, "cables/tension/surge_1")
    low, high = np.quantile(moves.simulated, (0.01, 0.99))
    assert moves.bins["value"][0].centre == pytest.approx(low + (high - low) / 16)


def test_one_start_is_drawn_several_times_and_many_once(measurement, monkeypatch):
    seeds = []

    def noted(measured, noise, seed):
        seeds.append(seed)
        return with_more_noise(measured, noise, seed)

    monkeypatch.setattr(floor, "with_more_noise", noted)
    machine, noise = measurement.machine, noise_of(measurement, None)[0]
    timeline = Timeline(measurement)
    for count, draws in ((1, 4), (2, 2), (5, 1)):
        seeds.clear()
        windows = [(100 * i, 100 * (i + 1)) for i in range(count)]
        scatter = floor.propagated(timeline, machine, Input.WINCH, windows, noise)
        assert len(set(seeds)) == len(seeds) == draws
        assert np.isfinite(scatter.bars).all()


def test_thinned_lines_keep_spikes():
    values = np.zeros(200_000)
    values[123_456] = 7.0
    times, shown = thinned(np.arange(200_000) * 1e-3, values)
    assert len(shown) <= POINTS
    assert shown.max() == 7.0
    assert times[np.argmax(shown)] == pytest.approx(123.456)


@pytest.fixture
def command(monkeypatch, capsys):
    def call(*words):
        monkeypatch.setattr(sys, "argv", ["cspm", *map(str, words)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        return caught.value.code or 0, *capsys.readouterr()

    return call


def test_the_command_prints_writes_and_reports(command, folder, tmp_path):
    code, out, _ = command(
        "compare", folder, "--out", tmp_path / "report", "--json", tmp_path / "found.json"
    )
    assert code == 0
    assert "whole, from measured winch" in out
    assert "winch: left out, all winches stand still" in out
    assert "/bar/pose: " in out.splitlines()[0]
    assert out.splitlines()[0].endswith("; too small to matter, left in")
    found = json.loads((tmp_path / "found.json").read_text())
    channels = {(c["block"], c["channel"]): c for c in found["channels"]}
    assert channels["whole", "bar/pose/surge"]["vaf"] > 99.9
    assert {"vaf", "nrmse", "lag_s", "noise_floor", "bias"} <= set(found["channels"][0])
    page = (tmp_path / "report" / "report.html").read_text()
    assert page.count("plotly-graph-div") >= 9
    assert "winch: left out, all winches stand still" in page
    assert "http://" not in page.split("<body>")[1].split("<script")[0]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--drive", "sail"], "--drive sail: allowed: winch, torque, tension"),
        (["--horizon", "0"], "--horizon 0: allowed: 0.01 to 3600 s"),
        (["--delay", "/bar/pose"], "--delay /bar/pose: allowed: TOPIC=SECONDS with one of"),
        (["--delay", "/bar/pose=2"], "--delay /bar/pose=2: allowed: TOPIC=SECONDS with one of"),
    ],
)
def test_wrong_options_are_one_line(command, folder, words, line):
    code, _, err = command("compare", folder, *words)
    assert (code, err.count("\n")) == (2, 1)
    assert said(err).startswith(line)


@pytest.mark.slow
@pytest.mark.parametrize("width", [400, 1280])
def test_a_browser_draws_the_page_and_nothing_but_tables_is_wider_than_the_screen(
    comparison, width, tmp_path
):
    write_page(tmp_path / "report.html", comparison)
    shown = look(tmp_path / "report.html", width)
    assert shown["errors"] == []
    # Lines that only the script draws.
    assert shown["plots"] == 2 * OPEN
    assert shown["wide"] <= shown["seen"] <= width
