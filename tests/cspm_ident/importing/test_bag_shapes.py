"""Everyday shapes of ROS messages: names that move, parts that are missing, clocks that differ."""

import numpy as np
import pytest
from import_samples import imported
from lab_bags import EPOCH_NS, JAZZY, STEP_NS, bag, header, joints, made, transform, wrench
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from cspm_msgs_py.errors import InputError

STATE, TENSION, POSE = "/winches/state", "/cables/tension", "/bar/pose"
TWO = """
name: two
bar: {mass: 2.0, inertia: {ixx: 1.0e-3, iyy: 0.2, izz: 0.2}, dimensions: [1.0, 0.04, 0.04]}
cables:
  - &left
    name: left
    exit: [-0.4, 0.0, 0.0]
    attachment: [-0.5, 0.0, -0.02]
    stiffness: {law: linear, youngs_modulus: 8.7e+9, diameter: 1.0e-3, floor_tension: 0.05}
    damping: {constant: 4.0}
    drum_radius: 0.025
    rotor_inertia: 2.4e-4
    torque_limit: 2.0
    tension_limits: [1.0, 40.0]
  - {<<: *left, name: right, exit: [0.4, 0.0, 0.0], attachment: [0.5, 0.0, -0.02]}
"""
BOTH = ("left", "right")
STAMPS = EPOCH_NS + STEP_NS * np.arange(60)


def read(tmp_path, messages, channels, *, extra="", trial=False, definitions=None):
    testbed = tmp_path / "two.yaml"
    testbed.write_text(TWO)
    path = bag(tmp_path / "a.mcap", messages, definitions=definitions)
    return imported(path, f"name: rig\n{extra}\nchannels:\n{channels}", testbed, trial=trial)


