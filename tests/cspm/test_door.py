"""The front door: few names, quick to open, each documented with an example that runs."""

import doctest
import importlib
import subprocess
import sys

import pytest

import cspm

MODULES = (
    *(
        "testbed",
        "scenario",
        "signals",
        "controller",
        "simulation",
        "many",
        "recorded",
        "catalogue",
    ),
    *("parameters", "diagnosis", "comparison", "identification.winches", "importing"),
    *("analysis.linear", "analysis.manipulability", "analysis.sag", "analysis.reference"),
)


def test_few_names_and_each_explained():
    assert 10 < len(cspm.__all__) <= 31
    assert sorted(cspm.__all__) == dir(cspm)
    for name in cspm.__all__:
        assert getattr(cspm, name).__doc__, name
    assert cspm.InputError.exit_code == 2


def test_another_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'cspm' has no attribute 'walk'"):
        cspm.walk  # noqa: B018


def test_importing_it_loads_neither_numpy_nor_ros():
    code = (
        "import sys, cspm; assert cspm.__all__;"
        "sys.exit(sorted({m.partition('.')[0] for m in sys.modules}"
        " & {'numpy', 'numba', 'scipy', 'pydantic', 'matplotlib', 'rclpy', 'mcap'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == "[]"


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_docstrings_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(f"cspm.{name}")
    found = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert found.failed == 0
    assert found.attempted > 0
