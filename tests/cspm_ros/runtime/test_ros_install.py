"""Which ROS 2 is found, from folders as pip and a native installation lay them out."""

import importlib.util
import json
import os
import subprocess
import sys
import sysconfig
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.metadata import version
from pathlib import Path

import pytest

from cspm_msgs_py.errors import InputError
from cspm_ros.runtime.ros_install import RosInstall, find_ros, has_wheels

ROOT = Path(__file__).resolve().parents[3]
LIBRARIES = {"LD_LIBRARY_PATH": f"/elsewhere/lib:{sys.prefix}/lib"}
needs_ros = pytest.mark.skipif(
    importlib.util.find_spec("rclpy") is None, reason="ROS 2 is not installed"
)


def rclpy_in(prefix, distribution, number, suffix=EXTENSION_SUFFIXES[0]):
    """Lay out rclpy below a prefix; return its folder of packages."""
    packages = prefix / "lib" / "python3" / "site-packages"
    (packages / "rclpy").mkdir(parents=True)
    (packages / "rclpy" / "__init__.py").write_text("raise AssertionError('imported')\n")
    (packages / "rclpy" / f"_rclpy_pybind11{suffix}").touch()
    record = packages / f"{distribution.replace('-', '_')}-{number}.dist-info"
    record.mkdir()
    (record / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {number}\n"
    )
    return packages


def refusal(environment, *folders):
    with pytest.raises(InputError) as caught:
        find_ros("--mode graph", environment, [str(folder) for folder in folders])
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith("--mode graph: ")
    assert ", allowed: " in line
    return line


def test_wheels_are_found(tmp_path):
    folder = rclpy_in(tmp_path, "ros-rclpy", "7.1.6")
    found = find_ros(environment=LIBRARIES, path=["/nowhere", str(folder)])
    assert found == RosInstall("wheels", "7.1.6", Path(sys.prefix))


def test_a_sourced_native_jazzy_is_found_before_what_follows_on_the_path(tmp_path):
    native = rclpy_in(tmp_path / "jazzy", "rclpy", "7.1.11")
    other = rclpy_in(tmp_path / "other", "ros-rclpy", "7.1.6")
    environment = {
        "ROS_DISTRO": "jazzy",
        "AMENT_PREFIX_PATH": f"{tmp_path}/overlay:{tmp_path}/jazzy",
    }
    found = find_ros(environment=environment, path=[str(native), str(other)])
    assert found == RosInstall("native", "7.1.11", tmp_path / "jazzy")


def test_a_native_jazzy_in_no_sourced_prefix_is_named_by_its_folder(tmp_path):
    folder = rclpy_in(tmp_path, "rclpy", "7.1.4")
    found = find_ros(environment={"ROS_DISTRO": "jazzy"}, path=[str(folder)])
    assert found == RosInstall("native", "7.1.4", folder)


def test_wheels_serve_where_jazzy_is_named_but_not_on_the_path(tmp_path):
    folder = rclpy_in(tmp_path, "ros-rclpy", "7.1.6")
    found = find_ros(environment=LIBRARIES | {"ROS_DISTRO": "jazzy"}, path=[str(folder)])
    assert found.kind == "wheels"


def test_absence_says_what_to_install(tmp_path):
    line = refusal({}, tmp_path)
    assert line.startswith("--mode graph: ROS 2 Jazzy is not installed, allowed: `pip install ")
    assert line.endswith(", or a shell with a native Jazzy sourced")


def test_a_folder_that_is_merely_called_rclpy_is_not_ros(tmp_path):
    (tmp_path / "rclpy").mkdir()
    assert "is not installed" in refusal({}, tmp_path)


@pytest.mark.parametrize("distribution", ["rclpy", "ros-rclpy"])
def test_another_distribution_is_refused_whatever_is_installed(tmp_path, distribution):
    folder = rclpy_in(tmp_path, distribution, "7.1.6")
    line = refusal(LIBRARIES | {"ROS_DISTRO": "humble"}, folder)
    assert "ROS_DISTRO is humble, allowed: jazzy, or, in a shell without ROS sourced, `pip" in line


@pytest.mark.parametrize("number", ["3.3.16", "7.1.3", "7.0.9", "9.1.2", "7.1", "seven", "7.x.4"])
@pytest.mark.parametrize("distribution", ["rclpy", "ros-rclpy"])
def test_rclpy_of_another_distribution_or_too_old_is_refused(tmp_path, distribution, number):
    folder = rclpy_in(tmp_path, distribution, number)
    line = refusal(LIBRARIES | {"ROS_DISTRO": "jazzy"}, folder)
    assert f"rclpy in {folder}/rclpy has version {number}, allowed: 7.1.4 or newer" in line


def test_rclpy_without_a_version_is_refused(tmp_path):
    folder = rclpy_in(tmp_path, "something-else", "7.1.6")
    assert "has version unknown, allowed: 7.1.4" in refusal({"ROS_DISTRO": "jazzy"}, folder)


