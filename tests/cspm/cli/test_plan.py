"""What a motion could show, before anything is recorded."""

import json

import pytest

from cspm_sim.effects import catalogue


@pytest.mark.compiled
def test_a_plan_says_from_which_size_on_effects_show(cspm, tmp_path):
    file = tmp_path / "limits.json"
    code, out, _ = cspm("diagnose", "--plan", "one_winch", "--duration", "8", "--json", str(file))
    assert code == 0
    assert "what 8 s of one_winch show from" in out
    assert "without sensors or parts that would show it: bar_com" in out
    limits = {(each["effect"], each["parameter"]): each for each in json.loads(file.read_text())}
    dry = limits["winch_coulomb_friction", "torque"]
    assert (dry["element"], dry["unit"], dry["possible"]) == ("surge", "N·m", True)
    assert 1e-6 < dry["least"] < 1e-3
    ((_, healthy),) = catalogue()["tension_delay"].signature.negligible.values()
    assert limits["tension_delay", "delay"]["least"] > healthy
    assert {p for e, p in limits if e == "winch_unbalance"} == {"cosine", "sine"}


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ["--plan", "one_winch", "somewhere"],
            "--plan beside recordings or --out, allowed: --plan alone",
        ),
        (["somewhere", "--duration", "8"], "--duration of recordings, allowed: with --plan"),
        (["--plan", "no_such"], "no_such"),
    ],
)
def test_what_does_not_go_with_a_plan_is_refused(refused, arguments, line):
    assert line in refused("diagnose", *arguments)
