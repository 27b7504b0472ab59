"""Turning recordings of others into those of the contract."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

from cspm.progress import Progress, shows_progress, silent
from cspm.recorded import Recording
from cspm.testbed import AnyTestbed, as_file
from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.mapping import MappingFile, load_mapping
from cspm_ident.importing.preparation import Prepared, prepare
from cspm_ident.importing.write import write_messages
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.recording.attached_testbed import TESTBED
from cspm_msgs_py.recording.run_record import CONTRACT_VERSION
from cspm_msgs_py.testbed import TestbedFile
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_run.library import find_mapping

MAPPING, REPORT = "mapping.yaml", "import.yaml"
MODE = "import"


@shows_progress("reading")
def import_recording(
    source: str | Path,
    folder: str | Path,
    *,
    mapping: str | Path,
    testbed: AnyTestbed,
    progress: Progress = silent,
) -> Recording:
    """Convert a recording of others, and return the new one: `cspm import`.

    What was converted, and what looks wrong, is in its attachment `import.yaml`.

    Args:
        source: a text table, a spreadsheet, a Parquet, HDF5 or .mat file, or a bag: a rosbag2
            folder, an .mcap or .db3 file, or a ROS 1 .bag.
        folder: a new one for the recording.
        mapping: which column is which number, in which unit: a name of the library or a file; see
            `docs/reference/import-mapping.md`.
        testbed: the machine that was recorded: a name, a file or a `Testbed`.
        progress: called now and then with the share that is done and what is being done;
            none: a bar in a terminal, lines in a notebook.

    Raises:
        InputError: naming what is wrong in the file, the mapping or the test-bed.

    Examples:
        >>> import cspm
        >>> recording = cspm.import_recording(
        ...     "DATA_EMPS.mat", "emps", mapping="emps", testbed="emps"
        ... )  # doctest: +SKIP
    """
    place = Path(folder)
    refuse_existing(place)
    described, machine = load_mapping(find_mapping(str(mapping))), as_file(testbed)

    def reading(share: float) -> None:
        progress(0.5 * share, "reading")

    def writing(share: float) -> None:
        progress(0.5 + 0.5 * share, "writing")

    with ColumnStore() as store:
        prepared = prepare(Path(source), described, machine, store, reading, trial=False)
        write_import(place, prepared, described, machine, writing)
    return Recording(place)


def write_import(
    folder: Path,
    prepared: Prepared,
    mapping: MappingFile,
    testbed: TestbedFile,
    progress: Callable[[float], None],
) -> dict[str, int]:
    """Write a prepared import; return how many messages each topic got.

    Args:
        folder: a new one.
        prepared: what to write.
        mapping: as it was converted, to attach.
        testbed: the machine, to attach.
        progress: called now and then with the share that is written.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    attachments = {
        TESTBED: testbed.text.encode(),
        MAPPING: mapping.text.encode(),
        REPORT: dump_yaml(prepared.report.data()).encode(),
    }
    about = {
        "contract_version": CONTRACT_VERSION,
        "mode": MODE,
        "package_version": version("cspm"),
        **prepared.report.about,
    }
    return write_messages(folder, prepared.messages, attachments, about, progress)
