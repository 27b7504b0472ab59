"""What a machine lacks is found, by the command, in recordings that another plant made."""

import json
import shutil
import sys

import pytest
from emps_samples import DATA, ESTIMATION, MAPPING, PULSES, TESTBED
from error_lines import said
from run_samples import SCENARIOS

from cspm.cli import main as cli
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.testbed import EffectEntry, load_testbed

THESIS = SCENARIOS / "testbeds" / "thesis.yaml"
TORQUE = 0.01
FRICTION = f"""\
  - effect: winch_coulomb_friction
    elements: [sway_1]
    parameters: {{torque: {TORQUE}}}
"""


@pytest.fixture(scope="module")
def cspm(tmp_path_factory):
    """Run a command line in one folder; return exit code, stdout and stderr."""
    folder = tmp_path_factory.mktemp("diagnose")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "200")

        def call(capsys, *arguments):
            patch.setattr(sys, "argv", ["cspm", *map(str, arguments)])
            with pytest.raises(SystemExit) as caught:
                cli.main()
            out, err = capsys.readouterr()
            return caught.value.code or 0, out, err

        call.folder = folder
        yield call


def recorded(cspm, capsys, name, text, seed):
    """Record 24 s of the worst sea on the MuJoCo plant of a test-bed file."""
    if not (cspm.folder / name).exists():
        machine = cspm.folder / f"{name}.yaml"
        machine.write_text(text, encoding="utf-8")
        options = ["--plant", "mujoco", "--testbed", machine, "--duration", 24, "--seed", seed]
        code, _, err = cspm(capsys, "run", "worst_case_steep", *options, "--out", name)
        assert (code, err) == (0, "")
    return name


def diagnosed(cspm, capsys, *arguments):
    report = cspm.folder / "report.json"
    code, out, err = cspm(capsys, "diagnose", *arguments, "--json", report)
    assert (code, err) == (0, "")
    return json.loads(report.read_text(encoding="utf-8")), out


def plain():
    return THESIS.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.compiled
def test_friction_of_one_winch_is_found_named_and_modelled(cspm, capsys):
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    name = recorded(cspm, capsys, "rubbing", plain() + FRICTION, 31)
    found, out = diagnosed(cspm, capsys, name, "--testbed", THESIS, "--out", "verdict")
    assert found["schema"] == "cspm.diagnosis/1"
    assert found["verdict"] == "effect"
    (finding,) = found["findings"]
    assert (finding["subsystem"], finding["effect"]) == ("winch", "winch_coulomb_friction")
    assert finding["elements"] == ["sway_1"]
    assert finding["onset_s"] is None
    (torque,) = finding["parameters"]
    assert torque["value"] == pytest.approx(TORQUE, rel=0.03)
    assert torque["ci95"][0] < torque["value"] < torque["ci95"][1]
    assert finding["statement"] in out
    fit = {each["channel"]: each["held_out"] for each in found["residuals"]}
    rubbing, other = fit["winches/torque/sway_1"], fit["winches/torque/sway_2"]
    assert rubbing["nrmse_after"] < 0.1 * rubbing["nrmse_before"]
    assert rubbing["nrmse_after"] < 0.1 * rubbing["nrmse_retuned_nominal"]
    assert other["nrmse_after"] == pytest.approx(other["nrmse_before"])
    turned = {
        each["channel"]: each["held_out"] for each in found["fit"] if each["drive"] == "torque"
    }
    simulated = turned["winches/angle/sway_1"]
    assert simulated["nrmse_after"] < 0.02 * simulated["nrmse_before"]
    assert simulated["nrmse_after"] < 2.0 * simulated["noise_floor"]
    assert turned["winches/angle/sway_2"]["nrmse_after"] == pytest.approx(
        turned["winches/angle/sway_2"]["nrmse_before"]
    )
    improved = load_testbed(cspm.folder / "verdict" / found["model"]).testbed
    assert improved.effects[-1].effect == "winch_coulomb_friction"
    assert improved.effects[-1].elements == ("sway_1",)
    code, _, _ = cspm(
        capsys, "run", "rest", "--testbed", "verdict/testbed.improved.yaml", "--no-record"
    )
    assert code == 0
    assert (cspm.folder / "verdict" / "diagnosis.png").read_bytes().startswith(b"\x89PNG")
    page = (cspm.folder / "verdict" / "diagnosis.html").read_text(encoding="utf-8")
    assert "Marked: winch sway 1." in page


@pytest.mark.slow
@pytest.mark.compiled
def test_nothing_is_found_where_nothing_is_missing(cspm, capsys):
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    name = recorded(cspm, capsys, "healthy", plain(), 32)
    found, out = diagnosed(cspm, capsys, name)
    assert (found["verdict"], found["findings"], found["model"]) == ("consistent", [], None)
    assert "winch_backlash" in {each["effect"] for each in found["not_excited"]}
    assert "verdict: consistent" in out
    assert all(each["ok"] for each in found["data_checks"])
    assert "data: 10 of 10 checks passed" in out


@pytest.fixture(scope="module")
def emps(cspm):
    """Diagnose the real EMPS recordings with some of the published model's friction deleted."""
    if not DATA.is_dir():
        pytest.skip("the EMPS recordings are not here")
    for name in (ESTIMATION, PULSES):
        options = ["--mapping", MAPPING, "--testbed", TESTBED, "--out", name[:-4]]
        assert cspm(Silent(), "import", DATA / name, *options)[0] == 0
    measured = [read_measurement(cspm.folder / name[:-4]) for name in (ESTIMATION, PULSES)]

    def call(*deleted, added=()):
        machine = measured[0].machine
        kept = tuple(entry for entry in machine.effects if entry.effect not in deleted)
        more = (EffectEntry(effect=n, parameters={"torque": PUBLISHED[n]}) for n in added)
        bare = machine.model_copy(update={"effects": (*kept, *more)})
        searched, judged = (m.with_machine(bare) for m in measured)
        return diagnosis_data(diagnose([searched], [judged]))

    return call


