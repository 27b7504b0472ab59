"""Schedules of small machines."""

from cspm_msgs_py.schedule import NodePlan, Schedule, Timing

MS = 1_000_000


def delayed(testbed, delays):
    """Return the machine with sensors that are late by so many milliseconds."""
    sensors = {
        name: sensor.model_copy(update={"delay": delays.get(name, 0) * 1e-3})
        for name, sensor in testbed.sensors.items()
    }
    return testbed.model_copy(update={"sensors": sensors})


def schedule_with(first=0, divider=1, delay=0):
    """Return a schedule of one topic and one node that reads it, at 1 kHz."""
    plan = NodePlan(first, divider, 100, ("/in",), (), ("/out",))
    topics = {"/in": Timing(first, divider, delay), "/out": Timing(first, divider)}
    return Schedule(MS, topics, {"node": plan}, 100)
