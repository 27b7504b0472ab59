from pathlib import Path

import pytest

from cspm_msgs_py.control_spec.distribution import TensionDistribution
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import (
    ClosedLoop,
    LockedWinches,
    Scenario,
    TorqueProfile,
    load_scenario,
    parse_scenario,
)
from cspm_msgs_py.yaml_file import dump_yaml, validate

LIBRARY = Path(__file__).resolve().parents[2] / "scenarios"
BASE = {"name": "s", "testbed": "t.yaml", "duration": 10.0}
RATES = ("winches", "load_cells", "motion_capture", "force_controller")


def read(**changes):
    return validate(Scenario, {**BASE, **changes}, "s.yaml")


FAULTS = [
    ({"duration": 0}, "duration: 0, allowed: greater than 0"),
    ({"duration": float("inf")}, "duration: inf, allowed: a finite number"),
    ({"duration": "10"}, "duration: '10', allowed: a number"),
    (
        {"duration": 1.0005},
        "duration: 1.0005 s, allowed: a whole number of the plant's periods of 1/1000 s",
    ),
    (
        {"duration": 1e-9},
        "duration: 1e-09 s, allowed: a whole number of the plant's periods of 1/1000 s",
    ),
    (
        {"events": [{"at": 10.0, "cut": "sway_3"}]},
        "events[0].at: 10 s, allowed: before the run's end at 10 s",
    ),
    (
        {"events": [{"at": 1.0, "cut": "a"}, {"at": 1.0005, "cut": "b"}]},
        "events[1].at: 1.0005 s, allowed: a whole number of the plant's periods of 1/1000 s",
    ),
    (
        {"events": [{"at": 1.0, "cut": "a"}, {"at": 2.0, "cut": "a"}]},
        "events[1].cut: a is cut twice, allowed: once",
    ),
    ({"events": [{"at": -1.0, "cut": "a"}]}, "events[0].at: -1.0, allowed: greater than or equal"),
    (
        {
            "control": {
                "mode": "closed_loop",
                "motion": {"law": "computed_wrench"},
                "tension_distribution": {"lost_cable": {}},
            }
        },
        "control: tension_distribution.lost_cable: with law computed_wrench, whose observer counts",
    ),
    (
        {
            "control": {
                "mode": "closed_loop",
                "tension_distribution": {
                    "method": "prescribed",
                    "null_space": [0.0, 0.0, 0.0],
                    "lost_cable": {},
                },
            }
        },
        "control.tension_distribution.lost_cable: with method prescribed, whose null_space is",
    ),
    (
        {"operation": [{"at": 1.0, "mode": "auto"}]},
        "operation[0].mode: 'auto', allowed: 'manual' or 'track'",
    ),
    (
        {"operation": [{"at": 1.005, "mode": "track"}]},
        "operation[0].at: 1.005 s, allowed: a multiple of 0.01 s",
    ),
    (
        {"operation": [{"at": 10.0, "mode": "track"}]},
        "operation[0].at: 10 s, allowed: before the run's end at 10 s",
    ),
    (
        {"operation": [{"at": 2.0, "mode": "manual"}, {"at": 2.0, "mode": "track"}]},
        "operation[1].at: 2 s, allowed: later than operation[0] at 2 s",
    ),
    (
        {"operation": [{"at": 2.0, "mode": "track"}], "target": {"source": "measured"}},
        "operation: with target.source measured, allowed: prescribed, or no operation",
    ),
    (
        {"target": {"source": "seen"}},
        "target.source: 'seen', allowed: 'prescribed', 'measured' or 'external'",
    ),
    ({"target": {"bandwidth": 0.0}}, "target.bandwidth: 0.0, allowed: greater than 0"),
    (
        {
            "target": {"source": "measured"},
            "control": {
                "mode": "closed_loop",
                "motion": {"law": "computed_wrench", "governor": {}},
            },
        },
        "target.source: measured with a governor, which plans with the target's motion to come",
    ),
    ({"seed": -1}, "seed: -1, allowed: greater than or equal to 0"),
    ({"seed": 1.5}, "seed: 1.5, allowed: a whole number without decimal point"),
    ({"seed": True}, "seed: True, allowed: a whole number without decimal point"),
    ({"testbed": None}, "testbed: None, allowed: text"),
    ({"sede": 1}, "sede: unknown key, allowed: name, description, testbed, duration, seed, rates"),
    ({"sensors": "real"}, "sensors: 'real', allowed: 'testbed' or 'ideal'"),
    ({"rates": {"plant": 0}}, "rates.plant: 0, allowed: greater than 0"),
    (
        {"rates": {"plant": 300}},
        "rates.plant: 300 Hz, allowed: a rate whose period is a whole number of ns",
    ),
    (
        {"rates": {"motion_capture": 300}},
        "rates.motion_capture: 300 Hz does not divide the plant's 1000 Hz, allowed: a divisor of 1",
    ),
    (
        {"rates": {"force_controller": 2000}},
        "rates.force_controller: 2000 Hz does not divide the plant's 1000 Hz, allowed: a divisor o",
    ),
    ({"rates": {"camera": 100}}, "rates.camera: unknown key, allowed: plant, winches, load_cells"),
    (
        {"winch_frame": {"motion": {"type": "foo"}}},
        "winch_frame.motion.type: 'foo', allowed: 'still'",
    ),
    (
        {"target": {"motion": {}}},
        "target.motion.type: missing, allowed: 'still', 'jonswap', 'vessel'",
    ),
    ({"target": {"motion": 3}}, "target.motion: 3, allowed: a mapping of keys to values"),
    ({"target": {"mean_pose": [0] * 5}}, "target.mean_pose[5]: missing, a value is required"),
    ({"bar_offset": [0] * 7}, "bar_offset: [0, 0, 0, 0, 0, 0, 0], allowed: a list of at most 6"),
    (
        {"control": {"mode": "foo"}},
        "control.mode: 'foo', allowed: 'closed_loop', 'locked_winches', 'torque' or 'angle'",
    ),
    (
        {"control": {}},
        "control.mode: missing, allowed: 'closed_loop', 'locked_winches', 'torque' or 'angle'",
    ),
    ({"control": {"mode": "locked_winches", "x": 1}}, "control.x: unknown key, allowed: mode"),
    (
        {"control": {"mode": "torque", "torque": {"c": {"sines": [{"amplitude": 1}]}}}},
        "control.torque.c.sines[0].frequency: missing, a value is required",
    ),
    (
        {"control": {"mode": "torque", "torque": {"c": {"ofset": 1}}}},
        "control.torque.c.ofset: unknown key, allowed: offset, sines",
    ),
    (
        {"control": {"mode": "closed_loop", "motion": {"crossover": {"rol": 1}}}},
        "control.motion.crossover.rol: 'rol', allowed: 'surge', 'sway', 'heave', 'roll', 'pitch'",
    ),
    (
        {"control": {"mode": "closed_loop", "force": {"bandwidth": -1}}},
        "control.force.bandwidth: -1, allowed: greater than 0",
    ),
    (
        {"control": {"mode": "closed_loop", "tension_distribution": {"method": "best"}}},
        "control.tension_distribution.method: 'best', allowed: 'pseudo_inverse'",
    ),
    ({"requirement": {"position": 0}}, "requirement.position: 0, allowed: greater than 0"),
]


