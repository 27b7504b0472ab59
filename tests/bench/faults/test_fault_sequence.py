"""The faults that the sequence draws, and what it calls unsafe."""

import numpy as np
import pytest
from ros_graph import load_ros
from run_samples import bundle_of

load_ros()

from bench.faults.__main__ import drawn, unsafe_in  # noqa: E402
from cspm_msgs_py.scenario_keys.faults import check_fault  # noqa: E402
from cspm_run.recorded_run import run  # noqa: E402


@pytest.fixture(scope="module")
def bundle():
    return bundle_of("rest")


def test_every_fault_drawn_is_one_that_the_machine_can_have_and_that_ends(bundle):
    machine, rng = bundle.testbed.testbed, np.random.default_rng(1)
    found = [drawn(rng, machine) for _ in range(400)]
    for fault in found:
        check_fault(fault, machine, "drawn", realtime=True)
        assert fault.lasts is not None
    kinds = {fault.fault for fault in found}
    assert len(kinds) == 7
    again = np.random.default_rng(1)
    assert [drawn(again, machine) for _ in range(400)] == found


def test_a_bar_at_rest_is_safe_and_one_that_falls_is_not(bundle, tmp_path):
    machine = bundle.testbed.testbed
    run(bundle, tmp_path / "rest", steps=200)
    assert unsafe_in(tmp_path / "rest", machine) == []
    weak = [
        f'{{"fault": "winch_weak", "on": "{name}", "amount": 0.0}}' for name in machine.cable_names
    ]
    falling = bundle_of("rest", f"faults=[{', '.join(weak)}]")
    run(falling, tmp_path / "falling", steps=400)
    said = "; ".join(unsafe_in(tmp_path / "falling", machine))
    assert "m away, allowed: 0.15 m" in said
    assert "m/s, allowed: 1 m/s" in said
