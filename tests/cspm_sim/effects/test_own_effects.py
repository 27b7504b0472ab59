"""An effect in a file of one's own: simulated, recognised, documented; bad files are refused."""

import json
import re
import sys
from pathlib import Path

import pytest
from error_lines import said
from run_samples import SCENARIOS

from cspm.cli import main as cli
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import catalogue
from cspm_sim.effects.document import effects_page
from cspm_sim.effects.own_files import VARIABLE

PAGE = Path(__file__).resolve().parents[3] / "docs" / "how-to" / "add-an-effect.md"
RIG = SCENARIOS / "testbeds" / "one_winch.yaml"
COEFFICIENT = 0.01


def block(language):
    """The page's first example in a language."""
    return re.search(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)[1]


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Make the catalogue read a file of this text, and forget it afterwards."""

    def use(text, name="own.py"):
        path = tmp_path / "effects" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
        monkeypatch.setenv(VARIABLE, str(path))
        catalogue.cache_clear()
        return path

    yield use
    monkeypatch.undo()
    catalogue.cache_clear()


@pytest.fixture
def cspm(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["cspm", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        out, err = capsys.readouterr()
        return caught.value.code or 0, out, err

    return call


def test_the_pages_example_is_in_the_catalogue_and_documents_itself(own):
    before = set(catalogue())
    own(block("python"))
    assert set(catalogue()) - before == {"winch_churning"}
    assert list(catalogue()) == sorted(catalogue())
    page = effects_page(catalogue())
    assert "| [`winch_churning`](#winch_churning) | winch | coefficient |" in page
    assert "- Equation: resisting torque = coefficient·|q̇|·q̇." in page


def test_a_folder_may_hold_several_and_what_helps_them(own, monkeypatch):
    text = block("python")
    path = own(text)
    (path.parent / "helper.py").write_text("HELP = 1\n", encoding="utf-8")
    second = text.replace('id="winch_churning"', 'id="winch_second"')
    (path.parent / "second.py").write_text(second, encoding="utf-8")
    monkeypatch.setenv(VARIABLE, str(path.parent))
    catalogue.cache_clear()
    assert {"winch_churning", "winch_second"} <= set(catalogue())


def test_it_is_explained(own, cspm):
    own(block("python"))
    code, out, _ = cspm("diagnose", "--explain", "winch_churning")
    assert code == 0
    assert "N·m·s²/rad²" in out


@pytest.mark.slow
@pytest.mark.compiled
def test_it_is_simulated_and_recognised(own, cspm, tmp_path):
    own(block("python"))
    rig = RIG.read_text(encoding="utf-8")
    (tmp_path / "oily.yaml").write_text(rig.rstrip() + "\n" + block("yaml"), encoding="utf-8")
    assert cspm("run", "one_winch", "--testbed", "oily.yaml", "--out", "oily")[0] == 0
    assert cspm("run", "one_winch", "--out", "free")[0] == 0
    code, _, _ = cspm("diagnose", "oily", "--testbed", RIG, "--json", "oily.json")
    assert code == 0
    found = json.loads((tmp_path / "oily.json").read_text(encoding="utf-8"))
    (finding,) = found["findings"]
    assert (found["verdict"], finding["effect"]) == ("effect", "winch_churning")
    assert finding["elements"] == ["surge"]
    assert finding["parameters"][0]["value"] == pytest.approx(COEFFICIENT, rel=0.02)
    assert cspm("diagnose", "free", "--json", "free.json")[0] == 0
    healthy = json.loads((tmp_path / "free.json").read_text(encoding="utf-8"))
    assert (healthy["verdict"], healthy["findings"]) == ("consistent", [])


@pytest.mark.compiled
def test_a_kernel_that_does_not_compile_is_one_line(own, cspm, tmp_path):
    own(block("python").replace("abs(signals[SPEED])", "len(object())"))
    rig = RIG.read_text(encoding="utf-8")
    (tmp_path / "oily.yaml").write_text(rig.rstrip() + "\n" + block("yaml"), encoding="utf-8")
    code, out, err = cspm("run", "one_winch", "--testbed", "oily.yaml", "--no-record")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "effects: winch_churning: its kernel at WINCH does not compile (" in err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("raise RuntimeError('tired')\n", r"own\.py: RuntimeError: tired, allowed: a file that"),
        ("from nowhere import thing\n", r"own\.py: ModuleNotFoundError: No module named 'nowhere'"),
        ("X = 1\n", r"own\.py declares no EFFECT, allowed: EFFECT = Effect"),
        ("EFFECT = 3\n", r"own\.py: EFFECT is a int, allowed: an Effect$"),
    ],
)
def test_a_file_that_is_no_effect_is_refused(own, text, message):
    own(text)
    with pytest.raises(InputError, match=rf"^{VARIABLE}: .*{message}"):
        catalogue()


@pytest.mark.parametrize(
    ("old", "part"),
    [
        ("kernels={}", "physics=Physics(kernels=…)"),
        ("regression=None", "signature=Signature(regression=…)"),
        ("noun='oil'", "description=Description(noun=…)"),
        ("twins=()", "description=Description(confounded_with=…)"),
    ],
)
def test_a_file_in_the_form_of_version_0_1_is_refused_with_what_moved(own, cspm, old, part):
    text = block("python")
    path = own(text[: text.index("    physics=")] + f"    {old},\n)\n")
    code, out, err = cspm("diagnose", "--explain", "bar_mass")
    name = old.split("=")[0]
    assert (code, out) == (2, "")
    assert said(err) == (
        f"{VARIABLE}: {path}: '{name}' is no argument of Effect since version 0.2, allowed:"
        f" {part}; Effect takes id, block, parameters, elements, physics, signature, description\n"
    )


def test_an_argument_that_never_was_is_pythons_error(own):
    own(block("python").replace("    physics=", "    colour=1,\n    physics="))
    with pytest.raises(InputError, match=r"TypeError: Effect.__init__\(\) got an .*'colour', allo"):
        catalogue()


def test_a_taken_id_is_refused(own):
    own(block("python").replace('id="winch_churning"', 'id="bar_mass"'))
    with pytest.raises(InputError, match=r"^CSPM_EFFECTS: bar_mass is there already, allowed: ano"):
        catalogue()


@pytest.mark.parametrize("missing", ["nowhere.py", "text.txt"])
def test_a_file_that_is_not_there_is_refused(own, cspm, tmp_path, monkeypatch, missing):
    monkeypatch.setenv(VARIABLE, str(tmp_path / missing))
    catalogue.cache_clear()
    code, out, err = cspm("diagnose", "--explain", "bar_mass")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said(err).startswith(f"{VARIABLE}: {tmp_path / missing}: no such file, allowed: .py")
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    with pytest.raises(InputError, match=r"has no effect, allowed: files with an EFFECT$"):
        catalogue()
