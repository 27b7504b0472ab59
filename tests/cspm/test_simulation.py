"""Simulating from a script: arrays at once, a recording on demand, controllers of one's own."""

import sys
import threading

import numpy as np
import pytest
from run_samples import bundle_of, recorded

import cspm
from cspm_msgs_py.recording import Recording as Reader
from cspm_msgs_py.topics import SCENE
from cspm_run.recorded_run import run as run_to_disk

DURATION = 0.4
COUNT = 400


@pytest.fixture(scope="module")
def calm():
    return cspm.simulate("calm", duration=DURATION)


def test_signals_are_arrays_by_name(calm):
    assert calm.failure is None
    assert calm.duration == pytest.approx(DURATION)
    assert calm.time.tolist() == pytest.approx((np.arange(COUNT) * 1e-3).tolist())
    assert calm.tension["sway_3"].shape == calm.bar_pose["heave"].shape == (COUNT,)
    assert calm.tension.columns == calm.testbed.cables
    assert calm.bar_pose.units == ("m", "m", "m", "rad", "rad", "rad")
    # What is measured is the truth with noise of 0.02 N, rounded to 5 mN.
    noise = calm.tension - calm.truth.tension
    assert 0.015 < noise.std() < 0.025
    assert np.abs(calm.bar_pose[:, 2] - calm.bar_reference["heave"]).max() < 0.01
    assert calm.errors["heave"]["max"] < 0.002


def test_a_saved_run_is_what_the_command_line_records(calm, tmp_path):
    saved = calm.save(tmp_path / "calm")
    run_to_disk(bundle_of("calm", f"duration={DURATION}"), tmp_path / "other" / "calm")
    one, other = (next(tmp_path.glob(f"{each}/*.mcap")) for each in ("calm", "other/calm"))
    assert one.read_bytes() == other.read_bytes()
    assert (saved.path / "summary.json").exists()
    with pytest.raises(cspm.InputError, match="calm: already exists, allowed: a new folder"):
        calm.save(tmp_path / "calm")


def test_a_recording_reads_as_the_run_did(calm, tmp_path):
    saved = cspm.open(calm.save(tmp_path / "again").path)
    assert saved.names == calm.names
    for name in (*saved.names, "/cables/tension"):
        one, other = saved.signal(name), calm.signal(name)
        assert one.columns == other.columns
        assert np.array_equal(one.values, other.values)
        assert np.array_equal(one.time, other.time)
    assert np.array_equal(saved.truth.bar_pose, calm.truth.bar_pose)
    assert saved.testbed.sha256 == calm.testbed.sha256
    assert saved.complete
    assert saved.overview().scenario == "calm"


def test_a_planted_effect_is_simulated_and_attached(calm, tmp_path):
    worn = calm.testbed.with_effect("winch_coulomb_friction", "sway_3", torque=0.03)
    run = cspm.simulate("calm", testbed=worn, duration=DURATION)
    assert not np.array_equal(run.truth.tension, calm.truth.tension)
    saved = run.save(tmp_path / "worn")
    assert saved.testbed.effects == worn.effects
    assert saved.metadata["cspm"]["testbed_sha256"] == worn.sha256
    assert saved.resimulate().difference is None
    assert saved.difference(calm.save(tmp_path / "calm")) is not None


def test_progress_grows_to_one_and_says_what_is_done():
    reported = []
    cspm.simulate("rest", duration=0.2, progress=lambda *each: reported.append(each))
    shares = [share for share, _ in reported]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    assert {what for _, what in reported} == {"simulating"}


class Copy:
    """Answers as the controller of the thesis would not: a share of the tension's torque."""

    def __init__(self, factor=1.0):
        self.factor, self.times, self.started = factor, [], None

    def start(self, period, testbed):
        self.started = period, testbed.name
        self.radii = np.array([c.drum_radius / c.gear_ratio for c in testbed.cables])

    def step(self, time, inputs):
        self.times.append(time)
        return self.factor * self.radii * inputs["/tension_command"]


def test_a_controller_of_ones_own_takes_a_stages_place(calm, tmp_path):
    own = Copy()
    run = cspm.simulate("calm", duration=DURATION, controllers={"force_controller": own})
    assert own.started == (0.001, "thesis_refitted")
    assert own.times == pytest.approx((np.arange(COUNT) * 1e-3).tolist())
    assert np.array_equal(run.torque_command, own.radii * run.tension_command)
    assert run.testbed.sha256 == calm.testbed.sha256
    saved = run.save(tmp_path / "own")
    assert saved.metadata["cspm"]["own_controllers"] == "force_controller: Copy"
    line = r"controllers that it does not carry \(force_controller: Copy\), allowed: one made with"
    with pytest.raises(cspm.InputError, match=line):
        saved.resimulate()


class Higher:
    def step(self, time, inputs):
        row = np.zeros(19)
        row[2], row[6] = 1.8 - 0.01 * time, 1.0
        return {"/bar/reference": row}


def test_a_reference_stage_may_leave_out_the_frame(calm):
    run = cspm.simulate("calm", duration=DURATION, controllers={"wave_trajectory": Higher()})
    assert run.bar_reference["heave"] == pytest.approx(1.8 - 0.01 * run.bar_reference.time)
    assert np.array_equal(run.frame_reference, calm.frame_reference)


@pytest.mark.parametrize("as_table", [False, True])
def test_the_bar_follows_a_reference_of_ones_own(as_table, tmp_path):
    def pose(time):
        return [0.0, 0.05 * time**2, 1.8, 0.0, 0.0, 0.02 * time]

    times = np.linspace(0.0, 0.5, 51)
    given = (times, [pose(t) for t in times]) if as_table else pose
    run = cspm.simulate("calm", duration=DURATION, reference=given)
    wanted = np.array([pose(t) for t in run.bar_reference.time])
    assert np.abs(run.bar_reference - wanted).max() < 1e-6
    assert run.save(tmp_path / "own").resimulate().difference is None


