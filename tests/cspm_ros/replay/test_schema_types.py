"""Messages of packages that are not installed, sent and received by their definitions."""

import numpy as np
import pytest
from bag_samples import NOETIC
from mcap.writer import Writer as McapWriter
from ros_graph import load_ros, new_domain
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

load_ros()

from cspm_msgs_py.bag import open_bag  # noqa: E402
from cspm_msgs_py.errors import InputError  # noqa: E402
from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402
from cspm_msgs_py.ros.qos import contract_qos  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.ros_types import serialize, typestore  # noqa: E402
from cspm_ros.replay.bag_selection import Selection  # noqa: E402
from cspm_ros.replay.player_node import PlayerNode  # noqa: E402
from cspm_ros.schema_types import schema_class as classes  # noqa: E402
from cspm_ros.schema_types.members import Introspection  # noqa: E402
from cspm_ros.schema_types.schema_class import (  # noqa: E402
    installed_hash,
    message_class_of,
    schema_class,
)

PATIENCE_S = 30.0
LOAD = "lab_msgs/msg/Load"
DEFINITION = "std_msgs/Header header\nfloat64[] forces\nlab_msgs/Cell[2] cells\n"
CELL = "string<=8 name\nuint16[<=3] raw\nbool ok\n"
SCHEMA = f"{DEFINITION}{'=' * 80}\nMSG: lab_msgs/Cell\n{CELL}"


def own_store(definition=SCHEMA):
    store = get_typestore(Stores.EMPTY)
    found = get_types_from_msg(definition, LOAD)
    store.register({**typestore().fielddefs, **found})
    return store


def load_message(store, seconds=3):
    kinds = store.types
    stamp = kinds["builtin_interfaces/msg/Time"](seconds, 5)
    header = kinds["std_msgs/msg/Header"](stamp, "cell_ned")
    cells = [
        kinds["lab_msgs/msg/Cell"]("α", np.array([1, 2], np.uint16), True),
        kinds["lab_msgs/msg/Cell"]("b", np.array([], np.uint16), False),
    ]
    return kinds[LOAD](header, np.array([1.5, -2.0, 3.25]), cells)


def write_own(path, store, times, definition=SCHEMA):
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2")
        schema = writer.register_schema(LOAD, "ros2msg", definition.encode())
        channel = writer.register_channel("/loads", "cdr", schema)
        for time in times:
            payload = bytes(store.serialize_cdr(load_message(store, time), LOAD))
            writer.add_message(channel, time * 10**6, payload, time * 10**6)
        writer.finish()
    return path


def write_own_ros1(path, times):
    store = get_typestore(Stores.EMPTY)
    cell = CELL.replace("<=8", "").replace("<=3", "")
    definition = f"{DEFINITION}{'=' * 80}\nMSG: lab_msgs/Cell\n{cell}"
    store.register({**NOETIC.fielddefs, **get_types_from_msg(definition, LOAD)})
    header = NOETIC.types["std_msgs/msg/Header"]
    with Rosbag1Writer(path) as writer:
        sender = writer.add_connection("/loads", LOAD, typestore=store)
        for time in times:
            message = load_message(store_without_number(store), time)
            message.header = header(7, message.header.stamp, message.header.frame_id)
            writer.write(sender, time * 10**6, store.serialize_ros1(message, LOAD))
    return path


def store_without_number(store):
    found = get_typestore(Stores.EMPTY)
    found.register({**store.fielddefs, **typestore().fielddefs})
    return found


def heard_of(path):
    """Play a bag; return what a reader of the type by its definition hears, and the endpoints."""
    heard = []
    with open_bag(path, own_types=True) as bag, Session(domain_id=new_domain()) as session:
        node = PlayerNode(session.node("player"), bag, Selection(), 1.0)
        assert node.unplayable == {}
        reader = session.node("reader").node
        kind = message_class_of(LOAD, bag.store("/loads"))
        reader.create_subscription(kind, "loads", heard.append, contract_qos(100), raw=True)
        count = bag.topics["/loads"].count
        assert session.spin_until(lambda: len(heard) >= count, PATIENCE_S)
        endpoints = reader.get_publishers_info_by_topic("/loads")
        assert session.spin_until(lambda: not node.unacknowledged(), PATIENCE_S)
    return heard, endpoints


def test_a_type_that_only_the_bag_knows_is_played(tmp_path):
    store, times = own_store(), range(1, 21)
    heard, endpoints = heard_of(write_own(tmp_path / "own.mcap", store, times))
    decoded = [store.deserialize_cdr(payload, LOAD) for payload in heard]
    assert [each.header.stamp.sec for each in decoded] == [*times]
    assert decoded[0].cells[0].name == "α"
    assert list(decoded[0].forces) == [1.5, -2.0, 3.25]
    (endpoint,) = endpoints
    assert endpoint.topic_type == LOAD
    assert str(endpoint.topic_type_hash) == store.hash_rihs01(LOAD)


