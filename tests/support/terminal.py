"""A program in a terminal of its own, by which a test reads its screen and presses its keys."""

import os
import re
import select
import subprocess
import sys
import time

PATIENCE_S = 60.0
# Makes standard input the controlling terminal, which only the process itself can do.
LAUNCH = (
    "import fcntl, os, sys, termios;"
    "fcntl.ioctl(0, termios.TIOCSCTTY, 0);"
    "os.execv(sys.argv[1], sys.argv[1:])"
)


class Terminal:
    """Runs a program; `text` is what it wrote since the last key."""

    def __init__(self, *command):
        self._file, inner = os.openpty()
        ends = dict.fromkeys(("stdin", "stdout", "stderr"), inner)
        words = [sys.executable, "-c", LAUNCH, *map(str, command)]
        self._process = subprocess.Popen(words, start_new_session=True, **ends)
        os.close(inner)
        self.text = ""

    def wait_for(self, pattern):
        """Wait until the program wrote something."""
        deadline = time.monotonic() + PATIENCE_S
        while not re.search(pattern, self.text):
            assert time.monotonic() < deadline, self.text
            assert self._read() or self._process.poll() is None, self.text

    def press(self, keys):
        """Press keys, and forget what was written before."""
        self.text = ""
        os.write(self._file, keys)

    def signal(self, number):
        """Send a signal to the program."""
        self._process.send_signal(number)

    def end(self):
        """Wait for the end; return the exit code."""
        deadline = time.monotonic() + PATIENCE_S
        while self._read() and time.monotonic() < deadline:
            continue
        return self._process.wait(max(0.1, deadline - time.monotonic()))

    def _read(self):
        """Take in what was written; return whether there may be more."""
        if select.select([self._file], [], [], 0.1)[0]:
            try:
                self.text += os.read(self._file, 65536).decode(errors="replace")
            except OSError:
                return False
        return True

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        os.close(self._file)