def test_rclpy_that_was_built_for_another_python_is_refused(tmp_path):
    folder = rclpy_in(tmp_path, "rclpy", "7.1.6", ".cpython-399-x86_64-linux-gnu.so")
    line = refusal({"ROS_DISTRO": "jazzy"}, folder)
    assert "holds _rclpy_pybind11.cpython-399-x86_64-linux-gnu.so, allowed: _rclpy_pybin" in line
    (folder / "rclpy" / "_rclpy_pybind11.cpython-399-x86_64-linux-gnu.so").unlink()
    assert "holds nothing, allowed: " in refusal({"ROS_DISTRO": "jazzy"}, folder)


def test_native_and_wheels_together_are_refused(tmp_path):
    folder = rclpy_in(tmp_path / "jazzy", "rclpy", "7.1.6")
    wheels = tmp_path / "wheels"
    (wheels / "ros_wheels_bootstrapper").mkdir(parents=True)
    (wheels / "ros_wheels_bootstrapper" / "__init__.py").touch()
    environment = {"ROS_DISTRO": "jazzy"}
    assert find_ros(environment=environment, path=[str(folder)]).kind == "native"
    line = refusal(environment, folder, wheels)
    assert f"both the native rclpy in {folder}/rclpy and the wheels" in line
    assert "`pip uninstall ros-wheels-bootstrapper`, or a shell without ROS sourced" in line


def test_native_rclpy_without_its_environment_is_refused(tmp_path):
    folder = rclpy_in(tmp_path, "rclpy", "7.1.6")
    line = refusal({}, folder)
    assert f"not set, allowed: jazzy; source the setup.bash that belongs to {folder}/rclpy" in line


@pytest.mark.parametrize("libraries", [{}, {"LD_LIBRARY_PATH": f"{sys.prefix}/lib64:/lib"}])
def test_wheels_without_their_libraries_are_refused(tmp_path, libraries):
    folder = rclpy_in(tmp_path, "ros-rclpy", "7.1.6")
    line = refusal(libraries, folder)
    assert f"LD_LIBRARY_PATH lacks {sys.prefix}/lib, allowed: with it" in line


@pytest.mark.parametrize(
    ("python", "system", "machine", "expected"),
    [
        ((3, 10), "linux", "x86_64", True),
        ((3, 14), "linux", "x86_64", True),
        ((3, 15), "linux", "x86_64", False),
        ((3, 12), "linux", "aarch64", False),
        ((3, 12), "darwin", "x86_64", False),
    ],
)
def test_for_what_there_are_wheels(python, system, machine, expected):
    assert has_wheels(python, system, machine) is expected


def test_where_there_are_no_wheels_the_line_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    line = refusal({}, tmp_path)
    assert "`pip install 'cspm[ros]'` on Linux x86_64 with Python 3.10 to 3.14, or a she" in line


REPORT = """
import json, sys
from cspm_ros.runtime.ros_install import find_ros
found = find_ros()
before = "rclpy" in sys.modules
import rclpy
rclpy.init()
node = rclpy.create_node("found")
name = node.get_name()
node.destroy_node()
rclpy.shutdown()
print(json.dumps([found.kind, found.version, str(found.prefix), before, name, rclpy.__file__]))
"""


def report(python, environment):
    """Find ROS in a process of its own, then use it."""
    local = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": "83"}
    done = subprocess.run(
        [python, "-c", REPORT],
        env=environment | local,
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@needs_ros
def test_what_is_found_here_works_and_finding_does_not_import_it():
    found = find_ros()
    kind, number, prefix, imported, name, _ = report(sys.executable, dict(os.environ))
    assert (kind, number, prefix) == (found.kind, found.version, str(found.prefix))
    assert (imported, name) == (False, "found")
    if kind == "wheels":
        assert number == version("ros-rclpy")


@needs_ros
@pytest.mark.skipif("ROS_DISTRO" in os.environ, reason="a native ROS is sourced")
def test_a_native_layout_of_the_same_libraries_works_in_an_environment_without_wheels(tmp_path):
    """Links to everything here but what marks wheels, put before an empty environment's packages.

    This is a native installation's layout and environment; it is not Debian's build of it.
    """
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "env"], check=True)
    packages = tmp_path / "jazzy" / "lib" / "site-packages"
    packages.mkdir(parents=True)
    for entry in Path(sysconfig.get_paths()["purelib"]).iterdir():
        wheel = entry.name.startswith("ros_") and entry.name.endswith(".dist-info")
        if not wheel and "ros_wheels" not in entry.name and entry.suffix != ".pth":
            (packages / entry.name).symlink_to(entry)
    environment = {
        key: text
        for key, text in os.environ.items()
        if key not in {"_ROS_WHEELS_BOOTSTRAP_COMPLETE", "VIRTUAL_ENV"}
    }
    environment |= {
        "ROS_DISTRO": "jazzy",
        "AMENT_PREFIX_PATH": str(tmp_path / "jazzy"),
        "PYTHONPATH": str(packages),
    }
    kind, _, prefix, imported, name, file = report(tmp_path / "env" / "bin" / "python", environment)
    assert (kind, prefix, imported, name) == ("native", str(tmp_path / "jazzy"), False, "found")
    assert Path(file).is_relative_to(packages)
