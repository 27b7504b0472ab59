"""Libraries of extras: what is absent is one line that ends with what installs it."""

import sys

import pytest

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library, refuse_absent


def test_a_library_that_is_there_is_returned():
    assert extra_library("json.decoder", "files", "x") is sys.modules["json.decoder"]
    refuse_absent(("json", "sys"), "files", "x")


def test_one_that_is_absent_is_named_with_the_extra_that_brings_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "json", None)
    line = r"^a\.x: json is not installed, allowed: after `pip install 'cspm\[files\]'`, or b$"
    with pytest.raises(InputError, match=line):
        extra_library("json", "files", "a.x", ", or b")
    with pytest.raises(InputError, match=r"^a\.x: json is not .* 'cspm\[files\]'`$"):
        refuse_absent(("sys", "json"), "files", "a.x")


def test_one_that_is_there_and_does_not_load_is_not_called_absent(tmp_path, monkeypatch):
    (tmp_path / "half_a_library.py").write_text("raise ImportError('libhalf.so: not found')")
    monkeypatch.syspath_prepend(tmp_path)
    line = r"^x: half_a_library cannot be loaded \(libhalf\.so: not found\), allowed: after `pip"
    with pytest.raises(InputError, match=line):
        extra_library("half_a_library", "files", "x")
