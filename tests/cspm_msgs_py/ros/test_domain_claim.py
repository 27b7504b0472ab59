"""One run in a ROS domain: the second is refused by the name of the first."""

import os
import re
import signal
import subprocess
import sys

import pytest
from ros_graph import new_domain

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros.domain_claim import DomainClaim, refuse_claimed

START = "/run/start"
HELD = """
import sys, time
from cspm_msgs_py.ros.domain_claim import DomainClaim
claim = DomainClaim(int(sys.argv[1]), "/run/start", "calm")
print("held", flush=True)
sys.stdin.read()
"""


def test_the_second_run_is_refused_by_the_name_of_the_first():
    domain = new_domain()
    claim = DomainClaim(domain, START, "calm")
    expected = (
        rf"^ROS_DOMAIN_ID {domain}: calm \(process {os.getpid()}\) runs there, allowed: one run in"
        r" a domain; end that one, or set another ROS_DOMAIN_ID$"
    )
    with pytest.raises(InputError, match=expected):
        DomainClaim(domain, START, "worst_case")
    with pytest.raises(InputError, match=expected):
        refuse_claimed(domain, START)
    claim.close()
    claim.close()
    refuse_claimed(domain, START)
    DomainClaim(domain, START, "worst_case").close()


def test_other_domains_and_other_robots_are_free():
    domain, other = new_domain(), new_domain()
    claims = [
        DomainClaim(domain, START, "calm"),
        DomainClaim(other, START, "calm"),
        DomainClaim(domain, "/robot1/run/start", "calm"),
    ]
    refuse_claimed(domain, "/robot2/run/start")
    for claim in claims:
        claim.close()


def test_a_long_name_is_cut():
    domain = new_domain()
    claim = DomainClaim(domain, START, "ä" * 200)
    with pytest.raises(InputError, match="ä" * 20):
        refuse_claimed(domain, START)
    claim.close()


def test_a_killed_run_holds_nothing():
    domain = new_domain()
    words = [sys.executable, "-c", HELD, str(domain)]
    with subprocess.Popen(words, stdin=-1, stdout=-1, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(InputError, match=re.escape(f"calm (process {holder.pid})")):
            refuse_claimed(domain, START)
        holder.send_signal(signal.SIGKILL)
    DomainClaim(domain, START, "calm").close()
