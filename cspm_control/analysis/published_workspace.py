"""Tables 6-1 and 6-2 of the thesis beside ours."""

from __future__ import annotations

from cspm_control.analysis.claim import Claim, rounded
from cspm_control.analysis.workspace_limits import LIMITED
from cspm_control.analysis.workspace_result import ROTATION, WorkspaceResult

OURS = "ours"
# The table's 0.2 for the general solution's surge is 0.25 in the thesis's conclusions.
TABLE_6_1 = {
    "pseudo_inverse": ("0.075", "0.2", "1.1", "0.5"),
    "general": ("0.25", "0.275", "1.24", "0.74"),
}
# What is left of the one for translation is the digit 9.
LARGEST_ROTATION_CONDITION = "68.8670"


def workspace_claims(found: WorkspaceResult) -> list[Claim]:
    """Return the figures of tables 6-1 and 6-2; a limit holds where it is the same grid value."""
    claims = []
    for algorithm, row in TABLE_6_1.items():
        for dof, published in zip(LIMITED, row, strict=True):
            value = found.limits[algorithm][dof]
            ours = {OURS: float("nan") if value is None else value}
            ends = float(published), float(published)
            claims.append(Claim(f"{algorithm}, {dof}", published, *ends, ours))
    condition = {OURS: found.largest_condition[ROTATION]}
    ends = rounded(LARGEST_ROTATION_CONDITION)
    return [*claims, Claim("max κ, rotation", LARGEST_ROTATION_CONDITION, *ends, condition)]
