"""What is put beside a recording: `summary.json`, and the picture of the run."""

from __future__ import annotations

from pathlib import Path

from cspm_msgs_py.interruption import interruptible
from cspm_msgs_py.recording import Recording, overview
from cspm_msgs_py.recording.run_record import RECORD_NAME
from cspm_run.bundle import Bundle
from cspm_run.output.json_file import write_json
from cspm_run.output.summary import summary_data
from cspm_run.recorded_bundle import recorded_bundle
from cspm_run.recorded_result import recorded_result
from cspm_run.run_result import RunResult

REALTIME = "realtime"


def summarise(folder: Path, bundle: Bundle, result: RunResult) -> None:
    """Put `summary.json` and `run.png` beside a recording."""
    # Loading matplotlib takes a quarter of a second, which the first step need not wait for.
    from cspm.plots.run_figure import draw_run

    write_json(folder / "summary.json", summary_data(result))
    period = 1.0 / bundle.scenario.rates.plant
    names = bundle.testbed.testbed.cable_names
    draw_run(folder / "run.png", result, bundle.scenario.requirement, names, period)


def finish_recording(folder: Path) -> None:
    """Put both beside a recording of nodes that were started by hand, or by `ros2 launch`.

    One without a message, of a run that did not begin, has neither.

    Raises:
        InputError: it cannot be read.
    """
    if not overview(folder).message_count:
        return
    with Recording(folder) as recording:
        mode = recording.metadata[RECORD_NAME]["mode"]
        seconds = 1e-9 * (recording.end_ns - recording.start_ns)
    bundle = recorded_bundle(folder, ())
    # Who ends nodes by a signal, as `ros2 launch` does, gives them time for this.
    with interruptible():
        result = recorded_result(
            bundle,
            folder,
            mode,
            simulated=seconds,
            elapsed=seconds,
            interrupted=False,
            failure=None,
            timed=mode == REALTIME,
        )
        summarise(folder, bundle, result)
