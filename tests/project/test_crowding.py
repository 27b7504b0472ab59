"""Tests by the wall clock are skipped where others have the processors, and only there."""

import os
import subprocess
import sys
import time

import conftest
import pytest


def times_of(busy):
    """What `psutil.cpu_times` says: before, nothing; afterwards so much by everybody [s]."""
    kinds = ("user", "nice", "system")
    zero, later = (
        type("Times", (), dict.fromkeys(kinds, each)) for each in (0.0, busy / len(kinds))
    )
    answers = iter((zero, later))
    return lambda: next(answers)


@pytest.mark.parametrize(("others", "crowded"), [(0.02, False), (0.5, True)])
def test_others_count_by_what_they_use(monkeypatch, others, crowded):
    clock = iter((0.0, 0.5, 0.5))
    monkeypatch.setattr(conftest.time, "perf_counter", lambda: next(clock))
    used = iter((1.0, 1.5))
    monkeypatch.setattr(conftest.time, "process_time", lambda: next(used))
    monkeypatch.setattr(conftest.psutil, "cpu_times", times_of(0.5 + others))
    assert conftest.is_crowded() is crowded


def test_a_loop_that_does_not_get_its_processor_is_crowded(monkeypatch):
    clock = iter((0.0, 0.5, 0.5))
    monkeypatch.setattr(conftest.time, "perf_counter", lambda: next(clock))
    used = iter((1.0, 1.4))
    monkeypatch.setattr(conftest.time, "process_time", lambda: next(used))
    monkeypatch.setattr(conftest.psutil, "cpu_times", times_of(0.4))
    assert conftest.is_crowded()


def test_busy_programs_on_every_processor_crowd():
    loop = [sys.executable, "-c", "while True: pass"]
    children = [subprocess.Popen(loop) for _ in range(2 * (os.cpu_count() or 1))]
    try:
        until = time.monotonic() + 20.0
        while not conftest.is_crowded():
            assert time.monotonic() < until
    finally:
        for child in children:
            child.kill()
            child.wait()