def fault(tmp_path, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        read(tmp_path, *args, **kwargs)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{tmp_path}/")


def state(key="%s", parts=("position",)):
    lines = ["  /winches/state:"]
    for part in parts:
        unit = {"position": "rad", "velocity": "rad/s", "effort": "N·m"}[part]
        for i, name in enumerate(BOTH):
            where = key % name if "%s" in key else key % i
            lines.append(f"    {part}/{name}: {{column: '/js:{part}[{where}]', unit: {unit}}}")
    return "\n".join(lines)


def angles(i):
    return [0.01 * i, -0.02 * i]


def test_names_that_change_their_order_are_followed_by_name_and_refused_by_number(tmp_path):
    messages = [
        (t, "/js", joints(t, BOTH, angles(i)) if i < 30 else joints(t, BOTH[::-1], angles(i)[::-1]))
        for i, t in enumerate(STAMPS)
    ]
    rows = read(tmp_path, messages, state()).rows[STATE]
    assert rows.tolist() == [angles(i) for i in range(60)]
    assert fault(tmp_path, messages, state("%d")) == (
        "a.mcap: /js: message 31: behind 'position[0]' is right of 2, in the first message left"
        " of 2, allowed: the same in all; a name in the brackets, as [surge], follows it"
    )
    assert read(tmp_path, messages[:30], state("%d")).rows[STATE].tolist() == rows[:30].tolist()


def test_an_array_whose_length_changes_is_refused_by_number(tmp_path):
    layout = made("std_msgs/msg/MultiArrayLayout", [], 0)
    messages = [
        (t, "/js", made("std_msgs/msg/Float64MultiArray", layout, np.arange(2.0 + (i == 40))))
        for i, t in enumerate(STAMPS)
    ]
    channels = state("%d").replace("position[", "data[")
    clock = "clocks: {log: {stamp: log}}"
    assert fault(tmp_path, messages, channels, extra=clock) == (
        "a.mcap: /js: message 41: behind 'data[0]' is an unnamed number of 3, in the first"
        " message an unnamed number of 2, allowed: the same in all; a name in the brackets, as"
        " [surge], follows it"
    )
    assert len(read(tmp_path, messages[:40], channels, extra=clock).stamps[STATE]) == 40


def test_messages_of_another_publisher_are_passed_over_and_counted(tmp_path):
    messages = []
    for i, t in enumerate(STAMPS):
        messages.append((t, "/js", joints(t, BOTH, angles(i))))
        if i % 5 == 0:
            messages.append((t + 3_000_000, "/js", joints(t + 3_000_000, ["gripper"], [0.5])))
    found = read(tmp_path, messages, state())
    assert found.stamps[STATE].tolist() == STAMPS.tolist()
    assert found.rows[STATE].tolist() == [angles(i) for i in range(60)]
    assert "/js: up to 12 messages have other names" in found.report.notes
    wrong = state().replace("[left]", "[port]")
    assert fault(tmp_path, messages, wrong) == (
        "a.mcap: /js: no message has 'position[port]', allowed: gripper, left, right"
    )


def test_joints_in_messages_of_their_own_are_paired_by_their_stamps(tmp_path):
    messages = []
    for i, t in enumerate(STAMPS):
        for k, name in enumerate(BOTH):
            messages.append((t + k, "/js", joints(t, [name], [angles(i)[k]])))
    found = read(tmp_path, messages, state())
    assert found.rows[STATE].tolist() == [angles(i) for i in range(60)]
    assert found.stamps[STATE].tolist() == STAMPS.tolist()
    assert found.kinds.isdisjoint({"paired"})


def test_a_part_without_numbers_is_left_out_and_a_late_one_is_empty_at_first(tmp_path):
    both = state(parts=("position", "velocity"))
    for speeds in ((), (np.nan, np.nan)):
        messages = [(t, "/js", joints(t, BOTH, angles(i), speeds)) for i, t in enumerate(STAMPS)]
        found = read(tmp_path, messages, both)
        assert found.topics[STATE].parts == ("position",)
        assert found.rows[STATE].tolist() == [angles(i) for i in range(60)]
        assert (f"{STATE} velocity/left", "empty") in found.suspected
        late = [
            (t, "/js", joints(t, BOTH, angles(i), speeds if i < 3 else (1.0, -2.0)))
            for i, t in enumerate(STAMPS)
        ]
        found = read(tmp_path, late, both)
        assert found.stamps[STATE].tolist() == STAMPS.tolist()
        assert np.isnan(found.rows[STATE][:3, 2:]).all()
        assert found.rows[STATE][3:, 2:].tolist() == [[1.0, -2.0]] * 57
        texts = [one.text for one in found.report.suspicions if one.kind == "late_part"]
        assert texts == ["velocity is missing in the first 3 messages, which are kept"]


def test_a_part_that_is_missing_later_goes_as_missing_numbers_do(tmp_path):
    messages = [
        (t, "/js", joints(t, BOTH, angles(i), (1.0, 2.0) if i != 30 else ()))
        for i, t in enumerate(STAMPS)
    ]
    both = state(parts=("position", "velocity"))
    found = read(tmp_path, messages, both)
    assert found.stamps[STATE].tolist() == np.delete(STAMPS, 30).tolist()
    assert found.report.topics[0].left_out.missing == 1
    assert "1 messages with a number missing" in fault(
        tmp_path, messages, both, extra="nan: refuse"
    )


def test_numbers_that_are_fewer_than_their_names_are_refused(tmp_path):
    messages = [
        (t, "/js", joints(t, BOTH, angles(i)[: 1 if i == 7 else 2])) for i, t in enumerate(STAMPS)
    ]
    assert fault(tmp_path, messages, state()) == (
        "a.mcap: /js: message 8: 1 values in 'position[left]' for 2 names, allowed: one each, or"
        " none"
    )


def test_stamps_that_nobody_set_are_taken_from_the_log_and_reported(tmp_path):
    lag = 2_000_000
    messages = [
        (t + lag, "/js", joints(0 if i in (0, 9) else t, BOTH, angles(i)))
        for i, t in enumerate(STAMPS)
    ]
    found = read(tmp_path, messages, state())
    assert found.stamps[STATE].tolist() == STAMPS.tolist()
    texts = [one.text for one in found.report.suspicions if one.kind == "unset"]
    assert texts == ["2 stamps were never set (0) and are repaired from the time of the log"]
    never = [(t, "/js", joints(0, BOTH, angles(i))) for i, t in enumerate(STAMPS)]
    assert fault(tmp_path, never, state()).endswith(
        "clocks.header: every stamp is 0, allowed: stamps, or `stamp: log`"
    )


def test_a_clock_that_begins_at_zero_has_set_its_stamps(tmp_path):
    messages = [(t, "/js", joints(t - EPOCH_NS, BOTH, angles(i))) for i, t in enumerate(STAMPS)]
    found = read(tmp_path, messages, state())
    assert found.stamps[STATE].tolist() == (STAMPS - EPOCH_NS).tolist()
    assert "unset" not in found.kinds


TENSIONS = """
  /cables/tension:
    effort/left: {column: '/lc:effort[left]', unit: N}
    effort/right: {column: '/lc:effort[right]', unit: N}"""


def two_clocks(shift):
    for i, t in enumerate(STAMPS):
        yield t, "/js", joints(t + shift, BOTH, angles(i))
        yield t, "/lc", joints(t, BOTH, effort=[5.0 + 0.01 * i, 6.0])


def test_topics_of_two_clocks_are_reported_and_not_written(tmp_path):
    messages = list(two_clocks(-EPOCH_NS))
    assert fault(tmp_path, messages, state() + TENSIONS) == (
        "mapping.yaml: /cables/tension begins 1.76986e+09 s after the end of /winches/state, and"
        " neither lasts that long: two clocks, allowed: topics that overlap; `stamp: log` in a bag,"
        " or `offset` or `points` of one clock"
    )
    shown = read(tmp_path, messages, state() + TENSIONS, trial=True)
    assert (TENSION, "overlap") in shown.suspected
    logged = read(tmp_path, messages, state() + TENSIONS, extra="clocks: {log: {stamp: log}}")
    assert logged.stamps[STATE].tolist() == logged.stamps[TENSION].tolist() == STAMPS.tolist()
    assert "overlap" not in logged.kinds


def test_topics_that_follow_each_other_soon_are_reported_only(tmp_path):
    found = read(tmp_path, list(two_clocks(-7 * 10**8)), state() + TENSIONS)
    assert (TENSION, "overlap") in found.suspected
    found = read(tmp_path, list(two_clocks(-5 * 10**8)), state() + TENSIONS)
    assert "overlap" not in found.kinds


CELLS = """
  /cables/tension:
    effort/left: {column: '/lc_left:wrench.force.z', unit: N}
    effort/right: {column: '/lc_right:wrench.force.z', unit: N}"""


def load_cells(later, last=60):
    for i, t in enumerate(STAMPS):
        yield t, "/lc_left", wrench(t, 10 + 0.01 * i)
        if i < last:
            yield t + later, "/lc_right", wrench(t + later, 12 - 0.01 * i)


def test_load_cells_on_topics_of_their_own_are_paired_within_a_stated_tolerance(tmp_path):
    found = read(tmp_path, list(load_cells(137_000)), CELLS)
    assert found.stamps[TENSION].tolist() == STAMPS.tolist()
    assert found.rows[TENSION].tolist() == [[10 + 0.01 * i, 12 - 0.01 * i] for i in range(60)]
    assert [one.text for one in found.report.suspicions if one.kind == "paired"] == [
        "stamps of one message differ by up to 0.000137 s, within the tolerance of 0.0005 s; the"
        " message has that of effort/left"
    ]
    assert "have 0 stamps in common, within 0 s" in fault(
        tmp_path, list(load_cells(137_000)), CELLS, extra="pairing: 0.0"
    )
    assert "have 0 stamps in common, within 0.0005 s" in fault(
        tmp_path, list(load_cells(1_000_000)), CELLS
    )
    wide = read(tmp_path, list(load_cells(1_000_000)), CELLS, extra="pairing: 0.002")
    assert len(wide.stamps[TENSION]) == 60
    assert read(tmp_path, list(load_cells(0)), CELLS).kinds.isdisjoint({"paired"})


def test_samples_before_and_after_both_run_need_no_partner(tmp_path):
    found = read(tmp_path, list(load_cells(137_000, last=57)), CELLS)
    assert found.stamps[TENSION].tolist() == STAMPS[:57].tolist()
    assert found.report.topics[0].left_out.unpaired == 3
    holed = [one for i, one in enumerate(load_cells(137_000)) if i != 61]
    assert "have 59 stamps in common" in fault(tmp_path, holed, CELLS)
    assert len(read(tmp_path, holed, CELLS, extra="unpaired: drop").stamps[TENSION]) == 59


def test_load_cells_on_some_cables_leave_the_others_without_number(tmp_path):
    found = read(tmp_path, list(load_cells(0)), CELLS.rpartition("\n")[0])
    assert found.rows[TENSION][:, 0].tolist() == [10 + 0.01 * i for i in range(60)]
    assert np.isnan(found.rows[TENSION][:, 1]).all()
    assert (TENSION, "unmeasured") in found.suspected


def transforms(i, t, *, swapped=False):
    bar, other = transform(t, "world", "bar", 0.01 * i), transform(t - 1, "world", "hand", 9.0)
    return made("tf2_msgs/msg/TFMessage", [other, bar] if swapped else [bar, other])


BAR = """
  /bar/pose:
    x: {column: '/tf:transforms[%s].transform.translation.x', unit: m}
    y: {constant: 0.0}
    z: {constant: 1.0}
    qx: {constant: 0.0}
    qy: {constant: 0.0}
    qz: {constant: 0.0}
    qw: {constant: 1.0}"""


def test_transforms_are_found_by_their_child_frame_with_the_stamps_inside(tmp_path):
    messages = []
    for i, t in enumerate(STAMPS):
        messages.append((t + 5_000_000, "/tf", transforms(i, t, swapped=i % 2 == 1)))
        alone = made("tf2_msgs/msg/TFMessage", [transform(t, "world", "hand", 1.0)])
        messages.append((t + 6_000_000, "/tf", alone))
    found = read(tmp_path, messages, BAR % "bar")
    assert found.stamps[POSE].tolist() == STAMPS.tolist()
    assert found.rows[POSE][:, 0].tolist() == [0.01 * i for i in range(60)]
    assert "message 2: behind 'transforms[0].transform" in fault(tmp_path, messages, BAR % "0")
    assert fault(tmp_path, messages, BAR % "beam").endswith(
        "no message has 'transforms[beam].transform.translation.x', allowed: bar, hand, world"
    )


def test_a_frame_that_changes_is_refused(tmp_path):
    messages = [
        (t, "/lc_left", wrench(t, 10.0 + 0.01 * i, "cell" if i < 20 else "world"))
        for i, t in enumerate(STAMPS)
    ]
    channels = CELLS.rpartition("\n")[0]
    assert fault(tmp_path, messages, channels) == (
        "a.mcap: /lc_left: message 21 is in frame 'world', the first in 'cell', allowed: one frame;"
        " import the frames from bags of their own"
    )
    assert len(read(tmp_path, messages[:20], channels).stamps[TENSION]) == 20


def test_types_are_read_by_their_definition_in_the_bag(tmp_path):
    kind = "lab_msgs/msg/WinchLog"
    text = "std_msgs/Header header\nfloat64[] angle\nlab_msgs/Cell cell\n"
    nested = {"lab_msgs/msg/Cell": "float32 force\n", kind: text}
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, definition in nested.items():
        store.register(get_types_from_msg(definition, name))
    cell = store.types["lab_msgs/msg/Cell"]
    messages = [
        (t, "/log", store.types[kind](header(t), np.array(angles(i)), cell(1.5)))
        for i, t in enumerate(STAMPS)
    ]
    channels = state("%d").replace("/js:position", "/log:angle")
    channels += "\n  /cables/tension: {effort/left: {column: '/log:cell.force', unit: N}}"
    found = read(tmp_path, messages, channels, definitions=nested)
    assert found.rows[STATE].tolist() == [angles(i) for i in range(60)]
    assert found.rows[TENSION][:, 0].tolist() == [1.5] * 60
    assert kind not in JAZZY.types
