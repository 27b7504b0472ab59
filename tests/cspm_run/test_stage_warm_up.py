"""What runs need of compiled code is made by two processes before they begin."""

import multiprocessing
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor

import pytest
from numba import config
from run_samples import bundle_of

from cspm_run.stage_warm_up import compile_apart, is_compiled


def test_folders_and_other_kernels_are_not_a_compiled_plant(tmp_path, monkeypatch):
    """numba makes the folders when kernels are imported."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "kernels"))
    assert not is_compiled()
    (tmp_path / "kernels" / "kernels_1").mkdir(parents=True)
    (tmp_path / "kernels" / "kernels_1" / "plant.plant_tensions-1.py311.nbi").touch()
    assert not is_compiled()
    (tmp_path / "kernels" / "kernels_1" / "plant.plant_step-1.py311.nbi").touch()
    assert is_compiled()


@pytest.mark.compiled
def test_importing_and_bundling_do_not_count_as_compiled(tmp_path):
    """What a command does before it asks."""
    code = (
        "from cspm_run.library import find_scenario\n"
        "from cspm.commands.run_command import bundle_from\n"
        "from cspm_run.stage_warm_up import is_compiled\n"
        "bundle_from(find_scenario('rest'), [], None, 'sim')\n"
        "print(is_compiled())"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    found = subprocess.check_output([sys.executable, "-c", code], env=environment, text=True)
    assert found == "False\n"
    assert any(tmp_path.rglob("*.nbi"))


@pytest.mark.compiled
def test_plant_and_controllers_of_several_runs_are_compiled_apart():
    """Whatever the controllers of the second run are, nothing fails and nothing is returned."""
    bundles = [bundle_of("rest"), bundle_of("worst_case_past_thesis")]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert [each.result() for each in compile_apart(bundles, pool)] == [None, None]
