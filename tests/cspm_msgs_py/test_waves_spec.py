import pytest

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import (
    FileMotion,
    JonswapMotion,
    MotionSpec,
    MovesMotion,
    StillMotion,
    VesselMotion,
)
from cspm_msgs_py.yaml_file import StrictModel, validate


class Rider(StrictModel):
    motion: MotionSpec


SEA = {"type": "jonswap", "peak_period": 2.3, "band": [0.21, 1.16], "period": 200.0}
JONSWAP = {**SEA, "amplitudes": [0.1, 0.1, 0.3, 0.03, 0.2, 0.1]}
VESSEL = {**SEA, "type": "vessel", "significant_wave_height": 0.4, "rao": "ship.mat"}
MOVE = {"at": 1.0, "duration": 2.0, "by": [0.1, 0, 0, 0, 0, 0]}


def read(motion):
    return validate(Rider, {"motion": motion}, "s.yaml").motion


@pytest.mark.parametrize(
    ("motion", "kind"),
    [
        ({"type": "still"}, StillMotion),
        (JONSWAP, JonswapMotion),
        (VESSEL, VesselMotion),
        ({"type": "file", "path": "m.csv"}, FileMotion),
        ({"type": "moves", "moves": [MOVE, {**MOVE, "at": 3.0}]}, MovesMotion),
    ],
)
def test_each_type_is_read(motion, kind):
    assert type(read(motion)) is kind


def test_defaults():
    spec = read(JONSWAP)
    assert spec.peak_enhancement == 3.3
    assert spec.heading == 0.0
    assert spec.ramp == 0.0
    assert spec.position == (0.0, 0.0)
    assert read(VESSEL).scale == 1.0
    assert read({"type": "file", "path": "m.csv"}).rate is None


@pytest.mark.parametrize("band", [[0.21, 1.16], [0.01, 25.0]])
def test_plausible_bands(band):
    assert read({**JONSWAP, "band": band}).band == tuple(band)


FAULTS = [
    (
        {**JONSWAP, "band": [1.16, 0.21]},
        "band: [1.16, 0.21] Hz, allowed: 0 < lowest < highest ≤ 25",
    ),
    ({**JONSWAP, "band": [0.0, 1.0]}, "band: [0, 1] Hz, allowed: 0 < lowest < highest ≤ 25"),
    ({**JONSWAP, "band": [1.0, 1.0]}, "band: [1, 1] Hz, allowed: 0 < lowest < highest ≤ 25"),
    ({**JONSWAP, "band": [1.0, 25.1]}, "band: [1, 25.1] Hz, allowed: 0 < lowest < highest ≤ 25"),
    ({**JONSWAP, "period": -200.0}, "period: -200.0, allowed: greater than 0"),
    ({**JONSWAP, "period": 1e5}, "period: 100000.0, allowed: less than or equal to 10800"),
    ({**JONSWAP, "period": 1.0}, "period: 1 s is too short for waves in the band 0.21 to 1.16 Hz"),
    ({**JONSWAP, "peak_period": 0.0}, "peak_period: 0.0, allowed: greater than 0"),
    ({**JONSWAP, "peak_enhancement": 0.5}, "peak_enhancement: 0.5, allowed: greater than or equal"),
    ({**JONSWAP, "heading": 225.0}, "heading: 225.0, allowed: less than or equal to 6.28"),
    ({**JONSWAP, "spreading": -1.0}, "spreading: -1.0, allowed: greater than or equal to 0"),
    ({**JONSWAP, "ramp": -1.0}, "ramp: -1.0, allowed: greater than or equal to 0"),
    ({**JONSWAP, "amplitudes": [0, -0.1, 0, 0, 0, 0]}, "amplitudes: sway -0.1, allowed: ≥ 0 m"),
    (
        {**JONSWAP, "amplitudes": [0, 0, 0, 1.6, 0, 0]},
        "amplitudes: roll 1.6, allowed: 0 ≤ amplitude < 1.5708 rad",
    ),
    (
        {**JONSWAP, "amplitudes": [0, 0, 0, 0, 1.6, 0]},
        "amplitudes: pitch 1.6, allowed: 0 ≤ amplitude < 1.5708 rad",
    ),
    (
        {**JONSWAP, "amplitudes": [0, 0, 0, 0, 0, 3.2]},
        "amplitudes: yaw 3.2, allowed: 0 ≤ amplitude < 3.1416 rad",
    ),
    ({**JONSWAP, "hight": 1.0}, "hight: unknown key, allowed: "),
    (SEA, "amplitudes: missing, a value is required"),
    ({**VESSEL, "scale": 0.0}, "scale: 0.0, allowed: greater than 0"),
    (
        {**VESSEL, "significant_wave_height": -1.0},
        "significant_wave_height: -1.0, allowed: greater",
    ),
    ({"type": "file", "path": "m.csv", "rate": 0.0}, "rate: 0.0, allowed: greater than 0"),
    ({"type": "file", "path": ""}, "path: '', allowed: "),
    ({"type": "moves", "moves": []}, "moves: [], allowed: "),
    (
        {"type": "moves", "moves": [MOVE, {**MOVE, "at": 2.9}]},
        "moves: [1] starts at 2.9 s, allowed: at or after the end of [0], 3 s",
    ),
    (
        {"type": "moves", "moves": [{**MOVE, "at": -1.0}]},
        "moves[0].at: -1.0, allowed: greater than",
    ),
    (
        {"type": "moves", "moves": [{**MOVE, "duration": 0.0}]},
        "moves[0].duration: 0.0, allowed: gr",
    ),
    (
        {"type": "moves", "moves": [{**MOVE, "at": 0.0123}]},
        "moves[0].at: 0.0123 s, allowed: a multiple of 0.001 s",
    ),
]


@pytest.mark.parametrize(("motion", "fault"), FAULTS)
def test_implausible_values_are_refused_in_one_line(motion, fault):
    with pytest.raises(InputError) as caught:
        read(motion)
    text = str(caught.value)
    assert text.startswith("s.yaml: motion")
    assert fault in text
    assert "\n" not in text
