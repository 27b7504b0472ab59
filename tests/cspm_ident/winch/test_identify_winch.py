"""`cspm identify winch` on a recording of another plant, on EMPS, and what it writes."""

import dataclasses
import json

import numpy as np
import pytest
from emps_samples import DATA, ESTIMATION, MAPPING, PUBLISHED, PULSES, TESTBED, recorded
from error_lines import said
from machines import THESIS
from matplotlib.image import imread
from run_samples import SCENARIOS, bundle_of
from winch_samples import EFFECTS, Winch, closed_loop

from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_ident.winch import identify_winch
from cspm_ident.winch.fitted_file import fitted_testbed
from cspm_ident.winch.identified_winch import IdentifiedWinch, WinchesResult
from cspm_ident.winch.identify_winches import described_equation, identify_winches
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed, parse_testbed
from cspm_run.recorded_run import run

FRICTION = """
effects:
  - effect: winch_viscous_friction
    parameters: {coefficient: 0.003}
  - effect: winch_coulomb_friction
    elements: [surge]
    parameters: {torque: 0.012}
"""
# Of one_winch.yaml and of FRICTION: inertia, viscous, Coulomb, offset.
TRUTH = np.array([2.4e-4, 0.003, 0.012, 0.0])
PUBLISHED_FORCE_ERROR = 5.9824  # %, with pulses


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """One winch with friction on the MuJoCo plant; said to be one without."""
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    folder = tmp_path_factory.mktemp("winch") / "bag"
    bundle = bundle_of("one_winch", "duration=12")
    rough = parse_testbed(bundle.testbed.text + FRICTION, "rough")
    assert not run(
        dataclasses.replace(bundle, testbed=rough, plant="mujoco"), folder, lambda now: None
    ).failure
    return folder


@pytest.fixture(scope="module")
def measured(bag):
    return read_measurement(bag, SCENARIOS / "testbeds" / "one_winch.yaml")


def inside(estimate):
    return (estimate.ci95[:, 0] <= TRUTH) & (estimate.ci95[:, 1] >= TRUTH)


@pytest.mark.slow
def test_another_plants_winch_lies_within_the_intervals(measured):
    age = measured.torque_age
    assert age == pytest.approx(0.5e-3)
    found = identify_winches([measured], torque_age=age, reversals=False).winches[0]
    estimate = found.fit.estimate
    assert inside(estimate).all(), estimate
    assert np.all(estimate.sd[:3] < 0.012 * TRUTH[:3])
    assert found.described == dict(zip(estimate.names, [2.4e-4, 0.0, 0.0, 0.0], strict=True))
    errors = found.judgements[0].errors
    assert errors["fitted"].percent < 0.5 * errors["described"].percent


@pytest.mark.slow
def test_where_friction_sticks_the_windows_disagree_and_it_is_reported(measured):
    age = measured.torque_age
    with_them = identify_winches([measured], torque_age=age, reversals=True).winches[0]
    assert not inside(with_them.fit.estimate)[0]
    assert "inertia" in with_them.torn
    without = identify_winches([measured], torque_age=age).winches[0]
    assert (without.reversals, inside(without.fit.estimate).all()) == (False, True)
    smooth = identify_winches([measured], ["surge"], ["winch_viscous_friction"], torque_age=5e-4)
    assert smooth.winches[0].otherwise is not None


@pytest.mark.slow
def test_the_torque_is_older_than_its_stamp(measured):
    """With the age's sign turned the shaft seems to brake less than it does."""
    wrong = identify_winches([measured], torque_age=-measured.torque_age, reversals=False)
    viscous = wrong.winches[0].fit.estimate.interval("winch_viscous_friction coefficient")
    assert viscous[1] < TRUTH[1]


