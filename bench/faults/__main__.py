"""Faults drawn at random, one after another.

    python -m bench.faults [--minutes M] [--seed S] [--out FOLDER]

A run in real time on ROS 2, at 200 Hz. A fault is drawn, put in, and waited for to end; where a
part went to its safe state it is reset. Safe means that tensions stay below their limit, the bar
near where it hangs, and it slower than it falls.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rclpy.client import Client

from bench.performance.slow_machine import slow_overrides
from cspm_msgs_py.diagnostics import Level, decode_diagnostics
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.session import Session
from cspm_msgs_py.scenario_keys.faults import Fault
from cspm_msgs_py.schedule import FORCE_CONTROLLER, PLANT
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_ros.inject.injection import inject
from cspm_run.recorded_bundle import recorded_bundle

DOMAIN = 93
# Somebody else's work on this computer is no fault of the graph.
_PATIENT = ("safety.stale_after=0.5", "safety.watchdog=0.5", "safety.lateness=0.5")
# A bar that hangs still need not go half the machine's size, the default.
_NEAR = ("safety.following_error=0.1",)
_SETTLES_S, _STARTS_S = 1.5, 60.0
# Beyond where it trips, the bar has to be braked; one that falls is at 1 m/s after 5 cm.
FARTHEST_M, FASTEST = 0.15, 1.0
GUARDED = (FORCE_CONTROLLER, PLANT)


def drawn(rng: np.random.Generator, testbed: Testbed) -> Fault:
    """Return a fault of random kind, place, size and length, that does not last for ever."""
    sensor, winch = str(rng.choice(list(testbed.sensors))), str(rng.choice(testbed.cable_names))
    lasts = round(float(rng.uniform(0.1, 1.5)), 3)
    unit = 0.001 if sensor.endswith("/pose") else 0.05
    size = round(unit * 10 ** float(rng.uniform(-1.0, 2.5)), 6)
    late = round(float(rng.uniform(0.02, 1.0)), 3)
    share = round(float(rng.uniform(0.3, 1.0)), 2)
    options: list[Fault] = [
        Fault(fault="sensor_frozen", on=sensor, lasts=lasts),
        Fault(fault="sensor_noisy", on=sensor, amount=size, lasts=lasts),
        Fault(fault="sensor_biased", on=sensor, amount=size, lasts=lasts),
        Fault(fault="sensor_late", on=sensor, amount=late, lasts=lasts),
        Fault(fault="sensor_dropped", on=sensor, lasts=lasts),
        Fault(fault="winch_weak", on=winch, amount=share, lasts=lasts),
        Fault(fault="brake", lasts=lasts),
    ]
    return options[int(rng.integers(len(options)))]


def _sequence(minutes: float, seed: int, testbed: Testbed) -> Iterator[Fault]:
    rng, end = np.random.default_rng(seed), time.monotonic() + 60.0 * minutes
    while time.monotonic() < end:
        yield drawn(rng, testbed)


def _until_running(session: Session, node: ContractNode) -> None:
    """Wait until the force controller says that it runs."""
    running: set[str] = set()

    def note(payload: bytes) -> None:
        for status in decode_diagnostics(payload).statuses:
            if status.level < Level.ERROR and status.values.get("state") == "running":
                running.add(status.name)

    node.subscribe(DIAGNOSTICS, note)
    if not session.spin_until(lambda: FORCE_CONTROLLER in running, _STARTS_S):
        raise CspmError(f"{FORCE_CONTROLLER} does not run after {_STARTS_S:g} s")


def _wait(session: Session, seconds: float) -> None:
    session.spin_until(lambda: session.stopped, seconds)


def _reset(session: Session, clients: dict[str, Client]) -> None:
    kind = ros_class("std_srvs/srv/Trigger")
    for client in clients.values():
        if client.service_is_ready():
            answer = client.call_async(kind.Request())
            session.spin_until(answer.done, _SETTLES_S)


def _put_all(minutes: float, seed: int, testbed: Testbed) -> int:
    """Put faults into the run in this domain; return how many there were."""
    count = 0
    with Session(domain_id=DOMAIN) as session:
        node, kind = session.node("fault_sequence"), ros_class("std_srvs/srv/Trigger")
        clients = {name: node.node.create_client(kind, f"/{name}/reset") for name in GUARDED}
        _until_running(session, node)
        for fault in _sequence(minutes, seed, testbed):
            if session.stopped:
                break
            inject(fault, domain_id=DOMAIN)
            count += 1
            print(f"{count}: {fault}", flush=True)
            _wait(session, (fault.lasts or 0.0) + _SETTLES_S)
            _reset(session, clients)
    return count


def unsafe_in(folder: Path, testbed: Testbed) -> list[str]:
    """Return what was unsafe in a recorded run, a line each."""
    with Recording(folder) as recording:
        place = recording.rows("/truth/bar/pose")
        speed = recording.rows("/truth/bar/twist").rows[:, :3]
        tension = recording.rows("/truth/cables/tension").rows
    limits = np.array([limit[1] for c in testbed.cables if (limit := c.tension_limits)])
    distances = np.linalg.norm(place.rows[:, :3] - place.rows[0, :3], axis=1)
    far, when = float(distances.max()), 1e-9 * place.stamp_ns[distances.argmax()]
    fast = float(np.linalg.norm(speed, axis=1).max())
    taut = float((tension / limits).max())
    print(
        f"bar at most {far * 1e3:.0f} mm from where it hung (at {when:.2f} s), {fast:.2f} m/s;"
        f" highest tension {100.0 * taut:.0f} % of its limit"
    )
    unsafe = {
        f"bar {far:.3f} m away, allowed: {FARTHEST_M:g} m": far > FARTHEST_M,
        f"bar at {fast:.2f} m/s, allowed: {FASTEST:g} m/s": fast > FASTEST,
        f"tension at {100.0 * taut:.0f} % of its limit": taut > 1.0,
    }
    return [text for text, bad in unsafe.items() if bad]


def main() -> int:
    """Run the sequence; return 0 where nothing unsafe came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=3.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, help="folder of the recording, which is kept")
    options = parser.parse_args()
    with ScratchFolder("faults") as place:
        folder = options.out or place / "faults"
        seconds = 60.0 * options.minutes + 2.0 * _STARTS_S
        settings = (*slow_overrides(), *_PATIENT, *_NEAR, f"duration={round(seconds)}")
        command = [sys.executable, "-m", "cspm", "run", "rest", "--mode", "realtime", "--quiet"]
        command += ["--out", str(folder), *(word for each in settings for word in ("--set", each))]
        run = subprocess.Popen(command, env=os.environ | {"ROS_DOMAIN_ID": str(DOMAIN)})
        try:
            testbed = _machine(folder)
            count = _put_all(options.minutes, options.seed, testbed)
        finally:
            run.send_signal(2)
            run.wait()
        unsafe = unsafe_in(folder, testbed)
        print(f"{count} faults, seed {options.seed}: {'; '.join(unsafe) or 'nothing unsafe'}")
    return 1 if unsafe else 0


def _machine(folder: Path) -> Testbed:
    """Wait until a run is recorded; return its machine."""
    end = time.monotonic() + _STARTS_S
    while True:
        try:
            found = recorded_bundle(folder, ()).testbed.testbed
        except InputError:
            if time.monotonic() > end:
                raise
            time.sleep(0.5)
        else:
            return found


if __name__ == "__main__":
    sys.exit(main())
