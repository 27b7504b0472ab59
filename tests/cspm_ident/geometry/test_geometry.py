"""Self-calibration against machines whose ends were moved, by lengths that scipy's turns give."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from geometry_samples import BAR, FRAME, measured, survey
from machines import general_content

from cspm_ident.geometry.fitted_file import fitted_file
from cspm_ident.geometry.identify_geometry import identify_geometry
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import parse_testbed
from cspm_msgs_py.testbed_keys.route import Stop

NOISE = 1e-4
# Without turns of either body, ends that move alike change no length.
STRAIGHT = {"bar": BAR * [1, 1, 1, 0, 0, 0], "frame": 0.0 * FRAME}


@pytest.fixture(scope="module")
def moved():
    """A machine with errors of 2 mm, and what was found of it."""
    truth = survey(11)
    return truth, identify_geometry([measured(truth, 60.0, noise=NOISE)])


def ends(result):
    """Offsets (n, 6), their intervals (n, 6, 2), and which are determined, (n, 6)."""
    found = [cable.numbers[:6] for cable in result.cables]
    parts = [
        [[getattr(x, name) for x in row] for row in found] for name in ("off", "ci95", "determined")
    ]
    return tuple(np.array(part) for part in parts)


def beyond(result):
    return [(c.name, n.name) for c in result.cables for n in c.numbers if n.beyond]


def test_errors_of_two_millimetres_are_within_their_intervals(moved):
    """Of 48 intervals of 95 % two or three may miss."""
    truth, result = moved
    off, interval, determined = ends(result)
    inside = (interval[..., 0] <= truth) & (truth <= interval[..., 1])
    assert inside.sum() >= 44
    assert determined.sum() >= 44
    half = 0.5 * np.ptp(interval, axis=2)
    sharp = half < 2e-4
    assert sharp.sum() >= 30
    assert np.abs(off - truth)[sharp].max() < 2e-4
    # The survey is said to be twice as bad as usual ones.
    assert 1.5 < result.factors["points"] < 2.5
    assert result.factors["drum radius"] == 1.0


def test_a_fitted_file_leaves_nothing_off(moved):
    truth, result = moved
    file = result.searched[0].testbed
    better = fitted_file(result, file, "fitted.yaml")
    once_more = measured(truth, 60.0, noise=NOISE, seed=8).with_testbed(better)
    judge = measured(truth, 30.0, noise=NOISE, seed=9).with_testbed(better)
    again = identify_geometry([once_more], [judge])
    assert beyond(again) == []
    assert again.factors["points"] == 1.0
    (_, searched, before, after), (_, held_out, improved, _) = again.cables[0].errors
    assert (searched, held_out) == (False, True)
    assert after < before < 1.2 * after
    assert improved < 0.2 * result.cables[0].errors[0][2]


def test_a_healthy_machine_has_nothing_beyond_its_accuracy():
    result = identify_geometry([measured(survey(12, 0.3e-3), noise=NOISE)])
    assert beyond(result) == []
    assert result.factors["points"] == 1.0
    assert result.objections == ()
    assert all(cable.moves for cable in result.cables)


def test_one_attachment_that_is_off_is_named_alone():
    truth = np.zeros((8, 6))
    truth[2, 3] = 5e-3
    result = identify_geometry([measured(truth, noise=NOISE)])
    assert beyond(result) == [("c2", "attachment x")]
    assert result.cables[2].number("attachment x").off == pytest.approx(5e-3, abs=1e-4)


@pytest.mark.parametrize("factor", [1.06, 0.94])
def test_a_scale_of_six_per_cent_is_found_on_its_cable_alone(factor):
    scales = np.where(np.arange(8) == 4, factor, 1.0)
    result = identify_geometry([measured(np.zeros((8, 6)), noise=NOISE, scales=scales)])
    assert beyond(result) == [("c4", "drum radius")]
    number = result.cables[4].number("drum radius")
    assert number.off == pytest.approx(factor - 1.0, rel=0.01)
    (_, _, before, after) = result.cables[4].errors[0]
    assert after < 0.1 * before


def test_poses_that_are_late_are_told_and_move_no_end():
    result = identify_geometry([measured(np.zeros((8, 6)), noise=NOISE, late=0.012)])
    assert result.lateness.off == pytest.approx(0.012, abs=2e-4)
    assert beyond(result) == []


def test_without_load_cells_stretch_is_an_error_of_lengths():
    without = identify_geometry([measured(survey(13), noise=NOISE, tension=False)])
    beside = identify_geometry([measured(survey(13), noise=NOISE)])
    assert [n.name for n in without.cables[0].numbers][-1] == "drum radius"
    widths = [np.ptp(ends(each)[1], axis=2) for each in (without, beside)]
    assert (widths[0] > 2.0 * widths[1]).mean() > 0.9
    _, interval, _ = ends(without)
    inside = (interval[..., 0] <= survey(13)) & (survey(13) <= interval[..., 1])
    assert inside.sum() >= 44


def test_a_machine_without_winch_frame_has_its_exits_in_the_world():
    content = general_content()
    del content["winch_frame"]
    file = parse_testbed(yaml.safe_dump(content), "fixed.yaml")
    fixed = replace(measured(survey(14), 60.0, noise=NOISE, file=file, frame=0.0), frame_pose=None)
    result = identify_geometry([fixed])
    _, interval, _ = ends(result)
    inside = (interval[..., 0] <= survey(14)) & (survey(14) <= interval[..., 1])
    assert inside.sum() >= 44
    assert not any("winch frame" in each.motion for each in result.undetermined)


def test_what_straight_motion_does_not_tell_is_named_with_the_motion_that_does(moved):
    straight = measured(survey(11), noise=NOISE, **STRAIGHT)
    result = identify_geometry([straight])
    together = {
        each.name: each
        for each in result.undetermined
        if each.name.startswith("exit and attachment")
    }
    assert len(together) == 3
    assert "in z" in [*together][2]
    for each in together.values():
        assert each.cables == tuple(f"c{i}" for i in range(8))
        assert "rad in " in each.motion
        assert each.sd_with < 0.5 * each.sd
    determined = {each.name for each in moved[1].undetermined}
    assert not determined & set(together)
    # The turns are recorded as well: what was expected of them comes true.
    sweep = {"bar": BAR * [0, 0, 0, 1, 1, 1], "frame": 0.0 * FRAME}
    both = identify_geometry([straight, measured(survey(11), noise=NOISE, seed=4, **sweep)])
    assert not {each.name for each in both.undetermined} & set(together)


def test_an_angle_of_the_other_sign_is_no_result():
    scales = np.where(np.arange(8) == 0, -1.0, 1.0)
    result = identify_geometry([measured(np.zeros((8, 6)), noise=NOISE, scales=scales)])
    (text,) = result.objections
    assert text.startswith("c0: no result: scale -")
    assert text.endswith("check the sign of the angle: positive winds in")
    kept = fitted_file(result, result.searched[0].testbed, "f.yaml").testbed.cables[0]
    assert kept == result.searched[0].machine.cables[0]


def test_what_is_missing_is_named():
    good = measured(np.zeros((8, 6)), 5.0)
    with pytest.raises(InputError, match="geometry needs /winches/state position, allowed: "):
        identify_geometry([replace(good, angle=None)])
    with pytest.raises(InputError, match="geometry needs /bar/pose, allowed: "):
        identify_geometry([replace(good, bar_pose=None)])
    still = Samples(good.angle.times, np.ones_like(good.angle.values))
    with pytest.raises(InputError, match="no winch moves, allowed: recordings in which one does"):
        identify_geometry([good.with_samples("angle", still)])
    with pytest.raises(InputError, match="rows with all poses and angles, allowed: 50 and more"):
        identify_geometry([good.within(1.0, 1.5)])
    cable = good.machine.cables[0]
    stops = tuple(
        Stop(on=on, at=at) for on, at in (("frame", cable.exit), ("bar", cable.attachment))
    )
    routed = cable.model_copy(update={"route": stops})
    machine = good.machine.model_copy(update={"cables": (routed, *good.machine.cables[1:])})
    with pytest.raises(InputError, match="c0 has a route, allowed: cables from exit to attachment"):
        identify_geometry([replace(good, assumed=machine)])
