"""A node of nobody's run that talks on the contract's topics, as a program of its own.

Each kind of talk is a function that is called again and again while the run goes on.
"""

import random
import sys
import time
import warnings
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
from rclpy.qos import QoSProfile
from std_msgs.msg import Header, String

from cspm_msgs_py.diagnostics import Level, Status, encode_diagnostics
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import message_of
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros.rendezvous import END, PROGRESS, START
from cspm_msgs_py.ros.session import Session
from cspm_msgs_py.ros_types import serialize
from cspm_msgs_py.schedule import MOTION_CONTROLLER, PLANT, TENSION_DISTRIBUTION
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.topics import CLOCK, DIAGNOSTICS, POSE
from cspm_msgs_py.wire import WireReader

THESIS = Path(__file__).resolve().parents[3] / "scenarios" / "testbeds" / "thesis.yaml"
MS, SECOND = 1_000_000, 1_000_000_000
LATEST_NS = (2**31 - 1) * SECOND
TURN_S, LONGEST_S = 0.01, 300.0
CALM_S = 0.5
# More than a run's own messages, fewer than a reader keeps waiting, and more than that.
FLOOD, DELUGE = 700, 6000
REPORTS = 50  # more than a node makes in these runs


def plausible(topic):
    """Return a row that the topic could carry."""
    row = np.full(topic.width, 5.0)
    if topic.fields[: len(POSE)] == POSE:
        row[3:7] = (0.0, 0.0, 0.0, 1.0)
    return row


class Stranger:
    """What the stranger hears and how it speaks.

    Attributes:
        topics: the contract's topics that carry rows and stamps, by name.
        now_ns: the last instant of the run that was heard [ns].
        heard: the last bytes heard, by topic.
        turns: how often it talked.
        known: whether it has talked to all readers of a run.
    """

    def __init__(self, node, kinds, seed):
        self.random = random.Random(seed)
        found = load_testbed(THESIS).testbed.topics
        self.topics = {n: t for n, t in found.items() if n not in (CLOCK.name, DIAGNOSTICS.name)}
        self.now_ns, self.heard, self.turns = 0, {}, 0
        self._readers, self._changed, self.known = [], 0.0, False
        self._node, self.others, self._decode = node.node, [], {}
        node.subscribe_rows(CLOCK, self._note, lambda _: None)
        if "types" in kinds:
            # A participant can have one type on a topic.
            make = node.node.create_publisher
            names = (*self.topics, DIAGNOSTICS.name)
            self.others = [make(String, name, QoSProfile(depth=10)) for name in names]
            return
        self.send = {name: node.raw_publisher(topic) for name, topic in self.topics.items()}
        self.status = node.raw_publisher(DIAGNOSTICS)
        make = node.node.create_publisher
        names = (PROGRESS, START, END) if "handshakes" in kinds else ()
        self.headers = [make(Header, name, contract_qos()) for name in names]
        for name in self.topics if {"echoes", "noise"} & {*kinds} else ():
            node.subscribe(self.topics[name], partial(self._hear, name))
            self._decode[name] = WireReader(self.topics[name]).decode

    def _hear(self, name, payload):
        """Keep what is valid: its own noise comes back to it as well."""
        with suppress(InputError):
            self._decode[name](payload)
            self.heard[name] = payload

    def _note(self, stamp_ns, _):
        self.now_ns = stamp_ns

    @property
    def heard_by_any(self):
        """Whether a run is there; who speaks of other types cannot know."""
        return bool(self.others) or any(self._counts())

    def heard_by_all(self):
        """Whether all of a run's readers are there: no other has come for a while."""
        if (readers := self._counts()) != self._readers:
            self._readers, self._changed = readers, time.monotonic()
        return bool(self.others) or time.monotonic() - self._changed >= CALM_S

    def _counts(self):
        return [each.get_subscription_count() for each in self._node.publishers]

    def some_heard(self):
        """Return name and last bytes of a few topics: reading noise takes a run its time."""
        heard = sorted(self.heard.items())
        return self.random.sample(heard, min(2, len(heard)))

    def say(self, topic, stamp_ns, row=None, **changes):
        """Send a message, with some of its fields replaced."""
        message = message_of(topic, stamp_ns, plausible(topic) if row is None else row)
        for name, value in changes.items():
            setattr(message, name, value)
        self.send[topic.name](serialize(message))


