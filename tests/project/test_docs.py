import re
from pathlib import Path

import numpy as np
import pytest

from cspm_control.waves.build import build_motion, sea_of
from cspm_model.motion import Motion
from cspm_msgs_py.motion_spec import JonswapMotion
from cspm_msgs_py.scenario import parse_scenario
from cspm_msgs_py.testbed import parse_testbed
from cspm_sim.plant import Plant

DOCS = Path(__file__).resolve().parents[2] / "docs"
FILES = "\n".join(
    (DOCS / "reference" / f"{name}.md").read_text(encoding="utf-8")
    for name in ("testbed-file", "scenario-file", "control-section", "safety")
)
EXAMPLE = re.compile(r"<!-- (testbed|scenario): (\S+) -->\n```yaml\n(.*?)```", re.DOTALL)
NUMBERS = re.compile(r"<!-- numbers: (\w+) -->\n.*?<!-- end -->", re.DOTALL)


@pytest.fixture
def figure_scripts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "scripts"))


def examples(kind: str) -> list[tuple[str, str]]:
    return [(name, text) for found, name, text in EXAMPLE.findall(FILES) if found == kind]


def numbers_in(text: str) -> dict[str, str]:
    return {match[1]: match[0] for match in NUMBERS.finditer(text)}


def test_there_are_examples_of_both_files() -> None:
    assert [name for name, _ in examples("testbed")] == ["two_cable_bar", "winch_rig"]
    assert len(examples("scenario")) >= 2


@pytest.mark.parametrize(("name", "text"), examples("testbed"))
def test_example_testbed_is_accepted_and_its_plant_runs(name: str, text: str) -> None:
    testbed = parse_testbed(text, "docs/reference/testbed-file.md").testbed
    assert testbed.name == name
    pose = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0] if testbed.bar else None
    plant = Plant(testbed, Motion.still(np.zeros(6)), 1_000_000, bar_pose=pose)
    for _ in range(100):
        plant.step(np.zeros(len(testbed.cables)))
    assert np.isfinite(plant.state).all()


@pytest.mark.parametrize(("name", "text"), examples("scenario"))
def test_example_scenario_is_accepted(name: str, text: str) -> None:
    assert parse_scenario(text, "docs/reference/scenario-file.md").name == name


def test_provenance_of_the_example_is_found() -> None:
    text = dict(examples("testbed"))["two_cable_bar"]
    assert (
        parse_testbed(text, "docs/reference/testbed-file.md").provenance["bar.mass"].provenance
        == "measured"
    )


def test_every_key_of_both_files_is_documented() -> None:
    from cspm_msgs_py.scenario import Scenario
    from cspm_msgs_py.testbed import Testbed

    keys = _keys(Testbed) | _keys(Scenario)
    missing = sorted(key for key in keys if f"`{key}`" not in FILES)
    assert not missing


def _keys(annotation: object) -> set[str]:
    fields = getattr(annotation, "model_fields", None)
    if fields is None:
        inner = (_keys(part) for part in getattr(annotation, "__args__", ()))
        return set().union(*inner)
    return set(fields).union(*(_keys(field.annotation) for field in fields.values()))


def test_pictures_are_small() -> None:
    pictures = list((DOCS / "figures").glob("*.png"))
    assert len(pictures) >= 2
    assert all(path.stat().st_size <= 200_000 for path in pictures)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.usefixtures("figure_scripts")
def test_numbers_of_the_model_page_are_those_that_the_code_gives() -> None:
    import model_numbers
    import winding_energy

    page = numbers_in((DOCS / "explanation" / "model.md").read_text(encoding="utf-8"))
    found = numbers_in(model_numbers.report() + winding_energy.report() + "\n<!-- end -->\n")
    assert sorted(found) == ["energy", "law", "step", "winding"]
    assert page == found, "copy what docs/scripts/model_numbers.py, winding_energy.py write"


@pytest.mark.compiled
@pytest.mark.usefixtures("figure_scripts")
def test_law_table_is_as_exact_as_the_model_page_says() -> None:
    import model_numbers

    assert (
        max(model_numbers.table_error(law) for law in model_numbers.thesis_laws().values()) < 1e-9
    )


def test_spline_of_the_targets_motion_is_as_exact_as_the_model_page_says() -> None:
    spec = JonswapMotion(
        peak_period=2.31,
        heading=np.deg2rad(225.0),
        band=(0.23, 1.16),
        period=200.0,
        amplitudes=(0.1105, 0.0865, 0.318, 0.027, 0.2164, 0.1068),
    )
    motion = build_motion(spec, [0.0] * 6, seed=1, duration=200.0, gravity=9.81, folder=DOCS)
    harmonic = sea_of(spec, 1).harmonic
    amplitude = np.fft.rfft(motion.knots[:, :6], axis=0)[harmonic] * 2.0 / len(motion.knots)
    times = np.random.default_rng(0).uniform(0.0, 200.0, 500)
    waves = np.exp(2j * np.pi * np.outer(times, harmonic) / spec.period)
    found = np.array([motion.at(time)[:6] for time in times])
    assert np.abs(found - (waves @ amplitude).real).max() < 2e-11
    assert len(harmonic) == 187
