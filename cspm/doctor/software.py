"""What is installed: Python, the package and what it needs, its extras, and ROS 2."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from cspm.doctor.part import Part
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.dependencies import EXTRAS, PACKAGE, unmet
from cspm_msgs_py.installed.extra_library import remedy
from cspm_ros.runtime.ros_install import RosInstall, find_ros
from cspm_run.library import scenario_names, testbed_names

_MIDDLEWARE = "rmw_fastrtps_cpp"
_SERVES = {
    "files": "importing spreadsheets, Parquet, HDF5 and MATLAB 7.3",
    "benches": "importing TDMS and MDF",
    "tables": "to_pandas, to_xarray",
    "campaign": "cspm campaign",
    "mujoco": "--plant mujoco",
    "fmu": "cspm fmu, --plant FILE.fmu",
    "view": "cspm view",
}
_ROS_SERVES = "--mode graph, processes and realtime; replay, check-drivers, inject"


def software(environment: Mapping[str, str] = os.environ) -> Iterator[Part]:
    """Yield what is installed.

    Args:
        environment: the process's.
    """
    yield Part("python", f"{sys.version.split()[0]} in {sys.prefix}")
    yield _package()
    yield _kernels(environment)
    yield from _ros(environment)
    yield from (_extra(name) for name in EXTRAS if name in _SERVES)


def _package() -> Part:
    """Return this package, with the library of its files and what it requires."""
    place = Path(__file__).resolve().parents[2]
    try:
        release, missing = version(PACKAGE), unmet()
    except PackageNotFoundError:
        return Part(PACKAGE, f"{place}, not installed", "`pip install` of its wheel or its folder")
    if missing:
        line = f"`pip install {' '.join(map(repr, missing))}`"
        return Part(PACKAGE, f"{release} without {', '.join(missing)}", line, "every command")
    scenarios, testbeds = len(scenario_names()), len(testbed_names())
    if not (scenarios and testbeds):
        line = f"`pip install --force-reinstall --no-deps` of the wheel of {PACKAGE}"
        return Part(PACKAGE, f"{release} in {place}, without its scenarios", line, "names of files")
    return Part(PACKAGE, f"{release} in {place}, {scenarios} scenarios, {testbeds} test-beds")


def _kernels(environment: Mapping[str, str]) -> Part:
    """Return numba, and whether what it compiles is kept for the next run."""
    try:
        numba = import_module("numba")
    except ImportError as err:
        return Part("numba", f"cannot be loaded ({err})", "`pip install numba`", "every simulation")
    if environment.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        line = "unset NUMBA_DISABLE_JIT"
        return Part("numba", f"{numba.__version__}, switched off", line, "runs in good time")
    from cspm_model.kernel_cache import use_kernel_cache

    use_kernel_cache()
    folder = Path(numba.config.CACHE_DIR)
    if any(folder.rglob("*.nbc")):
        return Part("numba", f"{numba.__version__}, kernels compiled in {folder}")
    if not _writable(folder):
        line = "set NUMBA_CACHE_DIR to a folder that you can write"
        return Part("numba", f"{numba.__version__}, cannot write {folder}", line, "starting fast")
    return Part("numba", f"{numba.__version__}, compiles for a minute at the first run")


def _writable(folder: Path) -> bool:
    there = next(each for each in (folder, *folder.parents) if each.exists())
    return os.access(there, os.W_OK)


def _ros(environment: Mapping[str, str]) -> Iterator[Part]:
    """Yield ROS 2 and, where there is one, its middleware."""
    try:
        found = find_ros("ROS 2", environment)
    except InputError as err:
        what, _, allowed = str(err).removeprefix("ROS 2: ").partition(", allowed: ")
        yield Part("ros", what, allowed, _ROS_SERVES)
        return
    yield Part("ros", f"2 Jazzy, {found.kind}, rclpy {found.version} in {found.prefix}")
    yield _middleware(found, environment.get("RMW_IMPLEMENTATION") or _MIDDLEWARE)


def _middleware(ros: RosInstall, name: str) -> Part:
    if (ros.prefix / "lib" / f"lib{name}.so").is_file():
        return Part("middleware", name)
    line = remedy("ros") if name == _MIDDLEWARE else "unset RMW_IMPLEMENTATION"
    if ros.kind == "native":
        line = f"`apt install ros-jazzy-{name.replace('_', '-')}`, or unset RMW_IMPLEMENTATION"
    return Part("middleware", f"{name} is not in {ros.prefix / 'lib'}", line, _ROS_SERVES)


def _extra(name: str) -> Part:
    try:
        missing = unmet(name)
    except PackageNotFoundError:
        missing = [PACKAGE]
    if missing:
        return Part(f"extra {name}", f"lacks {', '.join(missing)}", remedy(name), _SERVES[name])
    return Part(f"extra {name}", "complete")
