"""The report page of a diagnosis: what it says, what it draws, and that a browser shows it."""

import json
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from diagnosis_samples import (
    NOISE,
    PLACE,
    RUBBING,
    TORQUE,
    diagnosis,
    equation,
    held_out,
    judged,
)

from cspm_ident.diagnosis.finding import (
    HoldOut,
    Region,
)
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival, is_constant
from cspm_ident.diagnosis.reporting.diagnosis_page import write_diagnosis_page
from cspm_ident.diagnosis.reporting.evidence_figure import caption_of, driver_figure
from cspm_ident.diagnosis.reporting.verdict import (
    Verdict,
    diagnosis_data,
    named_in,
    verdict_of,
)
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_ident.diagnosis.validation.residual_curves import (
    Curve,
    bins_of,
    explained_by,
    held_out_curves,
)
from cspm_ident.signals.samples import Samples
from cspm_sim.effects import Channel, catalogue

LOADED = Candidate(catalogue()["winch_load_friction"], "surge_2")
WIDER = Candidate(catalogue()["winch_drum_radius"], "surge_2")

TRUSTED = DEFAULT_THRESHOLDS.trusted_probability


HUM = Line(Place(Channel.WRENCH, "bar"), 1, 2.7, 0.314, 1e-9)
FAST = Region("speed [rad/s]", 0.5, 2.0, 0.25, 0.93)


def page_of(tmp_path, found):
    path = tmp_path / "diagnosis.html"
    data = diagnosis_data(found)
    data["not_excited"][0]["separating_experiment"] = "experiment.yaml"
    write_diagnosis_page(path, found, data)
    return path.read_text(encoding="utf-8")


def section(page, name):
    return re.search(rf"<section id={name}>.*?</section>", page, re.DOTALL).group()


def test_what_rivals_leave_is_shared_by_how_far_they_lie_behind():
    (alone,) = diagnosis_data(diagnosis())["findings"]
    assert alone["probability"] == TRUSTED
    rival = Hypothesis(LOADED.effect, (LOADED,))
    for behind, odds in ((0.0, 1.0), (2.0, np.exp(-2.0))):
        (tied,) = diagnosis_data(diagnosis(alternatives=[Rival(rival, behind)]))["findings"]
        (other,) = tied["alternatives"]
        assert other["probability"] == pytest.approx(odds * tied["probability"])
        assert tied["probability"] + other["probability"] == pytest.approx(TRUSTED)
        assert other["beside"] is None


def test_an_alternative_that_needs_a_wrong_number_names_it(tmp_path):
    beside = Hypothesis(WIDER.effect, (WIDER,))
    found = diagnosis(alternatives=[Rival(Hypothesis(LOADED.effect, (LOADED,)), 0.0, beside)])
    (tied,) = diagnosis_data(found)["findings"]
    assert tied["alternatives"][0]["effect"] == "winch_load_friction"
    assert tied["alternatives"][0]["beside"] == "winch_drum_radius"
    words = "winch_load_friction on surge_2 beside a wrong winch_drum_radius"
    assert words in section(page_of(tmp_path, found), "hypotheses")


def test_a_curve_is_what_the_found_columns_leave():
    (curve,) = held_out_curves([[equation()]], {RUBBING: np.array([TORQUE])})
    part = equation()
    assert np.array_equal(curve.before, part.target[:, 0])
    expected = part.target[:, 0] - TORQUE * part.columns[RUBBING][:, 0, 0]
    np.testing.assert_allclose(curve.after, expected)
    assert curve.gained > 0.99
    assert (curve.unit, curve.touched, curve.main_signal) == ("N·m", (RUBBING,), "speed [rad/s]")
    (wrong,) = held_out_curves([[equation()]], {RUBBING: np.array([-TORQUE])})
    assert wrong.gained < -2.0


def test_what_no_recording_shows_is_fitted_on_both_sides():
    part = equation()
    start = np.linspace(1.0, 2.0, len(part.times))
    shifted = Equation(
        part.place,
        part.times,
        part.target + 5.0 * start[:, None],
        part.columns,
        part.measured,
        start[:, None, None],
        part.signals,
    )
    (curve,) = held_out_curves([[shifted]], {RUBBING: np.array([TORQUE])})
    assert np.std(curve.after) < 2.0 * NOISE