@pytest.mark.slow
def test_the_fitted_file_runs_and_predicts_a_second_recording(cspm, bag, tmp_path):
    clean = SCENARIOS / "testbeds" / "one_winch.yaml"
    words = ["--testbed", clean, "--without-reversals", "--out", "fitted", "--json", "found.json"]
    code, out, err = cspm("identify", "winch", bag, *words)
    assert (code, err) == (0, "")
    assert "torque taken to act 0.5 ms before its stamp" in out
    winch = json.loads((tmp_path / "found.json").read_text())["winches"][0]
    values = {each["name"]: each for each in winch["estimate"]["parameters"]}
    assert f"{values['inertia']['value']:.5g}" in out
    assert imread(tmp_path / "fitted" / "winch_surge.png").std() > 0.05
    fitted = load_testbed(tmp_path / "fitted" / "fitted_testbed.yaml")
    about = fitted.provenance["cables[0].rotor_inertia"]
    assert about.recording == read_measurement(bag).sha256
    assert about.interval == pytest.approx(tuple(values["inertia"]["ci95"]), rel=1e-6)
    words = ["--set", "seed=9", "--duration", "3", "--out", "again"]
    assert cspm("run", "one_winch", "--testbed", "fitted/fitted_testbed.yaml", *words)[0] == 0
    code, _, err = cspm("identify", "winch", bag, "--held-out", "again", "--testbed", clean)
    assert (code, err) == (0, "")
    code, _, err = cspm("identify", "winch", bag, "--held-out", "again")
    assert code == 2
    assert said(err).startswith("again: another test-bed than ")


@recorded
@pytest.mark.slow
def test_the_command_on_emps(cspm, tmp_path):
    for name in (ESTIMATION, PULSES):
        words = ["--mapping", MAPPING, "--testbed", TESTBED, "--out", name.removesuffix(".mat")]
        assert cspm("import", DATA / name, *words)[0] == 0
    words = ["--held-out", "DATA_EMPS_PULSES", "--json", "emps.json", "--out", "fitted"]
    code, out, err = cspm("identify", "winch", "DATA_EMPS", *words)
    assert (code, err) == (0, "")
    assert "torque taken to act 0 ms before its stamp" in out
    assert "in which the shaft reverses" not in out
    assert "no result" not in out
    winch = json.loads((tmp_path / "emps.json").read_text())["winches"][0]
    values = np.array([each["value"] for each in winch["estimate"]["parameters"]])
    # From the shaft to the carriage; the effect's torque helps, hence the sign.
    np.testing.assert_allclose(values * [1e4, 1e4, 1e2, -1e2], PUBLISHED, rtol=0.015)
    searched, held_out = (each["torque_error_percent"] for each in winch["judgements"])
    assert searched["fitted"] < 4.0834
    assert held_out["fitted"] < PUBLISHED_FORCE_ERROR
    assert held_out["described"] > held_out["fitted"]
    assert load_testbed(tmp_path / "fitted" / "fitted_testbed.yaml").testbed.effects[2].elements
    words = ["--testbed", "fitted/fitted_testbed.yaml", "--duration", "1", "--no-record"]
    assert cspm("run", "emps", *words)[0] == 0


MADE = Winch()


def result_for(names, winch=MADE):
    """Two winches of the thesis's machine, said to have been recorded; simulated by other code."""
    fit = identify_winch([closed_loop(winch, 3000, torque_noise=0.005, seed=8)], EFFECTS)
    file = load_testbed(THESIS)
    measurement = Measurement(THESIS, "ab" * 32, file)
    winches = (IdentifiedWinch(name, 0.01, {}, fit, None, ()) for name in names)
    return WinchesResult(tuple(winches), (measurement,), 40.0, 0.0)


def test_the_file_keeps_what_other_winches_have():
    """`hoist_2` takes the inertia from `hoist_1`, and one entry of friction is that of all."""
    shared = "effects:\n  - effect: winch_viscous_friction\n    parameters: {coefficient: 0.01}\n"
    given = "  - effect: winch_inertia\n    elements: [hoist_1]\n    parameters: {inertia: 0.1}\n"
    file = parse_testbed(
        load_testbed(THESIS).text.replace("effects:\n", shared + given, 1), "t.yaml"
    )
    result = result_for(["hoist_1"])
    fitted = fitted_testbed(result, file, "t.yaml")
    before, after = file.testbed.cables, fitted.testbed.cables
    found = result.winches[0].fit.estimate
    assert after[0].rotor_inertia == pytest.approx(found.value("inertia"), rel=1e-7)
    assert [c.rotor_inertia for c in after[1:]] == [c.rotor_inertia for c in before[1:]]
    assert not [e for e in fitted.testbed.effects if e.effect == "winch_inertia"]
    for name in before[0].name, before[1].name:
        _, effects = described_equation(fitted.testbed, name, EFFECTS)
        viscous = effects["winch_viscous_friction"]["coefficient"]
        mine = found.value("winch_viscous_friction coefficient")
        assert viscous == pytest.approx(mine if name == "hoist_1" else 0.01, rel=1e-7)
    again = fitted_testbed(result, fitted, "t.yaml")
    assert again.testbed == fitted.testbed
    assert "# The thesis's test-bed." in fitted.text


