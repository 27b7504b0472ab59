"""What tests of the project as a whole share."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def source(tmp_path_factory):
    """A workspace with a copy of all files that are under version control or will be."""
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    found = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=False)
    if found.returncode:
        pytest.skip("not a git checkout")
    workspace = tmp_path_factory.mktemp("workspace")
    for name in found.stdout.split("\0"):
        if name and (ROOT / name).is_file():
            target = workspace / "src" / "cspm" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)
    return workspace


@pytest.fixture(scope="session")
def loaded():
    """Return what loads a script of the documentation, which is no module of a package."""

    def load(path):
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        sys.modules[path.stem] = module
        spec.loader.exec_module(module)
        return module

    return load
