import gc
import subprocess
import sys

import pytest

from cspm_msgs_py.garbage import look_seldom

# Only a search for garbage finds this one, and the last search is at the end.
RING = """
class Ring:
    def __del__(self):
        print("found")

ring = Ring()
ring.ring = ring
del ring
"""
SELDOM = "from cspm_msgs_py.garbage import look_seldom; look_seldom()"


@pytest.fixture(autouse=True)
def _often():
    """Look as often as Python does by itself; afterwards as before."""
    before = gc.get_threshold()
    gc.set_threshold(700, 10, 10)
    yield
    gc.set_threshold(*before)


@pytest.mark.parametrize(("begin", "said"), [("", "found\n"), (SELDOM, "")])
def test_a_program_that_ends_looks_for_no_garbage(begin, said):
    code = [sys.executable, "-c", begin + RING]
    done = subprocess.run(code, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == (said, "")


def test_what_is_loaded_starts_few_searches():
    look_seldom()
    assert gc.isenabled()
    assert gc.get_threshold() == (100_000, 10, 10)


def test_a_command_looks_seldom(cspm):
    assert cspm("--version")[0] == 0
    assert gc.get_threshold()[0] == 100_000
