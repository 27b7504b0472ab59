"""The processes that a host forks, as who started the host sees them."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from cspm_ros.processes.node_host import ENDED, STARTED

HOST_LOG = "host.log"
_BYTES = 65536
_CLOSING_S = 5.0


class HostedProcess:
    """A node's process.

    Attributes:
        pid: its number, None before it has started.
        returncode: its exit code, None before its end is known; a signal is negative.
    """

    def __init__(self, host: NodeHost) -> None:
        self._host = host
        self.pid: int | None = None
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """Return the exit code, None while it runs or starts."""
        if self.returncode is None:
            self._host.read(0.0)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Signal it; before it has started, end the host in its place."""
        if self.poll() is not None:
            return
        if self.pid is None:
            self._host.end()
            return
        with suppress(ProcessLookupError):
            os.kill(self.pid, number)

    def wait(self, seconds: float) -> bool:
        """Wait for its end; return whether it ended.

        Args:
            seconds: how long at most [s].
        """
        deadline = time.monotonic() + seconds
        while self.poll() is None and (left := deadline - time.monotonic()) > 0.0:
            self._host.read(left)
        return self.returncode is not None


class NodeHost:
    """The program that forks a process per node.

    Attributes:
        nodes: their processes, by name.
    """

    def __init__(
        self, names: Sequence[str], parameters: Path, log: Path, namespace: str = "/"
    ) -> None:
        """Start it.

        Args:
            names: of the nodes.
            parameters: ROS 2 parameter file for all of them.
            log: folder for what they print.
            namespace: of all of them.
        """
        self.nodes = {name: HostedProcess(self) for name in names}
        for name in names:
            (log / f"{name}.log").touch()
        self._rest = b""
        command = [sys.executable, "-m", "cspm_ros.processes.node_host"]
        command += [str(parameters), str(log), namespace]
        with (log / HOST_LOG).open("wb") as errors:
            self._process = subprocess.Popen(
                [*command, *names],
                # The nodes inherit it, and end when it closes.
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                # Ctrl-C in a terminal goes to a whole group; the nodes end in their own order.
                start_new_session=True,
            )

    def read(self, seconds: float) -> None:
        """Take in what the host says of its nodes, waiting for a time [s] if it says nothing."""
        said = self._process.stdout
        if said is None or said.closed or not select.select([said], [], [], seconds)[0]:
            return
        content = os.read(said.fileno(), _BYTES)
        if not content:
            said.close()
            self._lost(self._process.wait())
            return
        *lines, self._rest = (self._rest + content).split(b"\n")
        for line in lines:
            what, name, number = line.decode().split()
            if what == STARTED:
                self.nodes[name].pid = int(number)
            elif what == ENDED:
                self.nodes[name].returncode = int(number)

    def _lost(self, code: int) -> None:
        """End who is left once the host is gone: how they end can no longer be known."""
        for node in self.nodes.values():
            if node.returncode is None:
                node.returncode = code
                if node.pid is not None:
                    with suppress(ProcessLookupError):
                        os.kill(node.pid, signal.SIGKILL)

    def end(self) -> None:
        """End the host itself; nodes that it has not forked yet count as ended."""
        if self._process.poll() is None:
            self._process.terminate()

    def close(self) -> None:
        """Close the standard input of host and nodes; end by force who does not end then."""
        with self._process as process:
            if process.stdin is not None:
                process.stdin.close()
            try:
                process.wait(_CLOSING_S)
            except subprocess.TimeoutExpired:
                process.kill()
                self._lost(-signal.SIGKILL)
