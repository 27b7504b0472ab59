"""Who sends and who reads what, and whom the plant waits for."""

import pytest
from run_samples import bundle_of
from schedules import delayed

from cspm_msgs_py.graph import NODES, PLAYER, RECORDER, STAGES, followers, graph_of, members_of
from cspm_msgs_py.schedule import PLANT, schedule_of
from cspm_msgs_py.stepping.lockstep import WINDOW

MEASURED = {
    "/winch_frame/pose": {"tension_distribution"},
    "/bar/pose": {"motion_controller", "tension_distribution"},
    "/winches/state": {"force_controller"},
    "/cables/tension": {"force_controller"},
}
COMMANDS = {
    "/bar/reference": ("wave_trajectory", {"motion_controller"}),
    "/winch_frame/reference": ("wave_trajectory", set()),
    "/wrench_command": ("motion_controller", {"tension_distribution"}),
    "/tension_command": ("tension_distribution", {"force_controller"}),
    "/winches/torque_command": ("force_controller", {"plant"}),
}


def schedule(scenario="rest", *overrides, delays=None):
    bundle = bundle_of(scenario, *overrides)
    return schedule_of(bundle.scenario, delayed(bundle.testbed.testbed, delays or {}))


def everybody(found):
    return (PLANT, *found.nodes, RECORDER)


def test_the_edges_of_a_closed_loop():
    found = schedule()
    edges = graph_of(found, everybody(found))
    assert set(edges) == {*found.topics, "/diagnostics"}
    for name, edge in edges.items():
        sender, readers = "plant", {"wave_trajectory"} if name == "/clock" else set()
        if name in MEASURED:
            readers = MEASURED[name]
        elif name in COMMANDS:
            sender, readers = COMMANDS[name]
        if name == "/diagnostics":
            assert edge.senders == (PLANT, *STAGES)
        else:
            assert edge.senders == (sender,)
        assert set(edge.readers) == {*readers, RECORDER}
        assert len(edge.readers) == len(set(edge.readers))


def test_drives_that_take_tensions_hear_no_tension_and_send_no_torque_to_the_plant():
    found = schedule("rest", "drive=tension")
    edges = graph_of(found, everybody(found))
    assert edges["/tension_command"].readers == ("force_controller", RECORDER)
    for name in ("/cables/tension", "/winches/state", "/winches/torque_command"):
        assert edges[name].readers == (RECORDER,)
    # Where a player is in the plant's place they are nodes of their own.
    played = graph_of(found, (PLAYER, "force_controller", RECORDER))
    assert "force_controller" in played["/cables/tension"].readers
    assert members_of(found) == everybody(found)
    drivers = members_of(found, external=True)
    assert drivers == tuple(n for n in everybody(found) if n not in (PLANT, "force_controller"))
    assert members_of(schedule(), external=True) == everybody(schedule())[1:]


def test_control_never_reads_the_truth():
    found = schedule()
    edges = graph_of(found, everybody(found))
    truth = [edge for name, edge in edges.items() if name.startswith("/truth/")]
    assert truth
    assert all(edge.readers == (RECORDER,) for edge in truth)


def test_nodes_that_are_absent_neither_send_nor_read():
    found = schedule()
    edges = graph_of(found, (PLANT, "motion_controller"))
    assert edges["/bar/pose"].readers == ("motion_controller",)
    assert edges["/bar/reference"].senders == ()
    assert edges["/wrench_command"].senders == ("motion_controller",)
    assert edges["/wrench_command"].readers == ()
    assert edges["/diagnostics"].senders == (PLANT, "motion_controller")
    assert edges["/diagnostics"].readers == ()


def target(source):
    return schedule("calm_measured_target", f"target.source={source}")


