"""Which recordings are searched, and which only judge."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError


def check_roles(searched: Sequence[Measurement], held_out: Sequence[Measurement]) -> None:
    """Refuse recordings that cannot be searched together, or that judge what was found in them.

    Raises:
        InputError: none is searched, they are not all of one machine, one is searched twice under
            whatever name, or one is both searched and held out.
    """
    if not searched:
        raise InputError("no recording, allowed: one or more")
    seen: dict[str, Path] = {}
    for each in searched:
        if (other := seen.get(each.sha256)) is not None:
            raise InputError(f"{each.path}: the same recording as {other}, allowed: each once")
        seen[each.sha256] = each.path
    for each in (*searched[1:], *held_out):
        if each.machine != searched[0].machine:
            raise InputError(
                f"{each.path}: another test-bed than {searched[0].path}, allowed: recordings of"
                " one machine, or --testbed FILE for all"
            )
    for each in held_out:
        if each.sha256 in seen:
            raise InputError(
                f"--held-out {each.path}: is already used for the search, allowed: another"
                " recording"
            )
