"""Runs with a process per node, and code that these processes run first."""

import os

from ros_graph import load_ros, new_domain

load_ros()

from cspm_ros.runtime.process_run import run_processes  # noqa: E402


def processes(bundle, folder, *arguments, **options):
    """Run in the domain of nobody else, and wait no longer than a test may."""
    return run_processes(
        bundle, folder, *arguments, **{"domain_id": new_domain(), "patience_s": 20.0} | options
    )


def use_site(folder, monkeypatch, code):
    """Have each Python that a test starts run some code first."""
    (folder / "sitecustomize.py").write_text(code)
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    monkeypatch.setenv("PYTHONPATH", path)
