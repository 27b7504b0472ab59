"""Which ROS 2 Jazzy there is, native or wheels, found without importing it."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.machinery import EXTENSION_SUFFIXES, PathFinder
from importlib.metadata import distributions
from pathlib import Path
from typing import Literal

from cspm_msgs_py.errors import InputError

DISTRO = "jazzy"
OLDEST_RCLPY = (7, 1, 4)  # the first of Jazzy with the events executor
WHEELS_UP_TO = (3, 14)  # of Python; checked on the package index, as is the platform below
WHEELS_PLATFORM = ("linux", "x86_64")


@dataclass(frozen=True)
class RosInstall:
    """A usable ROS 2 Jazzy.

    Attributes:
        kind: "native" for a sourced installation, "wheels" for packages installed by pip.
        version: of rclpy.
        prefix: the folder that holds its `lib` and `share`.
    """

    kind: Literal["native", "wheels"]
    version: str
    prefix: Path


def find_ros(
    needed_by: str = "ROS 2",
    environment: Mapping[str, str] = os.environ,
    path: Sequence[str] | None = None,
) -> RosInstall:
    """Find the ROS 2 Jazzy that `import rclpy` would use, and refuse what could not work.

    Args:
        needed_by: what needs ROS, such as `--mode graph`; begins the line of an error.
        environment: the process's.
        path: where modules are looked for; `sys.path` unless given.

    Raises:
        InputError: there is none, or it is not Jazzy, older than rclpy 7.1.4, built for another
            Python, or native and wheels would mix.
    """
    distro = environment.get("ROS_DISTRO", DISTRO)
    if distro != DISTRO:
        raise InputError(
            f"{needed_by}: ROS_DISTRO is {distro}, allowed: {DISTRO}, or, in a shell without ROS"
            f" sourced, {_how_to_install()}"
        )
    folders = list(sys.path if path is None else path)
    spec = PathFinder.find_spec("rclpy", folders)
    if spec is None or spec.origin is None:
        raise InputError(
            f"{needed_by}: ROS 2 Jazzy is not installed, allowed: {_how_to_install()},"
            " or a shell with a native Jazzy sourced"
        )
    package = Path(spec.origin).parent
    wheel = _version(package.parent, "ros-rclpy")
    version = wheel or _version(package.parent, "rclpy") or "unknown"
    _check_rclpy(needed_by, package, version)
    if wheel:
        _check_library_path(needed_by, environment)
        return RosInstall("wheels", wheel, Path(sys.prefix))
    _check_native(needed_by, package, environment, folders)
    return RosInstall("native", version, _prefix(package, environment))


def has_wheels(python: tuple[int, int], system: str, machine: str) -> bool:
    """Return whether the package index has wheels of ROS 2 Jazzy for a Python and a platform.

    Args:
        python: major and minor version.
        system: as `sys.platform` says it.
        machine: as `platform.machine()` says it.
    """
    return python <= WHEELS_UP_TO and (system, machine) == WHEELS_PLATFORM


def _how_to_install() -> str:
    if has_wheels(sys.version_info[:2], sys.platform, platform.machine()):
        return "`pip install 'cspm[ros]'`"
    newest = ".".join(map(str, WHEELS_UP_TO))
    return f"`pip install 'cspm[ros]'` on Linux x86_64 with Python 3.10 to {newest}"


def _version(folder: Path, name: str) -> str | None:
    """Return the version of a distribution that is installed in a folder; None if it is not."""
    found = next(iter(distributions(name=name, path=[str(folder)])), None)
    return found.version if found else None


def _check_rclpy(needed_by: str, package: Path, version: str) -> None:
    digits = version.split(".")
    numbers = tuple(int(part) for part in digits if part.isdecimal())
    if len(numbers) != len(digits) or numbers < OLDEST_RCLPY or numbers[0] != OLDEST_RCLPY[0]:
        raise InputError(
            f"{needed_by}: rclpy in {package} has version {version},"
            f" allowed: {'.'.join(map(str, OLDEST_RCLPY))} or newer of ROS 2 Jazzy"
        )
    core = "_rclpy_pybind11"
    if not any((package / f"{core}{suffix}").is_file() for suffix in EXTENSION_SUFFIXES):
        built = ", ".join(sorted(file.name for file in package.glob(f"{core}*"))) or "nothing"
        raise InputError(
            f"{needed_by}: {package} holds {built}, allowed: {core}{EXTENSION_SUFFIXES[0]}; use the"
            " Python for which this ROS was built, or a shell without ROS sourced"
        )


def _check_library_path(needed_by: str, environment: Mapping[str, str]) -> None:
    """Refuse a process whose libraries are those of another environment than its Python."""
    needed = str(Path(sys.prefix) / "lib")
    if needed not in environment.get("LD_LIBRARY_PATH", "").split(os.pathsep):
        raise InputError(
            f"{needed_by}: LD_LIBRARY_PATH lacks {needed}, allowed: with it, as `pip install"
            " ros-wheels-bootstrapper` makes Python set it at its start, unless"
            " _ROS_WHEELS_BOOTSTRAP_COMPLETE was inherited from elsewhere"
        )


def _check_native(
    needed_by: str, package: Path, environment: Mapping[str, str], folders: Sequence[str]
) -> None:
    if "ROS_DISTRO" not in environment:
        raise InputError(
            f"{needed_by}: ROS_DISTRO is not set, allowed: {DISTRO}; source the setup.bash that"
            f" belongs to {package}"
        )
    # The wheels put their libraries before and after the native ones in an order left to chance.
    if PathFinder.find_spec("ros_wheels_bootstrapper", folders) is not None:
        raise InputError(
            f"{needed_by}: both the native rclpy in {package} and the wheels of ROS 2 are"
            " installed, allowed: one of them; `pip uninstall ros-wheels-bootstrapper`, or a shell"
            " without ROS sourced"
        )


def _prefix(package: Path, environment: Mapping[str, str]) -> Path:
    """Return the sourced prefix that a package lies in; its folder of packages if in none."""
    sourced = environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    prefixes = [Path(entry) for entry in sourced if entry and package.is_relative_to(entry)]
    return prefixes[0] if prefixes else package.parent
