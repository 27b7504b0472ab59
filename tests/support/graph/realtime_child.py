"""A node's process, forked from one in which code is loaded and compiled: it starts in no time."""

import ctypes
import os
import signal
import sys
import tempfile
import traceback
import warnings
from pathlib import Path

from first_in_line import go_first

PR_SET_PDEATHSIG = 1


def load():
    """Load ROS, the nodes and the kernels."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        from ros_graph import load_ros
        from run_samples import bundle_of

        load_ros()
        import cspm_ros.runtime.node_run  # noqa: F401
        from cspm_msgs_py.schedule import PLANT, schedule_of
        from cspm_ros.runtime.warm_up import warm_up

        bundle = bundle_of("rest")
        nodes = schedule_of(bundle.scenario, bundle.testbed.testbed).nodes
        with tempfile.TemporaryDirectory() as place:
            for name in (PLANT, *nodes):
                warm_up(name, bundle, Path(place))


def run(name, arguments, domain, log, first):
    """Be a node, `first` before other programs; what it prints goes to a file."""
    if first:
        go_first()
    # Whoever forked this process may be killed; no node is to outlive it.
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    from cspm_ros.runtime.node_main import main

    try:
        code = main(name, ["--ros-args", *arguments])
    except BaseException:
        traceback.print_exc()
        code = 99
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "realtime_child":
    load()
