"""The nodes of a lockstep run as plain objects, with every message between them in our hands."""

from collections import deque
from pathlib import Path

from cspm_msgs_py.diagnostics import encode_diagnostics
from cspm_msgs_py.graph import RECORDER, followers, graph_of
from cspm_msgs_py.schedule import PLANT
from cspm_msgs_py.stepping.lockstep import RECORDER_WINDOW, WINDOW, Acknowledgement, Follower
from cspm_msgs_py.topics import QOS_DEPTH
from cspm_msgs_py.wire import WireWriter
from cspm_run.assembly import assemble
from cspm_sim.lockstep_plant import LockstepPlant
from cspm_sim.simulator import Simulator

STATUS, PROGRESS, END = "status", "progress", "end"


def with_rates(bundle, **rates):
    """Return the bundle's scenario with other rates and its machine; its gains stay."""
    scenario = bundle.scenario
    content = scenario.rates.model_dump() | rates
    rates = type(scenario.rates).model_validate(content)
    return scenario.model_copy(update={"rates": rates}), bundle.testbed.testbed


class Network:
    """A run whose messages wait, per topic and reader, until somebody delivers them.

    As in the middleware a queue holds the last few: one more pushes out the oldest, and is `lost`.

    Attributes:
        heard: log time, stamp and row of every message sent, by topic.
        statuses: instant and status of every diagnostics message sent.
        queues: what waits, by topic and reader, or kind and node.
        lost: how many messages did not fit.
    """

    def __init__(self, scenario, testbed, steps, make_recorder=None, depth=QOS_DEPTH):
        parts = assemble(scenario, testbed, Path())
        self.schedule, self._topics = parts.schedule, testbed.topics
        self._machine = testbed.name
        members = (PLANT, *self.schedule.nodes, *[RECORDER] * (make_recorder is not None))
        self._edges = graph_of(self.schedule, members)
        self._writers = {name: WireWriter(self._topics[name]) for name in self.schedule.topics}
        self.heard = {name: [] for name in self.schedule.topics}
        self.statuses = []
        self.queues, self.lost, self._depth = {}, 0, depth
        waited_for = followers(self.schedule, members, WINDOW)
        publish = {name: self._publisher(name) for name in self.schedule.topics}
        simulator = Simulator(
            parts.plant,
            parts.sensors,
            publish,
            period_ns=parts.period_ns,
            controlled=parts.controlled,
        )
        self.plant = LockstepPlant(simulator, self.schedule, steps, waited_for, self._status)
        self.nodes = {
            stage.node: Follower(stage, self.schedule, publish, self._status)
            for stage in parts.stages
        }
        self._acknowledgements = {
            name: Acknowledgement() for name in self.nodes if name in waited_for
        }
        self.recorder = make_recorder(self._acknowledge) if make_recorder else None
        self._take = {}
        if self.recorder is not None:
            self._take = {name: self.recorder.receive(name) for name in self.schedule.topics}
        self._ended = False

    def run(self, choose):
        """Deliver everything, each time from the queue that `choose` takes of those that wait."""
        self.plant.start()
        self.settle(choose)

    def settle(self, choose):
        """Deliver until nothing waits."""
        while waiting := [key for key, queue in self.queues.items() if queue]:
            self.deliver(choose(waiting))

    def deliver(self, key):
        """Deliver the oldest message of a queue."""
        kind, reader = key
        message = self.queues[key].popleft()
        if kind == PROGRESS:
            self.plant.receive_progress(reader, message)
        elif kind == END:
            self._end(reader, message)
        elif kind[0] == STATUS:
            self.recorder.receive_diagnostics(message, 0)
        elif reader == PLANT:
            self.plant.receive_torque(*message)
        elif reader == RECORDER:
            self._take[kind](message, 0)
        else:
            self.nodes[reader].receive(kind, *message)
            self._tell(reader)
        if self.plant.ended and not self._ended:
            self._ended = True
            for name in (*self.nodes, *[RECORDER] * (self.recorder is not None)):
                self._put((END, name), self.plant.last_step)

    def _end(self, node, last_step):
        if node == RECORDER:
            self.recorder.end(last_step)
            return
        self.nodes[node].check_end(last_step)
        if node in self._acknowledgements:
            self._acknowledgements[node].last = last_step
            self._tell(node)

    def _tell(self, node):
        reached = self.nodes[node].reached
        if node in self._acknowledgements and self._acknowledgements[node].due(reached):
            self._put((PROGRESS, node), reached)

    def _acknowledge(self, step):
        self._put((PROGRESS, RECORDER), step)

    def _publisher(self, topic):
        readers = self._edges[topic].readers

        def publish(log, stamp, row):
            self.heard[topic].append((log, stamp, row.copy()))
            for reader in readers:
                message = stamp, row.copy()
                if reader == RECORDER:
                    message = self._writers[topic].encode(stamp, row)
                self._put((topic, reader), message)

        return publish

    def _status(self, now, status):
        self.statuses.append((now, status))
        if self.recorder is not None:
            payload = encode_diagnostics(now, [status], self._machine)
            self._put(((STATUS, status.name), RECORDER), payload)

    def _put(self, key, message):
        queue = self.queues.setdefault(key, deque())
        queue.append(message)
        # The recorder has room for more than the contract asks of a reader.
        if len(queue) > (RECORDER_WINDOW + 1 if key[1] == RECORDER else self._depth):
            queue.popleft()
            self.lost += 1


def chooser(random):
    """Return a way to choose: some queues always before others, now and then any."""
    ranks, fickle = {}, random.choice([0.0, 0.05, 1.0])

    def choose(waiting):
        if random.random() < fickle:
            return random.choice(waiting)
        return min(waiting, key=lambda key: ranks.setdefault(key, random.random()))

    return choose