def test_a_caption_says_how_far_a_residual_depends_on_its_driver():
    """Friction of 0.03 N·m with a noise of 0.001: all before, of what is left chance alone."""
    (curve,) = held_out_curves([[equation()]], {RUBBING: np.array([TORQUE])})
    reported = caption_of(curve, "speed [rad/s]")
    assert "root mean square is 0.03 N·m before and 0.001" in reported
    share, left = map(
        float, re.search(r"Speed explains (\S+) % of.*before, (\S+) % after", reported).groups()
    )
    assert share > 90.0
    assert left < 0.01
    (unsolved,) = held_out_curves([[equation()]], {})
    assert caption_of(unsolved, "speed [rad/s]").endswith(" % of the squared residual.")


def test_a_signal_explains_what_is_a_function_of_it():
    rng = np.random.default_rng(0)
    signal = rng.uniform(-1.0, 1.0, 5000)
    assert explained_by(signal, signal**2) > 0.95
    assert explained_by(signal, rng.standard_normal(5000)) < 0.02
    assert explained_by(np.zeros(10), np.arange(10.0)) == 0.0


def test_a_signal_that_does_not_change_has_one_bin_that_can_be_drawn():
    edges, home = bins_of(np.full(10, 3.0))
    assert list(edges) == [3.0, 3.0]
    assert set(home) == {0}
    values = np.arange(10.0)
    still = {"tension [N]": np.full(10, 3.0)}
    place = Place(Channel.SHAFT, "surge")
    curve = Curve(place, "", np.arange(10.0), values, values, values, still, ())
    means = driver_figure(curve, "tension [N]").data[-1]
    assert (tuple(means.x), tuple(means.y)) == ((3.0,), (4.5,))


def test_the_page_says_all_that_was_found(tmp_path):
    rival = Rival(Hypothesis(LOADED.effect, (LOADED,)), 0.1)
    page = page_of(tmp_path, diagnosis(alternatives=[rival]))
    assert "Diagnosis of today: tie" in page
    top = page.index('class="verdict"')
    assert top < page.index("<section")
    rival = (
        "As well explained by friction in proportion to tension (winch_load_friction on surge_2)"
    )
    assert top < page.index(rival) < page.index("<section")
    simulated = section(page, "simulated")
    for reported in ("winches/angle/surge_2", "torque", "1.46", "0.0071", "0.0049"):
        assert f">{reported}<" in simulated
    limits = section(page, "limits")
    assert ">winch_viscous_friction<" in limits
    assert ">2.1e-06<" in limits
    assert "Marked: winch surge_2" in section(page, "where").replace("surge 2", "surge_2")
    assert "0.029 to 0.031" in section(page, "parameters")
    ranking = section(page, "hypotheses")
    assert ranking.index("winch_coulomb_friction") < ranking.index("winch_load_friction")
    assert "485 hypotheses" in ranking
    assert "90.0" in ranking
    assert "winch_backlash" in section(page, "silent")
    assert "from winch_load_friction" in section(page, "next")
    assert "<a href='experiment.yaml'>" in section(page, "next")
    assert section(page, "evidence").count("plotly-graph-div") == 2
    assert "ab" * 32 in section(page, "sources")
    assert "<script src" not in page
    assert '"name":"after"' in page


def test_the_power_of_what_is_missing_is_reported(tmp_path):
    """Dry friction takes torque·⟨|speed|⟩; modelled, nothing is left."""
    found = diagnosis()
    (power,) = diagnosis_data(found)["energy"]
    assert power["channel"] == "winches/torque/surge_2"
    assert power["lost_before_w"] == pytest.approx(TORQUE * 2.0 / np.pi, rel=0.02)
    low, high = power["ci95_after_w"]
    assert low < 0.0 < high < 1e-3
    reported = section(page_of(tmp_path, found), "energy")
    assert ">0.019<" in reported
    assert ">neither significantly<" in reported
    assert ">takes energy<" in section(page_of(tmp_path, diagnosis(named=False)), "energy")


