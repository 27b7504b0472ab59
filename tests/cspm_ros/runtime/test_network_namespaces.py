"""Plant and controllers on two hosts: the same messages, over a network that is what it is."""

import re
import time

import pytest
from network_hosts import LOSS, shape, two_hosts
from ros_graph import (
    assert_same,
    ended_in_any_case,
    load_ros,
    new_domain,
    outcome,
    start_node,
)
from run_samples import bundle_of

from cspm_msgs_py.recording.recover import recover
from cspm_ros.runtime.progress_file import read_report
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

load_ros()

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

ON_BOARD = ("plant", "recorder")
ASHORE = ("wave_trajectory", "motion_controller", "tension_distribution", "force_controller")
# Both hosts see the same shared memory, which would go around the network.
NETWORKED = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
}
# Little longer than nodes take to complain.
PATIENCE_S = 6.0
# Beyond the first steps, at which nodes are given more time, as every node has seen at two looks.
UNDER_WAY_S = 1.0
# A busy machine takes its time to start six programs; nobody waits for ever.
LONGEST_S = 180.0


def start(hosts, folder, steps, patience_s):
    """Start the machine's nodes on one host, the controllers' on the other."""
    reported = ("scenario:=rest", f"folder:={folder}", f"steps:={steps}", f"patience:={patience_s}")
    reported += (f"report:={report_of(folder)}",)
    domain = new_domain()
    return ended_in_any_case(
        {
            name: start_node(name, *reported, domain=domain, before=host.words, **NETWORKED)
            for host, names in zip(hosts, (ON_BOARD, ASHORE), strict=True)
            for name in names
        }
    )


def report_of(folder):
    return folder.with_name("report.json")


def get_under_way(plant, folder):
    """Wait until the plant has simulated so much that no node is at its start any more."""
    end = time.monotonic() + LONGEST_S
    while read_report(report_of(folder)).simulated < UNDER_WAY_S:
        assert plant.poll() is None, plant.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


def assert_all_well(nodes):
    for name, process in nodes.items():
        code, out, err = outcome(process, LONGEST_S)
        errors = [line for line in err.splitlines() if not line.startswith("[WARN]")]
        assert (name, code, out, errors) == (name, 0, "", [])


def assert_as_in_process(folder, steps):
    run(bundle_of("rest"), folder.with_name("inprocess"), steps=steps)
    assert_same(folder.with_name("inprocess"), folder)


@pytest.mark.parametrize("by", ["relay", "kernel"])
def test_lost_and_late_packets_change_nothing(tmp_path, by):
    steps, folder = 200, tmp_path / "bag"
    with two_hosts(relayed=by == "relay") as hosts:
        if by == "kernel":
            for host in hosts:
                shape(host)
        with start(hosts, folder, steps, 60.0) as nodes:
            assert_all_well(nodes)
        sent, received = (sum(host.packets(way) for host in hosts) for way in ("tx", "rx"))
    # A state and a command of every step went over the cable, not around it.
    assert received > 2 * steps
    # The kernel does not count what it loses as sent.
    assert received < (1.0 - 0.5 * LOSS) * sent or by == "kernel"
    assert_as_in_process(folder, steps)


def test_a_network_that_goes_away_for_a_while_changes_nothing(tmp_path):
    steps, folder = 2000, tmp_path / "bag"
    with two_hosts() as hosts, start(hosts, folder, steps, 60.0) as nodes:
        get_under_way(nodes["plant"], folder)
        hosts[1].unplug()
        assert re.search(r"since \d+ s plant waits for \S", nodes["plant"].stderr.readline())
        hosts[1].plug()
        assert_all_well(nodes)
    assert_as_in_process(folder, steps)


def test_a_network_that_goes_away_for_good_ends_the_run_and_is_reported(tmp_path):
    folder = tmp_path / "bag"
    with two_hosts() as hosts, start(hosts, folder, 3_600_000, PATIENCE_S) as nodes:
        get_under_way(nodes["plant"], folder)
        hosts[1].unplug()
        said = {name: outcome(process, LONGEST_S) for name, process in nodes.items()}
    for name, (code, out, err) in said.items():
        assert (name, code, out) == (name, 1, "")
        waits = rf"{name} waits for \S"
        assert re.search(rf"since \d+ s {waits}", err)
        last = err.splitlines()[-1]
        assert re.match(rf"cspm node {name}: nothing moved for {PATIENCE_S:g} s: {waits}", last)
    recover(folder)
    assert resimulate(folder, lambda now, total: None).difference is None