@pytest.mark.parametrize(("changes", "text"), FAULTS)
def test_each_fault_is_one_line(changes, text):
    with pytest.raises(InputError) as caught:
        read(**changes)
    line = str(caught.value)
    assert line.startswith(f"s.yaml: {text}")
    assert "\n" not in line


@pytest.mark.parametrize("key", ["name", "testbed", "duration"])
def test_what_has_no_default_is_required(key):
    content = {k: v for k, v in BASE.items() if k != key}
    with pytest.raises(InputError) as caught:
        parse_scenario(dump_yaml(content), "s.yaml")
    assert str(caught.value) == f"s.yaml: {key}: missing, a value is required"


@pytest.mark.parametrize("text", ["", "[1]", "a"])
def test_what_is_no_mapping_is_refused(text):
    with pytest.raises(InputError, match=r"^s\.yaml: .*, allowed: a mapping of keys to values$"):
        parse_scenario(text, "s.yaml")


@pytest.mark.parametrize(
    ("mode", "kind"),
    [("closed_loop", ClosedLoop), ("locked_winches", LockedWinches), ("torque", TorqueProfile)],
)
def test_each_mode_is_read(mode, kind):
    assert type(read(control={"mode": mode}).control) is kind


def test_defaults():
    scenario = read()
    assert scenario.seed == 1
    assert type(scenario.control) is ClosedLoop
    assert scenario.rates.plant == 1000
    assert scenario.requirement.position == 0.002
    assert scenario.requirement.angle == 0.004


