import dataclasses
import io
import json

import numpy as np
import pytest
from error_lines import said
from machines import THESIS
from rich.console import Console
from run_samples import PLUCKED_IN_SURGE
from system_samples import TRUE, record_other

from cspm.commands.identify_system_command import print_system
from cspm.plots.system_figure import draw_system
from cspm_ident.estimation import Prior
from cspm_ident.system.choice import DEFAULT, choose
from cspm_ident.system.fitted_file import fitted_testbed
from cspm_ident.system.identification import identify_system, solve
from cspm_ident.system.machine import machine_with
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.testbed import load_testbed, parse_testbed

FILE = load_testbed(THESIS)
MACHINE = FILE.testbed
# In the recordings nothing but surge moves, so nothing says how sway is damped.
UNSEEN = "bar_damping.sway"


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    folder = tmp_path_factory.mktemp("system")
    searched = record_other(folder / "searched", "factor_six_mid", "duration=13", "seed=3")
    held_out = record_other(
        folder / "held_out",
        *("verification_mid", "duration=12", "seed=4", PLUCKED_IN_SURGE),
        plant="sim",
    )
    return searched, held_out


@pytest.fixture(scope="module")
def result(recordings):
    searched, held_out = recordings
    chosen = choose(MACHINE, [*TRUE, UNSEEN])
    return identify_system([searched], chosen, held_out=[held_out], most_windows=2)


@pytest.mark.slow
def test_what_another_plant_was_given_is_found(result):
    """Within 3 %: far less than the change, far more than what the two plants differ by."""
    estimate = result.solution.estimate
    assert result.settled
    for name, true in TRUE.items():
        nominal = next(each.nominal for each in result.chosen if each.name == name)
        assert abs(estimate.value(name) - true) < 0.03 * true < 0.5 * abs(nominal - true), name
        low, high = estimate.interval(name)
        assert low < estimate.value(name) < high


@pytest.mark.slow
def test_a_machine_whose_winches_stand_in_the_world_is_fitted(tmp_path):
    """A platform on six stiff cables: nothing measures a winch frame, since there is none.

    Its winches vibrate, since they are controlled by noisy poses. That is no noise of their speed.
    """
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    true = {"bar.mass": 33.0, "axial_damping": 1.0, "bar_damping.surge": 9.0}
    damping = "{effect: bar_linear_damping, parameters: {surge: 9.0, sway: 0.0, heave: 0.0,"
    changes = {
        "mass: {value: 30.0,": "mass: {value: 33.0,",
        "sensors:": f"effects:\n  - {damping} roll: 0.0, pitch: 0.0, yaw: 0.0}}}}\nsensors:",
    }
    recorded = record_other(tmp_path / "crane", "robocrane", "duration=9", changes=changes)
    assert recorded.frame_pose is None
    chosen = choose(recorded.machine, list(true))
    estimate = solve([recorded], chosen, most_windows=1).solution.estimate
    for name, value in true.items():
        low, high = estimate.interval(name)
        assert low <= value <= high < 1.05 * value, name


@pytest.mark.slow
def test_what_does_not_move_is_named(result):
    estimate = result.solution.estimate
    assert [direction.name for direction in estimate.unexcited] == [UNSEEN]
    assert estimate.interval(UNSEEN) == (-np.inf, np.inf)


@pytest.mark.slow
def test_a_recording_held_out_is_predicted_better(result):
    searched, held_out = result.judgements
    assert (searched.held_out, held_out.held_out) == (False, True)
    for each in (searched, held_out):
        assert each.vaf["fitted"]["surge"] > 99.5
        assert 100 - each.vaf["nominal"]["surge"] > 5 * (100 - each.vaf["fitted"]["surge"])
        assert each.vaf["fitted"]["sway"] is None


@pytest.mark.slow
def test_the_file_is_a_machine_with_provenance(result):
    fitted = fitted_testbed(result, FILE, "t.yaml")
    mass = result.solution.estimate.value("bar.mass")
    assert fitted.testbed.bar.mass == pytest.approx(mass, rel=1e-7)
    about = fitted.provenance["bar.mass"]
    assert about.provenance == "fitted"
    assert about.recording == result.searched[0].sha256
    assert about.interval[0] < mass < about.interval[1]
    assert about.window == (0.0, pytest.approx(result.searched[0].duration))
    roll, added = fitted.testbed.effects
    assert roll.parameters["roll"] == 0.0074
    assert roll.parameters["surge"] == pytest.approx(1.5, rel=0.03)
    assert roll.parameters["sway"] == 0.0  # not excited, so not written
    assert added.effect == "cable_axial_damping"
    assert "# The thesis's test-bed." in fitted.text
    assert parse_testbed(fitted.text, "again").testbed == fitted.testbed


