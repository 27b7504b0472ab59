"""Which package may import which, held by reading the source."""

import ast
import importlib
import importlib.util
import pkgutil
import subprocess
import sys
import types
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Each may import those before it, but for `BESIDE`.
ORDER = (
    "cspm_msgs_py",
    "cspm_model",
    "cspm_checks",
    "cspm_sim",
    "cspm_control",
    "cspm_run",
    "cspm_ident",
    "cspm_ros",
    "cspm",
    "bench",
)
# Controllers run on hardware without the simulator; diagnosis needs no ROS, nor ROS a diagnosis.
BESIDE = {"cspm_control": {"cspm_sim"}, "cspm_ros": {"cspm_ident"}}
PACKAGES = [name for name in ORDER if (ROOT / name).is_dir()]
ROS = {
    "rclpy",
    "rosidl_runtime_py",
    "rosidl_parser",
    "ament_index_python",
    "launch",
    "launch_ros",
    "builtin_interfaces",
    *(f"{kind}_msgs" for kind in ("sensor", "geometry", "trajectory", "diagnostic", "rosgraph")),
    *(f"{kind}_msgs" for kind in ("std", "nav", "tf2")),
    "std_srvs",
}

# Front-end modules that are made for ROS.
FOR_ROS = {
    "cspm.commands.check_drivers_command",
    "cspm.commands.replay_command",
    "cspm.drivers",
    "cspm.graph",
    "cspm.replaying",
}


def imported(text):
    """Top-level names of all modules that a source text imports, wherever in it."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield (node.module or "").split(".")[0]


def out_of_bounds(package):
    """Return the packages that `package` must not import."""
    return set(ORDER[ORDER.index(package) + 1 :]) | BESIDE.get(package, set())


def wrong_imports(package, name, text):
    """Imports that go against the order, or to ROS from where ROS must not be."""
    may_use_ros = (
        package in {"cspm_ros", "bench"} or name.endswith("_node") or name.startswith("ros/")
    )
    found = set(imported(text))
    return found & (out_of_bounds(package) | (set() if may_use_ros else ROS))


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_go_one_way_and_ros_stays_outside(package):
    for path in sorted((ROOT / package).rglob("*.py")):
        name = path.relative_to(ROOT / package).with_suffix("").as_posix()
        wrong = wrong_imports(package, name, path.read_text(encoding="utf-8"))
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


@pytest.mark.parametrize(("before", "after"), list(pairwise(ORDER)))
def test_the_check_sees_an_import_against_the_order(before, after):
    for text in (
        f"import {after}",
        f"from {after}.x import y",
        f"def f():\n    import {after}.x as z",
        f"if True:\n    from {after} import x",
    ):
        assert wrong_imports(before, "any", text) == {after}
    allowed = set() if before in BESIDE.get(after, ()) else {"none"}
    found = wrong_imports(after, "any", f"import {before}\nimport numpy")
    assert bool(found) == (not allowed)


def test_the_check_sees_ros_where_it_must_not_be():
    text = "import rclpy\nfrom sensor_msgs.msg import JointState"
    assert wrong_imports("cspm_sim", "plant", text) == {"rclpy", "sensor_msgs"}
    assert wrong_imports("cspm_sim", "plant_node", text) == set()
    assert wrong_imports("cspm_msgs_py", "ros/session", text) == set()
    assert wrong_imports("cspm_msgs_py", "rosy", text) == {"rclpy", "sensor_msgs"}
    assert wrong_imports("cspm_ros", "runner", text) == set()


def modules():
    """Names of all modules that can be imported without running, and whether each needs ROS."""
    for package in PACKAGES:
        yield package, False
        for info in pkgutil.walk_packages([str(ROOT / package)], f"{package}."):
            place = ROOT / info.name.replace(".", "/")
            text = (place / "__init__.py" if info.ispkg else place.with_suffix(".py")).read_text()
            ros = (
                set(imported(text)) & ROS
                or ".ros" in info.name
                or package in {"cspm_ros", "bench"}
                or info.name in FOR_ROS
            )
            if not info.name.endswith("__main__"):
                yield info.name, bool(ros)


def unfit(name):
    """Return what a module does not keep of what it says of itself."""
    try:
        module = importlib.import_module(name)
    except Exception as err:
        return [f"{name} cannot be imported: {err!r}"]
    silent = [] if module.__doc__ else [f"{name} says nothing about itself"]
    exported = getattr(module, "__all__", ())
    return silent + [
        f"{name}.{each} is not there" for each in exported if not hasattr(module, each)
    ]


@pytest.mark.parametrize("ros", [False, True], ids=["without ROS", "on ROS"])
def test_each_module_imports_and_exports_what_it_says(ros):
    if ros:
        pytest.importorskip("rclpy", reason="ROS 2 is not installed")
    names = [name for name, needs in modules() if needs is ros]
    if importlib.util.find_spec("jax") is None:
        # For one benchmark only.
        names = [name for name in names if name != "bench.performance.jax_plant"]
    assert len(names) > 200
    assert [fault for name in names for fault in unfit(name)] == []


def test_the_check_sees_what_a_module_does_not_keep(monkeypatch):
    mute = types.ModuleType("mute")
    mute.__all__ = ["there", "absent"]
    mute.there = 1
    monkeypatch.setitem(sys.modules, "mute", mute)
    assert unfit("mute") == ["mute says nothing about itself", "mute.absent is not there"]
    (fault,) = unfit("no_such_module")
    assert fault.startswith("no_such_module cannot be imported: ModuleNotFoundError")
    assert unfit("cspm") == []


def test_the_command_line_and_a_run_in_process_bring_no_ros_in():
    code = (
        "import sys, cspm.commands.run_command, cspm.cli.main, cspm_run.recorded_run;"
        f"sys.exit(sorted(set(sys.modules) & {ROS!r}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == "[]"


def test_a_node_starts_without_any_part_of_scipy():
    """They take a third of a node's start, and are loaded where something needs one of them."""
    pytest.importorskip("rclpy", reason="ROS 2 is not installed")
    code = (
        "import sys, cspm_ros.runtime.node_run;"
        "sys.exit([name for name in sys.modules if name in"
        " ('scipy.optimize', 'scipy.linalg', 'scipy.sparse', 'scipy.special')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == "[]"
