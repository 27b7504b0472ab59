import signal
import threading

import pytest

from cspm_msgs_py.interruption import interruptible

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture(autouse=True)
def _handlers():
    """Let SIGINT interrupt, which programs in a shell's background are started without."""
    before = [signal.getsignal(each) for each in SIGNALS]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for each, handler in zip(SIGNALS, before, strict=True):
        signal.signal(each, handler)


def heard():
    return [signal.getsignal(each) for each in SIGNALS]


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_is_noted_and_the_next_one_is_heard_as_before(number):
    before = heard()
    with interruptible() as stopped:
        assert not stopped()
        assert heard() != before
        signal.raise_signal(number)
        assert stopped()
        assert heard() == before
    assert heard() == before


def test_without_a_signal_nothing_is_left_behind():
    before = heard()
    with interruptible() as stopped:
        pass
    assert not stopped()
    assert heard() == before


def test_a_signal_within_a_part_ends_the_whole():
    before = heard()
    with interruptible() as whole:
        with interruptible() as part:
            signal.raise_signal(signal.SIGINT)
            assert (whole(), part()) == (True, True)
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        assert heard() == before
    assert heard() == before


def test_a_part_that_has_ended_hears_nothing_more():
    with interruptible() as whole:
        with interruptible() as part:
            pass
        signal.raise_signal(signal.SIGINT)
        assert (whole(), part()) == (True, False)


def test_another_thread_hears_nothing():
    found, before = [], heard()

    def look():
        with interruptible() as stopped:
            found.append((stopped(), heard() == before))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert found == [(False, True)]
