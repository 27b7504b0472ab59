"""`cspm check-drivers`: what it holds drivers against, and what it refuses; no ROS is needed."""

import re
import sys

import pytest
from error_lines import said
from run_samples import SCENARIOS

from cspm.cli import main as cli
from cspm.drivers import machine_of
from cspm_msgs_py.errors import InputError

THESIS = SCENARIOS / "testbeds" / "thesis.yaml"


@pytest.fixture
def refused(monkeypatch, capsys):
    """Run the command, which must fail with one line on stderr; return the line."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["cspm", "check-drivers", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        out, err = capsys.readouterr()
        assert (caught.value.code, out, err.count("\n")) == (2, "", 1), err
        return said(err).removesuffix("\n")

    return call


class TestMachine:
    def test_a_scenario_brings_its_machine_rates_and_safe_state(self):
        machine = machine_of("calm", None, ["safety.state=brake"])
        assert machine.testbed.name == "thesis_refitted"
        assert machine.scenario.rates.motion_capture == 1000
        assert (machine.commanded, machine.braked) == (True, True)
        locked = machine_of("calm", None, ["control={mode: locked_winches}"])
        assert (locked.commanded, locked.braked) == (False, False)

    def test_a_testbed_alone_has_the_usual_rates(self):
        machine = machine_of(None, THESIS)
        rates = machine.scenario.rates
        assert (rates.winches, rates.load_cells, rates.motion_capture) == (1000, 1000, 100)
        assert (machine.commanded, machine.braked) == (True, False)

    def test_slower_sensors_of_a_testbed_alone_lower_the_rates(self, tmp_path):
        path = tmp_path / "slow.yaml"
        text = (SCENARIOS / "testbeds" / "one_winch.yaml").read_text(encoding="utf-8")
        path.write_text(re.sub(r"rate: .*1000.*", "rate: 500", text), encoding="utf-8")
        rates = machine_of(None, path).scenario.rates
        assert (rates.winches, rates.motion_capture, rates.plant) == (500, 100, 1000)
        assert machine_of(None, path, ["rates.winches=250"]).scenario.rates.winches == 250

    def test_one_of_both_is_to_be_given(self):
        both = "^check-drivers: allowed: a scenario or a test-bed, one of both$"
        for given in ((None, None), ("calm", THESIS)):
            with pytest.raises(InputError, match=both):
                machine_of(*given)


class TestRefusals:
    def test_unusable_arguments_end_in_one_line(self, refused):
        assert refused().startswith("allowed: a scenario or a test-bed")
        assert refused("--scenario", "none").startswith("none: no such scenario, allowed: ")
        assert (
            refused("--testbed", "none.yaml") == "none.yaml: no such file, allowed: a test-bed file"
        )
        for time in ("0.5", "nan"):
            line = f"listening for {time} s: allowed: 1 to 300 s"
            assert refused("--scenario", "rest", "--for", time) == line
        assert refused("--scenario", "rest", "--set", "rates.winches=30").startswith(
            f"{SCENARIOS / 'rest.yaml'}: rates.winches: 30 Hz "
        )
        assert refused("--scenario", "rest", "--pull", "hoist").startswith(
            "--pull hoist: no such cable, allowed: all, hoist_1, hoist_2, "
        )
        assert refused("--scenario", "rest", "--json", "no/where.json").startswith("--json ")

    def test_an_unknown_effect_names_the_file(self, refused, tmp_path):
        path = tmp_path / "lab.yaml"
        effect = "effects: [{effect: winch_magic, elements: [], parameters: {}}]"
        text = THESIS.read_text(encoding="utf-8")
        path.write_text(re.sub(r"\neffects:(.|\n)*", f"\n{effect}\n", text), encoding="utf-8")
        assert refused("--testbed", path).startswith(f"{path}: ")

    def test_a_pull_needs_a_terminal(self, refused):
        reported = "--pull: standard input is no terminal, allowed: one, for its Enter key"
        assert refused("--scenario", "rest", "--pull", "all") == reported

    def test_another_ros_is_refused(self, refused, monkeypatch):
        monkeypatch.setenv("ROS_DISTRO", "humble")
        reported = refused("--scenario", "rest")
        assert reported.startswith("ROS_DISTRO is humble, allowed: jazzy")