def test_a_friction_that_drives_is_no_machine():
    result = result_for(["hoist_1"], MADE._replace(viscous=-2e-3))
    with pytest.raises(InputError, match=r"^t.yaml: .*winch_viscous_friction.*coefficient") as said:
        fitted_testbed(result, load_testbed(THESIS), "t.yaml")
    assert "\n" not in str(said.value)


def test_effects_of_a_winch_add_up():
    text = load_testbed(THESIS).text.replace(
        "effects:\n",
        "effects:\n  - effect: winch_coulomb_friction\n    parameters: {torque: 0.01}\n"
        "  - effect: winch_coulomb_friction\n    elements: [sway_1]\n"
        "    parameters: {torque: 0.02}\n",
        1,
    )
    machine = parse_testbed(text, "t.yaml").testbed
    for name, torque in (("sway_1", 0.03), ("sway_2", 0.01)):
        inertia, effects = described_equation(machine, name, EFFECTS)
        assert effects["winch_coulomb_friction"]["torque"] == pytest.approx(torque)
        assert effects["winch_torque_offset"]["torque"] == 0.0
        assert inertia == next(c.rotor_inertia for c in machine.cables if c.name == name)


UNBALANCED = """
effects:
  - {effect: winch_unbalance, parameters: {cosine: 0.02, sine: -0.015, order: 1}}
  - {effect: winch_inertia, parameters: {inertia: 6.0e-5}}
  - {effect: winch_coulomb_friction, parameters: {torque: 0.012}}
"""


@pytest.mark.compiled
def test_what_the_file_has_beside_the_fitted_is_no_part_of_them(tmp_path):
    bundle = bundle_of("one_winch", "duration=8")
    own = parse_testbed(bundle.testbed.text + UNBALANCED, "unbalanced")
    run(dataclasses.replace(bundle, testbed=own), tmp_path / "run", lambda now: None)
    known = read_measurement(tmp_path / "run")
    bare = known.with_machine(own.testbed.model_copy(update={"effects": own.testbed.effects[1:]}))
    found, without = (
        identify_winches([each], torque_age=known.torque_age).winches[0] for each in (known, bare)
    )
    assert found.described["inertia"] == pytest.approx(3.0e-4)
    assert found.fit.estimate.value("inertia") == pytest.approx(3.0e-4, rel=0.01)
    described, false = (each.judgements[0].errors["described"].percent for each in (found, without))
    assert described < 0.2
    assert false > 10.0 * described
    offset = "winch_torque_offset torque"
    assert abs(found.fit.estimate.value(offset)) < 1e-3
    # The shaft hardly turns: an unbalance that is not known of becomes an offset.
    assert without.fit.estimate.value(offset) == pytest.approx(-0.02, rel=0.1)


@pytest.fixture
def short(tmp_path):
    """A recording that is there, with too little in it."""
    folder = tmp_path / "short"
    run(bundle_of("one_winch", "duration=0.1"), folder, lambda now: None)
    return folder


def test_bad_input_is_one_line(cspm, short):
    def refused(*words):
        code, _, err = cspm("identify", "winch", short, *words)
        assert (code, err.count("\n")) == (2, 1), err
        return said(err).removesuffix("\n")

    assert refused("--winches", "hoist") == f"{short}: no cable hoist, allowed: surge"
    assert refused("--effects", "cable_creep").startswith(
        "effect cable_creep of a winch; allowed: winch_coulomb_friction, "
    )
    assert refused("--winches", "a,,b") == "--winches a,,b: allowed: names with commas between them"
    assert refused("--band", "0") == "--band 0: allowed: a frequency above 0 Hz"
    assert refused("--held-out", short) == (
        f"--held-out {short}: is already used for the search, allowed: another recording"
    )
    assert refused("--out", ".") == ".: already exists, allowed: a new folder"


def test_help_says_what_to_do(cspm):
    code, out, _ = cspm("identify", "winch", "--help")
    assert code == 0
    for word in ("--held-out", "--effects", "--torque-age", "--without-reversals", "emps"):
        assert word in out
