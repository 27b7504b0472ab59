"""The published data of EMPS, where they are there."""

from pathlib import Path

import numpy as np
import pytest
from run_samples import SCENARIOS

DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "emps"
TESTBED = SCENARIOS / "testbeds" / "emps.yaml"
MAPPING = SCENARIOS / "mappings" / "emps.yaml"
STATE = "/winches/state"
ESTIMATION, PULSES = "DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"
RADIUS = 0.01  # m, of the test-bed's drum
# Janot, Gautier and Brunot 2019: mass [kg], viscous [N·s/m], Coulomb [N], constant force [N].
PUBLISHED = np.array([95.1089, 203.5034, 20.3935, -3.1648])
recorded = pytest.mark.skipif(not DATA.is_dir(), reason="the EMPS recordings are not here")
