"""What is not as it should be though a run goes on, a line each."""

from __future__ import annotations

from cspm_model.cable_strength import strength_warnings
from cspm_msgs_py.scenario import ClosedLoop, Scenario
from cspm_msgs_py.testbed import Testbed
from cspm_run.run_statistics import RunStatistics
from cspm_run.stability.limit_cycle import oscillation
from cspm_run.stability.loop_growth import loop_growth, period_of_force
from cspm_run.stability.saturation import saturation_words

# Less of the time does not matter: a gust. Shorter than this [s] there is a start, which shows
# nothing.
NOTED_SHARE, LEAST_SPAN = 0.01, 1.0


def run_warnings(
    scenario: Scenario, testbed: Testbed, statistics: RunStatistics, *, late: bool = False
) -> tuple[str, ...]:
    """Return what a run warns of: the cables' strength, loops that are not stable, a limit cycle.

    Args:
        scenario: resolved.
        testbed: the machine.
        statistics: of the run.
        late: whether torques come a period late, as in real time.
    """
    unstable = unstable_line(scenario, testbed, late=late)
    cycle = _cycle_line(testbed, statistics) if _shares(scenario, statistics) else None
    found = [line for line in (unstable, cycle) if line is not None]
    return (*strength_warnings(testbed, statistics.highest_tensions), *found)


def unstable_line(scenario: Scenario, testbed: Testbed, *, late: bool = False) -> str | None:
    """Return a line where the loops are not stable about rest; arguments as `run_warnings`."""
    computing = period_of_force(scenario) if late else 0.0
    found = loop_growth(scenario, testbed, computing)
    if found is None or not found.unstable:
        return None
    return (
        f"the control loops are not stable: at the design pose a motion of {found.frequency:.4g}"
        f" rad/s grows as exp({found.rate:.3g}·t), t in s; lower control.motion.crossover or"
        " control.force.bandwidth; `cspm analyze design` shows each loop"
    )


def limits_met(scenario: Scenario, testbed: Testbed, statistics: RunStatistics) -> str | None:
    """Return a line on how much of the time a closed loop was at a limit; None for hardly any.

    Arguments as `run_warnings`.
    """
    shares = _shares(scenario, statistics)
    if not shares:
        return None
    line = "limits met: " + ", ".join(f"{what} {share:.1%} of the time" for what, share in shares)
    drives = saturation_words(statistics.saturation(testbed.cable_names), NOTED_SHARE)
    return f"{line}: {drives}" if drives else line


def _shares(scenario: Scenario, statistics: RunStatistics) -> list[tuple[str, float]]:
    if not isinstance(scenario.control, ClosedLoop) or statistics.span < LEAST_SPAN:
        return []
    shares = (
        ("a cable slack", statistics.slack_share),
        ("the commanded wrench infeasible", statistics.infeasible_share),
        ("a motor at its torque limit", statistics.saturated_share),
    )
    return [(what, share) for what, share in shares if share >= NOTED_SHARE]


def _cycle_line(testbed: Testbed, statistics: RunStatistics) -> str | None:
    found = oscillation(statistics.last_tensions, statistics.kept_period)
    if found is None:
        return None
    return (
        f"limit cycle: the tension of {testbed.cables[found.cable].name} oscillates at"
        f" {found.frequency:.3g} Hz by ± {found.amplitude:.3g} N to the end, between limits; lower"
        " the gains"
    )
