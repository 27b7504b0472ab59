"""Recordings of earlier versions: opened, valid, and repeated bit for bit.

Each is `cspm run rest --duration 0.02` of the last commit of its version.
"""

from pathlib import Path

import numpy as np
import pytest

import cspm as door
from cspm.commands.installation.migrate_command import migrate_command
from cspm_msgs_py.errors import InputError

VERSIONS = Path(__file__).with_name("versions")
OF_ALL = ("0.1.0", "0.2.0", "0.3.0")


def recording_of(version):
    return VERSIONS / f"rest_{version}.mcap"


def test_there_is_a_recording_of_each_version():
    assert {path.name for path in VERSIONS.iterdir()} == {recording_of(v).name for v in OF_ALL}


@pytest.mark.parametrize("version", OF_ALL)
def test_it_opens_with_its_machine_and_its_signals(version):
    recording = door.open(recording_of(version))
    assert recording.metadata["cspm"]["package_version"] == version
    assert recording.duration == pytest.approx(0.019)
    assert recording.testbed.name.startswith("thesis")
    assert {"bar_pose", "winch_torque", "tension"} <= set(recording.names)
    assert len(recording.tension) == 20
    assert np.all(recording.tension.values > 1.0)


@pytest.mark.compiled
@pytest.mark.parametrize("version", OF_ALL)
def test_it_is_repeated_bit_for_bit(version):
    assert door.open(recording_of(version)).resimulate().difference is None


@pytest.mark.parametrize("version", OF_ALL)
def test_its_files_are_valid_as_they_are(version, capsys):
    migrate_command(recording_of(version), None)
    out = capsys.readouterr().out
    assert out.count("valid as it is: nothing to change") == 2
    assert f"written by version {version}" in out


def test_a_file_with_a_key_of_no_version_names_it(tmp_path):
    scenario = tmp_path / "old.yaml"
    text = door.open(recording_of("0.1.0")).attachments["scenario.yaml"].decode()
    scenario.write_text(text + "wind: strong\n")
    with pytest.raises(InputError, match=r"old\.yaml: wind: .*allowed"):
        migrate_command(scenario, None)
    other = tmp_path / "other.yaml"
    other.write_text("jobs: []\nsteps: []\n")
    with pytest.raises(InputError, match="of no known kind, allowed: see `cspm schema`"):
        migrate_command(other, None)
    with pytest.raises(InputError, match="nowhere: no such file or folder"):
        migrate_command(Path("nowhere"), None)
