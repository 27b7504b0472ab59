"""Two hosts on one machine: network namespaces, joined by a cable that may lose packets."""

import os
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

RELAY = Path(__file__).resolve().with_name("lossy_relay.py")
LOSS, DELAY_S = 0.05, 0.002
PORT, ENDS = "eth0", ("left", "right")
PREFIX = "cspm"


def command(*words):
    """Run a command; return what it said, or raise `CalledProcessError`."""
    done = subprocess.run(words, capture_output=True, text=True, timeout=20, check=True)
    return done.stdout


def why_not(*attempt):
    """Return in one line why a command fails, None if it does not."""
    try:
        command(*attempt)
    except subprocess.CalledProcessError as err:
        return err.stderr.strip().splitlines()[0] if err.stderr.strip() else str(err)
    except OSError as err:
        return str(err)
    return None


@contextmanager
def namespace(name):
    """Make a network namespace, or skip; it is gone in the end, with all devices in it."""
    refusal = why_not("ip", "netns", "add", name)
    if refusal is not None:
        pytest.skip(f"network namespaces are not permitted here: {refusal}")
    try:
        command("ip", "-n", name, "link", "set", "lo", "up")
        yield Host(name)
    finally:
        command("ip", "netns", "del", name)


class Host:
    """One network namespace.

    Attributes:
        words: what goes before a command that is to run there.
    """

    def __init__(self, name):
        self.name = name
        self.words = ("ip", "netns", "exec", name)

    def ip(self, *words):
        """Run `ip` there."""
        return command("ip", "-n", self.name, *words)

    def unplug(self):
        """Take the network away."""
        self.ip("link", "set", PORT, "down")

    def plug(self):
        """Give the network back."""
        self.ip("link", "set", PORT, "up")

    def packets(self, direction):
        """Return how many packets went through the port: `tx`, out of the host, or `rx`."""
        place = f"/sys/class/net/{PORT}/statistics/{direction}_packets"
        return int(command(*self.words, "cat", place))


def join(one, port, other, other_port):
    """Lay a cable between two hosts."""
    one.ip("link", "add", port, "type", "veth", "peer", "name", other_port, "netns", other.name)
    for host, name in ((one, port), (other, other_port)):
        host.ip("link", "set", name, "up")


@contextmanager
def two_hosts(*, relayed=False):
    """Make two hosts with an address each; `relayed` packets are late, and some are lost."""
    with ExitStack() as stack:
        names = [f"{PREFIX}{os.getpid()}{letter}" for letter in "abr"]
        hosts = [stack.enter_context(namespace(name)) for name in names[: 2 + relayed]]
        if relayed:
            for host, end in zip(hosts, ENDS, strict=False):
                join(host, PORT, hosts[2], end)
            stack.enter_context(relay(hosts[2]))
        else:
            join(hosts[0], PORT, hosts[1], PORT)
        for i, host in enumerate(hosts[:2]):
            host.ip("address", "add", f"10.77.0.{i + 1}/24", "dev", PORT)
        yield hosts[:2]


@contextmanager
def relay(host):
    """Hand on packets between a host's two ports."""
    words = [*host.words, sys.executable, RELAY, *ENDS, str(LOSS), str(DELAY_S)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            yield
        finally:
            process.kill()


def shape(host):
    """Have the kernel lose and delay what a host sends, or skip where it cannot."""
    loss, delay = f"{LOSS:.0%}", f"{DELAY_S * 1e3:g}ms"
    queue = ("tc", "-n", host.name, "qdisc", "add", "dev", PORT, "root", "netem")
    refusal = why_not(*queue, "loss", loss, "delay", delay)
    if refusal is not None:
        pytest.skip(f"tc netem is not available here: {refusal}")
