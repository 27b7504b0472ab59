"""Whether loops are stable together: by the analysis, by a run, and by gains that are designed."""

import json

import numpy as np
import pytest
import yaml
from run_samples import bundle_of
from swivel_platform import MIDDLE, NAMES, platform, platform_content, platform_scenario

import cspm
from cspm_control.design.gains import design_widest_gains
from cspm_control.stages.make import controlled_axes
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.scenario import PidGains, parse_scenario
from cspm_run.assembly import resolve
from cspm_run.recorded_run import run
from cspm_run.stability.limit_cycle import oscillation
from cspm_run.stability.loop_growth import Growth, loop_growth
from cspm_run.stability.run_warnings import limits_met, run_warnings, unstable_line

PLATFORM = platform()
DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def resolved(testbed=PLATFORM, **changes):
    text = json.dumps(platform_scenario(**changes))
    return resolve(parse_scenario(text, "test", []), testbed)


DEFAULT = resolved()


@pytest.fixture(scope="module")
def one_by_one():
    """The gains that the procedure gives each loop by itself."""
    control = DEFAULT.control
    found = design_widest_gains(
        PLATFORM,
        nominal_parameters(PLATFORM),
        MIDDLE,
        DOFS,
        dead_time=0.009,
        force_bandwidth=800.0,
        axes=controlled_axes(control),
    )
    return {dof: gains.model_dump() for dof, gains in found.items()}


@pytest.fixture(scope="module")
def files(one_by_one, tmp_path_factory):
    """A folder with the platform, its scenario, and the one with loops that are not stable."""
    folder = tmp_path_factory.mktemp("platform")
    motion = {"law": "pid", "design_pose": MIDDLE, "gains": one_by_one}
    unstable = platform_scenario(control={"mode": "closed_loop", "motion": motion})
    for name, content in (
        ("platform", platform_content()),
        ("stable", platform_scenario()),
        ("unstable", unstable),
    ):
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(content))
    return folder


def times(factor, gains):
    return {
        dof: each.model_copy(
            update={key: factor * getattr(each, key) for key in ("kp", "ki", "kd")}
        )
        for dof, each in gains.items()
    }


def growth_with(gains):
    motion = DEFAULT.control.motion.model_copy(update={"gains": gains})
    control = DEFAULT.control.model_copy(update={"motion": motion})
    return loop_growth(DEFAULT.model_copy(update={"control": control}), PLATFORM)


def test_gains_of_loops_that_are_unstable_together_are_designed_slower(one_by_one):
    gains = DEFAULT.control.motion.gains
    assert growth_with({dof: PidGains(**each) for dof, each in one_by_one.items()}).unstable
    assert not growth_with(gains).unstable
    assert not growth_with(times(2.0, gains)).unstable
    assert growth_with(times(8.0, gains)).unstable
    assert all(gains[dof].kp < one_by_one[dof]["kp"] for dof in DOFS)


def test_gains_of_a_scenario_stay_what_they_are(one_by_one):
    motion = {"law": "pid", "design_pose": MIDDLE, "gains": one_by_one}
    scenario = resolved(control={"mode": "closed_loop", "motion": motion})
    found = {dof: each.model_dump() for dof, each in scenario.control.motion.gains.items()}
    assert found == one_by_one


def test_negative_damping_that_the_model_cannot_tell_from_none_is_stable():
    assert Growth(0.6, 116.0).unstable
    assert Growth(0.01, 0.0).unstable
    assert not Growth(0.00086, 26.4).unstable
    assert not Growth(-0.1, 0.0).unstable
    assert not Growth(0.0, 0.0).unstable


def test_what_a_run_says_is_what_the_analysis_of_its_design_says(files):
    data = cspm.analyze_design(files / "unstable.yaml").data()
    bundle = bundle_of(files / "unstable.yaml")
    testbed = bundle.testbed.testbed
    for way, late in (("cascade", False), ("late", True)):
        rate, frequency = data["growth"][way].values()
        found = loop_growth(bundle.scenario, testbed, 1e-3 * late)
        assert found == pytest.approx((rate, frequency))
        line = unstable_line(bundle.scenario, testbed, late=late)
        assert f"a motion of {frequency:.4g} rad/s grows as exp({rate:.3g}·t), t in s;" in line
        assert line.endswith("`cspm analyze design` shows each loop")


@pytest.mark.parametrize(
    "changes",
    [
        {"control": {"mode": "locked_winches"}},
        {"control": {"mode": "closed_loop", "motion": {"law": "lqr", "design_pose": MIDDLE}}},
        {"rates": {"motion_controller": 100, "tension_distribution": 200}},
    ],
)
def test_loops_that_the_analysis_cannot_follow_are_not_judged(changes):
    assert loop_growth(resolved(**changes), PLATFORM) is None
    assert unstable_line(resolved(**changes), PLATFORM) is None


def test_own_controllers_are_not_judged(one_by_one):
    motion = {"law": "pid", "design_pose": MIDDLE, "gains": one_by_one}
    scenario = resolved(control={"mode": "closed_loop", "motion": motion})
    assert loop_growth(scenario, PLATFORM).unstable
    own = scenario.model_copy(update={"controllers": {"force_controller": None}})
    assert loop_growth(own, PLATFORM) is None


@pytest.mark.compiled
def test_a_run_says_before_and_after_it_what_is_not_stable(files, cspm, tmp_path):
    arguments = ("--no-record", "--json", "found.json")
    code, out, err = cspm("run", files / "unstable.yaml", *arguments)
    assert code == 0
    first = "warning: the control loops are not stable: at the design pose a motion of"
    assert err.startswith(first)
    assert err.count("\n") == 1
    told = [line for line in out.splitlines() if line.startswith("warning: ")]
    reported = json.loads((tmp_path / "found.json").read_text())["warnings"]
    assert [f"warning: {line}" for line in reported] == told
    unstable, cycle, met = told
    assert unstable.startswith(first)
    assert "limit cycle: the tension of " in cycle
    assert "limits met: " in met
    assert "a motor at its torque limit" in met


@pytest.mark.compiled
def test_a_run_with_designed_gains_warns_of_nothing(files, cspm, tmp_path):
    arguments = ("--no-record", "--json", "found.json")
    code, _, err = cspm("run", files / "stable.yaml", *arguments)
    assert (code, err) == (0, "")
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["warnings"] == []
    assert found["slack_share"] == 0.0
    assert found["tension"]["min"] > 4.0


@pytest.mark.compiled
def test_the_limit_cycle_has_about_the_frequency_of_the_motion_that_grows(files):
    bundle = bundle_of(files / "unstable.yaml")
    testbed = bundle.testbed.testbed
    result = run(bundle, None)
    found = oscillation(result.statistics.last_tensions, result.statistics.kept_period)
    growing = loop_growth(bundle.scenario, testbed)
    assert 2.0 * np.pi * found.frequency == pytest.approx(growing.frequency, rel=0.1)
    (line,) = [each for each in result.warnings if each.startswith("limit cycle")]
    assert f"of {NAMES[found.cable]} oscillates at {found.frequency:.3g} Hz" in line


def test_shares_below_a_hundredth_and_starts_are_not_noted():
    bundle = bundle_of("rest")
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    for steps, slack, noted in ((2000, 30, True), (2000, 10, False), (900, 300, False)):
        statistics = run(bundle, None, steps=1).statistics
        statistics.counts[:] = steps, slack, 0, 0
        line = limits_met(scenario, testbed, statistics)
        assert line == ("limits met: a cable slack 1.5% of the time" if noted else None)
        assert run_warnings(scenario, testbed, statistics) == ()
