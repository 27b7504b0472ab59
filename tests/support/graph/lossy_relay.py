"""A cable between two network ports of this host that delays every packet and loses some."""

import heapq
import itertools
import random
import selectors
import socket
import sys
import time

ALL_PROTOCOLS = 3
MOST_BYTES = 65_536
ETHERNET_BYTES, IPV4, UDP = 14, b"\x08\x00", 17
SEED = 7


def without_checksum(frame):
    """Return a frame whose UDP checksum says "none": the kernel leaves it to network cards."""
    if frame[12:14] != IPV4 or frame[23] != UDP or frame[20] & 0x1F or frame[21]:
        return frame
    at = ETHERNET_BYTES + 4 * (frame[14] & 0x0F) + 6
    return frame[:at] + b"\x00\x00" + frame[at + 2 :]


def opened(port):
    """Return a socket for the raw frames of a port."""
    made = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ALL_PROTOCOLS))
    made.bind((port, 0))
    made.setblocking(False)
    return made


def relay(one, other, loss, delay_s):
    """Hand on frames for ever."""
    ports = [opened(one), opened(other)]
    chance, order = random.Random(SEED), itertools.count()
    underway = []
    print("ready", flush=True)  # noqa: T201 - to the test
    with selectors.DefaultSelector() as selector:
        for port, opposite in zip(ports, reversed(ports), strict=True):
            selector.register(port, selectors.EVENT_READ, opposite)
        while True:
            wait = max(0.0, underway[0][0] - time.monotonic()) if underway else None
            for key, _ in selector.select(wait):
                frame, (_, _, kind, *_) = key.fileobj.recvfrom(MOST_BYTES)
                if kind != socket.PACKET_OUTGOING and chance.random() >= loss:
                    due = time.monotonic() + delay_s
                    heapq.heappush(underway, (due, next(order), key.data, frame))
            while underway and underway[0][0] <= time.monotonic():
                _, _, port, frame = heapq.heappop(underway)
                port.send(without_checksum(frame))


if __name__ == "__main__":
    relay(sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
