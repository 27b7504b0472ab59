"""Where a test-bed's numbers come from.

Any value of a test-bed file may be written as `{value: …, provenance: …}`; `unwrap_provenance`
separates the two.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, model_validator
from typing_extensions import Self

from cspm_msgs_py.yaml_file import StrictModel, validate

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Provenance(StrictModel):
    """Origin of one value.

    `thesis`: published in the thesis; `reconstructed`: chosen so that the published results hold,
    or assumed where nothing fixes it; `fitted`: identified from the recording with SHA-256
    `recording` and those in `further_recordings`; `measured`, `datasheet`, `published`: as the
    words say, the source in the `note` or at the head of the file.
    `window` is the time [s] of the recording that was used, `further_windows` those of the further
    recordings; `interval` holds the value with 95 % probability, an end that nothing bounds is
    None. `accuracy` is one standard deviation of the value, in its unit and for each coordinate of
    a place; a diagnosis takes it for the numbers that an effect of the catalogue adds to.
    """

    provenance: Literal["thesis", "reconstructed", "fitted", "measured", "datasheet", "published"]
    recording: Sha256 | None = None
    note: str = ""
    further_recordings: tuple[Sha256, ...] = ()
    window: tuple[float, float] | None = None
    further_windows: tuple[tuple[float, float], ...] = ()
    interval: tuple[float | None, float | None] | None = None
    accuracy: Annotated[float, Field(ge=0.0)] | None = None

    @model_validator(mode="after")
    def _fitted_from(self) -> Self:
        if self.provenance == "fitted" and self.recording is None:
            raise ValueError("recording: missing, allowed: the SHA-256 of the fitted recording")
        return self


class _Unwrapped(NamedTuple):
    content: Any
    provenance: dict[str, Provenance]


def unwrap_provenance(content: object, source: str) -> _Unwrapped:
    """Return `content` with plain values, and the provenance of each wrapped one by key path.

    Raises:
        InputError: a provenance is none of the allowed words, or a fitted one names no recording.
    """
    found: dict[str, Provenance] = {}

    def walk(node: object, path: str) -> object:
        if isinstance(node, dict):
            if "value" in node and "provenance" in node:
                about = {key: value for key, value in node.items() if key != "value"}
                found[path] = validate(Provenance, about, f"{source}: {path}")
                return node["value"]
            return {k: walk(v, f"{path}.{k}" if path else str(k)) for k, v in node.items()}
        if isinstance(node, list):
            return [walk(item, f"{path}[{i}]") for i, item in enumerate(node)]
        return node

    return _Unwrapped(walk(content, ""), found)
