"""Say which of some modules each step loads that none before it did.

`python loaded_child.py WATCHED ... < STEPS`: a step is a module's name, or the words of a command,
as JSON. What each step has loaded in addition goes to standard output, as JSON too.
"""

import contextlib
import importlib
import json
import sys

import cspm.cli.main as cli


def take(step):
    """Import a module, or run a command, whose exit code has to be 0."""
    if isinstance(step, str):
        importlib.import_module(step)
        return
    sys.argv = ["cspm", *step]
    try:
        with contextlib.redirect_stdout(sys.stderr):
            cli.main()
    except SystemExit as end:
        if end.code:
            raise


if __name__ == "__main__":
    watched, answer = set(sys.argv[1:]), []
    for each in json.load(sys.stdin):
        before = watched & set(sys.modules)
        take(each)
        answer.append(sorted(watched & set(sys.modules) - before))
    json.dump(answer, sys.stdout)
