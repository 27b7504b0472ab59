"""Recipes of environments: read as their programs read them, and in step with the package."""

import json
import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
from packaging.requirements import Requirement

from cspm_msgs_py.yaml_file import read_yaml

ROOT = Path(__file__).resolve().parents[2]
RECIPES = ROOT / "recipes"
# What `common_interfaces` and `rclpy` of ROS bring.
BROUGHT = {
    *(f"{kind}_msgs" for kind in ("diagnostic", "geometry", "sensor", "std", "trajectory")),
    *("std_srvs", "builtin_interfaces", "rcl_interfaces", "rosgraph_msgs", "launch"),
}


@pytest.fixture(scope="module")
def project():
    tomllib = pytest.importorskip("tomllib", reason="Python 3.10 reads no TOML")
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_conda_takes_versions_that_the_package_takes(project):
    described = read_yaml(RECIPES / "environment.yml")
    assert described["channels"] == ["conda-forge"]
    *plain, by_pip = described["dependencies"]
    (install,) = by_pip["pip"]
    extra = re.fullmatch(r"-e \.\.\[(\w+)\]", install)[1]
    assert extra in project["optional-dependencies"]
    least = {r.name: str(r.specifier) for r in map(Requirement, project["dependencies"])}
    least |= {"python": project["requires-python"], "matplotlib-base": least["matplotlib"]}
    found = dict(each.split(" ") for each in plain if " " in each)
    assert len(found) >= 6
    assert {name: least[name] for name in found} == found


def test_pixi_has_all_that_the_ros_package_needs(project):
    import tomllib

    described = tomllib.loads((RECIPES / "pixi.toml").read_text(encoding="utf-8"))
    assert "https://prefix.dev/robostack-jazzy" in described["workspace"]["channels"]
    found = {
        name.removeprefix("ros-jazzy-").replace("-", "_") for name in described["dependencies"]
    }
    needed = {
        each.text
        for each in ElementTree.parse(ROOT / "package.xml").getroot().findall("exec_depend")
        if not each.text.startswith("python3-")
    }
    assert needed - BROUGHT <= found
    assert {"rclpy", "common_interfaces"} <= found
    own = described["pypi-dependencies"]["cspm"]
    assert (RECIPES / own["path"]).resolve() == ROOT
    assert set(own["extras"]) <= set(project["optional-dependencies"])


def test_the_container_is_built_of_files_that_are_there():
    text = (RECIPES / "Dockerfile").read_text(encoding="utf-8")
    assert "FROM ros:jazzy\n" in text
    copied = [line.split()[1] for line in text.splitlines() if line.startswith("COPY")]
    assert copied == [".", "recipes/entrypoint.sh"]
    assert all((ROOT / each).exists() for each in copied)
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert not {"recipes", "scenarios", "package.xml", "setup.cfg"} & set(ignored)
    subprocess.run(["bash", "-n", RECIPES / "entrypoint.sh"], check=True)


def test_the_development_container_builds_the_same_image():
    place = ROOT / ".devcontainer"
    described = json.loads((place / "devcontainer.json").read_text(encoding="utf-8"))
    assert (place / described["build"]["dockerfile"]).resolve() == RECIPES / "Dockerfile"
    assert (place / described["build"]["context"]).resolve() == ROOT
    assert described["workspaceFolder"] in described["workspaceMount"]