class Silent:
    """In place of a test's captured output where nothing is read of it."""

    def readouterr(self):
        return "", ""


def named(found):
    return [each for each in found["findings"] if each["effect"] != "unknown"]


COULOMB, VISCOUS, OFFSET, DIRECTIONAL = (
    "winch_coulomb_friction",
    "winch_viscous_friction",
    "winch_torque_offset",
    "winch_directional_friction",
)
PUBLISHED = {COULOMB: 0.203935, VISCOUS: 2.035034e-2, OFFSET: 3.1648e-2}


@pytest.mark.compiled
def test_friction_deleted_from_a_real_machine_comes_back_in_order(emps):
    found = emps(COULOMB, VISCOUS)
    assert found["verdict"] == "effect"
    effects = [each["effect"] for each in found["findings"]]
    assert effects == [COULOMB, VISCOUS, DIRECTIONAL]
    for each in named(found)[:2]:
        value = each["parameters"][0]["value"]
        assert value == pytest.approx(PUBLISHED[each["effect"]], rel=0.05)
    # Paying out needs more than winding in: the published model has a constant force instead.
    assert named(found)[2]["parameters"][0]["value"] == pytest.approx(-0.0039, rel=0.1)
    (fit,) = found["residuals"]
    # The published symmetric model leaves 5.98 %, with its constant force 4.9 %.
    assert fit["held_out"]["nrmse_after"] <= 0.045
    assert fit["held_out"]["nrmse_after"] < fit["held_out"]["nrmse_black_box"]
    (simulated,) = found["fit"]
    assert simulated["held_out"]["nrmse_after"] < 0.05 * simulated["held_out"]["nrmse_before"]


@pytest.mark.compiled
@pytest.mark.parametrize("deleted", [COULOMB, VISCOUS])
def test_one_term_deleted_from_a_real_machine_is_named_first(emps, deleted):
    """What differs by direction is in no entry of the file, and is found as well."""
    found = emps(deleted)
    assert [each["effect"] for each in named(found)] == [deleted, DIRECTIONAL]
    (number,) = named(found)[0]["parameters"]
    low, high = number["ci95"]
    assert low < PUBLISHED[deleted] < high
    assert high - low < 0.2 * PUBLISHED[deleted]


@pytest.mark.compiled
def test_what_differs_by_direction_explains_more_than_the_published_offset(emps):
    """It is named beside what is left beyond the noise, which widens its interval."""
    found = emps()
    assert found["verdict"] == "effect"
    (finding,) = named(found)
    assert (finding["effect"], finding["presence"]) == (DIRECTIONAL, "certain")
    (number,) = finding["parameters"]
    assert number["value"] == pytest.approx(-0.0039, rel=0.1)
    low, high = number["ci95"]
    assert low < number["value"] < high < 0.0
    assert found["left"]
    (fit,) = found["residuals"]
    assert 0.07 < fit["held_out"]["nrmse_before"] < 0.08
    assert fit["held_out"]["nrmse_after"] < 0.045


@pytest.mark.compiled
def test_the_published_offset_is_taken_back(emps):
    """With the directions' difference in the model nothing is left of the constant force."""
    found = emps(added=[OFFSET])
    assert [each["effect"] for each in named(found)] == [DIRECTIONAL, OFFSET]
    left = PUBLISHED[OFFSET] + named(found)[1]["parameters"][0]["value"]
    assert left == pytest.approx(0.0, abs=0.1 * PUBLISHED[OFFSET])
    (fit,) = found["residuals"]
    assert fit["held_out"]["nrmse_before"] < 0.05
    assert fit["held_out"]["nrmse_after"] < 0.045


def test_a_recording_counts_once_whatever_its_name_and_has_to_be_long_enough(cspm, capsys):
    code, _, err = cspm(capsys, "run", "rest", "--duration", 2, "--out", "once")
    assert (code, err) == (0, "")
    shutil.copytree(cspm.folder / "once", cspm.folder / "copied")
    assert cspm(capsys, "run", "rest", "--duration", 1, "--out", "part")[0] == 0
    for arguments, message in (
        (("once", "copied"), "copied: the same recording as once, allowed: each once"),
        (
            ("once", "--held-out", "once"),
            "--held-out once: is already used for the search, allowed: ",
        ),
        (
            ("once", "--held-out", "copied"),
            "--held-out copied: is already used for the search, allowed: ",
        ),
        (("once", "--held-out", "part"), "--held-out part: shares 100 % of its rows with once"),
        (("once",), "once: 1.4 s to search, allowed: 3 s or more; without --held-out "),
    ):
        code, _, err = cspm(capsys, "diagnose", *arguments)
        assert code == 2
        assert said(err).startswith(message)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no recording, allowed: one or more, --explain EFFECT or --plan SCENARIO"),
        (("--explain", "gremlins"), "--explain gremlins: allowed: bar_com, "),
        (("one", "--out", "taken"), "taken: already exists, allowed: a new folder"),
    ],
)
def test_unusable_input_is_one_line(cspm, capsys, arguments, message):
    (cspm.folder / "taken").mkdir(exist_ok=True)
    code, out, err = cspm(capsys, "diagnose", *arguments)
    assert (code, out) == (2, "")
    assert said(err).startswith(message)
    assert err.count("\n") == 1


def test_an_effect_is_explained(cspm, capsys):
    code, out, _ = cspm(capsys, "diagnose", "--explain", "winch_coulomb_friction")
    assert code == 0
    assert "winch_stribeck_friction" in out
    assert "torque" in out
