"""ROS domains of our own, recordings compared by hash, and the processes of a run."""

import fcntl
import hashlib
import importlib
import itertools
import os
import subprocess
import tempfile
import warnings
from collections import deque
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from cspm_process import CSPM, child

from cspm_msgs_py.recording import Recording, first_difference

NODES = (
    "plant",
    "wave_trajectory",
    "motion_controller",
    "tension_distribution",
    "force_controller",
    "recorder",
)

# Above 101 the ports that a domain needs lie among those that the system hands out.
DOMAINS, HELD = 100, 12
_CLAIMS = deque()
_TURN = itertools.count(os.getpid())


def load_ros():
    """Import ROS, or skip the tests that need it."""
    with warnings.catch_warnings():
        # The parser that rclpy loads with its first type uses a module deprecated in 3.11.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            serialization = importlib.import_module("rclpy.serialization")
            serialization.serialize_message(importlib.import_module("std_msgs.msg").Header())
        except ImportError as err:
            pytest.skip(f"ROS cannot be imported: {err}", allow_module_level=True)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"


def new_domain():
    """Return a ROS domain that no other test, of this or another process, has or just had."""
    place = Path(tempfile.gettempdir()) / "cspm-test-domains"
    place.mkdir(exist_ok=True)
    for _ in range(DOMAINS):
        domain = next(_TURN) % DOMAINS + 1
        # Held for some time, so that nobody meets the remains of its nodes.
        claim = os.open(place / str(domain), os.O_CREAT | os.O_RDWR)
        try:
            fcntl.flock(claim, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(claim)
            continue
        _CLAIMS.append(claim)
        if len(_CLAIMS) > HELD:
            os.close(_CLAIMS.popleft())
        return domain
    pytest.fail(f"all {DOMAINS} ROS domains are taken")


def hashes(folder):
    """Return, by topic, the SHA-256 over log times and payloads of all its messages."""
    with Recording(folder) as recording:
        found = {}
        for name in recording.topics:
            messages = recording.payloads(name)
            digest = hashlib.sha256(messages.log_ns.tobytes())
            for payload in messages.payloads:
                digest.update(payload)
            found[name] = digest.hexdigest()
        return found


def difference(folder, other):
    """Return where two recordings first differ, log times included."""
    with Recording(folder) as one, Recording(other) as two:
        return first_difference(one, two, log_times=True)


def content(folder):
    """Return the SHA-256 of each chunk's content: messages, their order and log times."""
    with Recording(folder) as recording:
        return [
            hashlib.sha256(file.chunk_content(place)).hexdigest()
            for file in recording.files
            for place in file.chunks
        ]


def assert_same(folder, other):
    """Hold two recordings to be the same, bit for bit in every field of every topic."""
    found = difference(folder, other)
    assert found is None, found
    assert hashes(folder) == hashes(other)


def words_of(process):
    """Return a process's command line as words; a process that was forked has it as one text."""
    return " ".join(process.cmdline()).split()


def node_processes(parent=None):
    """Return the processes of a run's nodes, by node, that descend from a process."""
    found = {}
    for process in psutil.Process(parent).children(recursive=True):
        try:
            words = words_of(process)
        except psutil.Error:
            continue
        if "cspm_ros.runtime.node_main" in words:
            found[words[words.index("cspm_ros.runtime.node_main") + 1]] = process
    return found


def done(*arguments, domain=None, timeout=90):
    """Run a command in a domain of its own; return exit code, stdout and stderr."""
    environment = os.environ | {"ROS_DOMAIN_ID": str(domain or new_domain())}
    process = child(*arguments, env=environment)
    try:
        out, err = process.communicate(timeout=timeout)
    finally:
        process.kill()
    return process.returncode, out, err


def start_node(name, *parameters, domain, remap=(), before=(), **environment):
    """Start `cspm node NAME` with parameters, remapped topics, and words before the command."""
    words = [word for each in parameters for word in ("-p", each)]
    words += [word for each in remap for word in ("-r", each)]
    return subprocess.Popen(
        [*before, CSPM, "node", name, "--ros-args", *words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"ROS_DOMAIN_ID": str(domain)} | environment,
    )


@contextmanager
def ended_in_any_case(processes):
    """Kill whatever still runs in the end."""
    try:
        yield processes
    finally:
        for process in processes.values():
            process.kill()
            process.communicate()


def outcome(process, seconds=60.0):
    """Return exit code, stdout and stderr of a process that ends within a time.

    Fast DDS may print that a port in shared memory is taken, and takes another.
    """
    out, err = process.communicate(timeout=seconds)
    out = "".join(line for line in out.splitlines(True) if "RTPS_TRANSPORT_SHM" not in line)
    return process.returncode, out, err
