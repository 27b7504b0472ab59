"""A plucked bar that has come to rest in what is held out."""

import pytest

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.blind.concealed_run import believed, record_concealed
from bench.blind.reality.reality import conceal
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.signals.measurement import read_measurement

SEED, DURATION_S, DRAG = 4, 60.0, 36.0


@pytest.mark.slow
@pytest.mark.compiled
def test_what_held_out_data_at_rest_cannot_confirm_is_told_with_that(tmp_path):
    bundle = believed("verification_mid", DURATION_S, SEED)
    reality = conceal(bundle.testbed.testbed, {"air": [DRAG]}, 0.0, SEED)
    folder = tmp_path / "plucked"
    record_concealed(bundle, reality, folder, note="", without=(), progress=lambda now: None)
    found = diagnosis_data(diagnose([read_measurement(folder)]))
    (finding,) = found["findings"]
    assert (finding["effect"], found["verdict"]) == ("bar_quadratic_drag", "effect")
    surge = next(each for each in finding["parameters"] if each["name"] == "surge")
    assert surge["value"] == pytest.approx(DRAG, rel=0.05)
    assert finding["statement"].endswith(
        "What was not searched moves so little that it shows little of it."
    )
