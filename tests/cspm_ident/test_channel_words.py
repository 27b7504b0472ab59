"""Names of channels in plain words."""

import pytest

from cspm_ident.channel_words import channel_words


@pytest.mark.parametrize(
    ("channel", "words"),
    [
        ("winches/torque/surge_2", "torque of winch surge 2"),
        ("winches/torque_command/surge_2", "commanded torque of winch surge 2"),
        ("cables/tension/sway_1", "tension of cable sway 1"),
        ("bar/pose/heave", "heave pose of the bar"),
        ("winch_frame/pose/yaw", "yaw pose of the winch frame"),
        ("bar/wrench", "wrench of the bar"),
        ("pitch", "pitch"),
    ],
)
def test_a_channel_is_named_as_people_do(channel, words):
    assert channel_words(channel) == words