@pytest.mark.parametrize("plant", [1000, 2000, 500])
@pytest.mark.parametrize("key", RATES)
def test_rates_that_divide_are_accepted(plant, key):
    slow = dict.fromkeys(type(read().rates).model_fields, 100) | {"plant": plant, key: plant // 5}
    assert getattr(read(rates=slow).rates, key) == plant // 5


@pytest.mark.parametrize("duration", [0.001, 0.3, 1.001, 200.0, 3600.0])
def test_whole_numbers_of_periods_are_accepted(duration):
    assert read(duration=duration).duration == duration


def test_the_bar_hangs_beside_its_target():
    scenario = read(
        target={"mean_pose": [1, 2, 3, 0.1, 0.2, 0.3]}, bar_offset=[0, 0, -0.2, 0, 0, 0.1]
    )
    assert scenario.bar_mean_pose == pytest.approx((1, 2, 2.8, 0.1, 0.2, 0.4), abs=1e-15)


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text(dump_yaml({**BASE, "target": {"mean_pose": [0, 0, 2, 0, 0, 0]}}))
    return file


def test_overrides_change_what_they_name_and_nothing_else(path):
    changed = load_scenario(
        path, ["seed=7", "rates.plant=2000", "control.mode=locked_winches", "duration=0.5"]
    )
    plain = load_scenario(path)
    assert changed.seed == 7
    assert changed.rates.plant == 2000
    assert changed.control == LockedWinches()
    same = {"seed": plain.seed, "rates": plain.rates, "duration": plain.duration}
    assert changed.model_copy(update={**same, "control": plain.control}) == plain


def test_another_mode_keeps_nothing_of_the_files(tmp_path):
    given = {"mode": "closed_loop", "tension_distribution": {"method": "qp"}}
    file = tmp_path / "s.yaml"
    file.write_text(dump_yaml({**BASE, "control": given}))
    assert load_scenario(file, ["control.mode=locked_winches"]).control == LockedWinches()
    same = load_scenario(file, ["control.mode=closed_loop"]).control
    assert same.tension_distribution.method == "qp"


@pytest.mark.parametrize(
    "name", ["calm", "rest", "worst_case", "worst_case_4m", "worst_case_literal"]
)
def test_what_reproduces_the_thesis_names_its_tension_distribution(name):
    control = load_scenario(LIBRARY / f"{name}.yaml").control
    assert control.tension_distribution == TensionDistribution(method="pseudo_inverse")


def test_a_later_override_wins(path):
    assert load_scenario(path, ["seed=7", "seed=8"]).seed == 8


@pytest.mark.parametrize("override", ["", "seed", "=3", ".=3", "a..b=3", "seed.=3"])
def test_what_is_no_override_is_refused(path, override):
    with pytest.raises(InputError) as caught:
        load_scenario(path, [override])
    assert str(caught.value) == f"--set {override}: allowed: key.path=value, such as seed=2"


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("seed=x", "{path}: seed: 'x', allowed: a whole number without decimal point"),
        ("seed=", "{path}: seed: None, allowed: a whole number without decimal point"),
        ("sede=1", "{path}: sede: unknown key, allowed: name, description, testbed"),
        ("rates.plan=1", "{path}: rates.plan: unknown key, allowed: plant, winches"),
        ("control.mode=foo", "{path}: control.mode: 'foo', allowed: 'closed_loop'"),
        ("name.first=1", "--set name.first=1: name is no mapping, allowed: keys inside one"),
        ("seed=[", "--set seed=[: line 1: not YAML: expected the node content"),
        ("name=a: b: c", "--set name=a: b: c: line 1: not YAML: mapping values are not allowed"),
    ],
)
def test_faulty_overrides_are_refused_in_one_line(path, override, text):
    with pytest.raises(InputError) as caught:
        load_scenario(path, [override])
    assert str(caught.value).startswith(text.format(path=path))
    assert "\n" not in str(caught.value)


def test_an_override_of_what_is_no_scenario(tmp_path):
    file = tmp_path / "list.yaml"
    file.write_text("[1]")
    with pytest.raises(InputError) as caught:
        load_scenario(file, ["seed=1"])
    line = "--set seed=1: the scenario is not a mapping of keys to values"
    assert str(caught.value) == line


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError) as caught:
        load_scenario(tmp_path / "none.yaml")
    assert str(caught.value) == f"{tmp_path / 'none.yaml'}: no such file, allowed: a YAML file"


def test_drives_take_torques_unless_a_closed_loop_says_otherwise():
    text = "name: a\ntestbed: t.yaml\nduration: 1.0\n"
    usual = parse_scenario(text, "a")
    assert usual.drive == "torque"
    # Recordings of before stay the same.
    assert "drive" not in usual.model_dump()
    wanted = parse_scenario(text + "drive: tension\n", "a")
    assert wanted.model_dump()["drive"] == "tension"
    locked = text + "drive: tension\ncontrol: {mode: locked_winches}\n"
    with pytest.raises(InputError, match=r"drive: tension with control\.mode locked_winches"):
        parse_scenario(locked, "a")
