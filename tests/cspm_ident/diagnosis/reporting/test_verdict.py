"""The verdict, and that no two statements of a report contradict each other."""

from dataclasses import replace

import pytest
from diagnosis_samples import NOISE, PLACE, diagnosis, held_out, judged, remainder
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from cspm.commands.diagnose_command import print_diagnosis
from cspm_ident.block_simulation import Input
from cspm_ident.diagnosis.finding import Rejection, Status
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.reporting.diagnosis_page import write_diagnosis_page
from cspm_ident.diagnosis.reporting.finding_statement import considered_words
from cspm_ident.diagnosis.reporting.verdict import SENTENCES, Verdict, diagnosis_data, verdict_of
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.validation.holdout_simulation import Output, SimulatedFit
from cspm_sim.effects import Channel


def with_left(named, *left):
    """A diagnosis whose residual leaves so much of each of its components."""
    fit = held_out(left[0].rms, left[0].measured) if left else held_out(NOISE)
    return replace(diagnosis(named=named), fit=(replace(fit, remainders=tuple(left)),))


@pytest.mark.parametrize(
    ("rms", "measured", "verdict"),
    [
        (NOISE, 0.15, Verdict.CONSISTENT),
        (4.0 * NOISE, 0.05, Verdict.UNKNOWN),
        (10.0 * NOISE, 0.15, Verdict.UNKNOWN),
        (4.0 * NOISE, 0.15, Verdict.CONSISTENT),  # 2.6 % of what was measured
        (NOISE, 2.0 * NOISE, Verdict.NOT_EXCITED),
    ],
)
def test_nothing_found_is_consistent_only_at_the_noise_and_where_it_would_show(
    rms, measured, verdict
):
    assert verdict_of(with_left(False, remainder(rms, measured))) is verdict


def test_nothing_judged_cannot_tell():
    assert verdict_of(with_left(False)) is Verdict.NOT_EXCITED
    unknown = remainder(NOISE)._replace(noise=float("nan"))
    assert verdict_of(with_left(False, unknown)) is Verdict.NOT_EXCITED


def test_what_is_left_is_reported_with_size_driver_and_time():
    found = with_left(False, remainder(20.0 * NOISE))
    (entry,) = diagnosis_data(found)["findings"]
    assert (entry["effect"], entry["elements"]) == ("unknown", [PLACE.element])
    assert entry["region"]["driver"] == "angle [rad]"
    for words in (
        "differs from the model by 20 mN·m, 20 times its noise and 13 % of what was measured",
        "50 % of the squares are a function of angle [rad]",
        "60 % of the squares lie between 3 and 4 s",
    ):
        assert words in entry["statement"]


@pytest.mark.parametrize(
    ("drive", "times", "verdict"),
    [
        (Input.WINCH, 11.0, Verdict.UNKNOWN),
        (Input.WINCH, 9.0, Verdict.CONSISTENT),
        (Input.CABLE, 447.0, Verdict.UNKNOWN),
        (Input.SHAFT, 447.0, Verdict.CONSISTENT),
        (Input.TORQUE, 447.0, Verdict.CONSISTENT),
    ],
)
def test_simulated_cables_and_bars_vote(drive, times, verdict):
    """Those from torques do not: they integrate noise twice. Nor do any without load cells."""
    pose = Output(drive, "bar/pose/sway", "m", "bar", Channel.WRENCH)
    fit = SimulatedFit(pose, 0.3, times * 1e-3, times * 1e-3, times * 1e-3, 1e-3)
    without = replace(with_left(False, remainder(NOISE)), simulated=(fit,))
    assert verdict_of(without) is Verdict.CONSISTENT
    (measured,) = without.searched
    found = replace(without, searched=(replace(measured, tension=measured.bar_pose),))
    data = diagnosis_data(found)
    assert verdict_of(found) is verdict
    statements = [each["statement"] for each in data["findings"]]
    assert [f"{times:.2g} times its noise" in each for each in statements] == (
        [True] if verdict is Verdict.UNKNOWN else []
    )


