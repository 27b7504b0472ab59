"""What was not searched is simulated from earlier on, and judged by itself."""

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_bringup.run import run
from cspm_ident.diagnosis.simulation import baselines_of
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.dofs import DOFS


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Eight seconds of the worst sea."""
    folder = tmp_path_factory.mktemp("simulation") / "bag"
    run(bundle_of("worst_case", "duration=8"), folder)
    return read_measurement(folder)


@pytest.mark.parametrize("start", [0.0, 6.0])
def test_only_what_was_not_searched_is_judged(recording, start):
    found = baselines_of([recording], [start], {})
    (part,) = found.parts
    assert part.bar_pose.times[0] == recording.bar_pose.times[0]
    inside = recording.bar_pose.times >= start
    spreads = {out.name: spread for out, (spread, _) in found.described.items()}
    for k, dof in enumerate(DOFS):
        expected = np.std(recording.bar_pose.values[inside, k])
        assert spreads[f"bar/pose/{dof}"] == pytest.approx(expected, rel=0.02)
