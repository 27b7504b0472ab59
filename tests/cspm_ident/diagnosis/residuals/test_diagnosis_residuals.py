"""Residuals driven by measured signals, and that effects' columns are what they leave over."""

from dataclasses import replace

import numpy as np
import pytest
from residual_samples import without_start, worst_sea
from run_samples import SCENARIOS, bundle_of

from cspm_ident.diagnosis.residuals.cable_and_bar import Suspension
from cspm_ident.diagnosis.residuals.corrected_measurement import with_found
from cspm_ident.diagnosis.residuals.drive_torque import sampled_constant, time_constant
from cspm_ident.diagnosis.residuals.machine_signals import machine_signals
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.winch_torque import may_reverse
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.testbed import EffectEntry, load_testbed
from cspm_run.recorded_run import run
from cspm_sim.effect_entries import Action, altered_testbed
from cspm_sim.effects import Channel, catalogue
from cspm_sim.effects.signals import FrameSignal

THESIS = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")


@pytest.fixture(scope="module")
def measurement(tmp_path_factory):
    """Six seconds of the worst sea, read by ideal sensors."""
    return worst_sea(tmp_path_factory.mktemp("residuals") / "bag")


@pytest.fixture(scope="module")
def equations(measurement):
    return by_place(measurement)


def by_place(measurement, effects=None):
    found = equations_of(measurement, list(catalogue().values()) if effects is None else effects)
    return {equation.place: equation for equation in found}


def described(measurement, name, element, **values):
    """The measurement, said to be of a machine with other parameters."""
    effect = catalogue()[name]
    machine = measurement.machine
    index = machine.cable_names.index(element) if element in machine.cable_names else 0
    other = altered_testbed(machine, [Action(effect, index, element, values)])
    return measurement.with_machine(other)


def rms(values):
    return np.sqrt(np.mean(np.square(values), axis=0))


def test_there_is_one_residual_per_winch_cable_and_bar(equations):
    cables = THESIS.testbed.cable_names
    kinds = (Channel.DRIVE, Channel.SHAFT, Channel.TENSION)
    expected = {Place(kind, name) for kind in kinds for name in cables}
    assert set(equations) == expected | {Place(Channel.WRENCH, "bar")}


def test_the_machine_itself_leaves_next_to_nothing(equations):
    """Of what the residual is made of: ideal sensors, but smoothing and discrete derivatives."""
    for place, equation in equations.items():
        left = without_start(equation, equation.target)
        assert np.all(rms(left) < 0.01 * rms(equation.measured - equation.measured.mean(0))), place


def test_cables_pull_the_frame_towards_the_bar(measurement):
    (signals,) = machine_signals(Timeline(measurement))
    here = Suspension(signals, measurement.machine, nominal_parameters(measurement.machine))
    cables = range(len(measurement.machine.cables))
    towards = FrameSignal.DIRECTION + np.arange(3)
    pulls = sum(signals.tensions[:, i, None] * here.frame_rows(i)[:, towards] for i in cables)
    force = here.frame_rows(0)[:, FrameSignal.FORCE + np.arange(3)]
    np.testing.assert_allclose(force, pulls, atol=1e-9)
    assert np.abs(force).max() > 10.0


@pytest.mark.parametrize(
    ("name", "element", "samples", "change"),
    [
        ("tension_gain", "surge_1", "tension", lambda t, v, i: 0.002 * v[:, i]),
        ("tension_bias", "hoist_2", "tension", lambda t, v, i: 0.002),
        ("tension_drift", "sway_2", "tension", lambda t, v, i: 0.002 * t),
        (
            "tension_crosstalk",
            "sway_4",
            "tension",
            lambda t, v, i: 0.002 * np.delete(v, i, axis=1).mean(axis=1),
        ),
        ("encoder_scale", "sway_3", "angle", lambda t, v, i: 1e-5 * v[:, i]),
    ],
)
def test_a_wrong_reading_leaves_its_columns(measurement, equations, name, element, samples, change):
    """Readings really changed move the residuals of cable and bar by the columns, no others."""
    weight = 1e-5 if samples == "angle" else 0.002
    i = measurement.machine.cable_names.index(element)
    read = getattr(measurement, samples)
    values = read.values.copy()
    values[:, i] += change(read.times, read.values, i)
    moved = by_place(measurement.with_samples(samples, Samples(read.times, values)), [])
    candidate = Candidate(catalogue()[name], element)
    reached = {Place(Channel.TENSION, element)}
    reached |= {Place(Channel.WRENCH, "bar")} if samples == "tension" else set()
    for place, equation in equations.items():
        if place.channel not in (Channel.TENSION, Channel.WRENCH):
            continue
        change_seen = without_start(equation, moved[place].target - equation.target)
        assert (candidate in equation.columns) == (place in reached)
        if place not in reached:
            assert np.all(np.abs(change_seen) < 1e-9)
            continue
        expected = without_start(equation, weight * equation.columns[candidate][:, :, 0])
        # The length at the start, given by the first tension, is taken out to first order only.
        assert rms(change_seen - expected).max() < 0.03 * rms(expected).max()


