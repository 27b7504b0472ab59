"""The same run by the staged loop and by the compiled one, in memory."""

from dataclasses import replace

import numpy as np

from cspm_msgs_py.diagnostics import encode_diagnostics
from cspm_msgs_py.errors import DivergenceError
from cspm_run.loop import Loop
from cspm_run.memory_recorder import MemoryRecorder
from cspm_run.recorded_run import parts_of, recorded_topics
from cspm_run.run_statistics import RunStatistics
from cspm_run.stepping import Stepping


class Staged(Stepping):
    """Makes every step in Python."""

    def _advance(self, end):
        self._by_stages(end)

    def _begin_compiled(self):
        pass


class MadeRun:
    """What a run sent and counted, and how it ended."""

    def __init__(self, bundle, steps, stepping, change=lambda parts: parts):
        parts = change(parts_of(bundle))
        self.sent = MemoryRecorder(recorded_topics(bundle))
        self.statistics = RunStatistics(steps, len(parts.plant.tensions))
        channels = {name: self.sent.channel(name) for name in parts.schedule.topics}
        publish = {name: channel.append for name, channel in channels.items()}
        take = {name: channel.append_rows for name, channel in channels.items()}
        self.failure, self.statuses = None, []
        loop = Loop(parts, publish, self._status)
        self.stepping = stepping(loop, self.statistics, take, steps)
        try:
            self.stepping.run(lambda now: None, lambda: False)
        except DivergenceError as err:
            self.failure = f"{err}; {self.stepping.history()}"
        self.plant = parts.plant

    def _status(self, now_ns, status):
        self.statuses.append(status)
        payload = encode_diagnostics(now_ns, [status])
        self.sent.append_payload("/diagnostics", now_ns, payload)


def assert_same(bundle, steps, change=lambda parts: parts):
    """Make a run both ways; return the compiled one once every bit is found to be the same."""
    staged, compiled = (MadeRun(bundle, steps, by, change) for by in (Staged, Stepping))
    assert_same_messages(staged, compiled)
    for part in ("envelope", "squares", "counts", "kept"):
        one, other = getattr(staged.statistics, part), getattr(compiled.statistics, part)
        np.testing.assert_array_equal(other, one, err_msg=part)
    return compiled


def assert_same_messages(first, second):
    """Check that two runs sent the same bits, and ended where and how they did."""
    assert second.failure == first.failure
    assert second.sent.counts == first.sent.counts
    for name, count in first.sent.counts.items():
        if name == "/diagnostics":
            assert second.sent.channel(name).contents == first.sent.channel(name).contents
        elif count:
            pairs = zip(first.sent.rows(name), second.sent.rows(name), strict=True)
            for one, other in pairs:
                np.testing.assert_array_equal(other, one, err_msg=name, strict=True)
    np.testing.assert_array_equal(second.plant.state, first.plant.state)


def with_stages(make):
    """Return a change of parts: `make` returns a stage in the place of each."""
    return lambda parts: replace(parts, stages=[make(stage) for stage in parts.stages])
