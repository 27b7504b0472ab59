"""The test-bed's description that travels inside a recording."""

from __future__ import annotations

from collections.abc import Mapping

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import TestbedFile, parse_testbed

TESTBED = "testbed.yaml"


def attached_testbed(attachments: Mapping[str, bytes], source: object) -> TestbedFile:
    """Return the test-bed that a recording carries.

    Args:
        attachments: the recording's, by name.
        source: names the recording in errors.

    Raises:
        InputError: it carries none, or a damaged one.
    """
    text = attachments.get(TESTBED)
    if text is None:
        raise InputError(f"{source}: carries no {TESTBED}, allowed: with --testbed FILE")
    return parse_testbed(text.decode(errors="replace"), f"{source}: {TESTBED}")
