"""`cspm check-drivers`: what it holds drivers against, and what it refuses; no ROS is needed."""

import re
import sys

import pytest
from run_samples import SCENARIOS

from cspm.cli import main as cli
from cspm.commands.check_drivers_command import machine_of
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
        return err.removeprefix("cspm: ").removesuffix("\n")

    return call


class TestMachine:
    def test_a_scenario_brings_its_machine_rates_and_safe_state(self):
        machine = machine_of(None, "calm", ["safety.state=brake"])
        assert machine.testbed.name == "thesis"
        assert machine.scenario.rates.motion_capture == 1000
        assert (machine.commanded, machine.braked) == (True, True)
        locked = machine_of(None, "calm", ["control={mode: locked_winches}"])
        assert (locked.commanded, locked.braked) == (False, False)

    def test_a_testbed_alone_has_the_usual_rates(self):
        machine = machine_of(THESIS, None)
        rates = machine.scenario.rates
        assert (rates.winches, rates.load_cells, rates.motion_capture) == (1000, 1000, 100)
        assert (machine.commanded, machine.braked) == (True, False)

    def test_slower_sensors_of_a_testbed_alone_lower_the_rates(self, tmp_path):
        path = tmp_path / "slow.yaml"
        text = (SCENARIOS / "testbeds" / "one_winch.yaml").read_text(encoding="utf-8")
        path.write_text(re.sub(r"rate: .*1000.*", "rate: 500", text), encoding="utf-8")
        rates = machine_of(path, None).scenario.rates
        assert (rates.winches, rates.motion_capture, rates.plant) == (500, 100, 1000)
        assert machine_of(path, None, ["rates.winches=250"]).scenario.rates.winches == 250

    def test_one_of_both_is_to_be_given(self):
        both = r"^check-drivers: allowed: --testbed FILE or --scenario NAME, one of both$"
        for given in ((None, None), (THESIS, "calm")):
            with pytest.raises(InputError, match=both):
                machine_of(*given)


class TestRefusals:
    def test_unusable_arguments_end_in_one_line(self, refused):
        assert refused().startswith("check-drivers: allowed: --testbed FILE or ")
        assert refused("--scenario", "none").startswith("none: no such scenario, allowed: ")
        assert refused("--testbed", "none.yaml") == "none.yaml: no such file, allowed: a YAML file"
        assert refused("--scenario", "rest", "--for", "0.5") == "--for 0.5: allowed: 1 to 300 s"
        assert refused("--scenario", "rest", "--for", "nan") == "--for nan: allowed: 1 to 300 s"
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
        told = "--pull: standard input is no terminal, allowed: one, for its Enter key"
        assert refused("--scenario", "rest", "--pull", "all") == told

    def test_another_ros_is_refused(self, refused, monkeypatch):
        monkeypatch.setenv("ROS_DISTRO", "humble")
        told = refused("--scenario", "rest")
        assert told.startswith("check-drivers: ROS_DISTRO is humble, allowed: jazzy")
