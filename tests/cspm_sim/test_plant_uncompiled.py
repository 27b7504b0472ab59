"""The kernels as plain Python: the same numbers, so that coverage and debuggers see them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from uncompiled_child import trajectory

SCRIPT = """
import json, sys
sys.path.insert(0, "tests/support")
from uncompiled_child import trajectory
print(json.dumps(trajectory().tolist()))
"""


@pytest.mark.slow
def test_uncompiled_kernels_give_the_same_trajectory():
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=Path(__file__).resolve().parents[2],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    plain, compiled = np.array(json.loads(run.stdout)), trajectory()
    assert compiled[-8:].min() == 0.0
    assert compiled[-8:].max() > 1.0
    assert plain == pytest.approx(compiled, rel=1e-9, abs=1e-10)
