"""Recordings written anew with something else in them."""

from run_samples import bundle_of

from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording import Recording, RecordingWriter


def rewrite(folder, target, change=None, *, attachments=None, metadata=None):
    """Write a recording anew; `change(topic, index, row)` returns the row, or None to drop it.

    What follows from its messages, the scene for viewers, is left out.
    """
    with Recording(folder) as recording:
        names = list(recording.topics)
        topics = {
            name: recording.topic(name)
            for name, info in recording.topics.items()
            if carries_row(info.ros_type)
        }
        rows = recording.rows_of(topics)
        statuses = recording.payloads("/diagnostics")
        attached = recording.attachments if attachments is None else attachments
        about = recording.metadata["cspm"] | (metadata or {})
    found = bundle_of("worst_case").testbed.testbed.topics
    order = {name: found[name] for name in found if name in names}
    messages = [
        (log, name, stamp, row if change is None else change(name, i, row.copy()))
        for name in topics
        for i, (log, stamp, row) in enumerate(zip(*rows[name], strict=True))
    ]
    messages += [
        (log, "/diagnostics", log, payload)
        for log, payload in zip(statuses.log_ns, statuses.payloads, strict=True)
    ]
    with RecordingWriter(target, order, attachments=attached, metadata=about) as writer:
        for log, name, stamp, content in sorted(messages, key=lambda message: message[0]):
            if isinstance(content, bytes):
                writer.append_payload(name, int(log), content)
            elif content is not None:
                writer.channel(name).append(int(log), int(stamp), content)
    return target
