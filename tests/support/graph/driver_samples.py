"""What a lab's drivers would send: the measured topics of simulated runs, on a clock of 2026."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from run_samples import SCENARIOS, bundle_of, run_to

from cspm_msgs_py.layout import layout_of
from cspm_msgs_py.scenario import Rates
from cspm_msgs_py.sensor_spec import MEASURED
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import Topic
from cspm_ros.check_drivers.driver_check import check_drivers
from cspm_ros.check_drivers.driver_observation import Observation

TENSION, WINCHES = "/cables/tension", "/winches/state"
BAR, FRAME = "/bar/pose", "/winch_frame/pose"
BAR_TWIST, FRAME_TWIST = "/bar/twist", "/winch_frame/twist"

EPOCH_NS = 1_795_000_000_000_000_000
LATENCY_NS = 300_000
JITTER_NS = 50_000

TWIST_SENSOR = "{noise: [1.0e-3, 1.0e-3], resolution: [0.0, 0.0], rate: 1000}"


@dataclass(frozen=True, eq=False)
class Feed:
    """A topic's messages: stamps and receptions (n,) [ns], rows (n, width)."""

    topic: Topic
    stamps: np.ndarray
    receives: np.ndarray
    rows: np.ndarray
    publishers: int = 1

    def observation(self):
        payloads = layout_of(self.topic).encode(self.stamps, self.rows)
        samples = [(int(r), p.tobytes()) for r, p in zip(self.receives, payloads, strict=True)]
        return Observation(self.topic.name, self.topic.ros_type, self.publishers, samples)

    def only(self, keep):
        """The messages of this index or mask."""
        stamps, receives, rows = self.stamps[keep], self.receives[keep], self.rows[keep]
        return replace(self, stamps=stamps, receives=receives, rows=rows)

    def scaled(self, factor, columns=slice(None)):
        """Numbers of some columns multiplied."""
        rows = self.rows.copy()
        rows[:, columns] = rows[:, columns] * factor
        return replace(self, rows=rows)

    def shifted(self, nanoseconds):
        """Stamps later by so much, a number or one per message."""
        return replace(self, stamps=self.stamps + np.asarray(nanoseconds, dtype=np.int64))

    def described(self, **changes):
        """The same numbers under another type, frame or names."""
        return replace(self, topic=replace(self.topic, **changes))


@dataclass(frozen=True, eq=False)
class Lab:
    """A machine whose drivers send."""

    testbed: Testbed
    rates: Rates
    feeds: dict[str, Feed]

    def but(self, name, change):
        """The same lab with one topic's feed changed."""
        return replace(self, feeds={**self.feeds, name: change(self.feeds[name])})

    def without(self, name):
        """The same lab with one topic silent."""
        return replace(self, feeds={k: feed for k, feed in self.feeds.items() if k != name})

    def window(self, start, end):
        """What is sent between two times since the run's start [s]."""
        first, last = EPOCH_NS + round(start * 1e9), EPOCH_NS + round(end * 1e9)
        feeds = {
            name: feed.only((feed.stamps >= first) & (feed.stamps < last))
            for name, feed in self.feeds.items()
        }
        return replace(self, feeds=feeds)

    def findings(self, *others):
        """What the check says, of these topics and other observations."""
        observations = [feed.observation() for feed in self.feeds.values()]
        return check_drivers(self.testbed, self.rates, [*observations, *others])


def lab_of(folder, scenario, *overrides):
    """Simulate a scenario; its measured topics arrive a little late, as over a network."""
    bundle = bundle_of(scenario, *overrides)
    testbed = bundle.testbed.testbed
    _, rows = run_to(folder, scenario, *overrides)
    rng = np.random.default_rng(20)
    feeds = {}
    for name in MEASURED:
        if name in rows:
            stamps = rows[name].stamp_ns + EPOCH_NS
            delay = LATENCY_NS + rng.exponential(JITTER_NS, len(stamps))
            receives = np.maximum.accumulate(stamps + delay.astype(np.int64))
            feeds[name] = Feed(testbed.topics[name], stamps, receives, rows[name].rows)
    return Lab(testbed, bundle.scenario.rates, feeds)


def refitted_with_twists(folder):
    """Write the sea's scenario for a machine that also measures twists; return its path."""
    text = (SCENARIOS / "testbeds" / "thesis_refitted.yaml").read_text(encoding="utf-8")
    sensors = "".join(f"  {name}: {TWIST_SENSOR}\n" for name in (BAR_TWIST, FRAME_TWIST))
    (folder / "testbeds").mkdir(parents=True)
    (folder / "testbeds" / "thesis_refitted.yaml").write_text(
        text.replace("\nsensors:\n", f"\nsensors:\n{sensors}"), encoding="utf-8"
    )
    path: Path = folder / "twists.yaml"
    path.write_text((SCENARIOS / "worst_case.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    return path


def steady_feed(topic, rate, seconds, seed=0):
    """Tensions of about 5 N at a rate [Hz]; messages arrive 0.3 ms late, seldom a little later."""
    rng = np.random.default_rng(seed)
    count = round(rate * seconds)
    stamps = EPOCH_NS + np.arange(count) * round(1e9 / rate)
    delay = LATENCY_NS + rng.exponential(JITTER_NS, count)
    receives = np.maximum.accumulate(stamps + delay.astype(np.int64))
    return Feed(topic, stamps, receives, rng.normal(5.0, 0.02, (count, topic.width)))


def wrong(findings):
    """Topic and check of everything that is wrong."""
    return {(finding.topic, finding.check) for finding in findings if finding.ok is False}


def undecided(findings):
    """Topic and check of everything that cannot be decided."""
    return {(finding.topic, finding.check) for finding in findings if finding.ok is None}


def said(findings, topic, check):
    """The findings of one check, as `ok` and text."""
    return [(f.ok, f.text) for f in findings if (f.topic, f.check) == (topic, check)]
