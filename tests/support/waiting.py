"""Waiting for what another program does."""

import time

import pytest

PATIENCE_S = 240


def until(condition, what):
    """Wait for a condition, and fail where it does not come."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > end:
            pytest.fail(f"{what}: not within {PATIENCE_S} s")
        time.sleep(0.05)
