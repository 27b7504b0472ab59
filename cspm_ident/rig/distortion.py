"""What measuring does to a stiffness, found by measuring a law's own, and taken out."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace

import numpy as np

from cspm_ident.rig.branches import Branch, mean_branches
from cspm_ident.rig.flanks import UP, Ramps, find_ramps
from cspm_ident.rig.law import Law
from cspm_ident.rig.winding import Winding


def centred(ramps: Ramps, half_width: float) -> Ramps:
    """Return ramps with both directions moved into the middle of their loop.

    Args:
        ramps: as measured.
        half_width: of the loop, stretching above releasing [N].
    """
    flanks = tuple(
        flank._replace(tension=flank.tension + (-half_width if flank.branch == UP else half_width))
        for flank in ramps.flanks
    )
    return replace(ramps, flanks=flanks)


def modelled(ramps: Ramps, law: Law, half_width: float, cutoff: float) -> Ramps:
    """Return the ramps of a cable that obeys the law, wound, filtered and centred like `ramps`.

    Its loop is as wide and turns with the speed, as a damper's does.

    Args:
        ramps: centred.
        law: of the cable.
        half_width: of the loop [N].
        cutoff: of the filter [Hz].
    """
    specimen, speed = ramps.specimen, float(np.mean([flank.speed for flank in ramps.flanks]))
    tension = Winding(ramps, law).tension(specimen.wound) + half_width * specimen.rate / speed
    seen = find_ramps(replace(specimen, tension=tension), cutoff)
    return replace(centred(seen, half_width), lowest=ramps.lowest)


def undistorted(
    ramps: Ramps, seen: Ramps | None, law: Law | None, cycles: Container[int] | None = None
) -> list[Branch]:
    """Return the mean branches of `ramps` less what the filter makes of the law in them.

    The filter rounds the law where it bends and at the ramps' ends; of a cable that obeys the law
    the amount is known, since what is there without a filter is known.

    Args:
        ramps: centred.
        seen: the same of a cable that obeys the law; None takes nothing out.
        law: of both.
        cycles: by number; all where none is named.
    """
    measured = mean_branches(ramps, law, cycles)
    if seen is None or law is None:
        return measured
    found = []
    for one, model in zip(measured, mean_branches(seen, law, cycles), strict=True):
        excess = model.stiffness - law.stiffness(model.tension, model.length)
        found.append(one._replace(stiffness=one.stiffness - excess))
    return found