def test_a_measured_target_has_topics_and_a_tracker_of_its_own():
    found = target("measured")
    edges = graph_of(found, everybody(found))
    assert edges["/target/reference"].senders == ("wave_trajectory",)
    assert edges["/target/pose"].senders == (PLANT,)
    assert edges["/target/pose"].readers == ("target_tracker", RECORDER)
    assert edges["/bar/reference"].senders == ("target_tracker",)
    assert edges["/truth/target/pose"].readers == (RECORDER,)
    # Through the bar's reference a torque proves that the tracker read, not the wave trajectory.
    assert followers(found, everybody(found), WINDOW) == ("wave_trajectory", RECORDER)


def test_nobody_of_a_run_sends_what_is_somebody_elses():
    found = target("external")
    edges = graph_of(found, everybody(found))
    assert edges["/target/pose"].senders == ()
    assert edges["/target/pose"].readers == ("target_tracker", RECORDER)
    assert not {"/target/reference", "/truth/target/pose"} & set(edges)
    assert graph_of(found, (PLAYER, "target_tracker"))["/target/pose"].senders == (PLAYER,)


def test_a_prescribed_target_has_no_topics():
    found = target("prescribed")
    assert not [name for name in found.topics if "target" in name]
    assert "target_tracker" not in found.nodes


def test_a_rig_with_one_winch():
    found = schedule("one_winch")
    edges = graph_of(found, everybody(found))
    assert edges["/clock"].readers == ("force_controller", RECORDER)
    assert set(edges["/winches/torque_command"].readers) == {PLANT, RECORDER}
    assert not [name for name in edges if "pose" in name or "wrench" in name]


def test_a_player_replaces_the_plant_and_who_is_absent():
    found = schedule()
    edges = graph_of(found, (PLAYER, "motion_controller", RECORDER))
    assert edges["/bar/pose"].senders == (PLAYER,)
    assert edges["/bar/reference"].senders == (PLAYER,)
    assert edges["/wrench_command"].senders == ("motion_controller",)
    assert set(edges["/wrench_command"].readers) == {PLAYER, RECORDER}


def test_the_names_of_all_nodes_are_the_contracts():
    assert NODES == (
        "plant",
        "wave_trajectory",
        "motion_controller",
        "tension_distribution",
        "force_controller",
        "target_tracker",
        "recorder",
        "player",
        "viewer",
    )


@pytest.mark.parametrize(
    ("overrides", "delays", "expected"),
    [
        # At 1 kHz a torque proves that its chain has read everything.
        (["rates.motion_capture=1000", *[f"rates.{n}=1000" for n in STAGES[1:3]]], {}, set()),
        # At 100 Hz ten references come between two wrenches.
        ([], {}, {"wave_trajectory", "motion_controller"}),
        # Ten tensions and states come between two torques, ten poses between two wrenches.
        (
            ["rates.force_controller=100", "rates.motion_capture=1000"],
            {},
            set(STAGES),
        ),
        # Slow controllers that read slow topics are proven.
        (
            [f"rates.{n}=100" for n in ("wave_trajectory", "winches", "load_cells", STAGES[-1])],
            {},
            {"wave_trajectory"},
        ),
        # Before the first torque nothing is proven: it comes with the first pose.
        (
            ["rates.motion_capture=1000", *[f"rates.{n}=1000" for n in STAGES[1:3]]],
            {"/bar/pose": WINDOW},
            set(STAGES),
        ),
        (
            ["rates.motion_capture=1000", *[f"rates.{n}=1000" for n in STAGES[1:3]]],
            {"/bar/pose": WINDOW - 1},
            set(),
        ),
    ],
)
def test_whom_the_plant_waits_for(overrides, delays, expected):
    found = schedule("rest", *overrides, delays=delays)
    waited_for = followers(found, everybody(found), WINDOW)
    assert set(waited_for) == {RECORDER, *expected}
    assert len(waited_for) == len(set(waited_for))


def test_the_plant_waits_for_nobody_who_is_absent():
    found = schedule()
    assert followers(found, (PLANT, "motion_controller"), WINDOW) == ("motion_controller",)
    assert followers(found, (PLANT,), WINDOW) == ()


def test_without_torques_the_plant_waits_for_all_who_read():
    found = schedule("verification_mid")
    assert followers(found, everybody(found), WINDOW) == ("wave_trajectory", RECORDER)
