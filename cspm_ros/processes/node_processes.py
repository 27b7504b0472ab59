"""The processes of a run, one a node."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Collection
from pathlib import Path

from typing_extensions import Self

from cspm_ros.processes.background import put_behind
from cspm_ros.processes.hosted_process import HOST_LOG, NodeHost
from cspm_ros.runtime.stall_watchdog import STANDSTILL

LEAVING_S = 5.0
# How long a node may be gone before that is reported.
SILENCE_S = 2.0
_LOOK_EVERY_S = 0.05
_TAIL = 4000
_COLOUR = re.compile(r"\x1b\[[\d;]*m")
_MIDDLEWARE = re.compile(r"\[RTPS_\w+ (?:Error|Warning)\]")
_WARNING = re.compile(r"\[(?:WARN|ERROR|FATAL)\] \[[\d.]+\] \[(.+?)\]: (.+)\n")


class NodeProcesses:
    """The processes of a run, one a node; they stop with this one, however it ends."""

    def __init__(self, host: NodeHost, log: Path, behind: Collection[str] = ()) -> None:
        """Take them over from their host.

        Args:
            host: starts them.
            log: folder for what they print.
            behind: who of them has time, and gives way to the others once the run has begun.
        """
        self._host, self._log = host, log
        self._ending: set[str] = set()
        self.by_name = host.nodes
        self._read = dict.fromkeys(host.nodes, 0)
        self._behind = list(behind)

    def begin(self) -> None:
        """Note that the run has begun: who has time gives way. The start waits for them as well."""
        while self._behind:
            process = self.by_name[self._behind.pop()].pid
            if process is not None:
                put_behind(process)

    def ended(self) -> dict[str, int]:
        """Return the exit codes of those that ended; a signal is negative."""
        codes = {name: process.poll() for name, process in self.by_name.items()}
        return {name: code for name, code in codes.items() if code is not None}

    def stop(self, name: str) -> None:
        """Signal a node to end, once: a second signal would not let it end in order."""
        if self.by_name[name].poll() is None and name not in self._ending:
            self._ending.add(name)
            self.by_name[name].send_signal(signal.SIGINT)

    def obituary(self, name: str, leaving_s: float = LEAVING_S) -> str:
        """Return in one line how a node ended, and its last words.

        Args:
            name: of the node.
            leaving_s: how long the others may take to give up as well [s].
        """
        code, words = self.by_name[name].poll() or 0, self._last_words(name)
        how = f"by signal {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
        text = f"{name} ended {how} before the run did" + f": {words}" * bool(words)
        if STANDSTILL not in words or self._wait_for_others(leaving_s):
            return text
        # All nodes give up a run that stands still, but for those that hang themselves.
        silent = [name for name in self.by_name if name not in self.ended()]
        return f"no answer from {', '.join(silent)}; {text}"

    def _wait_for_others(self, seconds: float) -> bool:
        """Wait for all to end; return whether they did. Nobody waits for those that are stopped."""
        deadline = time.monotonic() + seconds
        while left := [each for each in self.by_name.values() if each.poll() is None]:
            if time.monotonic() > deadline or all(_is_stopped(each.pid) for each in left):
                return False
            time.sleep(_LOOK_EVERY_S)
        return True

    def warnings(self) -> list[str]:
        """Return what the nodes warned of since the last call, a line each."""
        found = []
        for name in self.by_name:
            with (self._log / f"{name}.log").open("rb") as log:
                log.seek(self._read[name])
                text, _, _ = log.read().rpartition(b"\n")
            self._read[name] += len(text)
            lines = _WARNING.findall(text.decode(errors="replace") + "\n")
            found += [f"{node}: {line}" for node, line in lines]
        return found

    def _last_words(self, name: str) -> str:
        # A host that fails before it has forked any node speaks for all.
        files = [self._log / f"{name}.log", self._log / HOST_LOG]
        texts = (file.read_text(errors="replace") for file in files)
        return last_words(next(filter(None, texts), "")[-_TAIL:])

    def wait(self, seconds: float) -> bool:
        """Wait for all to end; return whether they did."""
        deadline = time.monotonic() + seconds
        return all(
            process.wait(max(0.0, deadline - time.monotonic())) for process in self.by_name.values()
        )

    def close(self) -> None:
        """End all that still run, the stubborn by force."""
        for process in self.by_name.values():
            process.send_signal(signal.SIGTERM)
            # Who was stopped can end in order as well.
            process.send_signal(signal.SIGCONT)
        if not self.wait(LEAVING_S):
            for process in self.by_name.values():
                process.send_signal(signal.SIGKILL)
            self.wait(LEAVING_S)
        self._host.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def last_words(text: str) -> str:
    """Return the last line that a program printed, but for the middleware's remarks; "" if none.

    Fast DDS reports ports in shared memory that it cannot have, and takes others.
    """
    lines = [_COLOUR.sub("", line).strip() for line in text.splitlines()]
    return next((each for each in reversed(lines) if each and not _MIDDLEWARE.search(each)), "")


def _is_stopped(process: int | None) -> bool:
    """Return whether a signal has stopped a process; False where the system does not show it."""
    try:
        state = Path(f"/proc/{process}/stat").read_text(errors="replace")
    except OSError:
        return False
    # After the name in parentheses, which may hold anything.
    return state.rpartition(")")[2].split()[0] == "T"
