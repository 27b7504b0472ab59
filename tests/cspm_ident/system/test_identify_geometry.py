"""Where cables begin and end, found from recordings of a plant of another make."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from machines import THESIS
from run_samples import bundle_of

from bench.accuracy.geometry import with_frame_beside
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.system.choice import choose
from cspm_ident.system.fitted_file import fitted_testbed
from cspm_ident.system.identification import solve
from cspm_ident.system.machine import machine_with
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed, parse_testbed
from cspm_run.recorded_run import run
from cspm_sim.effect_entries import altered_testbed, read_actions

FILE = load_testbed(THESIS)
MACHINE = FILE.testbed
# x y z [m], φ θ ψ [rad]
BESIDE = (0.008, 0.0, 0.01, 0.0, -0.005, 0.006)
TRUE = {
    "frame_offset.surge": 0.008,
    "frame_offset.heave": 0.01,
    "frame_offset.pitch": -0.005,
    "frame_offset.yaw": 0.006,
}


def recorded(folder, beside, scenario, *overrides):
    """Record a machine whose frame is beside its sensor; return it as the described one's."""
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    bundle = bundle_of(scenario, "seed=5", *overrides)
    moved = bundle.concealing(with_frame_beside(MACHINE, beside))
    changed = dataclasses.replace(moved, plant="mujoco")
    assert not run(changed, folder, lambda now: None).failure
    return read_measurement(folder).with_testbed(FILE)


@pytest.mark.slow
def test_a_frame_beside_its_sensor_is_found_from_motion_in_surge(tmp_path):
    """Each interval holds what was put in, and shuts out that there is nothing."""
    measurement = recorded(tmp_path / "moving", BESIDE, "factor_six_mid", "duration=13")
    found = solve([measurement], choose(MACHINE, list(TRUE)), most_windows=2)
    assert found.settled
    for name, true in TRUE.items():
        low, high = found.solution.estimate.interval(name)
        assert low <= true <= high, (name, low, high)
        assert not low <= 0.0 <= high, (name, low, high)


@pytest.mark.slow
def test_geometry_that_nothing_excites_is_named_and_has_no_interval(tmp_path):
    """A bar at rest: the balance of forces shows surge, but only to load cells, and never heave."""
    beside = (0.008, 0.0, 0.01, 0.0, 0.0, 0.0)
    options = ("duration=12.5", "control.mode=locked_winches")
    still = recorded(tmp_path / "rest", beside, "rest", *options)
    names = ["frame_offset.surge", "frame_offset.heave"]
    for measurement, unseen in (
        (still, names[1:]),
        (dataclasses.replace(still, tension=None), names),
    ):
        found = solve([measurement], choose(MACHINE, names), most_windows=1, delays={})
        estimate = found.solution.estimate
        assert [direction.name for direction in estimate.unexcited] == unseen
        for name in unseen:
            assert estimate.interval(name) == (-np.inf, np.inf)
        if names[0] not in unseen:
            low, high = estimate.interval(names[0])
            assert 0.0 < low <= beside[0] <= high


def test_a_frame_offset_moves_exits_as_one_body():
    """The effect that is fitted against a turn by another library."""
    chosen = choose(MACHINE, [f"frame_offset.{dof}" for dof in ("surge", "sway", "roll", "yaw")])
    offset = (0.02, -0.03, 0.0, 0.1, 0.0, -0.2)
    fitted = machine_with(MACHINE, chosen, [offset[i] for i in (0, 1, 3, 5)])
    fitted = altered_testbed(fitted, read_actions(fitted))
    by_hand = with_frame_beside(MACHINE, offset)
    for one, other in zip(fitted.cables, by_hand.cables, strict=True):
        assert one.exit == pytest.approx(other.exit, abs=1e-12)


def test_one_end_of_one_cable_moves_alone():
    chosen = choose(MACHINE, ["exit.sway_1.y", "attachment.hoist_2.z"])
    assert [each.nominal for each in chosen] == [0.398, -0.02]
    assert {each.parameter.unit for each in chosen} == {"m"}
    found = machine_with(MACHINE, chosen, [0.41, -0.05])
    ends = {c.name: (c.exit, c.attachment) for c in found.cables}
    expected = {c.name: (c.exit, c.attachment) for c in MACHINE.cables}
    expected["sway_1"] = ((0.379, 0.41, -0.25), expected["sway_1"][1])
    expected["hoist_2"] = (expected["hoist_2"][0], (-0.5, 0.0, -0.05))
    assert ends == expected


@pytest.mark.parametrize("name", ["exit.rope_1.x", "exit.sway_1.w", "exit.sway_1", "attachment"])
def test_a_wrong_end_is_one_line(name):
    with pytest.raises(InputError, match=rf"^--fit {name}: allowed: .*exit\.CABLE\.x\|y\|z, att"):
        choose(MACHINE, [name])


def found_at(values, text=FILE.text, unexcited=()):
    """Return the file with ends of cables put in by name, and a result that says so."""
    file = parse_testbed(text, "described")
    intervals = {name: (value - 1e-3, value + 1e-3) for name, value in values.items()}
    intervals |= {name: (-np.inf, np.inf) for name in unexcited}
    estimate = SimpleNamespace(value=values.get, interval=intervals.get, at_bound=())
    searched = SimpleNamespace(sha256="5" * 64, duration=13.0)
    result = SimpleNamespace(
        chosen=choose(file.testbed, list(values)),
        solution=SimpleNamespace(estimate=estimate),
        searched=(searched,),
        settled=True,
    )
    return fitted_testbed(result, file, "t.yaml")


def test_found_ends_stand_with_their_cable_and_its_other_coordinates_keep_their_origin():
    found = found_at({"exit.sway_1.y": 0.4, "exit.sway_1.z": -0.26})
    number = MACHINE.cable_names.index("sway_1")
    assert found.testbed.cables[number].exit == (0.379, 0.4, -0.26)
    fitted = found.provenance[f"cables[{number}].exit[1]"]
    assert (fitted.provenance, fitted.recording) == ("fitted", "5" * 64)
    assert fitted.interval == (0.399, 0.401)
    kept = found.provenance[f"cables[{number}].exit[0]"]
    assert kept.provenance == "reconstructed"
    assert "table 6-1" in kept.note


def test_an_end_that_is_not_excited_is_not_written():
    found = found_at({"exit.sway_1.z": -0.26}, unexcited=["exit.sway_1.z"])
    assert found.text == FILE.text


def test_cables_that_take_an_end_from_another_keep_theirs():
    """The second hoist without an attachment of its own has the first one's by `<<`."""
    own = "    attachment: {value: [-0.5, 0.0, -0.02], provenance: reconstructed}\n"
    assert own in FILE.text
    found = found_at({"attachment.hoist_1.x": 0.52}, FILE.text.replace(own, "", 1))
    first, second = found.testbed.cables[:2]
    assert first.attachment == (0.52, 0.0, -0.02)
    assert second.attachment == (0.5, 0.0, -0.02)