def test_what_a_free_function_describes_is_not_reported_twice():
    driver = (Driver(PLACE, "speed [rad/s]"), Gain(50.0, 1.0), 0.9)
    found = replace(
        diagnosis(named=False, unknown=[driver]),
        fit=(replace(held_out(NOISE), remainders=(remainder(20.0 * NOISE),)),),
    )
    assert verdict_of(found) is Verdict.UNKNOWN
    (entry,) = diagnosis_data(found)["findings"]
    assert "a function of speed" in entry["statement"]


def printed(found, data):
    console = Console(width=200, record=True, file=None, quiet=False)
    with console.capture() as taken:
        print_diagnosis(console, found, data, None)
    return taken.get()


@pytest.mark.parametrize("reason", Rejection)
def test_what_is_not_kept_is_reported_with_its_own_reason(reason, tmp_path):
    (finding,) = diagnosis().findings
    gone = replace(finding, status=Status.REJECTED, rejection=reason)
    assert finding.reason_not_kept == ""
    found = diagnosis(named=False, rejected=[gone])
    data = diagnosis_data(found)
    text = printed(found, data)
    assert f"not named, {considered_words(finding)}: {reason.value}\n" in text
    write_diagnosis_page(tmp_path / "page.html", found, data)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert f">{reason.value}</td>" in page
    for other in set(Rejection) - {reason}:
        assert other.value not in text
        assert other.value not in page


@given(
    named=st.booleans(),
    levels=st.lists(st.floats(0.3, 60.0), min_size=0, max_size=3),
    spreads=st.lists(st.floats(0.5, 500.0), min_size=3, max_size=3),
)
def test_no_two_statements_of_a_report_contradict_each_other(named, levels, spreads):
    """JSON, sentence and terminal agree on the verdict, and on what is at the noise."""
    left = [
        remainder(NOISE * level, NOISE * spread)
        for level, spread in zip(levels, spreads, strict=False)
    ]
    found = with_left(named, *left)
    data = diagnosis_data(found)
    verdict, text = verdict_of(found), printed(found, data)
    assert data["verdict"] == verdict.value
    assert f"verdict: {verdict.value}" in text
    (residual,) = data["residuals"]
    parts = [each["at_noise"] for each in residual["left"]]
    assert residual["at_noise"] == (all(parts) if parts else None)
    unknown = [each for each in data["findings"] if each["effect"] == "unknown"]
    if verdict is Verdict.CONSISTENT:
        assert residual["at_noise"] is True
        assert any(each["excited"] for each in residual["left"])
    if verdict in (Verdict.CONSISTENT, Verdict.NOT_EXCITED):
        assert not data["findings"]
        assert SENTENCES[verdict].split(":")[0] in text
    if not named:
        assert bool(unknown) is (residual["at_noise"] is False)
        assert (verdict is Verdict.UNKNOWN) is bool(unknown)
    for each in data["findings"]:
        assert ("That is the noise floor" in each["statement"]) <= (residual["at_noise"] is True)
    if residual["at_noise"] is False:
        assert "1 of 1 at their noise" not in text


@pytest.mark.parametrize(("raises", "verdict"), [(True, Verdict.UNKNOWN), (False, Verdict.EFFECT)])
def test_what_makes_another_residual_worse_is_not_named_and_nothing_is_consistent(raises, verdict):
    found = with_left(True, remainder(NOISE))
    (one,) = found.findings
    found = judged(found, [replace(one, raises=(PLACE,) * raises)])
    assert verdict_of(found) is verdict
    assert [each["reason"] for each in diagnosis_data(found)["considered"]] == [
        f"cannot tell: it raises held-out residuals of {PLACE.element}, so that it may stand for"
        " another cause"
    ] * raises
