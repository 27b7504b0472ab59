"""Controllers from files that a scenario names, as nodes: the same messages in every mode."""

import pytest
from own_controllers import BOTH, written
from process_runs import processes
from ros_graph import assert_same, load_ros, new_domain
from run_samples import bundle_of

from cspm_msgs_py.errors import CspmError
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

load_ros()

from cspm_ros.runtime.graph_run import run_graph  # noqa: E402 - after ROS is known to be there
from cspm_ros.runtime.realtime_run import run_realtime  # noqa: E402

pytestmark = pytest.mark.compiled
FAILS = "{motion_controller: {python: 'lift.py:Lift', parameters: {fails_at: 0.2}}}"
STEPS = 300
# A busy machine makes inputs late.
PATIENT = ("safety.stale_after=5.0", "safety.watchdog=5.0", "safety.lateness=5.0")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own")
    run(bundle_of(written(folder, BOTH)), folder / "bag", steps=STEPS)
    return folder


def test_a_graph_sends_the_same_and_repeats(place, tmp_path):
    bundle = bundle_of(place / "mine.yaml")
    result = run_graph(bundle, tmp_path / "bag", steps=STEPS, domain_id=new_domain())
    assert result.failure is None
    assert_same(place / "bag", tmp_path / "bag")
    own = [place / "lift.py", place / "tension_pi.py"]
    assert resimulate(tmp_path / "bag", lambda *_: None, own).difference is None


@pytest.mark.slow
def test_processes_send_the_same(place, tmp_path):
    processes(bundle_of(place / "mine.yaml"), tmp_path / "bag", steps=STEPS)
    assert_same(place / "bag", tmp_path / "bag")


def test_in_a_graph_a_failure_is_one_line(tmp_path):
    bundle = bundle_of(written(tmp_path, FAILS))
    with pytest.raises(CspmError, match=r"line 17: ZeroDivisionError: nothing to divide by$"):
        run_graph(bundle, tmp_path / "bag", steps=STEPS, domain_id=new_domain())


def test_internals_are_not_expected_of_own_controllers(tmp_path):
    bundle = bundle_of(written(tmp_path, BOTH), "control.record_internals=true")
    run_graph(bundle, tmp_path / "bag", steps=STEPS, domain_id=new_domain())
    run(bundle, tmp_path / "alone", steps=STEPS)
    assert_same(tmp_path / "bag", tmp_path / "alone")


def test_real_time(place, tmp_path):
    bundle = bundle_of(place / "mine.yaml", *PATIENT)
    result = run_realtime(bundle, tmp_path / "bag", steps=3000, domain_id=new_domain())
    assert result.failure is None
    assert result.statistics.slack_share == 0.0
    assert result.messages["/winches/torque_command"] > 100


def test_in_real_time_a_failure_leads_to_the_safe_state(tmp_path):
    bundle = bundle_of(written(tmp_path, FAILS.replace("0.2", "1e-6")), *PATIENT)
    result = run_realtime(bundle, tmp_path / "bag", steps=1000, domain_id=new_domain())
    assert "ZeroDivisionError: nothing to divide by" in result.failure
