"""Thresholds that are given at the front door reach the diagnosis."""

import pytest

import cspm
import cspm.diagnosis as door
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, thresholds_of


def test_a_wrong_threshold_is_refused_before_anything_is_read():
    with pytest.raises(cspm.InputError, match="no material, allowed: material_share"):
        cspm.diagnose("nowhere", thresholds={"material": 0.1})


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("thresholds") / "bag"
    return cspm.simulate("one_winch", duration=0.1).save(folder)


@pytest.mark.compiled
@pytest.mark.parametrize("given", [None, {"material_share": 0.1}])
def test_thresholds_by_name_reach_the_search(given, recording, monkeypatch):
    seen = []

    class Stop(Exception):
        pass

    def search(*args, thresholds):
        seen.append(thresholds)
        raise Stop

    monkeypatch.setattr(door, "diagnose_measurements", search)
    with pytest.raises(Stop):
        cspm.diagnose(recording, thresholds=given)
    assert seen == [thresholds_of(given) if given else DEFAULT_THRESHOLDS]
