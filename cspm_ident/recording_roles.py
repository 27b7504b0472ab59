"""Which recordings are fitted, and which only judge."""

from __future__ import annotations

from collections.abc import Sequence

from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError


def check_roles(searched: Sequence[Measurement], held_out: Sequence[Measurement]) -> None:
    """Refuse recordings that cannot be fitted together, or that judge what was fitted to them.

    Raises:
        InputError: none is searched, they are not all of one machine, or one is both searched and
            held out.
    """
    if not searched:
        raise InputError("identify: no recording, allowed: one or more")
    for each in (*searched[1:], *held_out):
        if each.machine != searched[0].machine:
            raise InputError(
                f"{each.path}: another test-bed than {searched[0].path}, allowed: recordings of"
                " one machine, or --testbed FILE for all"
            )
    for each in held_out:
        if each.sha256 in {other.sha256 for other in searched}:
            raise InputError(
                f"--held-out {each.path}: is fitted to as well, allowed: a recording that is not"
            )
