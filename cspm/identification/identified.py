"""What an identification found: parameters, the fitted machine, pictures."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from cspm.parameters import Parameter, Parameters
from cspm.rig import FITTED
from cspm.testbed import AnyTestbed, Testbed, as_file
from cspm_ident.data_look.data_check import DataCheck
from cspm_ident.estimation.estimate import Estimate
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.testbed import TestbedFile


class Outcome(Protocol):
    """All that was identified."""

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""


Result = TypeVar("Result", bound=Outcome, covariant=True)


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Generic[Result]):
    """What was identified.

    Attributes:
        result: all of it, internal.
        parameters: the estimates: `parameters["bar.mass"].ci95`; of several winches
            `parameters["inertia", "sway_3"]`.
        fitted: gives the test-bed file with the estimates.
        draw: draws pictures into a folder; returns their paths by kind.
        pictures_first: whether they are listed before the test-bed file.
        objections: why some of the parameters are no result, in words; empty where all are.
        data_checks: what the recordings themselves show.
    """

    result: Result
    parameters: Parameters
    fitted: Callable[[], TestbedFile | None]
    draw: Callable[[Path], dict[str, str]]
    pictures_first: bool = False
    objections: tuple[str, ...] = ()
    data_checks: tuple[DataCheck, ...] = ()

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm identify … --json` writes."""
        return self.result.data()

    @cached_property
    def testbed(self) -> Testbed | None:
        """The machine with what was identified; None where nothing was that it could take.

        Raises:
            InputError: the numbers are no machine's.
        """
        file = self.fitted()
        return None if file is None else Testbed(file)

    def write(self, folder: str | Path) -> dict[str, str]:
        """Write the fitted test-bed file and pictures; return their paths by kind.

        Args:
            folder: a new one.

        Raises:
            InputError: the folder exists, or the numbers are no machine's.
        """
        place = Path(folder)
        refuse_existing(place)
        file = self.fitted()
        place.mkdir(parents=True)
        written = {}
        if file is not None:
            (place / FITTED).write_text(file.text, encoding="utf-8")
            written["testbed"] = str(place / FITTED)
        pictures = self.draw(place)
        return pictures | written if self.pictures_first else written | pictures


def source_of(testbed: AnyTestbed | None, recording: Path) -> str:
    """Return the source of the machine that was identified, for the fitted file."""
    return str(recording) if testbed is None else as_file(testbed).source


def estimates(
    estimate: Estimate, element: str, valid: Collection[str] | None = None
) -> Iterable[Parameter]:
    """Yield the parameters of an estimate, of an element or of the whole machine: ''.

    Args:
        estimate: of all of them.
        element: which.
        valid: names of those that are a result; None: all that are excited.
    """
    for name, unit in zip(estimate.names, estimate.units, strict=True):
        low, high = estimate.interval(name)
        known = isfinite(low) and isfinite(high) and (valid is None or name in valid)
        ends = (float(low), float(high)) if known else None
        yield Parameter(name, element, float(estimate.value(name)), unit, ends)