def test_a_page_without_findings_says_so(tmp_path):
    page = page_of(tmp_path, replace(diagnosis(named=False), fit=(held_out(NOISE),)))
    assert "The recordings agree with the model" in page
    assert "None of 485 was accepted" in section(page, "hypotheses")
    assert 'id="parameters"' not in page
    assert "no part" in section(page, "where")
    # What was not found changes nothing: there is no after to be drawn.
    assert '"name":"before"' in page
    assert '"name":"after"' not in page


@pytest.mark.parametrize(
    ("channel", "measured", "reported"),
    [
        (Channel.TENSION, False, True),
        (Channel.TENSION, True, False),
        (Channel.SHAFT, False, False),
    ],
)
def test_the_page_says_where_tensions_come_from(tmp_path, channel, measured, reported):
    found = diagnosis()
    cells = Samples(np.zeros(1), np.zeros((1, 8))) if measured else None
    found = replace(
        found,
        searched=(replace(found.searched[0], tension=cells),),
        places=(Place(channel, "surge_2"),),
    )
    assert ("No load cell was recorded" in section(page_of(tmp_path, found), "where")) is reported


def test_a_periodic_force_from_outside_is_unknown(tmp_path):
    found = diagnosis(named=False, lines=(HUM,))
    assert verdict_of(found) is Verdict.UNKNOWN
    (finding,) = diagnosis_data(found)["findings"]
    assert (finding["subsystem"], finding["elements"], finding["effect"]) == (
        "bar",
        ["bar"],
        "unknown",
    )
    assert finding["region"] == {
        "driver": "frequency [Hz]",
        "at": [2.7],
        "adds": [0.314],
        "hint": None,
    }
    assert "bar/wrench in sway: 0.314 N at 2.70 Hz" in finding["statement"]
    assert "162 rounds a minute" in finding["statement"]
    assert "periodic, 2.70 Hz, bar" in page_of(tmp_path, found)
    assert verdict_of(diagnosis(named=False)) is Verdict.CONSISTENT


@pytest.mark.parametrize(("half", "doubtful"), [(0.029, False), (0.031, True)])
def test_a_finding_whose_interval_contains_zero_is_not_named(half, doubtful, tmp_path):
    found = diagnosis()
    (one,) = found.findings
    own = [each._replace(half_widths=np.array([half])) for each in one.coefficients]
    found = judged(found, [replace(one, coefficients=tuple(own))])
    data = diagnosis_data(found)
    named, considered = named_in(data), data["considered"]
    assert [len(named), len(considered)] == [not doubtful, doubtful]
    (entry,) = [*named, *considered]
    assert entry["effect"] == "winch_coulomb_friction"
    assert entry["parameters"][0]["value"] == pytest.approx(0.03)
    assert len(entry["parameters"][0]["ci95"]) == 2
    assert entry.get("presence") == (None if doubtful else "certain")
    assert ("cannot tell" in page_of(tmp_path, found)) is doubtful
    assert data["model"] == "testbed.improved.yaml"


@pytest.mark.parametrize(("left", "first"), [(901.0, "unknown"), (899.0, "winch_coulomb_friction")])
def test_what_is_larger_comes_first(left, first):
    """The finding gains 900. It keeps its interval and its probability beside what is unknown."""
    found = diagnosis(unknown=[(Driver(PLACE, "tension [N]"), Gain(left, 1.0), 0.2)])
    data = diagnosis_data(found)
    assert data["findings"][0]["effect"] == first
    (finding,) = named_in(data)
    assert finding["probability"] == TRUSTED
    assert finding["parameters"][0]["ci95"] is not None
    assert verdict_of(found) is Verdict.EFFECT


@pytest.mark.parametrize("faint", [True, False])
def test_a_finding_that_held_out_data_hardly_show_says_so(faint):
    found = diagnosis()
    holdout = HoldOut.FAINT if faint else HoldOut.CONFIRMED
    found = judged(found, [replace(each, holdout=holdout) for each in found.findings])
    (finding,) = named_in(diagnosis_data(found))
    assert ("What was not searched moves so little" in finding["statement"]) is faint


def test_what_the_catalogue_has_as_constants():
    assert [name for name, effect in catalogue().items() if is_constant(effect)] == [
        "bar_constant_wrench",
        "tension_bias",
        "winch_torque_offset",
    ]


