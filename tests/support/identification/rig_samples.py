"""Recordings of cables on a rig that the project's plant did not make."""

import numpy as np

from cspm_msgs_py.recording import RecordingWriter
from cspm_msgs_py.topics import contract_topics
from cspm_msgs_py.yaml_file import dump_yaml


def record(folder, specimens, *, start_ns=0, keep=lambda name, step: True, attach=True, name="rig"):
    """Write specimens, moved at the same time, as the recording of a rig; return its folder.

    `keep(topic, step)` may leave messages out.
    """
    cables = [one.cable.model_dump(mode="json", exclude_none=True) for one in specimens]
    testbed = dump_yaml({"name": name, "cables": cables})
    topics = contract_topics(
        [one.cable.name for one in specimens], has_bar=False, has_winch_frame=False
    )
    radius = np.array([one.cable.drum_radius / one.cable.gear_ratio for one in specimens])
    angles = np.stack([one.wound for one in specimens], axis=1) / radius
    speeds = np.stack([one.rate for one in specimens], axis=1) / radius
    tensions = np.stack([one.tension for one in specimens], axis=1)
    rows = {
        "/winches/state": np.hstack([angles + 7.0, speeds, np.zeros_like(angles)]),
        "/cables/tension": tensions,
    }
    attachments = {"testbed.yaml": testbed.encode()} if attach else {}
    chosen = {name: topics[name] for name in rows}
    with RecordingWriter(folder, chosen, attachments=attachments, metadata={}) as writer:
        channels = {name: writer.channel(name) for name in rows}
        for step in range(len(tensions)):
            now = start_ns + step * 1_000_000
            for name, channel in channels.items():
                if keep(name, step):
                    channel.append(now, now, rows[name][step])
    return folder