class Wrong:
    def __init__(self, answer):
        self.answer = answer

    def step(self, time, inputs):
        return self.answer


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"plant": "matlab"}, "plant matlab: allowed: sim, mujoco, external"),
        ({"plant": "external"}, "plant external in mode inprocess: allowed: mode realtime"),
        ({"anyway": True}, "anyway in mode inprocess: allowed: mode realtime"),
        (
            {"anyway": True, "plant": "external", "mode": "realtime"},
            "anyway with plant external: allowed: sim, mujoco",
        ),
        ({"mode": "cloud"}, "mode cloud: allowed: inprocess, graph, processes, realtime"),
        (
            {"mode": "graph", "controllers": {"force_controller": Copy()}},
            "controllers in mode graph: allowed: mode inprocess",
        ),
        ({"duration": -1.0}, "duration: -1.0, allowed: greater than 0"),
        ({"testbed": "thesys"}, "thesys: no such test-bed, allowed: cogiro"),
        (
            {"controllers": {"autopilot": Copy()}},
            "controllers: autopilot, allowed: wave_trajectory, motion_controller",
        ),
        (
            {"controllers": {"force_controller": 3}},
            "force_controller: int has no step, allowed: an object with step",
        ),
        (
            {"controllers": {"force_controller": Wrong(np.zeros(3))}},
            r"Wrong returned /winches/torque_command of shape \(3,\), allowed: \(8,\)",
        ),
        (
            {"controllers": {"force_controller": Wrong(np.full(8, np.nan))}},
            r"returned /winches/torque_command \[nan.*allowed: finite numbers",
        ),
        (
            {"controllers": {"force_controller": Wrong({"/tension_command": np.zeros(8)})}},
            "Wrong returned /tension_command, allowed: /winches/torque_command",
        ),
        ({"reference": 3.0}, "reference: allowed: a function of time, or times"),
        ({"reference": lambda t: [0.0, 1.0]}, r"reference: shape \(\d+, 2\), allowed: finite"),
        ({"reference": lambda t: "up"}, "reference: shape .* allowed: finite numbers of shape"),
    ],
)
def test_what_cannot_be_run_is_refused_in_one_line(given, line):
    with pytest.raises(cspm.InputError, match=line) as caught:
        cspm.simulate("calm", **({"duration": 0.01} | given))
    assert "\n" not in str(caught.value)


def test_a_run_that_fails_on_its_way_is_returned_as_far_as_it_came():
    class Slack(Copy):
        def step(self, time, inputs):
            return 200.0 * super().step(time, inputs)

    with pytest.warns(RuntimeWarning, match="calm: t = "):
        run = cspm.simulate("calm", duration=2.0, controllers={"force_controller": Slack()})
    assert run.failure.startswith("t = ")
    assert 0 < len(run.time) < 2000


def test_a_run_outside_the_main_thread_is_the_same(calm):
    found = []
    thread = threading.Thread(target=lambda: found.append(cspm.simulate("calm", duration=DURATION)))
    thread.start()
    thread.join()
    assert np.array_equal(found[0].tension, calm.tension)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("altitude", "run: no altitude, it has: bar_pose, frame_pose"),
        ("/diagnostics", "carries no row of numbers"),
    ],
)
def test_what_is_not_recorded_is_refused(calm, name, line):
    with pytest.raises(cspm.InputError, match=line):
        calm.signal(name)


def test_a_column_that_is_not_there_is_refused(calm):
    with pytest.raises(cspm.InputError, match="tension: no sway_9, allowed: hoist_1, hoist_2"):
        calm.tension["sway_9"]


def test_a_machine_without_bar_has_no_bar_pose():
    run = cspm.simulate("one_winch", duration=0.1)
    assert "bar_pose" not in run.names
    with pytest.raises(cspm.InputError, match="run: no bar_pose, it has: winch_angle"):
        run.bar_pose  # noqa: B018


def test_without_pandas_the_remedy_is_reported(calm, monkeypatch):
    for name in ("pandas", "xarray"):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(
            cspm.InputError, match=rf"^to_{name}: {name} .* `pip install 'cspm\[tables\]'`$"
        ):
            getattr(calm, f"to_{name}")()


def test_signals_become_a_table(calm):
    pandas = pytest.importorskip("pandas")
    table = calm.to_pandas("tension", "bar_pose")
    assert isinstance(table, pandas.DataFrame)
    assert table["tension/sway_3"].to_numpy() == pytest.approx(calm.tension["sway_3"])
    assert table.index.name == "time"
    assert len(table.columns) == 8 + 6


def test_signals_become_a_data_set(calm):
    pytest.importorskip("xarray")
    found = calm.to_xarray("tension", "bar_pose")
    assert found["tension"].sel(cable="sway_3").to_numpy() == pytest.approx(calm.tension["sway_3"])
    assert found["bar_pose"].dims == ("time", "dof")


def test_a_drawn_run_is_a_picture(calm, tmp_path):
    calm.draw(tmp_path / "run.png")
    assert (tmp_path / "run.png").read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(cspm.InputError, match="exists"):
        calm.draw(tmp_path / "run.png")


def test_no_two_kinds_of_reading_differ(calm, tmp_path):
    saved = calm.save(tmp_path / "rows")
    rows = recorded(saved.path)
    with Reader(saved.path) as reader:
        assert set(rows) == set(reader.topics) - {"/diagnostics", *SCENE}
    assert np.array_equal(rows["/cables/tension"].rows, calm.signal("/cables/tension"))
