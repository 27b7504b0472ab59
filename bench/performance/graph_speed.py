"""The same closed loop as ROS 2 nodes, recorded, and how many messages are lost."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from bench.performance.measured_figure import Advance, Figure
from bench.performance.thesis_machine import worst_case
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_run.run_result import RunResult

GROUP = "ROS 2 graph, worst case, recorded"
DOMAIN_ID = 83


def measure_graph(
    repetitions: int, duration: float, realtime_duration: float, advance: Advance
) -> list[Figure]:
    """Simulate `duration` [s] in each mode in turns, and `realtime_duration` [s] by the wall."""
    return [
        *_in_step(repetitions, duration, advance),
        *_by_the_wall(realtime_duration, advance),
    ]


def _in_step(repetitions: int, duration: float, advance: Advance) -> list[Figure]:
    from cspm_ros.runtime.graph_run import run_graph
    from cspm_ros.runtime.process_run import run_processes

    factors: dict[str, list[float]] = {"graph": [], "processes": []}
    runners: dict[str, Callable[..., RunResult]] = {"graph": run_graph, "processes": run_processes}
    missing = 0
    for _ in range(repetitions):
        for name, runner in runners.items():
            with ScratchFolder("bench") as place:
                result = runner(worst_case(duration), place / "run", domain_id=DOMAIN_ID)
            factors[name].append(result.real_time_factor)
            missing += round(1000 * duration) - result.messages["/clock"]
            advance(GROUP)
    note = f"{repetitions} runs of {duration:g} s simulated, all rates 1 kHz, in turns"
    return [
        Figure(GROUP, "one process, × real time", "", factors["graph"], 3.0, note=note),
        Figure(GROUP, "a process per node, × real time", "", factors["processes"], 1.0, note=note),
        Figure(GROUP, "in step: steps not recorded", "", [missing], at_most=0, note=note),
    ]


def _by_the_wall(duration: float, advance: Advance) -> list[Figure]:
    from cspm_ros.runtime.process_run import run_processes
    from cspm_ros.runtime.realtime_run import run_realtime

    figures = []
    runners: dict[str, tuple[Callable[..., RunResult], float | None]] = {
        "one process": (run_realtime, 0),
        "a process per node": (partial(run_processes, mode="realtime"), None),
    }
    for name, (runner, most) in runners.items():
        with ScratchFolder("bench") as place:
            wall = runner(worst_case(duration), place / "run", domain_id=DOMAIN_ID)
        advance(GROUP)
        note = f"{wall.simulated:g} s, all rates 1 kHz"
        lost = wall.timing["recorder"]["lost"]
        late = 100 * wall.timing["plant"]["deadlines_missed"] / max(1.0, 1000 * wall.simulated)
        figures += [
            Figure(
                GROUP,
                f"real time, {name}: messages lost",
                "",
                [lost],
                at_most=most,
                note=f"{note}, by the senders' sequence numbers",
            ),
            Figure(
                GROUP,
                f"real time, {name}: torque commands late",
                "%",
                [late],
                note=f"{note}, later than one period of 1 ms",
            ),
        ]
    return figures
