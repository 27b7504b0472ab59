"""Runs that a recorder gathers in lockstep, and messages that come late or damaged."""

import numpy as np
from lockstep_network import Network
from run_samples import bundle_of
from schedules import delayed

from cspm_msgs_py.diagnostics import encode_diagnostics
from cspm_msgs_py.edited import file_of
from cspm_msgs_py.schedule import schedule_of
from cspm_msgs_py.wire import WireWriter
from cspm_ros.runtime.lockstep_recorder import LockstepRecorder
from cspm_run.recorded_run import new_recording, run

MS = 1_000_000
STEPS = 120
REST = bundle_of("rest", "rates.tension_distribution=125", "rates.motion_capture=500")


def late(bundle, **delays):
    """Return the bundle with sensors that are late by so many milliseconds."""
    testbed = delayed(
        bundle.testbed.testbed, {f"/{k.replace('__', '/')}": delays[k] for k in delays}
    )
    return type(bundle)(bundle.scenario, file_of(testbed), bundle.files)


class Case:
    """A run: its description, what it sends by sender's queue in order, and its recording."""

    def __init__(self, bundle, folder):
        self.bundle, self.expected = bundle, folder
        run(bundle, folder, steps=STEPS)
        network = Network(bundle.scenario, bundle.testbed.testbed, STEPS)
        network.run(lambda waiting: waiting[0])
        last_ns = network.plant.last_step * MS
        self.sent = {}
        for name, heard in network.heard.items():
            encode = WireWriter(bundle.testbed.testbed.topics[name]).encode
            self.sent[name] = [encode(stamp, row) for log, stamp, row in heard if log <= last_ns]
        for now, status in network.statuses:
            if now <= last_ns:
                payload = encode_diagnostics(now, [status], bundle.testbed.testbed.name)
                self.sent.setdefault(("/diagnostics", status.name), []).append(payload)


class Intake:
    """A recorder that records to a folder, with what it reported."""

    def __init__(self, bundle, folder, acknowledge=None, reporting=()):
        self.reported, self.rate_limited_warnings = [], []
        schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
        self.writer = new_recording(bundle, folder, "graph")
        self.recorder = LockstepRecorder(
            schedule,
            bundle.testbed.testbed.topics,
            self.writer,
            acknowledge or self.reported.append,
            lambda topic, reason: self.rate_limited_warnings.append((topic, reason)),
            reporting,
        )
        self._receive = {name: self.recorder.receive(name) for name in schedule.topics}

    def take(self, queue, payload):
        if isinstance(queue, tuple):
            self.recorder.receive_diagnostics(payload, 0)
        else:
            self._receive[queue](payload, 0)


def spoilt(queue, payload, rng):
    """Return bytes that are no message of the queue's, or not the next one."""
    kind = rng.randrange(3 if isinstance(queue, tuple) else 5)
    if kind == 0:
        return rng.randbytes(rng.randrange(64))
    if kind == 1:
        return payload[: rng.randrange(len(payload))]
    if kind == 2:
        # Another stamp.
        at = rng.randrange(4, 12)
        return payload[:at] + bytes([payload[at] ^ (1 + rng.randrange(255))]) + payload[at + 1 :]
    if kind == 3:
        return payload + rng.randbytes(9 + rng.randrange(3000))
    return payload[:-16] + np.full(2, np.nan).tobytes()
