import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from cspm_model.kernels.cable import RADIUS


@pytest.fixture(autouse=True)
def bench_is_importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[3]))


@pytest.mark.parametrize(
    ("limits", "samples", "reached"),
    [
        ({"at_least": 4.0}, [1.0, 4.0, 9.0], True),
        ({"at_least": 4.0}, [1.0, 3.9, 9.0], False),
        ({"at_most": 4.0}, [1.0, 4.0, 9.0], True),
        ({"at_most": 4.0}, [1.0, 4.1, 9.0], False),
        ({}, [1.0], None),
    ],
)
def test_the_median_is_what_must_reach(limits, samples, reached):
    from bench.performance.measured_figure import Figure

    assert Figure("group", "what", "s", samples, **limits).reached is reached


def test_the_table_shows_every_figure_and_how_it_was_measured():
    from bench.performance.figure_table import print_report
    from bench.performance.measured_figure import Figure

    out = io.StringIO()
    figures = [
        Figure("first", "speed", "m/s", [1.0, 2.0, 6.0], at_least=1.5, note="with a ruler"),
        Figure("second", "size", "MB", [77.0], note="with a scale"),
    ]
    print_report(Console(file=out, width=80), {"processor": "abacus"}, figures)
    lines = out.getvalue().splitlines()
    assert any(
        line.split() == ["speed", "[m/s]", "2.00", "1.00", "6.00", "≥", "1.5"] for line in lines
    )
    assert any(line.split() == ["size", "[MB]", "77.0"] for line in lines)
    for text in (
        "processor:    abacus",
        "first: speed: with a ruler",
        "second: size: with a scale",
    ):
        assert text in lines


def test_what_is_measured_is_the_plant():
    from bench.performance.thesis_machine import FRICTION, ThesisMachine

    machine = ThesisMachine(FRICTION)
    plant = machine.plant
    start = plant.state.copy()
    torque = plant.parameters.cables[:, RADIUS] * plant.tensions
    machine.advance(0, 20)
    found = plant.state.copy()
    machine.rewind()
    assert (plant.state == start).all()
    for _ in range(20):
        plant.step(torque)
    assert (plant.state == found).all()
    assert np.abs(found - start).max() > 1e-6


def test_slack_in_the_measured_machine_would_be_seen():
    from bench.performance.thesis_machine import ThesisMachine

    machine = ThesisMachine(())
    assert np.abs(machine.plant.frame[6:12]).min() > 0.0
    assert machine.lowest_tension(50) > 1.0
    machine.plant.unstretched_lengths[3] += 0.05
    loose = machine.plant.state.copy()
    machine._start = loose
    assert machine.lowest_tension(50) == 0.0


def test_the_bar_hangs_in_mujoco_where_it_hangs_in_the_plant(monkeypatch):
    from bench.performance.mujoco_model import machine as mujoco_machine
    from bench.performance.thesis_machine import ThesisMachine

    plant = ThesisMachine(()).plant
    monkeypatch.setattr(mujoco_machine, "PUSH", (0.0,) * 6)
    machine = mujoco_machine.MujocoMachine(plant, "RK4")
    stretch = machine.least_stretch(100)
    assert machine.data.qpos == pytest.approx([0.0, 0.0, plant.bar_state[2], 1, 0, 0, 0], abs=1e-9)
    assert machine.data.ten_length == pytest.approx(plant.lengths, abs=1e-9)
    assert 0.0 < stretch < 0.01


def test_memory_of_a_short_run_is_seen_from_outside():
    from bench.performance.memory import measure_memory

    done = []
    (peak,) = measure_memory(0.1, False, done.append)
    assert 50.0 < peak.median < 500.0
    assert done == ["memory, worst case"]


def test_a_run_that_fails_is_reported():
    from bench.performance.child import finish, start_cspm

    with pytest.raises(RuntimeError, match="ended with 2: cspm run: nowhere: no such scenario"):
        finish(start_cspm(["run", "nowhere"], {}))
