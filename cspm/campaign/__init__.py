"""Campaigns: many runs of one description, spread over processors and machines.

    from cspm.campaign import run_campaign

    done = run_campaign("robustness.yaml", "robustness")
    done.rows[0]["errors.surge.max"]

The engine, dask.distributed, comes with the extra `campaign`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cspm_msgs_py.installed.extra_library import refuse_absent

if TYPE_CHECKING:
    from cspm.campaign.campaign import Campaign as Campaign
    from cspm.campaign.campaign import run_campaign as run_campaign

__all__ = ["Campaign", "run_campaign"]
# With its dashboard, certificates of a cluster, and the table.
_ENGINE = ("distributed", "bokeh", "cryptography", "pyarrow")


def require_engine() -> None:
    """Refuse a campaign where a library that it needs is absent.

    Raises:
        InputError: one is not installed, with the line that installs it.
    """
    refuse_absent(_ENGINE, "campaign", "campaign")


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever the door leads to
    if name not in __all__:
        raise AttributeError(f"module 'cspm.campaign' has no attribute {name!r}")
    require_engine()
    # Only now is the engine loaded.
    from cspm.campaign import campaign

    return getattr(campaign, name)
