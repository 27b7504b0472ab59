"""A run's description as it travels inside its recording, and out of it again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from cspm_control.stages.own_code import read_code, sha256_of
from cspm_msgs_py.edited import file_of
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import FileMotion, VesselMotion
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.attached_testbed import TESTBED, attached_testbed
from cspm_msgs_py.recording.run_record import SIM
from cspm_msgs_py.scenario import Scenario, parse_scenario
from cspm_msgs_py.scenario_keys.bodies import Body
from cspm_msgs_py.scenario_keys.own_controller import OwnController, path_of
from cspm_msgs_py.testbed import Testbed, TestbedFile
from cspm_msgs_py.yaml_file import dump_yaml

SCENARIO = "scenario.yaml"


@dataclass(frozen=True)
class Bundle:
    """What is run, and what its recording says that was run.

    Attributes:
        scenario: resolved.
        testbed: the machine that is simulated.
        files: what the scenario's motions read, by name.
        plant: whose equations are simulated.
        attached: the file that the recording carries where the simulated machine is concealed;
            None: that of the simulated machine.
        origins: where the user has the files, by name, for errors.
        unasked: the recording that names code which the user did not ask to run; None: no code,
            or the user's own.
    """

    scenario: Scenario
    testbed: TestbedFile
    files: dict[str, bytes]
    plant: str = SIM
    attached: TestbedFile | None = None
    origins: dict[str, str] = field(default_factory=dict, compare=False)
    unasked: str | None = field(default=None, compare=False)

    @property
    def described(self) -> TestbedFile:
        """The file that the recording carries."""
        return self.testbed if self.attached is None else self.attached

    def concealing(self, machine: Testbed) -> Bundle:
        """Return a run of another machine whose recording goes on carrying this one's file.

        For tests of a diagnosis, which is to find the difference.

        Raises:
            InputError: the description is no machine's.
        """
        hidden = file_of(machine, f"{machine.name}, concealed")
        return replace(self, testbed=hidden, attached=self.described)

    def attachments(self) -> dict[str, bytes]:
        """Return the recording's attachments by name."""
        text = dump_yaml(self.scenario.model_dump(mode="json"))
        described = {SCENARIO: text.encode(), TESTBED: self.described.text.encode()}
        return described | self.files

    @contextmanager
    def unpacked(self) -> Iterator[Path]:
        """Give a folder in which the scenario's relative paths find its files.

        Raises:
            InputError: a recording names code that the user did not ask to run.
        """
        if self.unasked is not None:
            raise InputError(refusal(self.scenario, self.unasked))
        with ScratchFolder("scenario") as place:
            for name, content in self.files.items():
                (place / name).write_bytes(content)
            try:
                yield place
            except InputError as err:
                raise InputError(self._by_origin(str(err), place)) from None

    def _by_origin(self, text: str, place: Path) -> str:
        """Return an error's text with the user's files in place of their copies."""
        for name in self.files:
            text = text.replace(str(place / name), self.origins.get(name, name))
        return text


def make_bundle(
    scenario: Scenario, testbed: TestbedFile, folder: Path, own: Path | None = None
) -> Bundle:
    """Return the self-contained description of a run whose scenario file lies in `folder`.

    Args:
        scenario: resolved.
        testbed: the machine.
        folder: of the scenario's file, whose motions have to be in it.
        own: a further folder, of motions that the caller wrote.

    Raises:
        InputError: a file that a motion or a controller reads cannot be read.
    """
    files: dict[str, bytes] = {}
    origins: dict[str, str] = {}

    def contained(body: Body, role: str) -> Body:
        motion = body.motion
        if isinstance(motion, FileMotion):
            name = _take((folder, own), motion.path, role, files)
            origins[name] = str(folder / motion.path)
            return body.model_copy(update={"motion": motion.model_copy(update={"path": name})})
        if isinstance(motion, VesselMotion):
            name = _take((folder, own), motion.rao, role, files)
            origins[name] = str(folder / motion.rao)
            return body.model_copy(update={"motion": motion.model_copy(update={"rao": name})})
        return body

    def controllers() -> dict[str, OwnController]:
        found: dict[str, OwnController] = {}
        for stage, named in scenario.controllers.items():
            path = path_of(named, folder)
            text, name = read_code(path), path.name
            if files.get(name, text) != text:
                name = f"{stage}_{name}"
            files[name], origins[name] = text, str(path)
            found[stage] = named.moved(name, named.sha256 or sha256_of(files[name]))
        return found

    changes: dict[str, object] = {
        "controllers": controllers(),
        "testbed": TESTBED,
        "winch_frame": contained(scenario.winch_frame, "winch_frame"),
        "target": contained(scenario.target, "target"),
    }
    return Bundle(scenario.model_copy(update=changes), testbed, files, origins=origins)


