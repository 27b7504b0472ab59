"""Types that ROS 2 Jazzy has not: read by definitions in the bag, or what is missing is named."""

import pytest
from mcap.writer import Writer

from cspm_msgs_py.bag import open_bag

TYPE = "lab_msgs/msg/WinchLog"
# A header with an empty frame, and a float64.
PAYLOAD = b"\x00\x01\x00\x00" + bytes(8) + b"\x01\x00\x00\x00" + bytes(12)
RULE = "\n" + "=" * 80 + "\nMSG: "


def written(path, text, type_name=TYPE):
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        schema = writer.register_schema(type_name, "ros2msg" if text else "", text.encode())
        channel = writer.register_channel("/log", "cdr", schema)
        writer.add_message(channel, 5, PAYLOAD, 5)
        writer.finish()
    return path


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("lab_msgs/Inner inner\n", "lab_msgs/msg/Inner"),
        (
            "lab_msgs/Inner[] inner\nlab_msgs/Cell[2] cells\n",
            "lab_msgs/msg/Cell, lab_msgs/msg/Inner",
        ),
        (f"lab_msgs/Inner inner{RULE}lab_msgs/Inner\nlab_msgs/Deep deep\n", "lab_msgs/msg/Deep"),
    ],
)
def test_missing_definitions_are_named(tmp_path, text, missing):
    with open_bag(written(tmp_path / "a.mcap", text), own_types=True) as bag:
        assert bag.unplayable == {
            "/log": f"schema of {TYPE} lacks the definition of {missing}, allowed: those of all"
            " types in it"
        }


@pytest.mark.parametrize("inner", ["", f"{RULE}lab_msgs/Inner\nfloat64 x\n"])
def test_what_is_defined_in_the_bag_or_known_is_read(tmp_path, inner):
    text = f"std_msgs/Header header\n{'lab_msgs/Inner inner' if inner else 'float64 x'}\n{inner}"
    with open_bag(written(tmp_path / "a.mcap", text), own_types=True) as bag:
        (message,) = bag.messages()
        found = bag.message("/log", message.payload)
    assert found.header.stamp.sec == 0
    assert (found.inner.x if inner else found.x) == 0.0


def test_a_type_without_any_definition_is_named(tmp_path):
    with open_bag(written(tmp_path / "a.mcap", ""), own_types=True) as bag:
        assert bag.unplayable["/log"] == (
            f"{TYPE} is unknown and recorded without its definition, allowed: recorded where its"
            " package is built and sourced"
        )


def test_a_known_type_keeps_its_own_reason(tmp_path):
    known = "sensor_msgs/msg/Imu"
    with open_bag(written(tmp_path / "a.mcap", "", known), own_types=True) as bag:
        assert bag.unplayable["/log"] == f"{known} is recorded without its definition"
