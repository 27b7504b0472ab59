"""What runs need of compiled code is made by two processes before they begin."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import pytest
from numba import config
from run_samples import bundle_of

from cspm_run.stage_warm_up import compile_apart, is_compiled


def test_an_absent_cache_is_not_compiled(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "kernels"))
    assert not is_compiled()
    (tmp_path / "kernels").mkdir()
    assert is_compiled()


@pytest.mark.compiled
def test_plant_and_controllers_of_several_runs_are_compiled_apart():
    """Whatever the controllers of the second run are, nothing fails and nothing is returned."""
    bundles = [bundle_of("rest"), bundle_of("worst_case_past_thesis")]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert [each.result() for each in compile_apart(bundles, pool)] == [None, None]
