"""What `cspm doctor` says of software, where it is there and where it is not."""

import os
import sys

import pytest

from cspm.doctor.software import software
from cspm_msgs_py.installed import dependencies


def parts(environment=None):
    return {each.name: each for each in software({} if environment is None else environment)}


def test_python_and_package_are_named_with_their_places():
    found = parts()
    assert found["python"].found == f"{sys.version.split()[0]} in {sys.prefix}"
    assert found["cspm"].there
    assert "scenarios" in found["cspm"].found


def test_an_extra_whose_libraries_are_there_is_complete():
    pytest.importorskip("pyarrow")
    pytest.importorskip("h5py")
    pytest.importorskip("openpyxl")
    assert parts()["extra files"].there


def test_an_extra_is_missing_with_what_it_lacks_and_the_line_that_installs_it(monkeypatch):
    installed = dependencies.distribution

    def without(name):
        if name in ("h5py", "numpy"):
            raise dependencies.PackageNotFoundError(name)
        return installed(name)

    monkeypatch.setattr(dependencies, "distribution", without)
    found = parts()
    assert not found["extra files"].there
    assert "h5py>=" in found["extra files"].found
    assert "pyarrow" not in found["extra files"].found
    assert found["extra files"].remedy == "`pip install 'cspm[files]'`"
    assert found["extra campaign"].there
    assert "without numpy>=" in found["cspm"].found
    assert found["cspm"].remedy.startswith("`pip install 'numpy>=")


def test_kernels_that_are_switched_off_or_cannot_be_kept_are_missing(tmp_path):
    assert parts()["numba"].there
    off = parts({"NUMBA_DISABLE_JIT": "1"})["numba"]
    assert (off.there, off.remedy) == (False, "unset NUMBA_DISABLE_JIT")


def test_ros_that_cannot_be_used_is_missing_with_what_is_allowed():
    wrong = parts({"ROS_DISTRO": "humble"})["ros"]
    assert wrong.found == "ROS_DISTRO is humble"
    assert wrong.remedy.startswith("jazzy, or, in a shell without ROS sourced, ")
    assert "--mode graph" in wrong.serves


def test_the_middleware_that_is_asked_for_is_looked_for():
    pytest.importorskip("rclpy", reason="ROS 2 is not installed")
    usual = parts(os.environ)
    assert usual["ros"].there
    assert usual["middleware"].there
    other = parts({**os.environ, "RMW_IMPLEMENTATION": "rmw_pigeon_cpp"})["middleware"]
    assert other.found.startswith("rmw_pigeon_cpp is not in ")
    assert "unset RMW_IMPLEMENTATION" in other.remedy