def test_so_is_one_of_ros_1(tmp_path):
    heard, _ = heard_of(write_own_ros1(tmp_path / "own.bag", range(1, 11)))
    with open_bag(tmp_path / "own.bag", own_types=True) as bag:
        decoded = [bag.message("/loads", payload) for payload in heard]
    assert [each.header.stamp.sec for each in decoded] == [*range(1, 11)]
    assert decoded[0].header.frame_id == "cell_ned"
    assert list(decoded[0].cells[0].raw) == [1, 2]


@pytest.mark.parametrize(
    "ros_type",
    [
        "visualization_msgs/msg/MarkerArray",
        "sensor_msgs/msg/Imu",
        "shape_msgs/msg/SolidPrimitive",
        "std_msgs/msg/Empty",
        "diagnostic_msgs/msg/DiagnosticArray",
    ],
)
def test_generated_classes_read_what_is_sent_by_a_definition(ros_type):
    """The generated code is the independent road: it knows nothing of our definition."""
    installed, heard = ros_class(ros_type), []
    with Session(domain_id=new_domain()) as session:
        sender, reader = session.node("sender").node, session.node("reader").node
        reader.create_subscription(installed, "/sent", heard.append, contract_qos(10))
        made = sender.create_publisher(
            schema_class(ros_type, typestore()), "/sent", contract_qos(10)
        )
        assert session.spin_until(lambda: made.get_subscription_count() == 1, PATIENCE_S)
        from rclpy.serialization import serialize_message

        message = installed()
        made.handle.publish_raw(serialize_message(message))
        assert session.spin_until(lambda: bool(heard), PATIENCE_S)
    assert heard == [message]


def test_hashes_are_those_of_generated_code():
    """`std_msgs/msg/Char` is left out: its definition loses that it is no uint8."""
    for ros_type in ("geometry_msgs/msg/PoseStamped", "visualization_msgs/msg/Marker"):
        assert installed_hash(ros_class(ros_type)) == typestore().hash_rihs01(ros_type)


def test_other_fields_than_those_installed_are_refused():
    other = get_typestore(Stores.EMPTY)
    other.register(get_types_from_msg("int32 other", "std_msgs/msg/Bool"))
    other.register(get_types_from_msg("int32 other", "tf2_msgs/msg/TFMessage"))
    with pytest.raises(InputError) as caught:
        message_class_of("std_msgs/msg/Bool", other)
    assert str(caught.value) == "std_msgs/msg/Bool has other fields where it is installed"
    with pytest.raises(InputError) as caught:
        message_class_of("tf2_msgs/msg/TFMessage", other)
    assert str(caught.value) == "tf2_msgs/msg/TFMessage has other fields in ROS 2 Jazzy"
    assert message_class_of("std_msgs/msg/Bool", typestore()) is ros_class("std_msgs/msg/Bool")


def test_definitions_that_lack_a_part_or_hold_themselves_are_refused():
    lacking = get_typestore(Stores.EMPTY)
    lacking.register(get_types_from_msg("lab_msgs/Cell cell", LOAD))
    with pytest.raises(InputError) as caught:
        Introspection(lacking).support(LOAD)
    allowed = "allowed: types with their whole definition"
    assert str(caught.value) == f"lab_msgs/msg/Cell is not defined, {allowed}"
    itself = get_typestore(Stores.EMPTY)
    itself.register(get_types_from_msg("lab_msgs/Load[] loads", LOAD))
    with pytest.raises(InputError) as caught:
        Introspection(itself).support(LOAD)
    assert str(caught.value) == f"{LOAD} holds itself, {allowed}"


def test_another_middleware_cannot_send_what_is_not_installed(monkeypatch):
    monkeypatch.setattr(classes, "rmw_name", lambda: "rmw_cyclonedds_cpp")
    with pytest.raises(InputError) as caught:
        schema_class(LOAD, own_store())
    assert str(caught.value) == (
        f"{LOAD} is not installed, which rmw_cyclonedds_cpp cannot do without, allowed:"
        " rmw_fastrtps_cpp"
    )


def test_payloads_of_jazzy_stay_as_they_are(tmp_path):
    """Reading by the bag's definitions changes nothing where they are Jazzy's."""
    message = typestore().types["std_msgs/msg/String"]("x")
    payload = serialize(message)
    with (tmp_path / "text.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/text", "cdr", schema)
        writer.add_message(channel, 1, payload, 1)
        writer.finish()
    with open_bag(tmp_path / "text.mcap", own_types=True) as bag:
        assert [found.payload for found in bag.messages()] == [payload]
        assert bag.store("/text") is typestore()