def test_what_alternates_is_reported_and_nothing_is_named_by_it():
    """The finding gains more than all that is unknown."""
    swing = Line(Place(Channel.TENSION, "surge_2"), 0, 500.0, 5.6, 0.0, alternates=True)
    found = diagnosis(lines=[swing])
    found = judged(found, found.findings, {"surge_2"})
    data = diagnosis_data(found)
    (first,) = data["findings"]
    assert (first["effect"], first["region"]["at"]) == ("unknown", [500.0])
    assert [each["effect"] for each in data["considered"]] == ["winch_coulomb_friction"]
    assert verdict_of(found) is Verdict.UNKNOWN


def test_where_a_finding_shows_is_reported():
    (finding,) = diagnosis_data(diagnosis(region=FAST))["findings"]
    assert finding["region"] == FAST._asdict()
    assert "It shows where speed is 0.5 to 2 rad/s: 93 %" in finding["statement"]
    (finding,) = diagnosis_data(diagnosis())["findings"]
    assert finding["region"] == {}
    assert "It shows where" not in finding["statement"]


def test_an_unknown_shape_marks_the_part_of_its_residual(tmp_path):
    driver = (Driver(PLACE, "tension [N]"), Gain(50.0, 5.0), 0.4)
    page = page_of(tmp_path, diagnosis(named=False, unknown=[driver]))
    assert "Diagnosis of today: unknown" in page
    assert "winch surge" in section(page, "where")
    # Against the signal that was named, though another one explains more.
    assert '"text":"tension [N]"' in section(page, "evidence")
    assert '"text":"speed [rad/s]"' not in section(page, "evidence")
    assert "40 %" in section(page, "hypotheses")


def test_the_page_is_small_beside_its_script(tmp_path):
    page = page_of(tmp_path, diagnosis())
    script = max(len(each) for each in re.findall(r"<script.*?</script>", page, re.DOTALL))
    assert len(page) - script < 1_000_000


_PROBE = """<body><iframe id=f width=%d height=900 src="diagnosis.html"></iframe><script>
const errors = [];
const frame = document.getElementById('f');
frame.onload = () => {
  const inner = frame.contentWindow, page = frame.contentDocument;
  inner.addEventListener('error', e => errors.push(e.message));
  setTimeout(() => {
    const reached = [];
    for (const e of page.querySelectorAll('a[href], [tabindex="0"]')) {
      e.focus();
      if (page.activeElement === e) reached.push(e.textContent.slice(0, 20));
    }
    const found = {
      errors, wide: page.documentElement.scrollWidth, seen: page.documentElement.clientWidth,
      reached: reached.length, reachable: page.querySelectorAll('a[href], .wide').length,
      plots: page.querySelectorAll('.scatterlayer .trace').length,
      text: Math.min(...[...page.querySelectorAll('p, td, li')].map(
        e => parseFloat(inner.getComputedStyle(e).fontSize))),
      targets: [...page.querySelectorAll('nav a')].every(
        a => page.querySelector(a.getAttribute('href')) !== null)};
    const out = document.createElement('pre');
    out.id = 'found'; out.textContent = JSON.stringify(found);
    document.body.append(out);
  }, 3000);
};
</script></body>"""


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 400])
def test_a_browser_shows_the_page_at_any_width(tmp_path, width):
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium on this system")
    rival = Rival(Hypothesis(LOADED.effect, (LOADED,)), 0.1)
    page_of(tmp_path, diagnosis(alternatives=[rival]))
    (tmp_path / "probe.html").write_text(_PROBE % width, encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    options += ["--virtual-time-budget=20000", "--enable-logging=stderr", "--dump-dom"]
    shown = subprocess.run(
        [browser, *options, (tmp_path / "probe.html").as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert "CONSOLE" not in shown.stderr
    found = json.loads(re.search(r'<pre id="found">(.*?)</pre>', shown.stdout)[1])
    assert found["errors"] == []
    # No part of the page but tables, which scroll by themselves, is wider than the screen.
    assert found["wide"] <= found["seen"] <= width
    assert found["plots"] == 9
    assert found["text"] >= 14
    assert found["reached"] == found["reachable"] > 8
    assert found["targets"]
