"""One run in a ROS domain: whoever leads it claims the domain before anything of it is sent.

A claim is a socket in Linux's abstract namespace. To bind it is one step that the kernel gives to
one process alone, it ends with that process however that ends, and it is seen exactly as far as
messages on the local host. Leaders on other machines are found by the names of their nodes.
"""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from pathlib import Path

from cspm_msgs_py.errors import InputError

START = "/run/start"
"""Where a leader announces the start, without a namespace."""
_PREFIX, _NAMED = "cspm-run/", "/named/"
_SOCKETS = Path("/proc/net/unix")
# Of the 107 bytes of an address the domain and the longest usual namespace take less than half.
_MOST_CHARACTERS = 48
_UNKNOWN = "another run"


class DomainClaim:
    """Holds a domain, under a topic by which runs in it are kept apart, until it is closed."""

    def __init__(self, domain: int, topic: str, name: str) -> None:
        """Claim a domain.

        Args:
            domain: the ROS domain.
            topic: on which the leader announces the start, in full: runs with another do not meet.
            name: of the run.

        Raises:
            InputError: another run has it.
        """
        self._held = _socket()
        key = f"{_PREFIX}{domain}{topic}"
        try:
            self._held.bind(f"\0{key}")
        except OSError:
            self._held.close()
            raise _taken(domain, _holder(key) or _UNKNOWN) from None
        self._name = _socket()
        shown = name.encode()[:_MOST_CHARACTERS].decode(errors="ignore")
        # Without its name the claim holds as well.
        with suppress(OSError):
            self._name.bind(f"\0{key}{_NAMED}{shown} (process {os.getpid()})")

    def close(self) -> None:
        """Give the domain up; a second call does nothing."""
        self._name.close()
        self._held.close()


def refuse_claimed(domain: int | None, topic: str = START) -> None:
    """Refuse a run in a domain that another has, before any of its nodes is started.

    Args:
        domain: the ROS domain; None: that of `ROS_DOMAIN_ID`.
        topic: as for a claim.

    Raises:
        InputError: another run has it, under the same topic.
    """
    domain = int(os.environ.get("ROS_DOMAIN_ID") or 0) if domain is None else domain
    if holder := _holder(f"{_PREFIX}{domain}{topic}"):
        raise _taken(domain, holder)


def _taken(domain: int, holder: str) -> InputError:
    return InputError(
        f"ROS_DOMAIN_ID {domain}: {holder} runs there, allowed: one run in a domain; end that one,"
        " or set another ROS_DOMAIN_ID"
    )


def _socket() -> socket.socket:
    return socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)


def _holder(key: str) -> str:
    """Return the name of the run that holds a key, empty if none is seen."""
    start = f"@{key}{_NAMED}"
    with suppress(OSError):
        for line in _SOCKETS.read_text(encoding="utf-8", errors="replace").splitlines():
            _, found, name = line.partition(start)
            if found:
                return name
    return ""
