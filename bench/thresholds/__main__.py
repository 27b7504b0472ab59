"""Move each threshold by half and write what changes: `python -m bench.thresholds`."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from bench.thresholds.development_set import SET, recorded
from bench.thresholds.sensitivity import ROOT, diagnose_all, outcomes
from bench.thresholds.sensitivity_page import sensitivity_page

FOLDER = ROOT / ".results" / "thresholds"
PAGE = ROOT / "results" / "thresholds-sensitivity.md"


def main() -> None:
    """Run the command line."""
    names = [case.name for case in SET]
    parser = argparse.ArgumentParser(prog="python -m bench.thresholds", description=__doc__)
    parser.add_argument("--only", metavar="NAME", action="append", choices=names, help="repeated")
    parser.add_argument("--processes", type=int, default=1, help="diagnoses at a time")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="recordings and results")
    parser.add_argument("--page", type=Path, default=PAGE, help="which page to write")
    options = parser.parse_args()
    cases = [case for case in SET if options.only is None or case.name in options.only]
    for case in cases:
        recorded(case, options.folder / "recordings")
    begun = time.monotonic()

    def tell(what: str, done: int, total: int) -> None:
        left = (time.monotonic() - begun) / done * (total - done)
        print(f"{done} of {total}, {left / 60.0:.0f} min left: {what}", file=sys.stderr, flush=True)

    found = diagnose_all(cases, options.folder, max(1, options.processes), tell)
    changes = {case.name: dict(outcomes(found, case.name)) for case in cases}
    options.page.write_text(sensitivity_page(cases, changes), encoding="utf-8")
    print(f"written {options.page}")


if __name__ == "__main__":
    main()
