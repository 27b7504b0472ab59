"""What `cspm doctor` says of a computer, of both kinds each."""

import os
import webbrowser

import pytest

from cspm.doctor.computer import browser, may_go_first, priorities, processors, usable_processors


def test_one_processor_is_too_few_for_real_time():
    assert processors(2).there
    assert processors(1).remedy == "give this process a second one, or run in lockstep"
    assert usable_processors() >= 1


def test_priorities_are_there_where_they_are_permitted():
    assert priorities(lambda: True).there
    refused = priorities(lambda: False)
    assert (refused.found, refused.there) == ("SCHED_FIFO not permitted", False)
    assert "rtprio" in refused.remedy


def test_trying_a_priority_leaves_the_process_as_it_was():
    if not hasattr(os, "sched_getscheduler"):
        pytest.skip("no scheduler that can be asked")
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    assert may_go_first() in (True, False)
    assert (os.sched_getscheduler(0), os.sched_getparam(0)) == before


def test_without_a_browser_the_page_has_other_ways():
    def none():
        raise webbrowser.Error("could not locate runnable browser")

    assert browser(lambda: "firefox").found == "firefox"
    assert "--html FILE" in browser(none).remedy
