"""What benchmarks conceal shares no equation with the model that is to find it."""

from pathlib import Path

import pytest
from imported_modules import imported

from cspm_sim.effects import catalogue

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.blind.reality.phenomena import PHENOMENA

ROOM = Path(__file__).resolve().parents[3] / "bench" / "blind" / "reality"
ALLOWED = {
    *("__future__", "collections", "dataclasses", "statistics", "typing", "zlib"),
    *("cspm_msgs_py", "cspm_sim.mujoco", "bench.blind.reality", "mujoco", "numpy", "scipy"),
}


def test_it_imports_nothing_of_the_model():
    sources = sorted(ROOM.rglob("*.py"))
    assert len(sources) >= 8
    for path in sources:
        text = path.read_text(encoding="utf-8")
        assert set(imported(text)) <= ALLOWED, path.name
        own = text.replace("cspm_sim.mujoco", "")
        assert not any(name in own for name in ("cspm_sim", "cspm_model")), path.name


def test_the_check_sees_the_model():
    assert not set(imported("def f():\n    from cspm_sim.kernels import winch")) <= ALLOWED


@pytest.mark.parametrize("name", PHENOMENA)
def test_names_for_the_truth_are_those_of_the_catalogue(name):
    phenomenon = PHENOMENA[name]
    ways = ("influence", "drive", "faults", "clocks", "alter")
    assert sum(getattr(phenomenon, way) is not None for way in ways) == 1
    if phenomenon.effect is None:
        assert phenomenon.kind == "unknown"
        return
    effect = catalogue()[phenomenon.effect]
    assert effect.block.value == phenomenon.block
    assert (effect.physics.alter is not None) == (phenomenon.kind == "parameter")
    if phenomenon.parameter is not None:
        (parameter,) = (p for p in effect.parameters if p.name == phenomenon.parameter)
        assert (parameter.absent or 0.0) == phenomenon.base
