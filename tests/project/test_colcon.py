"""The package as ROS 2 sees it: manifest, colcon's installation, programs and launch file."""

import ast
import dataclasses
import importlib.util
import os
import re
import shlex
import subprocess
import sys
from configparser import ConfigParser
from importlib.metadata import distribution
from pathlib import Path

import error_lines
import pytest

from cspm.cli import node_program
from cspm_ros.runtime import node_main

ROOT = Path(__file__).resolve().parents[2]
VERSION = re.compile(r'^version = "(.+)"$', re.MULTILINE)
LAUNCH = ROOT / "launch" / "scenario.launch.py"
NODES = {
    "plant",
    "wave_trajectory",
    "motion_controller",
    "tension_distribution",
    "force_controller",
    "target_tracker",
    "recorder",
    "player",
    "viewer",
}
ROOMS = (
    "cspm",
    "cspm_msgs_py",
    "cspm_model",
    "cspm_checks",
    "cspm_sim",
    "cspm_control",
    "cspm_run",
    "cspm_ident",
    "cspm_ros",
    "launch",
)


def active():
    """The environment variables of a shell in which this Python's environment is active."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return os.environ | {"PATH": path}


def build(source, base, *options):
    """Run `colcon build` and return the folder that it installed the package in."""
    pytest.importorskip("colcon_ros", reason="colcon is not installed")
    command = [sys.executable, "-m", "colcon", "--log-base", base / "log", "build"]
    command += ["--build-base", base / "build", "--install-base", base / "install", *options]
    done = subprocess.run(
        command, cwd=source, env=active(), capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "doesn't explicitly install" not in done.stdout + done.stderr
    return base / "install" / "cspm"


@pytest.fixture(scope="module", params=[(), ("--symlink-install",)], ids=["copies", "links"])
def installed(request, source, tmp_path_factory):
    """What `colcon build` installed, and the variables of a shell that sourced it."""
    prefix = build(source, tmp_path_factory.mktemp("base"), *request.param)
    done = subprocess.run(
        ["bash", "-c", 'source "$0" && env -0', prefix.parent / "setup.bash"],
        env=active(),
        capture_output=True,
        text=True,
        check=True,
    )
    environment = dict(line.split("=", 1) for line in done.stdout.split("\0") if line)
    return prefix, environment


def said(command, environment, folder):
    done = subprocess.run(
        command, env=environment, cwd=folder, capture_output=True, text=True, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.mark.slow
def test_colcon_installs_what_ros_looks_for(installed):
    prefix, _ = installed
    executables = {path.name for path in (prefix / "lib" / "cspm").iterdir()}
    assert executables == NODES | {"cspm"}
    assert all(os.access(prefix / "lib" / "cspm" / name, os.X_OK) for name in executables)
    share = prefix / "share"
    assert (share / "ament_index" / "resource_index" / "packages" / "cspm").read_text() == ""
    for name in ("package.xml", "launch/scenario.launch.py"):
        assert (share / "cspm" / name).read_text() == (ROOT / name).read_text()
    for path in [*(ROOT / "launch" / "views").iterdir(), *(ROOT / "launch/security").iterdir()]:
        assert (share / "cspm" / path.relative_to(ROOT / "launch")).read_text() == path.read_text()
    for path in (ROOT / "scenarios").rglob("*.yaml"):
        copy = share / "cspm" / "scenarios" / path.relative_to(ROOT / "scenarios")
        assert copy.read_text() == path.read_text()
    assert not list(prefix.parent.rglob("*__pycache__/kernels-*"))


@pytest.mark.slow
def test_the_ament_index_of_a_sourced_shell_knows_the_package(installed, tmp_path):
    pytest.importorskip("ament_index_python", reason="ROS 2 is not installed")
    prefix, environment = installed
    code = "import ament_index_python as a; print(a.get_package_prefix('cspm'))"
    assert said([sys.executable, "-c", code], environment, tmp_path).strip() == str(prefix)


@pytest.mark.slow
def test_what_colcon_installed_runs_and_finds_its_scenarios(installed, tmp_path):
    prefix, environment = installed
    help_text = said([prefix / "lib" / "cspm" / "cspm", "run", "--help"], environment, tmp_path)
    assert "worst_case" in help_text
    code = (
        "import cspm_run.library as found\n"
        "print(found.__file__, found.find_scenario('worst_case'), sep='\\n')"
    )
    module, scenario = said([sys.executable, "-c", code], environment, tmp_path).splitlines()
    # With links the modules are those of the copied sources.
    assert Path(module).is_relative_to(prefix.parents[1])
    assert not Path(module).is_relative_to(ROOT)
    if Path(module).is_relative_to(prefix):
        assert Path(scenario) == prefix / "share" / "cspm" / "scenarios" / "worst_case.yaml"
    assert Path(scenario).read_text() == (ROOT / "scenarios" / "worst_case.yaml").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(NODES - {"player"}))
def test_a_node_of_the_installation_reads_its_parameters(installed, tmp_path, name):
    """Started as `ros2 run` and `ros2 launch` do: by its path, with ROS arguments."""
    pytest.importorskip("rclpy", reason="ROS 2 is not installed")
    prefix, environment = installed
    reported = tmp_path / "reported.yaml"
    reported.write_text("/**: {ros__parameters: {scenario: nowhere, pace: lockstep, plant: sim}}\n")
    done = subprocess.run(
        [prefix / "lib" / "cspm" / name, "--ros-args", "--params-file", reported],
        env=environment | {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": "84"},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 2, done.stderr
    assert error_lines.said(done.stderr).startswith("nowhere: no such scenario, allowed: calm, ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("name", sorted(NODES))
def test_what_ros2_run_starts_is_a_program_that_starts_this_node(name):
    """`colcon build` and pip copy these files to `lib/cspm`, which is not on the PATH."""
    path = ROOT / "launch" / "nodes" / name
    assert os.access(path, os.X_OK)
    text = path.read_text(encoding="utf-8")
    assert text.startswith("#!/usr/bin/env python3\n")
    imported, called = ast.parse(text).body[1:]
    # What a recorder leaves beside a recording is none of the nodes' business.
    module = node_program if name == "recorder" else node_main
    assert ast.unparse(imported) == f"from {module.__name__} import {name}"
    assert ast.unparse(called) == f"{name}()"
    assert callable(getattr(module, name))


def test_every_node_has_such_a_program():
    assert {path.name for path in (ROOT / "launch" / "nodes").iterdir()} == NODES


def test_colcon_and_pip_read_the_same_name():
    parsed = ConfigParser()
    parsed.read(ROOT / "setup.cfg", encoding="utf-8")
    assert parsed["metadata"]["name"] == distribution("cspm").metadata["Name"]


def test_the_manifest_is_valid_and_names_every_ros_package_that_is_imported():
    manifest = pytest.importorskip("catkin_pkg.package", reason="colcon is not installed")
    package = manifest.parse_package(str(ROOT / "package.xml"))
    warnings = []
    package.validate(warnings=warnings)
    assert warnings == []
    version = VERSION.search((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[1]
    assert (package.name, package.version) == ("cspm", version)
    assert package.get_build_type() == "ament_python"
    depends = {depend.name for depend in package.exec_depends}
    assert depends >= {"rclpy", "launch_ros", "rosgraph_msgs", "std_srvs", "trajectory_msgs"}
    ros = {"rclpy", "launch", "launch_ros", "ament_index_python", "rosidl_runtime_py"}
    imported = {name for room in ROOMS for name in imports(ROOT / room)}
    wanted = {n for n in imported if n in ros or n.endswith(("_msgs", "_srvs", "_interfaces"))}
    assert wanted <= depends


def imports(folder):
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                yield from (alias.name.split(".")[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                yield (node.module or "").split(".")[0]


def test_the_launch_file_names_nodes_that_are_installed():
    """Without ROS 2's `launch`, which is on no package index, this is all that can be said."""
    tree = ast.parse(LAUNCH.read_text(encoding="utf-8"))
    texts = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    assert texts >= NODES - {"player"}
    assert texts >= {"cspm", "scenario", "pace", "plant", "record", "external", "worst_case"}
    functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert "generate_launch_description" in functions
    compile(tree, LAUNCH, "exec")


