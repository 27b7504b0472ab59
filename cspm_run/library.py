"""The scenarios, test-beds and mappings that come with the package, and how a name finds one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, overload

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed_keys.near_name import allowed_names

if TYPE_CHECKING:
    from cspm_msgs_py.testbed import TestbedFile

# Groups of scenarios with a folder of their own.
GROUPS = ("steep", "operation", "robots")


def library_folders() -> list[Path]:
    """Return where the library may be: the source tree, then the installation's `share`.

    An installation is whatever holds this package: an environment, `~/.local`, or the prefix of a
    colcon workspace, each as `PREFIX/lib/python3.X/site-packages`.
    """
    package = Path(__file__).resolve().parent
    installed = [prefix / "share" / "cspm" / "scenarios" for prefix in package.parents]
    return [package.parent / "scenarios", *installed]


def scenario_folders() -> list[Path]:
    """Return where scenarios are looked for."""
    groups = (".", *GROUPS)
    return [folder / group for folder in library_folders() for group in groups]


def scenario_names() -> list[str]:
    """Return the names of all scenarios that come with the package."""
    return sorted({path.stem for folder in scenario_folders() for path in folder.glob("*.yaml")})


def testbed_names() -> list[str]:
    """Return the names of all test-beds that come with the package."""
    folders = [folder / "testbeds" for folder in library_folders()]
    return sorted({path.stem for folder in folders for path in folder.glob("*.yaml")})


def find_scenario(name: str) -> Path:
    """Return the scenario file that `name` means: a path, or a name from the library.

    Raises:
        InputError: there is none; the line lists the library.
    """
    return _find(name, "scenario", scenario_folders(), scenario_names)


def find_testbed(name: str) -> Path:
    """Return the test-bed file that `name` means: a path, or a name from the library.

    Raises:
        InputError: there is none; the line lists the library.
    """
    folders = [folder / "testbeds" for folder in library_folders()]
    return _find(name, "test-bed", folders, testbed_names)


def find_mapping(name: str) -> Path:
    """Return the mapping file of an import that `name` means: a path, or a name from the library.

    Raises:
        InputError: there is none; the line lists the library.
    """
    folders = [folder / "mappings" for folder in library_folders()]

    def names() -> list[str]:
        return sorted({path.stem for folder in folders for path in folder.glob("*.yaml")})

    return _find(name, "mapping", folders, names)


@overload
def named_testbed(name: Path | str) -> TestbedFile: ...
@overload
def named_testbed(name: None) -> None: ...
def named_testbed(name: Path | str | None) -> TestbedFile | None:
    """Return the file that an option such as `--testbed thesis` means, None without one.

    Raises:
        InputError: there is none, which names the library; or a key with a fault.
    """
    # Names alone are wanted by help, which need not wait for the models of files.
    from cspm_msgs_py.testbed import load_testbed

    return None if name is None else load_testbed(find_testbed(str(name)))


def _find(name: str, kind: str, folders: Iterable[Path], names: Callable[[], list[str]]) -> Path:
    path = Path(name)
    if path.suffix in {".yaml", ".yml"} or path.is_file():
        if path.is_file():
            return path
        raise InputError(f"{name}: no such file, allowed: a {kind} file")
    for folder in folders:
        if (folder / f"{name}.yaml").is_file():
            return folder / f"{name}.yaml"
    raise InputError(f"{name}: no such {kind}, {allowed_names(name, names(), 'a file')}")