@pytest.mark.slow
def test_recordings_are_not_both_searched_and_held_out(recordings):
    searched, _ = recordings
    with pytest.raises(
        InputError, match=r"is already used for the search, allowed: another recording"
    ):
        identify_system([searched], choose(MACHINE), held_out=[searched])
    with pytest.raises(InputError, match=r"^--horizon 0: allowed: 0.1 to 60 s$"):
        identify_system([searched], choose(MACHINE), horizon=0.0)


@pytest.mark.slow
def test_a_late_motion_capture_is_found_and_taken_out(recordings):
    """Bar poses stamped 20 ms late, and early; left in, the damping is far off."""
    searched, _ = recordings
    chosen = choose(MACHINE, list(TRUE))
    for late in (0.02, -0.02):
        shifted = dataclasses.replace(searched, bar_pose=searched.bar_pose.shifted(late))
        found = solve([shifted], chosen, most_windows=2)
        delays = found.shootings[0].timeline.delays
        assert delays == {"/bar/pose": pytest.approx(late, abs=1.5e-3)}
        for name in ("axial_damping", "bar_damping.surge"):
            assert abs(found.solution.estimate.value(name) - TRUE[name]) < 0.03 * TRUE[name], name
    left_in = solve([shifted], chosen, most_windows=2, delays={})
    for name in ("axial_damping", "bar_damping.surge"):
        assert abs(left_in.solution.estimate.value(name) - TRUE[name]) > 0.05 * TRUE[name], name


@pytest.mark.slow
def test_a_prior_holds_and_a_profile_agrees_with_the_interval(cspm, recordings, tmp_path):
    """Through the command: a scale that says 4.2 kg ± 1 g outweighs what the motion says."""
    searched, _ = recordings
    fit = ["--fit", "bar.mass", "--fit", "bar_damping.surge"]
    words = ["--testbed", THESIS, *fit, "--horizon", "6"]
    known = ["--prior", "bar.mass=4.2±0.00001", "--profile", "bar_damping.surge"]
    written = ["--json", "found.json", "--out", "fitted"]
    code, _, err = cspm("identify", "system", searched.path, *words, *known, *written)
    assert (code, err) == (0, "")
    data = json.loads((tmp_path / "found.json").read_text())
    mass, surge = data["estimate"]["parameters"]
    assert mass["value"] == pytest.approx(4.2, abs=1e-3)
    assert mass["value"] != pytest.approx(TRUE["bar.mass"], abs=0.01)
    (profile,) = data["profiles"]
    low, high = profile["ci95"]
    assert profile["name"] == "bar_damping.surge"
    assert low < surge["value"] < high
    assert min(profile["deviance"]) == 0.0
    width = surge["ci95"][1] - surge["ci95"][0]
    assert 0.3 * width < high - low < 3.0 * width
    # The fitted file runs as it is.
    words = ["run", "rest", "--duration", "0.1", "--out", "again", "--testbed"]
    assert cspm(*words, "fitted/fitted_testbed.yaml")[::2] == (0, "")
    with Recording(tmp_path / "again") as recording:
        file = parse_testbed(recording.attachments["testbed.yaml"].decode(), "again")
    assert file.testbed.bar.mass == pytest.approx(mass["value"], rel=1e-7)
    assert file.provenance["bar.mass"].recording == searched.sha256


def test_values_go_where_the_names_say():
    names = ["bar.com.y", "bar.inertia", "stiffness.sway", "transverse_damping.hoist_2"]
    names += ["bar_damping.roll", "frame_offset.yaw"]
    chosen = choose(MACHINE, names)
    assert [each.nominal for each in chosen] == [0.0, 1.0, 1.0, 0.0, 0.0074, 0.0]
    assert machine_with(MACHINE, choose(MACHINE), [c.nominal for c in choose(MACHINE)]).bar == (
        MACHINE.bar
    )
    found = machine_with(MACHINE, chosen, [0.01, 2.0, 1.1, 0.5, 0.02, 0.003])
    assert found.bar.com == (0.0, 0.01, 0.0)
    assert found.bar.inertia.izz == 2.0 * MACHINE.bar.inertia.izz
    roll, stiff, across, frame = found.effects
    assert roll.parameters["roll"] == 0.02
    assert stiff.elements == ("sway_1", "sway_2", "sway_3", "sway_4")
    assert stiff.parameters == {"scale": 1.1}
    assert (across.elements, across.parameters) == (("hoist_2",), {"coefficient": 0.5})
    assert frame.parameters["yaw"] == 0.003
    assert MACHINE.effects[0].parameters["roll"] == 0.0074


def test_knowledge_goes_to_its_parameter():
    chosen = choose(
        MACHINE, (), {"stiffness": 0.9, "bar.mass": None}, {"bar.inertia": Prior(1.0, 0.1)}
    )
    assert [each.name for each in chosen] == list(DEFAULT)
    by_name = {each.name: each for each in chosen}
    assert by_name["stiffness"].parameter.frozen
    assert by_name["stiffness"].nominal == 0.9
    assert by_name["bar.mass"].parameter.frozen
    assert by_name["bar.mass"].nominal == 4.06
    assert not by_name["bar.com.x"].parameter.frozen