def test_the_launch_files_parameters_are_those_that_nodes_declare():
    parameters = pytest.importorskip(
        "cspm_ros.runtime.node_parameters", reason="ROS 2 is not there"
    )
    declared = {field.name for field in dataclasses.fields(parameters.NodeParameters)}
    tree = ast.parse(LAUNCH.read_text(encoding="utf-8"))
    (start,) = (n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == "nodes")
    keys = {
        key.value for node in ast.walk(start) if isinstance(node, ast.Dict) for key in node.keys
    } | {
        node.slice.value
        for node in ast.walk(start)
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant)
    }
    assert keys == {"scenario", "pace", "folder", "plant", "patience", "overrides"}
    assert keys <= declared


@pytest.mark.parametrize(
    ("duration", "overrides", "expected"),
    [
        ("", "", []),
        ("10", "", ["duration=10"]),
        ("", "seed=2 'a.b=[1, 2]'", ["seed=2", "a.b=[1, 2]"]),
        ("0.5", "seed=2", ["seed=2", "duration=0.5"]),
    ],
)
def test_the_launch_files_overrides_are_those_of_the_nodes(duration, overrides, expected):
    tree = ast.parse(LAUNCH.read_text(encoding="utf-8"))
    (found,) = (n for n in tree.body if getattr(n, "name", "") == "overrides_of")
    names = {"shlex": shlex}
    exec(compile(ast.Module([found], []), LAUNCH, "exec"), names)
    assert names["overrides_of"](duration, overrides) == expected


@pytest.mark.parametrize(
    ("plant", "target", "left_out"),
    [
        ("sim", "prescribed", {"target_tracker"}),
        ("mujoco", "measured", set()),
        ("external", "external", {"plant"}),
    ],
)
def test_the_launch_file_starts_the_nodes_that_its_arguments_ask_for(plant, target, left_out):
    """Runs on a native ROS 2 only: neither `launch` nor `ros2 run` is on the package index."""
    launch = pytest.importorskip("launch.actions", reason="`launch` comes with a native ROS 2 only")
    launch_ros = pytest.importorskip("launch_ros.actions")
    context = sys.modules["launch"].LaunchContext()
    spec = importlib.util.spec_from_file_location("scenario_launch", LAUNCH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    arguments = [
        entity
        for entity in module.generate_launch_description().entities
        if isinstance(entity, launch.DeclareLaunchArgument)
    ]
    wanted = {
        "scenario": "calm",
        "pace": "lockstep",
        "plant": plant,
        "target": target,
        "record": "/tmp/bag",
        "patience": "60",
        "duration": "10",
        "overrides": "seed=2",
    }
    assert [argument.name for argument in arguments] == list(wanted)
    context.launch_configurations.update(wanted)
    started = module.nodes(context)
    assert all(isinstance(node, launch_ros.Node) for node in started)
    assert {node.node_executable for node in started} == NODES - left_out - {"player"}
