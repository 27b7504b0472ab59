"""The campaign in `examples/` runs as it stands."""

from pathlib import Path

import campaigns
import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.compiled
@pytest.mark.slow
def test_the_campaign_of_the_examples(tmp_path):
    file = ROOT / "examples/campaigns/robustness.yaml"
    code, out, err = campaigns.run(file, cwd=tmp_path)
    assert (code, err) == (0, ""), out
    rows = campaigns.rows(tmp_path / "campaigns/robustness")
    assert len(rows) == 24
    assert all(0.0 < row["largest_after"] <= row["errors.surge.max"] * 1.5 for row in rows)
    assert len([*(tmp_path / "campaigns/robustness/recordings").iterdir()]) == 1
