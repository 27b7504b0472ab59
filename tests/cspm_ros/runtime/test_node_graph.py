"""The picture of nodes and topics says what the nodes do."""

from pathlib import Path

from cspm_msgs_py.graph import RECORDER
from cspm_ros.runtime.node_graph import arrows, draw, thesis_graph

PICTURE = Path(__file__).resolve().parents[3] / "docs" / "figures" / "node_graph.svg"


def test_the_picture_in_the_docs_names_every_node_and_topic():
    text = PICTURE.read_text(encoding="utf-8")
    for (sender, reader), topics in arrows(thesis_graph()).items():
        for name in (sender, reader, *topics):
            assert f">{name}<" in text or f"{name}</" in text, name


def test_the_cascade_closes_over_the_plant():
    found = arrows(thesis_graph())
    assert found["force_controller", "plant"] == ["/winches/torque_command"]
    assert found["wave_trajectory", "motion_controller"] == ["/bar/reference"]
    assert found["motion_controller", "tension_distribution"] == ["/wrench_command"]
    assert set(found["plant", "force_controller"]) == {"/cables/tension", "/winches/state"}
    assert not any(RECORDER in pair for pair in found)
    assert ("plant", "plant") not in found


def test_nobody_but_the_recorder_reads_the_truth():
    readers = {
        topic: set(edge.readers) for topic, edge in thesis_graph().items() if "/truth/" in topic
    }
    assert len(readers) == 7
    assert set().union(*readers.values()) == {RECORDER}


def test_it_is_drawn(tmp_path):
    draw(tmp_path / "graph.png")
    assert (tmp_path / "graph.png").read_bytes().startswith(b"\x89PNG")
