"""A run repeated from its recording, whole, cut or tampered with."""

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from loops import WILD
from recording_samples import write_sample
from rewritten_recordings import rewrite
from rosbags.rosbag2 import Writer
from rosbags.rosbag2.enums import StoragePlugin
from run_samples import bundle_of

from cspm_msgs_py.diagnostics import hardware_id_of
from cspm_msgs_py.edited import with_effects
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording import Recording, recover
from cspm_msgs_py.recording.attached_testbed import attached_testbed
from cspm_msgs_py.recording.mcap_file import McapFile
from cspm_msgs_py.testbed import EffectEntry
from cspm_msgs_py.topics import SCENE
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

STEPS = 400
SAMPLES = Path(__file__).resolve().parents[3] / "shared" / "data" / "mcap_samples"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("resim") / "waves"
    run(bundle_of("worst_case", "rates.motion_controller=100"), place, steps=STEPS)
    return place


def again(path):
    return resimulate(path, lambda now, total: None)


def cut(folder, target, size):
    """Copy a recording as a killed writer leaves it: the first `size` bytes of its file."""
    target.mkdir()
    [file] = folder.glob("*.mcap")
    (target / file.name).write_bytes(file.read_bytes()[:size])
    (target / "metadata.yaml").write_bytes((folder / "metadata.yaml").read_bytes())
    return target


def test_a_run_repeats_itself(folder):
    reported = []
    found = resimulate(folder, lambda now, total: reported.append((now, total)))
    assert found.difference is None
    assert found.cut_ns is None
    assert found.same_version
    with Recording(folder) as recording:
        assert found.messages == sum(info.count for info in recording.topics.values())
    assert reported[-1] == (pytest.approx(0.4), pytest.approx(0.4))


@pytest.mark.parametrize("scenario", ["one_winch", "verification_mid", "rest"])
def test_every_kind_of_run_repeats_itself(tmp_path, scenario):
    run(bundle_of(scenario, "sensors=ideal"), tmp_path / "bag", steps=150)
    assert again(tmp_path / "bag").difference is None


def test_a_diverged_run_repeats_itself(tmp_path):
    assert run(bundle_of("rest", *WILD), tmp_path / "bag").failure is not None
    found = again(tmp_path / "bag")
    assert (found.difference, found.missing_s) == (None, ())


def test_a_copy_is_still_identical(folder, tmp_path):
    """What tampering is done with changes nothing by itself."""
    assert again(rewrite(folder, tmp_path / "copy")).difference is None


@pytest.mark.parametrize(
    ("topic", "index", "column", "field"),
    [
        ("/cables/tension", 217, 2, "effort/surge_1"),
        ("/truth/bar/pose", 399, 1, "y"),
        ("/wrench_command", 0, 4, "my"),
        ("/bar/reference", 50, 15, "az"),
        ("/winches/state", 123, 9, "velocity/hoist_2"),
    ],
)
def test_one_changed_bit_is_found_and_named(folder, tmp_path, topic, index, column, field):
    def change(name, i, row):
        if (name, i) == (topic, index):
            row[column] = np.nextafter(row[column], 1e9)
        return row

    found = again(rewrite(folder, tmp_path / "tampered", change)).difference
    assert found is not None
    assert (found.topic, found.index, found.field) == (topic, index, field)
    assert found.first == np.nextafter(found.second, 1e9)
    assert str(found).startswith(f"{topic} message {index} at ")


@pytest.mark.parametrize("index", [200, STEPS - 1])
def test_a_message_missing_among_others_is_no_cut(folder, tmp_path, index):
    def drop(name, i, row):
        return None if (name, i) == ("/bar/pose", index) else row

    found = again(rewrite(folder, tmp_path / "dropped", drop))
    assert found.cut_ns is None
    assert found.difference is not None
    assert (found.difference.topic, found.difference.index) == ("/bar/pose", index)


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    place = tmp_path_factory.mktemp("resim") / "short"
    run(bundle_of("worst_case", "duration=0.4", "rates.motion_controller=100"), place)
    return place


@pytest.mark.parametrize(
    ("kept", "missing"),
    [
        (range(400), ()),
        (range(200), ((0.2, 0.399),)),
        (range(200, 400), ((0.0, 0.199),)),
        ([*range(100), *range(300, 400)], ((0.1, 0.299),)),
    ],
)
def test_parts_of_a_run_that_are_missing_are_named(short, tmp_path, kept, missing):
    times = {i * 1_000_000 for i in kept}
    with Recording(short) as recording:
        names = [n for n, info in recording.topics.items() if carries_row(info.ros_type)]
        stamps = {name: rows.log_ns for name, rows in recording.rows_of(names).items()}

    def drop(name, i, row):
        return row if stamps[name][i] in times else None

    assert again(rewrite(short, tmp_path / "part", drop)).missing_s == missing


def test_another_seed_in_the_attachment_is_a_difference(folder, tmp_path):
    other = bundle_of("worst_case", "seed=2", "rates.motion_controller=100").attachments()
    found = again(rewrite(folder, tmp_path / "other", attachments=other)).difference
    assert found is not None
    assert found.index == 0


def test_another_version_is_reported(folder, tmp_path):
    found = again(rewrite(folder, tmp_path / "old", metadata={"package_version": "0.0.1"}))
    assert found.recorded_version == "0.0.1"
    assert not found.same_version
    assert found.difference is None


def chunk_spans(folder):
    [path] = folder.glob("*.mcap")
    with McapFile(path) as file:
        return [(place.record.offset, place.record.end) for place in file.chunks]