def values(stranger):
    """Numbers that are none, too many, too few, under other names."""
    for topic in stranger.topics.values():
        for number in (np.nan, np.inf, -np.inf):
            stranger.say(topic, stranger.now_ns + MS, np.full(topic.width, number))
        if topic.parts:
            names = list(topic.joint_names)
            crowd = {"name": [f"c{i}" for i in range(10_000)], "effort": np.zeros(10_000)}
            for changes in (crowd, {"name": names[::-1]}, {"name": names[1:]}, {"name": []}):
                stranger.say(topic, stranger.now_ns + MS, **changes)
            stranger.say(topic, stranger.now_ns + MS, **{topic.parts[0]: np.zeros(3)})


def stamps(stranger):
    """Good numbers of the far future, of the past, and of the instants that the run is at."""
    flood(stranger)
    imitations(stranger)


def imitations(stranger):
    """The same, counted as the run's own messages are."""
    soon = [stranger.now_ns + shift * MS for shift in range(-3, 12)]
    for topic in stranger.topics.values():
        for stamp in (LATEST_NS, stranger.now_ns - 5 * SECOND, 7, *soon, 0):
            stranger.say(topic, max(0, stamp))


def echoes(stranger):
    """What was heard just now of some topic, once more."""
    for name, payload in stranger.some_heard():
        stranger.send[name](payload)


def noise(stranger):
    """On some topic bytes at random, and messages with some bytes changed or cut off."""
    chance = stranger.random
    for name, payload in stranger.some_heard():
        stranger.send[name](chance.randbytes(chance.randrange(4, 400)))
        stranger.send[name](b"\x00\x01\x00\x00" + chance.randbytes(chance.randrange(200)))
        changed = bytearray(payload)
        for _ in range(chance.randrange(1, 5)):
            changed[chance.randrange(len(changed))] = chance.randrange(256)
        stranger.send[name](bytes(changed))
        stranger.send[name](payload[: chance.randrange(4, len(payload))])


def statuses(stranger):
    """Reports in the names of the run's nodes, counted beyond them."""
    for _ in range(REPORTS if not stranger.turns else 0):
        stranger.status(encode_diagnostics(LATEST_NS, [Status(Level.OK, PLANT, "", {})]))
    for name in (PLANT, MOTION_CONTROLLER, TENSION_DISTRIBUTION, "nobody", ""):
        for shift in range(0, 300, 10):
            stamp = (stranger.now_ns // (10 * MS) * 10 + shift) * MS
            status = Status(Level.ERROR, name, "on fire", {"value": "x" * 100})
            stranger.status(encode_diagnostics(stamp, [status]))
    stranger.status(encode_diagnostics(stranger.now_ns, []))
    stranger.status(stranger.random.randbytes(40))


def flood(stranger, count=FLOOD):
    """Very many messages, once."""
    for topic in stranger.topics.values() if not stranger.turns else ():
        payload = serialize(message_of(topic, LATEST_NS, plausible(topic)))
        for _ in range(count):
            stranger.send[topic.name](payload)


def deluge(stranger):
    """More messages than anybody keeps."""
    flood(stranger, DELUGE)


def handshakes(stranger):
    """The words by which nodes start, proceed and end, in the names of all."""
    for publisher in stranger.headers:
        for name in (PLANT, "recorder", "force_controller", "nobody"):
            message = Header(frame_id=name)
            step = stranger.now_ns // MS + stranger.random.randrange(-50, 50)
            message.stamp.sec, message.stamp.nanosec = divmod(step * MS, SECOND)
            publisher.publish(message)


def types(stranger):
    """Messages of another type on the topics' names."""
    for publisher in stranger.others:
        publisher.publish(String(data="x" * 500))


# In this order: whoever floods first counts beyond the run.
KINDS = (
    flood,
    deluge,
    values,
    stamps,
    imitations,
    echoes,
    noise,
    statuses,
    handshakes,
    types,
)


def main(kinds, seed):
    """Talk until killed."""
    with Session() as session:
        stranger = Stranger(session.node("stranger"), kinds, seed)
        chosen = [talk for talk in KINDS if talk.__name__ in kinds]

        def talk():
            if stranger.turns or stranger.heard_by_any:
                everybody = stranger.heard_by_all()
                for each in chosen:
                    each(stranger)
                if everybody and not stranger.known:
                    stranger.known = True
                    print("talking", flush=True)  # noqa: T201 - to the test
                stranger.turns += 1

        print("here", flush=True)  # noqa: T201 - to the test
        session.every(TURN_S, talk)
        session.spin_until(lambda: session.stopped, LONGEST_S)


if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        main(sys.argv[1].split("+"), int(sys.argv[2]))
