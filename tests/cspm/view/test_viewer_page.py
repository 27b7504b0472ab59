"""The viewer's page in a browser: draws, follows time, fits narrow screens, marks parts."""

import json
import re
from base64 import b64decode

import numpy as np
import pytest
from accessibility import serious_findings
from driven_browser import driven_browser

import cspm
from cspm.view.frames import frames_of
from cspm.view.marks import Mark, read_marks
from cspm.view.viewer_page import machine_shape, viewer_page
from cspm_msgs_py.errors import InputError

POLICY = re.compile(r"<meta http-equiv=Content-Security-Policy.*?>")
MARK = Mark("winch", "surge_2", "winch surge 2", "Winch surge 2 has </script> friction.", 0.7)
FOUND = """
const texts = place => [...document.querySelectorAll(place)].map(each => each.textContent);
return {plots: texts(".plot h2"), finding: document.getElementById("finding").textContent,
  guilty: texts(".chips .guilty").length, jumps: texts("#jumps button")};
"""
WIDTHS = "return [document.documentElement.scrollWidth, document.documentElement.clientWidth];"
CLOCK = "return document.getElementById('clock').textContent;"
PICTURE = "return document.getElementById('scene').toDataURL();"
# An empty picture of the scene takes some 5000 letters.
INKED = 20000


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with driven_browser(tmp_path_factory.mktemp("profile")) as found:
        yield found


@pytest.fixture(scope="module")
def rest():
    return cspm.simulate("rest", duration=2.0)


def written(path, run, *marks, others=()):
    runs = [frames_of(each, f"run {i}") for i, each in enumerate((run, *others))]
    page = viewer_page(run.testbed.description, runs, marks)
    path.write_text(page, encoding="utf-8")
    return page


def test_the_page_is_whole_and_calls_nobody(rest, tmp_path):
    page = written(tmp_path / "page.html", rest, MARK)
    assert len(POLICY.findall(page)) == 1
    assert "connect-src" not in POLICY.search(page)[0]
    assert not re.search(r"(?:src|href)\\s*=|https?://", page)
    # Over the picture the buttons would hide winches and names.
    assert page.index("id=views") < page.index("id=scene")
    assert not re.search(r"#views \{[^}]*absolute", page)
    # Names from outside end no script.
    assert "Winch surge 2 has </script>" not in page
    head = json.loads(re.search(r"id=view>(.*?)</script>", page, re.DOTALL)[1])
    assert head["marks"][0]["statement"] == MARK.statement
    assert len(page) < 5e6


def clock(browser, *keys):
    browser.press(*keys)
    browser.drawn()
    return browser.run(CLOCK).split()[0]


@pytest.mark.slow
def test_the_page_marks_the_part_and_follows_keys(rest, browser, tmp_path):
    written(tmp_path / "page.html", rest, MARK)
    browser.open((tmp_path / "page.html").as_uri())
    browser.drawn()
    found = browser.run(FOUND)
    assert len(found["plots"]) == 8
    assert found["plots"][0] == "Cable tensions [N]"
    assert found["guilty"] == 4
    assert found["finding"] == MARK.statement
    assert found["jumps"] == ["Where it shows: winch surge 2, 0.7 s"]
    assert browser.run(CLOCK).startswith("0.70 of 2.0 s")
    marked = browser.run("return document.getElementById('marked').textContent")
    assert re.fullmatch(r"surge 2, motor torques: −?[\d.]+ N·m", marked)
    bands = "return [...document.querySelectorAll('.band')].map(each => each.ariaPressed)"
    assert "false" in browser.run(bands)
    assert clock(browser, "Home") == "0.00"
    assert clock(browser, "ArrowRight", "ArrowRight") == "0.07"
    assert clock(browser, "End") == "2.00"
    assert clock(browser, "ArrowLeft") == "1.97"
    assert clock(browser, "j") == "0.70"
    assert browser.errors() == []


@pytest.mark.slow
def test_the_machine_is_drawn_and_turns(rest, browser, tmp_path):
    written(tmp_path / "page.html", rest)
    browser.open((tmp_path / "page.html").as_uri())
    browser.drawn()
    before = browser.run(PICTURE)
    assert len(before) > INKED
    browser.press("a")
    browser.drawn()
    turned = browser.run(PICTURE)
    assert turned != before
    browser.press("d")
    browser.drawn()
    assert browser.run(PICTURE) == before


