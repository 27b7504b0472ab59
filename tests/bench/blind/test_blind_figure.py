"""The scorecard's picture: what is met and missed in it, and that all of it is drawn."""

import pytest
from matplotlib.colors import same_color
from matplotlib.figure import Figure
from matplotlib.image import imread

from bench.blind.scoring.figure import _draw_bars, _draw_calibration, _draw_targets, draw_scorecard
from bench.blind.scoring.share import share_of as of
from bench.blind.scoring.target import findings_judged, numbers_judged

KEYS = (
    *("block", "block_tied", "element", "first", "named", "effect_only", "tied", "detected"),
    *("nothing_wrong_beside", "false_alarm", "parameter_called_effect", "unknown_recognised"),
    *("false_unknown", "failed"),
)


def card(**shares):
    amounts = [
        {"multiple": m, "detected": of(9, 10), "tied": of(8, 10), "named": of(n, 10)}
        for m, n in ((0.5, 2), (1.0, 5), (2.0, 8))
    ]
    return {
        "shares": dict.fromkeys(KEYS, of(9, 10)) | {"false_alarm": of(0, 60)} | shares,
        "parameters": {"covered": of(93, 100)},
        "fit": {"near_floor": of(99, 100), "below_retuned": of(0, 0)},
        "by_multiple": amounts,
        "by_stratum": [{"stratum": "noise", "cases": 10, "detected": 9, "named": 8}],
        "calibration": [
            {"said": None, "right": of(0, 0)},
            {"said": 0.9, "right": of(7, 10)},
        ],
        "peers": [],
    }


def colours(found):
    """Colours of the dots, by label."""
    axes = Figure().subplots()
    _draw_targets(axes, found)
    labels = [tick.get_text() for tick in axes.get_yticklabels()]
    dots = [line for line in axes.get_lines() if line.get_marker() == "o"]
    return {label: dot.get_color() for label, dot in zip(labels, dots, strict=True)}


@pytest.mark.parametrize(
    ("shares", "label", "met"),
    [
        ({"block": of(97, 100)}, "block found", True),
        ({"block": of(96, 100)}, "block found", False),
        ({"false_alarm": of(1, 60)}, "alarm where there is nothing", True),
        ({"false_alarm": of(2, 60)}, "alarm where there is nothing", False),
        ({}, "intervals that hold the truth", True),
        ({}, "held-out error within 1.5 × floor", False),
    ],
)
def test_what_is_met_is_green_and_what_is_missed_is_red(shares, label, met):
    assert same_color(colours(card(**shares))[label], "tab:green" if met else "tab:red")


def test_what_has_no_target_or_no_cases_is_not_drawn():
    found = card()
    labels = set(colours(found))
    assert "anything found" not in labels
    assert "held-out error below re-tuned" not in labels
    reported = {r.label for r in (*findings_judged(found), *numbers_judged(found)) if r.target}
    assert labels == reported - {"held-out error below re-tuned"}


def test_bars_have_their_length_and_say_of_how_many():
    axes = Figure().subplots()
    rows = [{"method": "a", "hit": of(3, 4)}, {"method": "b", "hit": of(0, 0)}]
    _draw_bars(axes, rows, "method", {"hit": ("found", "C0")})
    assert [bar.get_width() for bar in axes.patches] == [0.75, 0.0]
    assert [text.get_text().strip() for text in axes.texts] == ["3 of 4", "0 of 0"]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["a", "b"]


def test_probabilities_that_were_never_reported_are_not_drawn():
    axes = Figure().subplots()
    _draw_calibration(axes, card()["calibration"])
    (dot,) = [line for line in axes.get_lines() if line.get_marker() == "o"]
    assert (dot.get_xdata()[0], dot.get_ydata()[0]) == (0.9, 0.7)


@pytest.mark.parametrize("peers", [False, True])
def test_the_picture_is_written_with_and_without_peers(tmp_path, peers):
    rows = [
        {"method": m, "scored": 9, "first": of(5, 9), "nothing_wrong_beside": of(4, 9)}
        | {"false_alarm": of(0, 2)}
        for m in ("cspm", "retuned")
    ]
    path = tmp_path / "card.png"
    draw_scorecard(path, card() | {"peers": rows if peers else []})
    picture = imread(path)
    assert picture.shape[1] > 1000
    assert picture[..., :3].std() > 0.05
