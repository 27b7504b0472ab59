"""Faults of load cells: named alone, with an interval that holds what was planted."""

import pytest
import yaml

import cspm
from cspm_run.library import find_scenario

pytestmark = [pytest.mark.compiled, pytest.mark.slow]


@pytest.fixture(scope="module")
def two_winches(tmp_path_factory):
    """The rig of one winch twice, each with its own sines, so that two cells are neighbours."""
    return rig(tmp_path_factory.mktemp("rig"), 1.0, ("other",))


@pytest.fixture(scope="module")
def slow_winch(tmp_path_factory):
    """One winch up to 1 Hz: faster, a diagnosis takes what is late for noise that is fed back."""
    return rig(tmp_path_factory.mktemp("slow"), 0.1, ())


def rig(folder, pace, further):
    """The rig of one winch and further ones, sines with frequencies in proportion to a pace."""
    source = find_scenario("one_winch")
    content = yaml.safe_load(source.read_text(encoding="utf-8"))
    machine = yaml.safe_load((source.parent / content["testbed"]).read_text(encoding="utf-8"))
    (cable,), first = machine["cables"], content["control"]["torque"]["surge"]
    first["sines"] = [{**s, "frequency": pace * s["frequency"]} for s in first["sines"]]
    sines = [{**sine, "frequency": 0.7 * sine["frequency"]} for sine in first["sines"]]
    for name in further:
        machine["cables"].append({**cable, "name": name})
        content["control"]["torque"][name] = {"offset": 0.9, "sines": sines}
    content["testbed"] = "rig.yaml"
    for name, each in (("rig", machine), ("motion", content)):
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(each), encoding="utf-8")
    return cspm.load_scenario(folder / "motion.yaml")


def diagnosed(folder, scenario, *effects):
    """A rig with faults, each an effect, its element and its numbers, by its file without them."""
    machine = scenario.testbed
    for effect, element, numbers in effects:
        machine = machine.with_effect(effect, element, **numbers)
    run = cspm.simulate(scenario, testbed=machine, seed=3, duration=15.0)
    recording = run.save(folder / "recorded")
    return cspm.diagnose(recording, testbed=scenario.testbed, closed_loop=False)


def test_healthy_load_cells_have_no_fault(tmp_path, two_winches):
    found = diagnosed(tmp_path, two_winches)
    assert (found.verdict, found.findings) == ("consistent", ())


@pytest.mark.parametrize(
    ("effect", "numbers"),
    [("tension_drift", {"rate": 0.01}), ("tension_crosstalk", {"share": 0.02})],
    ids=["drift", "crosstalk"],
)
def test_a_fault_of_a_load_cell_is_named_alone(tmp_path, two_winches, effect, numbers):
    (finding,) = diagnosed(tmp_path, two_winches, (effect, "surge", numbers)).findings
    assert (finding.effect, list(finding.elements)) == (effect, ["surge"])
    for name, truth in numbers.items():
        low, high = finding.parameters[name].ci95
        assert low <= truth <= high


def test_a_low_pass_is_named_and_no_delay(tmp_path, slow_winch):
    (finding,) = diagnosed(
        tmp_path, slow_winch, ("tension_lag", "surge", {"time_constant": 0.02})
    ).findings
    assert (finding.effect, list(finding.elements)) == ("tension_lag", ["surge"])
    low, high = finding.parameters["time_constant"].ci95
    assert low <= 0.02 <= high
    assert "tension_delay" not in {each.effect for each in finding.alternatives}


def test_a_delay_is_no_low_pass(tmp_path, slow_winch):
    found = diagnosed(tmp_path, slow_winch, ("tension_delay", "surge", {"delay": 0.02}))
    named = {each.effect: each for each in found.findings}
    assert "tension_delay" in named
    others = {rival.effect for each in found.findings for rival in each.alternatives}
    assert "tension_lag" not in {*named, *others}