@pytest.mark.parametrize(
    ("names", "frozen", "text"),
    [
        (["bar.weight"], {}, r"^--fit bar.weight: allowed: bar.mass, bar.com.x, .*frame_offset"),
        (["stiffness.rope"], {}, r"^--fit stiffness.rope: allowed: .*stiffness\[.hoist\|.surge"),
        (["bar_damping"], {}, r"^--fit bar_damping: allowed: .*bar_damping.surge"),
        (["bar.mass", "bar.mass"], {}, r"^--fit bar.mass: occurs twice, allowed: each name once$"),
        (["bar.mass"], {"bar.weight": 4.0}, r"^--freeze bar.weight: allowed: bar.mass, bar.com.x"),
        (["bar.mass"], {"bar.mass": 900.0}, r"^bar.mass: 900 kg, allowed: 0.406 to 40.6$"),
    ],
)
def test_bad_choices_are_one_line(names, frozen, text):
    with pytest.raises(InputError, match=text) as caught:
        choose(MACHINE, names, frozen)
    assert "\n" not in str(caught.value)


def test_a_prior_needs_a_parameter():
    with pytest.raises(InputError, match=r"^--prior stiffness: is not fitted, allowed: bar.mass$"):
        choose(MACHINE, ["bar.mass"], {}, {"stiffness": Prior(1.0, 0.1)})


def test_bounds_are_kept_within_the_usual_ones():
    names = ["bar.mass", "stiffness"]
    mass, stiffness = choose(MACHINE, names, bounds={"bar.mass": (4.0, 4.3)})
    assert (mass.parameter.lower, mass.parameter.upper) == (4.0, 4.3)
    assert (stiffness.parameter.lower, stiffness.parameter.upper) == (0.2, 5.0)
    for bounds, text in (
        ({"bar.mass": (4.3, 4.0)}, r"^--bound bar.mass=4.3:4: allowed: rising, 0.406 to 40.6 kg$"),
        ({"bar.mass": (0.0, 5.0)}, r"^--bound bar.mass=0:5: allowed: rising, 0.406 to 40.6 kg$"),
        ({"bar.mass": (4.2, 5.0)}, r"^bar.mass: 4.06 kg, allowed: 4.2 to 5$"),
        ({"bar.com.x": (0, 1)}, r"^--bound bar.com.x: is not fitted, allowed: bar.mass, stiffness"),
    ):
        with pytest.raises(InputError, match=text):
            choose(MACHINE, names, bounds=bounds)


def test_a_rig_without_bar_is_refused():
    rig = load_testbed(THESIS.parent / "rig_hoist.yaml").testbed
    with pytest.raises(InputError, match=r"has no bar, allowed: a machine with one"):
        choose(rig)


@pytest.mark.slow
def test_the_command_prints_what_was_found(result, tmp_path):
    console = Console(width=160, record=True, file=io.StringIO())
    print_system(console, result)
    text = console.export_text()
    assert f"not excited: {UNSEEN}; its values are no result" in text
    assert "held_out, held out" in text
    row = next(line.split() for line in text.splitlines() if "bar.mass" in line)
    assert row[:3] == ["bar.mass", "kg", "4.06"]
    assert float(row[3]) == pytest.approx(result.solution.estimate.value("bar.mass"), rel=1e-4)
    assert json.loads(json.dumps(result.data(), allow_nan=False))["windows"]
    draw_system(tmp_path / "system.png", result.judgements)
    assert (tmp_path / "system.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--prior", "bar.mass=4"], "--prior bar.mass=4: allowed: NAME=MEAN±SD"),
        (["--freeze", "bar.mass=x"], "--freeze bar.mass=x: allowed: NAME or NAME=VALUE"),
        (["--bound", "bar.mass=4"], "--bound bar.mass=4: allowed: NAME=LOW:HIGH"),
        (["--out", "."], ".: already exists, allowed: a new folder"),
    ],
)
def test_wrong_options_are_one_line(cspm, tmp_path, words, text):
    assert cspm("identify", "system", str(tmp_path), "--quiet", *words) == (
        2,
        "",
        f"cspm identify system: {text}\n",
    )


@pytest.mark.slow
def test_a_scenario_runs_on_another_machine(cspm, tmp_path):
    text = FILE.text.replace("mass: {value: 4.06,", "mass: {value: 4.35,")
    (tmp_path / "heavy.yaml").write_text(text, encoding="utf-8")
    words = ["run", "rest", "--duration", "0.1", "--out", "bag", "--testbed"]
    code, _, line = cspm(*words, "heavy.yaml")
    assert (code, line) == (0, "")
    with Recording(tmp_path / "bag") as recording:
        assert recording.attachments["testbed.yaml"].decode() == text
    code, _, line = cspm("run", "rest", "--no-record", "--testbed", "missing.yaml")
    assert code == 2
    assert said(line).startswith("missing.yaml: ")
    assert line.count("\n") == 1