@pytest.mark.slow
def test_it_plays_and_pauses(rest, browser, tmp_path):
    written(tmp_path / "page.html", rest)
    browser.open((tmp_path / "page.html").as_uri())
    browser.press(" ")
    moved = "while (document.getElementById('clock').textContent < '0.2') await new Promise("
    browser.run(f"{moved} done => requestAnimationFrame(done));")
    browser.press(" ")
    browser.drawn()
    at = browser.run(CLOCK)
    assert float(at.split()[0]) >= 0.2
    browser.drawn()
    assert browser.run(CLOCK) == at


@pytest.mark.slow
def test_two_runs_fit_a_telephone(rest, browser, tmp_path):
    written(tmp_path / "page.html", rest, others=(rest,))
    browser.open((tmp_path / "page.html").as_uri(), width=400)
    browser.drawn()
    wide, seen = browser.run(WIDTHS)
    assert wide <= seen <= 400
    assert serious_findings(browser) == []
    assert browser.errors() == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["one_winch", "rig_stiffness_surge"])
def test_machines_without_bar_are_drawn(name, browser, tmp_path):
    run = cspm.simulate(name, duration=1.0)
    assert machine_shape(run.testbed.description)["bar"] is None
    written(tmp_path / "page.html", run)
    browser.open((tmp_path / "page.html").as_uri(), width=800)
    browser.drawn()
    assert browser.errors() == []
    browser.picture(tmp_path / "seen.png")
    assert len(browser.run(PICTURE)) > INKED // 2


def finding(**changed):
    entry = {
        "subsystem": "winch",
        "elements": ["surge_2"],
        "effect": "winch_coulomb_friction",
        "statement": "Friction.",
        "probability": 0.9,
        "onset_s": None,
        "region": {},
        "parameters": [],
        "alternatives": [],
        "shows_at": {"recording": "some/where/today", "time_s": 3.5},
    }
    return entry | changed


def marks_of(path, machine, *findings, schema="cspm.diagnosis/1"):
    data = {
        "schema": schema,
        "recordings": [],
        "testbed": {"path": "thesis.yaml", "sha256": "0"},
        "verdict": "effect",
        "findings": findings,
        "not_excited": [],
        "fit": [],
        "model": None,
    }
    path.write_text(json.dumps(data))
    return read_marks(path, machine, "today")


def test_marks_are_the_parts_of_the_findings(thesis, tmp_path):
    bag = [
        finding(),
        finding(effect="unknown", subsystem="cable", onset_s=2.0),
        finding(effect="tension_bias", subsystem="sensor", elements=["sway_1"]),
        finding(effect="bar_mass", subsystem="bar", elements=["bar"], shows_at=None),
    ]
    found = marks_of(tmp_path / "diagnosis.json", thesis, *bag)
    assert [(m.kind, m.element, m.at) for m in found] == [
        ("winch", "surge_2", 3.5),
        ("cable", "surge_2", 2.0),
        ("load cell", "sway_1", 3.5),
        ("body", "bar", None),
    ]
    assert read_marks(tmp_path, thesis, "today") == found
    other = read_marks(tmp_path, thesis, "yesterday")
    assert [m.at for m in other] == [None, 2.0, None, None]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("{", ": cannot be read as JSON"),
        ("[]", ": no diagnosis, allowed: a file with schema cspm.diagnosis/1"),
        (
            '{"schema": "cspm.diagnosis/1"}',
            ": recordings: missing, a value is required",
        ),
        ('{"schema": "other/1"}', ": no diagnosis, allowed: a file with schema cspm.diagnosis/1"),
    ],
)
def test_what_is_no_diagnosis_is_refused(thesis, tmp_path, text, line):
    path = tmp_path / "diagnosis.json"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_marks(path, thesis, "today")
    assert str(caught.value).startswith(f"{path}{line}")


def test_a_diagnosis_of_another_machine_is_refused(thesis, tmp_path):
    with pytest.raises(InputError, match="about crane_9, allowed on this machine: bar, hoist_1"):
        marks_of(tmp_path / "diagnosis.json", thesis, finding(elements=["crane_9"]))


def test_numbers_keep_their_order(rest):
    page = viewer_page(rest.testbed.description, [frames_of(rest, "rest")])
    text = re.search(r"id=numbers>(.*?)</script>", page)[1]
    numbers = np.frombuffer(b64decode(text), dtype="<f4")
    found = frames_of(rest, "rest")
    size = 6 * found.count
    first = next(iter(found.poses.values()))
    np.testing.assert_allclose(numbers[:size].reshape(-1, 6), first, rtol=1e-6)
    last = found.traces[-1].high
    np.testing.assert_allclose(numbers[-last.size :].reshape(last.shape), last, rtol=1e-6)
