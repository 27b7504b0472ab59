"""What objects show in a notebook."""

import re
from types import SimpleNamespace

import cspm
from cspm.diagnosis import Diagnosis, Finding
from cspm.notebook import table


def cells(html):
    rows = re.findall(r"<tr>(.*?)</tr>", html)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


def test_text_is_no_markup():
    assert "<td>a&lt;b&gt;</td>" in table("t", ("h",), [("a<b>",)])


def test_a_run_shows_its_signals():
    run = cspm.simulate("rest", duration=0.1)
    heads, *rows = cells(run._repr_html_())
    assert heads == ["signal", "samples", "columns", "least", "greatest", "unit"]
    assert [row[0] for row in rows] == list(run.names)
    (tension,) = (row for row in rows if row[0] == "tension")
    assert tension[1] == "100"
    assert float(tension[3]) <= run.tension.values.min() * 1.001
    assert tension[5] == "N"


def test_a_diagnosis_shows_what_it_found(monkeypatch):
    found = (
        Finding("reported", "bar_mass", ("bar",), "bar", 0.975, "The bar is heavier."),
        Finding("reported", "unknown", ("sway_1", "sway_2"), "cable"),
    )
    monkeypatch.setattr(Diagnosis, "findings", found)
    shown = Diagnosis(SimpleNamespace(), {"verdict": "parameter"}, (), ())._repr_html_()
    assert "Diagnosis: parameter" in shown
    assert cells(shown)[1:] == [
        ["bar_mass", "bar", "reported", "98 %", "The bar is heavier."],
        ["unknown", "sway_1, sway_2", "reported", "", ""],
    ]


def test_in_a_terminal_results_are_one_short_line(tmp_path):
    recording = cspm.simulate("one_winch", duration=6).save(tmp_path / "rig")
    compared = cspm.compare(recording)
    worst = max(compared.channels, key=lambda each: each.rms / each.floor)
    expected = f"<Comparison of {len(compared.channels)} quantities, worst {worst.name}>"
    assert repr(compared) == expected
    heads, first, *rows = cells(compared._repr_html_())
    assert heads == ["quantity", "block", "error, RMS", "times its noise", "VAF"]
    assert first[0] == worst.name
    assert len(rows) + 1 == len(compared.channels)
    found = cspm.diagnose(recording, closed_loop=False)
    assert repr(found) == f"<Diagnosis: {found.verdict}>"
