"""Processes that go before others, and this one only for a while."""

import os
import subprocess
import sys

import first_in_line
import pytest
from first_in_line import go_first, going_first


@pytest.fixture
def sleeper():
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    yield process
    process.communicate()


def test_a_process_goes_first_where_it_may(sleeper):
    granted = go_first(sleeper.pid)
    expected = os.SCHED_RR if granted else os.SCHED_OTHER
    assert os.sched_getscheduler(sleeper.pid) == expected
    assert granted or os.geteuid() != 0


def test_without_the_right_to_nothing_changes(sleeper, monkeypatch):
    def refuse(*_):
        raise PermissionError

    monkeypatch.setattr(first_in_line.os, "sched_setscheduler", refuse)
    assert not go_first(sleeper.pid)
    with going_first():
        assert os.sched_getscheduler(0) == os.SCHED_OTHER


def test_this_process_goes_first_for_a_while():
    before = os.sched_getscheduler(0)
    with going_first():
        pass
    assert os.sched_getscheduler(0) == before
