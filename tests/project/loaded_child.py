"""Say which of some modules each step loads that none before it did.

`python loaded_child.py WATCHED ... < STEPS`: a step is a module's name, or the words of a command,
under `refused` where it has to refuse them, as JSON. What each step has loaded in addition goes to
standard output, as JSON too.
"""

import contextlib
import importlib
import json
import sys

import cspm.cli.main as cli


def take(step):
    """Import a module, or run a command, whose exit code has to be 0, or 2 where it refuses."""
    if isinstance(step, str):
        importlib.import_module(step)
        return
    refused = isinstance(step, dict)
    sys.argv = ["cspm", *(step["refused"] if refused else step)]
    try:
        with contextlib.redirect_stdout(sys.stderr):
            cli.main()
    except SystemExit as end:
        if (end.code or 0) != (2 if refused else 0):
            raise


if __name__ == "__main__":
    watched, answer = set(sys.argv[1:]), []
    for each in json.load(sys.stdin):
        before = watched & set(sys.modules)
        take(each)
        answer.append(sorted(watched & set(sys.modules) - before))
    json.dump(answer, sys.stdout)