def read_bundle(attachments: Mapping[str, bytes], source: str) -> Bundle:
    """Return the description that a recording carries.

    Raises:
        InputError: the recording carries none, or a damaged one.
    """
    outside = [name for name in attachments if Path(name).name != name or name == ".."]
    if outside:
        raise InputError(f"{source}: attachment {outside[0]!r}, allowed: names without folders")
    missing = [name for name in (SCENARIO, TESTBED) if name not in attachments]
    if missing:
        raise InputError(
            f"{source}: carries no {' and no '.join(missing)}, allowed: a recording made by cspm"
        )
    text = attachments[SCENARIO].decode(errors="replace")
    scenario = parse_scenario(text, f"{source}: {SCENARIO}")
    for key, path in _motion_files(scenario).items():
        if path not in attachments:
            raise InputError(
                f"{source}: {SCENARIO}: {key}: {path!r}, allowed: a file that the recording carries"
            )
    return Bundle(
        scenario,
        attached_testbed(attachments, source),
        {name: content for name, content in attachments.items() if name not in (SCENARIO, TESTBED)},
        unasked=source if scenario.controllers else None,
    )


def with_own_code(bundle: Bundle, paths: Sequence[Path]) -> Bundle:
    """Return a recorded run in which the user's own copies of its controllers take part.

    What the recording carries of code is never run: only a file of the same SHA-256 is.

    Raises:
        InputError: a controller's file is not among the paths, or a path is no controller's.
    """
    own = {sha256_of(text): text for text in map(read_code, paths)}
    wanted = bundle.scenario.controllers
    known = {named.sha256 for named in wanted.values()}
    for path, sha256 in zip(paths, own, strict=True):
        if sha256 not in known:
            allowed = ", ".join(str(each) for each in known) or "none: no controller of one's own"
            raise InputError(f"--controller {path}: SHA-256 {sha256}, allowed: {allowed}")
    if any(named.sha256 not in own for named in wanted.values()):
        return bundle
    # A name that points elsewhere is a name in the run's own folder.
    moved = {s: n.moved(Path(n.file).name, str(n.sha256)) for s, n in wanted.items()}
    files = {n.file: own[str(n.sha256)] for n in moved.values()}
    scenario = bundle.scenario.model_copy(update={"controllers": moved})
    return replace(bundle, scenario=scenario, files=bundle.files | files, unasked=None)


def refusal(scenario: Scenario, recording: str) -> str:
    """Return in one line why a recording's code is not run, and what runs it."""
    named = ", ".join(
        f"{stage}: {each.class_name}, SHA-256 {each.sha256 or 'unknown'}"
        for stage, each in scenario.controllers.items()
    )
    return (
        f"{recording}: ran code of its user's ({named}), which is not run unasked, allowed:"
        f" `cspm resim {recording} --controller FILE.py` with your own copy of the file"
    )


def _motion_files(scenario: Scenario) -> dict[str, str]:
    """Return the paths of files that motions read, by key of the scenario."""
    found = {}
    for role in ("winch_frame", "target"):
        motion = getattr(scenario, role).motion
        if isinstance(motion, FileMotion):
            found[f"{role}.motion.path"] = motion.path
        elif isinstance(motion, VesselMotion):
            found[f"{role}.motion.rao"] = motion.rao
    return found


def _take(folders: tuple[Path, Path | None], named: str, role: str, files: dict[str, bytes]) -> str:
    path = folders[0] / named
    inside = [each.resolve() for each in folders if each is not None]
    try:
        if not any(path.resolve().is_relative_to(each) for each in inside):
            raise InputError(f"{path}: leads outside, allowed: a file in the scenario's folder")
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: no regular file, allowed: a file")
        content = path.read_bytes()
    except OSError as err:
        raise InputError(f"{path}: not readable ({err.strerror}), allowed: a file") from None
    name = f"{role}_motion{path.suffix}"
    files[name] = content
    return name
