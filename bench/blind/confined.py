"""A process that diagnoses the recording it is given and may open nothing but that and code.

    python -m bench.blind.confined RECORDING METHOD...

The recording lies in the present folder, where the results go. Files elsewhere are refused by an
audit hook, which guards against mistakes of ours, not against hostile code.
"""

from __future__ import annotations

import json
import os
import site
import stat
import sys
import sysconfig
import threading
import traceback
from pathlib import Path

_SYSTEM = ("/usr", "/lib", "/lib64", "/etc", "/proc", "/sys", "/dev")


def readable(room: Path) -> tuple[str, ...]:
    """Return the folders that may be read: the room, the code and what it imports."""
    code = Path(__file__).resolve().parents[2]
    found = (*code.glob("cspm*"), code / "bench")
    packages = [f for f in found if f.suffix == ".egg-info" or _is_package(f)]
    own = [str(folder) for folder in (*packages, code / "scenarios")]
    python: list[str] = [
        sys.prefix,
        sys.base_prefix,
        *sysconfig.get_paths().values(),
        *site.getsitepackages(),
    ]
    return tuple(os.path.realpath(path) for path in (str(room), *own, *python, *_SYSTEM) if path)


def _is_package(folder: Path) -> bool:
    return (folder / "__init__.py").exists()


def confine(room: Path) -> None:
    """Refuse, from now on and for good, to open files that are not readable from this room."""
    allowed = readable(room)

    def guard(event: str, arguments: tuple[object, ...]) -> None:
        if event != "open":
            return
        opened = arguments[0]
        # A descriptor was opened by its path before.
        if not isinstance(opened, str | bytes):
            return
        path = os.path.realpath(os.fsdecode(opened))
        if not any(path == root or path.startswith(root + os.sep) for root in allowed):
            raise PermissionError(f"{path}: outside what a blind diagnosis may read")

    sys.addaudithook(guard)


def end_with_parent() -> None:
    """End this process, from now on, when the other end of the pipe at its input is closed."""
    if stat.S_ISFIFO(os.fstat(0).st_mode):
        threading.Thread(target=_end_at_last_byte, daemon=True).start()


def _end_at_last_byte() -> None:
    while os.read(0, 1):
        pass
    os._exit(1)


def main() -> None:
    """Diagnose the recording named first by the methods named after it.

    Of each, its diagnosis and its processor time [s], or why there are none.
    """
    recording, *methods = sys.argv[1:]
    end_with_parent()
    confine(Path.cwd())
    from bench.blind.scoring.method import Methods

    bench = Methods([Path(recording)])
    for name in methods:
        try:
            reported, seconds = bench.diagnosis_by(name)
        except Exception:
            # Other methods go on.
            Path(f"{name}.txt").write_text(traceback.format_exc(), encoding="utf-8")
            continue
        content = json.dumps({"diagnosis": reported, "cpu_s": seconds})
        Path(f"{name}.json").write_text(content, encoding="utf-8")


if __name__ == "__main__":
    main()
