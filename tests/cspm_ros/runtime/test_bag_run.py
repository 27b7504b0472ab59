"""Merging runs of messages by log time."""

from hypothesis import given, settings
from hypothesis import strategies as st

from cspm_msgs_py.bag import BagMessage
from cspm_msgs_py.bag.run import Run, in_order

RUNS = st.lists(st.lists(st.integers(0, 6), min_size=1, max_size=5).map(sorted), max_size=6)


def bound(runs, begun):
    """Return runs of log times as `in_order` takes them; `begun` notes which are begun."""

    def begin(i):
        begun.append(i)
        return (BagMessage(log, str(i), bytes([j])) for j, log in enumerate(runs[i]))

    return [Run(run[0], run[-1], lambda i=i: begin(i)) for i, run in enumerate(runs)]


@given(RUNS)
@settings(max_examples=300)
def test_runs_merge_as_one_stable_sort_would(runs):
    messages = [
        BagMessage(log, str(i), bytes([j]))
        for i, run in enumerate(runs)
        for j, log in enumerate(run)
    ]
    merged = list(in_order(bound(runs, [])))
    assert merged == sorted(messages, key=lambda message: message.log_ns)


def test_a_run_is_begun_only_when_its_time_comes():
    begun = []
    merged = in_order(bound([[20, 21], [0, 1], [10, 12], [11, 13]], begun))
    steps = [(next(merged).log_ns, list(begun)) for _ in range(8)]
    assert steps == [
        (0, [1]),
        (1, [1]),
        (10, [1, 2]),
        (11, [1, 2, 3]),
        (12, [1, 2, 3]),
        (13, [1, 2, 3]),
        (20, [1, 2, 3, 0]),
        (21, [1, 2, 3, 0]),
    ]
    assert next(merged, None) is None
