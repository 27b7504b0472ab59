"""Load cells exchanged, negated, late or drifting, as torques and the bar's balance say."""

import numpy as np
import pytest
from machine_logs import BAR, CELLS, changed, healthy, later, told

from cspm_checks.hum import mains_hum
from cspm_checks.machine.coarse_lateness import coarse_shift
from cspm_checks.series import SensorSeries


@pytest.fixture(scope="module")
def names():
    return [f"effort/{name}" for name in healthy()[1].cable_names]


def said(change, topic=CELLS):
    log, machine = healthy()
    return told(changed(log, topic, change), machine)


def test_exchanged_cells_are_named_as_a_pair(names):
    def exchange(fields):
        fields[names[0]][:], fields[names[1]][:] = (
            fields[names[1]].copy(),
            fields[names[0]].copy(),
        )

    (found,) = said(exchange)
    assert (found.where, found.kind) == (f"{CELLS} {names[0]}", "exchanged")
    assert f"and {names[1]} are exchanged" in found.text
    assert found.mend[f"{CELLS} {names[1]}"] == {"of": f"{CELLS} {names[0]}"}


def test_a_negated_cell_is_named(names):
    def negate(fields):
        fields[names[3]][:] = 2.0 * fields[names[3]].mean() - fields[names[3]]

    (found,) = said(negate)
    assert (found.where, found.kind) == (f"{CELLS} {names[3]}", "reversed")


def test_cells_seconds_late_are_named():
    log, machine = healthy()
    (found,) = told(later(log, CELLS, 2.0), machine)
    assert (found.where, found.kind) == (CELLS, "late")
    assert found.numbers["seconds"] == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize(("newton", "count"), [(1.5, 1), (0.02, 0)])
def test_a_drift_against_the_others_is_named_where_it_matters(names, newton, count):
    def drift(fields):
        fields[names[1]] += newton * np.linspace(0.0, 1.0, len(fields[names[1]]))

    found = said(drift)
    assert [(one.where, one.kind) for one in found] == [(f"{CELLS} {names[1]}", "drift")] * count
    if count:
        assert found[0].numbers["change"] == pytest.approx(newton, rel=0.15)


def test_hum_of_the_mains_is_named_and_another_line_is_not(names):
    for frequency, count in ((50.02, 1), (43.0, 0)):

        def hum(fields, frequency=frequency):
            time = np.arange(len(fields[names[0]])) / 1000.0
            fields[names[0]] += 0.5 * np.sin(2.0 * np.pi * frequency * time)

        found = said(hum)
        assert [one.kind for one in found] == ["hum"] * count
    time = np.arange(0.0, 20.0, 1e-3)
    noise = np.random.default_rng(2).normal(size=len(time))
    line = mains_hum(SensorSeries(time, noise + 0.8 * np.sin(2.0 * np.pi * 60.0 * time)))
    assert line.amplitude == pytest.approx(0.8, rel=0.1)
    assert mains_hum(SensorSeries(time, noise)) is None


def test_a_motion_that_repeats_is_as_late_as_the_nearest_repetition():
    time = np.arange(0.0, 30.0, 0.01)
    table = np.sin(2.0 * np.pi * time / 6.0)[:, None]
    late = np.sin(2.0 * np.pi * (time - 1.0) / 6.0)[:, None]
    found = coarse_shift(time, late, time, table)
    assert found.seconds == pytest.approx(1.0, abs=0.02)
    assert found.others >= 2
    assert coarse_shift(time, table, time, table) is None
    noise = np.random.default_rng(1).normal(size=table.shape)
    assert coarse_shift(time, noise, time, table) is None


def test_held_frames_are_called_held_and_a_step_is_called_a_jump():
    def hold(fields):
        for column in fields.values():
            column[500:520] = column[500]

    found = said(hold, BAR)
    assert [one.kind for one in found] == ["stuck"]
    assert "never `jumps: join`" in found[0].remedy
    assert "19 of" in found[0].remedy

    def step(fields):
        fields["x"][500:] += 0.3

    assert "jump" in [one.kind for one in said(step, BAR)]


def test_a_body_whose_markers_are_swapped_jumps_at_both_ends():
    def swap(fields):
        x, y, z, w = (fields[name][500:540].copy() for name in ("qx", "qy", "qz", "qw"))
        # Half a turn about the body's z: q·k.
        turned = (y, -x, w, -z)
        for name, column in zip(("qx", "qy", "qz", "qw"), turned, strict=True):
            fields[name][500:540] = column

    (found,) = said(swap, BAR)
    assert found.kind == "attitude"
    assert "about the body's z, and back" in found.text
    step = np.median(np.diff(healthy()[0][BAR].stamp_ns)) * 1e-9
    assert found.at_s == pytest.approx((500 * step, 540 * step), abs=step)
    assert "40 of" in found.remedy