def test_what_candidates_do_not_touch_may_be_left_out(measurement, equations):
    winch = Candidate(catalogue()["winch_coulomb_friction"], "sway_1")
    sensor = Candidate(catalogue()["tension_gain"], "sway_1")
    radius = Candidate(catalogue()["winch_drum_radius"], "sway_1")
    for touched, suspended in (([winch], False), ([winch, sensor], True), ([radius], True)):
        found = equations_of(measurement, [winch.effect], touched=touched)
        assert [e.place for e in found if e.place.channel is Channel.SHAFT] == [
            Place(Channel.SHAFT, "sway_1")
        ]
        assert suspended == any(e.place.channel is Channel.WRENCH for e in found)
        for equation in found:
            assert np.array_equal(equation.target, equations[equation.place].target)


def test_a_late_load_cell_touches_its_winch_alone(measurement):
    effect, names = catalogue()["tension_delay"], measurement.machine.cable_names
    found = equations_of(measurement, [effect], touched=[Candidate(effect, names[0])])
    shafts = [e for e in found if e.place.channel is Channel.SHAFT]
    assert [e.place.element for e in shafts] == list(names)
    assert all(list(e.columns) == [Candidate(effect, e.place.element)] for e in shafts)


@pytest.mark.parametrize(
    ("name", "element", "value", "channel"),
    [
        ("winch_inertia", "sway_1", {"inertia": 2e-5}, Channel.SHAFT),
        ("winch_drum_radius", "surge_2", {"radius": 1e-4}, Channel.SHAFT),
        ("cable_axial_damping", "hoist_1", {"scale": 1.05}, Channel.TENSION),
        ("cable_stiffness", "surge_1", {"scale": 1.01}, Channel.TENSION),
        ("bar_mass", "bar", {"mass": 0.1}, Channel.WRENCH),
        ("bar_com", "bar", {"x": 0.01, "y": 0.0, "z": 0.0}, Channel.WRENCH),
        ("bar_inertia", "bar", {"ixx": 0.0, "iyy": 1e-3, "izz": 1e-3}, Channel.WRENCH),
    ],
)
def test_a_wrong_number_of_the_file_leaves_its_column(
    measurement, equations, name, element, value, channel
):
    """What the file has too much of is missing with the opposite sign."""
    effect = catalogue()[name]
    wrong = by_place(described(measurement, name, element, **value), [effect])
    place = Place(channel, element)
    here = equations[place]
    change = without_start(here, wrong[place].target - here.target)
    columns = next(
        found
        for term, found in here.columns.items()
        if getattr(term, "effect_id", "") == name and term.element == element
    )
    full = {p.name: value.get(p.name, p.absent) for p in effect.parameters}
    expected = without_start(here, columns @ effect.weights(full))
    assert rms(change + expected).max() < 0.03 * rms(expected).max()
    assert rms(change - expected).max() > rms(expected).max()


@pytest.mark.parametrize("body", ["bar", "winch_frame"])
def test_a_late_motion_capture_leaves_its_column(measurement, equations, body):
    """Half a millisecond more of delay, as samples with stamps that are too late."""
    late = 5e-4
    kind = "bar_pose" if body == "bar" else "frame_pose"
    shifted = measurement.with_samples(kind, getattr(measurement, kind).shifted(late))
    found = by_place(shifted, [catalogue()["pose_delay"]])
    for cable in ("hoist_1", "sway_3"):
        place = Place(Channel.TENSION, cable)
        columns = next(
            c
            for term, c in equations[place].columns.items()
            if getattr(term, "effect_id", "") == "pose_delay" and term.element == body
        )
        before = equations[place]
        times = found[place].times
        expected = late * np.interp(times, before.times, columns[:, 0, 0])
        change = found[place].target[:, 0] - np.interp(times, before.times, before.target[:, 0])
        inner = slice(5, -5)
        # The unknown length at the start moves with the first sample.
        error = (change - expected)[inner]
        assert rms(error - error.mean()) < 0.1 * rms(expected[inner])


def test_without_load_cells_and_motion_capture_there_is_only_what_needs_none(measurement):
    deaf = replace(measurement, tension=None, bar_pose=None)
    assert {place.channel for place in by_place(deaf)} == {Channel.DRIVE}
    assert by_place(replace(deaf, command=None)) == {}


def test_without_motion_capture_the_winches_are_left(measurement):
    blind = replace(measurement, bar_pose=None, frame_pose=None)
    assert {place.channel for place in by_place(blind)} == {Channel.DRIVE, Channel.SHAFT}