@pytest.mark.parametrize("share", [0.2, 0.45, 0.71, 0.9])
@pytest.mark.parametrize("mended", [True, False])
def test_a_recording_cut_inside_a_chunk_is_identical_up_to_there(folder, tmp_path, share, mended):
    start, end = chunk_spans(folder)[4]
    broken = cut(folder, tmp_path / "cut", start + round(share * (end - start)))
    if mended:
        report = recover(broken)
        assert 199_000_000 <= report.end_ns < 250_000_000
    found = again(broken)
    assert found.difference is None
    assert found.messages > 0


def prefix(folder, target, last):
    """Keep what comes before the last instant, and of that the first `last` messages."""
    order = list(bundle_of("worst_case").testbed.testbed.topics)
    with Recording(folder) as recording:
        present = [name for name in order if name in recording.topics]
    kept = present[:last]

    def shorten(name, i, row):
        return None if i == STEPS - 1 and name not in kept else row

    return rewrite(folder, target, shorten)


@pytest.mark.slow
def test_every_place_inside_an_instant_is_recognised(folder, tmp_path):
    for last in (1, 6, 15):
        found = again(prefix(folder, tmp_path / f"cut{last}", last))
        assert found.difference is None
        assert found.cut_ns == (STEPS - 1) * 1_000_000


def test_tampering_in_the_last_instant_of_a_cut_recording_is_found(folder, tmp_path):
    short = prefix(folder, tmp_path / "cut", 6)

    def change(name, i, row):
        if name == "/bar/pose" and i == STEPS - 1:
            row[0] += 1e-9
        return row

    found = again(rewrite(short, tmp_path / "tampered", change))
    assert found.difference is not None
    assert (found.difference.topic, found.difference.field) == ("/bar/pose", "x")


def test_recordings_of_others_are_one_line(tmp_path):
    with Writer(tmp_path / "other", version=9, storage_plugin=StoragePlugin.MCAP):
        pass
    write_sample(tmp_path / "elsewhere", 5)
    for name, text in {
        "missing": "no such file or folder",
        "other": "carries no scenario.yaml and no testbed.yaml, allowed: a recording made by cspm",
        "elsewhere": "scenario.yaml: testbed: missing",
    }.items():
        with pytest.raises(InputError) as caught:
            again(tmp_path / name)
        assert str(caught.value).startswith(f"{tmp_path / name}: {text}")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["test_bag_mcap", "compressed.mcap", "chunk_not_closed.mcap"])
def test_samples_of_other_tools_are_one_line(name):
    if not SAMPLES.is_dir():
        pytest.skip("the MCAP samples are not here")
    with pytest.raises(InputError) as caught:
        again(SAMPLES / name)
    assert "\n" not in str(caught.value)


def test_without_clock_there_is_nothing_to_repeat(folder, tmp_path):
    def drop(name, i, row):
        return None if name == "/clock" else row

    with pytest.raises(InputError) as caught:
        again(rewrite(folder, tmp_path / "timeless", drop))
    assert str(caught.value) == (
        f"{tmp_path}/timeless: has no /clock messages, allowed: a simulated recording"
    )


@pytest.mark.slow
def test_a_recording_cut_anywhere_repeats_itself(folder, tmp_path):
    [file] = folder.glob("*.mcap")
    first = chunk_spans(folder)[0][1]
    sizes = random.Random(3).sample(range(first, file.stat().st_size), 12)
    for size in sizes:
        broken = cut(folder, tmp_path / f"cut{size}", size)
        recover(broken)
        found = again(broken)
        assert found.difference is None, size


def test_a_planted_effect_travels_with_its_recording(tmp_path):
    bundle = bundle_of("worst_case", "rates.motion_controller=100")
    entry = EffectEntry(
        effect="winch_coulomb_friction", elements=("sway_3",), parameters={"torque": 0.03}
    )
    planted = replace(bundle, testbed=with_effects(bundle.testbed, [entry]))
    run(planted, tmp_path / "planted", steps=STEPS)
    with Recording(tmp_path / "planted") as recording:
        attached = attached_testbed(recording.attachments, "planted")
        assert recording.metadata["cspm"]["testbed_sha256"] == attached.sha256
    assert entry in attached.testbed.effects
    assert again(tmp_path / "planted").difference is None


def test_a_concealed_machine_is_what_the_recording_does_not_carry(folder, tmp_path):
    bundle = bundle_of("worst_case", "rates.motion_controller=100")
    machine = bundle.testbed.testbed
    heavy = machine.model_copy(update={"bar": machine.bar.model_copy(update={"mass": 4.5})})
    concealed = bundle.concealing(heavy)
    assert concealed.testbed.testbed == heavy
    assert concealed.described is bundle.testbed
    run(concealed, tmp_path / "concealed", steps=STEPS)
    with Recording(tmp_path / "concealed") as recording, Recording(folder) as open_run:
        assert recording.attachments == open_run.attachments
        assert recording.metadata == open_run.metadata
    assert again(tmp_path / "concealed").difference is not None


def test_recordings_from_before_machines_were_named_are_repeated(tmp_path, folder):
    """Statuses without a machine, and no scene, as older versions recorded."""
    bundle = bundle_of("worst_case", "rates.motion_controller=100")
    run(bundle, tmp_path / "old", steps=STEPS, hardware_id="")
    rewrite(tmp_path / "old", tmp_path / "older")
    found = again(tmp_path / "older")
    assert found.difference is None
    with Recording(tmp_path / "older") as older, Recording(folder) as new:
        assert set(new.topics) - set(older.topics) == set(SCENE)
        payloads = [each.payloads("/diagnostics").payloads for each in (older, new)]
    assert [hardware_id_of(each[0]) for each in payloads] == ["", bundle.testbed.testbed.name]
