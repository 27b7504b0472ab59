"""The measurement of imports, on small files."""

import pytest

from bench.performance import import_cost
from cspm_msgs_py.recording import Recording


@pytest.mark.slow
@pytest.mark.compiled
def test_a_table_and_a_bag_are_written_imported_and_watched(tmp_path, monkeypatch):
    monkeypatch.setattr(import_cost, "SECONDS", 2)
    import_cost.write_table(tmp_path)
    cost = import_cost.imported(tmp_path, "lab.csv", "table")
    assert cost.seconds > 0.0
    assert 20.0 < cost.own < cost.resident < 2000.0
    with Recording(tmp_path / "table") as found:
        counts = {name: info.count for name, info in found.topics.items()}
    assert counts == dict.fromkeys(("/winches/state", "/cables/tension", "/bar/pose"), 2000)
    import_cost.write_bag(tmp_path, 0.001)
    import_cost.imported(tmp_path, "bag", "copy")
    with Recording(tmp_path / "copy") as found:
        assert found.topics["/winches/state"].count > 1000
