"""What a node said last, in one line of a report on its end."""

import pytest
from ros_graph import load_ros

load_ros()

from cspm_ros.processes.node_processes import last_words  # noqa: E402 - ROS has to be there

SHARED_MEMORY = (
    "\x1b[37;1m2026-11-27 10:46:16.114 \x1b[31;1m[\x1b[37;1mRTPS_TRANSPORT_SHM\x1b[31;1m Error] "
    "\x1b[37mFailed init_port fastrtps_port7000: open_and_lock_file failed\x1b[34;1m -> Function "
    "\x1b[36mopen_port_internal\x1b[m"
)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], ""),
        (["", "  "], ""),
        (["first", "the plant waits", ""], "the plant waits"),
        ([SHARED_MEMORY], ""),
        (["the plant waits", SHARED_MEMORY, ""], "the plant waits"),
        ([SHARED_MEMORY, "\x1b[31mterminate called\x1b[0m"], "terminate called"),
        (
            ["[ERROR] [1.0] [plant]: [RTPS] is no reason"],
            "[ERROR] [1.0] [plant]: [RTPS] is no reason",
        ),
    ],
)
def test_the_last_line_that_is_a_nodes_own(lines, words):
    assert last_words("\n".join(lines)) == words
