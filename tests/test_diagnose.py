"""What a machine lacks is found, by the command, in recordings that another plant made."""

import json
import sys

import pytest
from run_samples import SCENARIOS
from test_emps_import import DATA, ESTIMATION, MAPPING, PULSES, TESTBED

from cspm_bringup import cli
from cspm_msgs_py.testbed import load_testbed

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
        code, _, err = cspm(capsys, "run", "worst_case", *options, "--out", name)
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
    fit = {each["channel"]: each["held_out"] for each in found["fit"]}
    rubbing, other = fit["winches/torque/sway_1"], fit["winches/torque/sway_2"]
    assert rubbing["nrmse_after"] < 0.1 * rubbing["nrmse_before"]
    assert rubbing["nrmse_after"] < 0.1 * rubbing["nrmse_retuned_nominal"]
    assert other["nrmse_after"] == pytest.approx(other["nrmse_before"])
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
    name = recorded(cspm, capsys, "sound", plain(), 32)
    found, out = diagnosed(cspm, capsys, name)
    assert (found["verdict"], found["findings"], found["model"]) == ("consistent", [], None)
    assert "winch_backlash" in {each["effect"] for each in found["not_excited"]}
    assert "verdict: consistent" in out


@pytest.mark.skipif(not DATA.is_dir(), reason="the EMPS recordings are not here")
@pytest.mark.compiled
def test_friction_deleted_from_a_real_machine_comes_back_in_order(cspm, capsys):
    bare = cspm.folder / "bare.yaml"
    bare.write_text(TESTBED.read_text(encoding="utf-8").split("effects:")[0], encoding="utf-8")
    for name in (ESTIMATION, PULSES):
        options = ["--mapping", MAPPING, "--testbed", bare, "--out", name[:-4]]
        assert cspm(capsys, "import", DATA / name, *options)[0] == 0
    found, _ = diagnosed(cspm, capsys, ESTIMATION[:-4], "--held-out", PULSES[:-4])
    named = [each for each in found["findings"] if each["effect"] != "unknown"]
    assert [each["effect"] for each in named] == [
        "winch_coulomb_friction",
        "winch_viscous_friction",
        "winch_torque_offset",
    ]
    published = [0.203935, 2.035034e-2, 3.1648e-2]
    for each, value in zip(named, published, strict=True):
        assert each["parameters"][0]["value"] == pytest.approx(value, rel=0.06)
    # Friction differs by direction, which the catalogue does not have.
    left = [each for each in found["findings"] if each["effect"] == "unknown"]
    assert left[0]["region"] == {"driver": "speed [rad/s]"}
    (fit,) = found["fit"]
    assert fit["held_out"]["nrmse_after"] < 0.1 * fit["held_out"]["nrmse_before"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "diagnose: no recording, allowed: one or more, or --explain EFFECT"),
        (("nowhere",), "nowhere: "),
        (("--explain", "gremlins"), "--explain gremlins: allowed: bar_com, "),
        (("one", "--held-out", "one"), "--held-out one: is searched as well, allowed: "),
        (("one", "--out", "taken"), "taken: exists, allowed: a new folder"),
    ],
)
def test_unusable_input_is_one_line(cspm, capsys, arguments, message):
    (cspm.folder / "taken").mkdir(exist_ok=True)
    code, out, err = cspm(capsys, "diagnose", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"cspm: {message}")
    assert err.count("\n") == 1


def test_an_effect_is_explained(cspm, capsys):
    code, out, _ = cspm(capsys, "diagnose", "--explain", "winch_coulomb_friction")
    assert code == 0
    assert "winch_stribeck_friction" in out
    assert "torque" in out