def test_a_drive_that_lags_leaves_its_column(tmp_path):
    lag = EffectEntry(
        effect="winch_torque_lag", elements=("sway_1",), parameters={"time_constant": 0.004}
    )
    slow = THESIS.testbed.model_copy(update={"effects": (*THESIS.testbed.effects, lag)})
    bundle = bundle_of("worst_case_steep", "duration=4", "sensors=ideal")
    run(bundle.concealing(slow), tmp_path / "bag")
    plain = read_measurement(tmp_path / "bag")
    effect = catalogue()["winch_torque_lag"]
    for cable, expected in (("sway_1", 0.004), ("sway_2", 0.0)):
        equation = by_place(plain, [effect])[Place(Channel.DRIVE, cable)]
        (columns,) = equation.columns.values()
        (found,) = np.linalg.lstsq(columns[:, 0], equation.target[:, 0], rcond=None)[0]
        assert time_constant(found, 1e-3) == pytest.approx(expected, abs=1e-4)
        assert sampled_constant(time_constant(found, 1e-3), 1e-3) == pytest.approx(found, abs=1e-6)
    known = with_found(plain, {Candidate(effect, "sway_1"): np.array([0.004])})
    reported = by_place(known, [])[Place(Channel.DRIVE, "sway_1")]
    without = by_place(plain, [])[Place(Channel.DRIVE, "sway_1")]
    assert rms(reported.target)[0] < 0.1 * rms(without.target)[0]


@pytest.mark.parametrize(
    ("name", "element", "value", "channel"),
    [
        ("winch_inertia", "sway_1", {"inertia": 2e-5}, Channel.SHAFT),
        ("cable_stiffness", "surge_1", {"scale": 1.01}, Channel.TENSION),
        ("tension_bias", "sway_2", {"bias": 0.5}, Channel.SHAFT),
    ],
)
def test_effects_of_the_file_count(measurement, equations, name, element, value, channel):
    """An effect under `effects` changes the residual by its columns, as a finding would."""
    effect = catalogue()[name]
    candidate = Candidate(effect, element)
    full = {p.name: value.get(p.name, p.absent) for p in effect.parameters}
    weights = effect.weights(full)
    place = Place(channel, element)
    known = by_place(with_found(measurement, {candidate: weights}), [])[place]
    change = without_start(equations[place], known.target - equations[place].target)
    expected = without_start(equations[place], -equations[place].columns[candidate] @ weights)
    assert rms(change - expected).max() < 0.03 * rms(expected).max()


@pytest.mark.parametrize("gain", [0.5, 0.9, 2.0])
def test_a_gain_of_torque_is_judged_by_the_torque_as_it_was_reported(measurement, gain):
    """A wrong gain leaves 1 − 1/g of the torque; never less than that."""
    place = Place(Channel.SHAFT, "surge_2")
    entry = EffectEntry(
        effect="winch_torque_gain", elements=("surge_2",), parameters={"gain": gain}
    )
    machine = measurement.machine.model_copy(update={"effects": (entry,)})
    own = by_place(measurement.with_machine(machine))[place]
    expected = abs(1.0 - 1.0 / gain) * rms(own.measured)
    assert rms(own.target) == pytest.approx(expected, rel=0.02)


def test_the_column_of_a_gain_is_the_torque_that_the_model_needs(measurement):
    """Fitted alone it takes nothing of a torque that no gain makes, however large that is."""
    place = Place(Channel.SHAFT, "surge_2")
    torque = measurement.torque
    column = measurement.machine.cable_names.index("surge_2")
    values = torque.values.copy()
    values[:, column] += 50.0 * np.sin(31.0 * torque.times)
    off = measurement.with_samples("torque", Samples(torque.times, values))
    own = by_place(off, [catalogue()["winch_torque_gain"]])[place]
    (columns,) = own.columns.values()
    regressor, target = columns[:, 0, 0].astype(float), own.target[:, 0]
    weight = regressor @ target / (regressor @ regressor)
    assert rms(target - weight * regressor) == pytest.approx(rms(target), rel=0.05)
    np.testing.assert_allclose(regressor, target - own.measured[:, 0], atol=1e-3 * rms(target))


def test_the_column_of_a_load_cells_scale_is_the_tension_of_the_cables_law(measurement):
    place = Place(Channel.TENSION, "sway_2")
    own = by_place(measurement, [catalogue()["tension_gain"]])[place]
    scale = Candidate(catalogue()["tension_gain"], "sway_2")
    expected = (own.measured - own.target)[:, 0]
    np.testing.assert_allclose(own.columns[scale][:, 0, 0], expected, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize(("counts", "known"), [(1_000, False), (100_000, True)])
def test_the_direction_is_known_where_the_speed_exceeds_the_encoder_s_steps(counts, known):
    """At 2 rad/s and 1 kHz a coarse encoder's difference is 0 or 6.3 rad/s."""
    step = 2.0 * np.pi / counts
    angles = step * np.round(2e-3 * np.arange(2000) / step)
    reverses = may_reverse(np.diff(angles) / 1e-3, 0.05, 41)
    assert reverses.all() if not known else not reverses.any()


def test_a_reversal_is_found_within_half_a_window():
    times = 1e-3 * np.arange(2001)
    reverses = may_reverse(np.cos(np.pi * times), 0.05, 41)
    # Speeds below 5 % of the root mean square are within 11.3 ms of the reversal.
    found = np.flatnonzero(reverses)
    assert (found[0], found[-1]) == (500 - 31, 1500 + 31)
    assert not reverses[600:1400].any()
    assert may_reverse(-np.cos(np.pi * times), 0.05, 41).tolist() == reverses.tolist()
