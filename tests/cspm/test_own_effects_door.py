"""Effects of one's own, added from a script."""

import os
from pathlib import Path

import pytest

import cspm
from cspm_sim.effects import catalogue
from cspm_sim.effects.own_files import VARIABLE

EFFECTS = Path(__file__).resolve().parents[2] / "examples" / "effects"


@pytest.fixture(autouse=True)
def _as_it_was(monkeypatch):
    # A variable that is set first is one that `undo` takes away again.
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.delenv(VARIABLE)
    catalogue.cache_clear()
    yield
    monkeypatch.undo()
    catalogue.cache_clear()


def test_an_effect_of_ones_own_is_one_like_any_other():
    assert "winch_churning" not in cspm.effects()
    cspm.use_effects(EFFECTS)
    cspm.use_effects(EFFECTS)
    assert cspm.effects()["winch_churning"].parameters[0].unit == "N·m·s²/rad²"
    planted = cspm.load_testbed("one_winch").with_effect("winch_churning", coefficient=0.01)
    assert planted.effects[-1].effect == "winch_churning"
    assert os.environ[VARIABLE] == str(EFFECTS)


def test_a_file_that_cannot_be_used_changes_nothing(tmp_path):
    (tmp_path / "nothing.py").write_text("")
    with pytest.raises(cspm.InputError, match=r"nothing.py declares no EFFECT, allowed: EFFECT ="):
        cspm.use_effects(tmp_path / "nothing.py")
    assert VARIABLE not in os.environ
    assert "winch_coulomb_friction" in cspm.effects()
