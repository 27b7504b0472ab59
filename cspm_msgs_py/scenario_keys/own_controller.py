"""A controller of the user's own in place of a stage, as a scenario names it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, model_validator
from typing_extensions import Self

from cspm_msgs_py.yaml_file import StrictModel

# The stages of all modes of control.
StageName = Literal[
    "wave_trajectory",
    "target_tracker",
    "motion_controller",
    "tension_distribution",
    "force_controller",
]


class OwnController(StrictModel):
    """A Python class in a file of its own.

    `python` is `FILE.py:CLASS`, the file relative to the scenario's. `parameters` are the keyword
    arguments of the class. `sha256` is that of the file, where no other is to be run.
    """

    python: str
    parameters: dict[str, Any] = {}
    sha256: str | None = None

    @model_validator(mode="after")
    def _names_a_class(self) -> Self:
        if not self.file.endswith(".py") or not self.class_name.isidentifier():
            raise ValueError(
                f"python: {self.python}, allowed: FILE.py:CLASS, such as tension_pi.py:TensionPi"
            )
        return self

    @property
    def file(self) -> str:
        """The file's path."""
        return self.python.rpartition(":")[0]

    @property
    def class_name(self) -> str:
        """The class's name."""
        return self.python.rpartition(":")[2]

    def moved(self, name: str, sha256: str) -> OwnController:
        """Return it with another name and the SHA-256 of its file."""
        return self.model_copy(update={"python": f"{name}:{self.class_name}", "sha256": sha256})


def _spelled_out(value: object) -> object:
    return {"python": value} if isinstance(value, str) else value


OwnControllers = dict[
    StageName,
    Annotated[
        OwnController, BeforeValidator(_spelled_out, json_schema_input_type=str | OwnController)
    ],
]


def path_of(named: OwnController, folder: Path) -> Path:
    """Return where the file is, for a scenario file in `folder`."""
    return folder / named.file
