"""Whether experiments decide what recordings leave tied.

`python -m bench.blind.separating FOLDER TRUTH`.

FOLDER is a blind benchmark of `python -m bench.blind make`. Every recording is diagnosed. Where
what is found first is a tie with an experiment, that is run on the machine that conceals what the
recording does, with the file that the laboratory believes in, and all is diagnosed together.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

from bench.blind.concealed_run import believed, record_concealed
from bench.blind.reality.reality import conceal
from bench.blind.scoring.outcome import tie_set
from bench.blind.scoring.share import share, share_words
from bench.blind.truth import RECORDINGS, read_truth, truth_sha256
from bench.markdown import markdown_table
from bench.page import into_page
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.verdict import UNKNOWN, diagnosis_data
from cspm_ident.experiment.experiment_files import write_experiments
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.errors import DivergenceError
from cspm_msgs_py.scenario import load_scenario
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle

PAGE = Path(__file__).resolve().parents[2] / "results" / "experiments.md"
# What is drawn anew in an experiment's run is not what was drawn in the recording's.
_ANOTHER_SEED = 1
_EXPERIMENT = "separating_experiment"

Data = Mapping[str, Any]


class SeparationCase(NamedTuple):
    """A tie, and what became of it.

    Attributes:
        item: of the truth file.
        before: the diagnosis of the recording.
        experiments: names of the motions that were run.
        after: the diagnosis of all together; None where the tie had no experiment.
    """

    item: Data
    before: Data
    experiments: tuple[str, ...]
    after: Data | None


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.blind.separating", description=__doc__)
    parser.add_argument("folder", type=Path, help="a blind benchmark's recordings")
    parser.add_argument("truth", type=Path, help="its truth file")
    parser.add_argument("--work", type=Path, required=True, help="folder for runs and diagnoses")
    parser.add_argument("--names", nargs="*", help="of recordings; otherwise all")
    parser.add_argument("--page", action="store_true", help="renew results/experiments.md")
    options = parser.parse_args()
    console, cases = Console(), []
    items = read_truth(options.truth)["items"]
    items = [item for item in items if not options.names or item["name"] in options.names]
    for item in items:
        with console.status(item["name"]):
            case = _case(
                item, options.folder / RECORDINGS / item["name"], options.work / item["name"]
            )
        if case is not None:
            cases.append(case)
            console.print(f"{item['name']}: {_words(case.before)} → {_words(case.after)}")
    if options.page:
        into_page(PAGE, "cases", separating_table(cases, truth_sha256(options.truth), len(items)))


def _case(item: Data, recording: Path, work: Path) -> SeparationCase | None:
    """Return what experiments make of a recording; None where it is no tie, or lost the bar.

    What is there already is not made again.
    """
    kept = work / "case.json"
    if kept.exists():
        reported = json.loads(kept.read_text(encoding="utf-8"))
        return (
            None
            if reported is None
            else SeparationCase(**{**reported, "experiments": tuple(reported["experiments"])})
        )
    if not (recording / "metadata.yaml").exists():
        return None
    work.mkdir(parents=True, exist_ok=True)
    case = _separated(item, recording, work)
    reported = None if case is None else case._asdict()
    kept.write_text(json.dumps(reported), encoding="utf-8")
    return case


def _separated(item: Data, recording: Path, work: Path) -> SeparationCase | None:
    measured = read_measurement(recording)
    found = diagnose([measured])
    before = diagnosis_data(found)
    if not before["findings"] or not before["findings"][0].get("alternatives"):
        return None
    write_experiments(work, found, before)
    first = before["findings"][0]["alternatives"]
    files = dict.fromkeys(a[_EXPERIMENT] for a in first if a[_EXPERIMENT])
    run = [read_measurement(folder) for folder in _run(item, work, list(files))]
    after = diagnosis_data(diagnose([measured, *run])) if run else None
    return SeparationCase(
        item, before, tuple(load_scenario(work / name).name for name in files), after
    )


def _run(item: Data, work: Path, files: Sequence[str]) -> Iterator[Path]:
    """Run experiments on the machine as it is, and yield their recordings."""
    file = believed(item["scenario"], 1.0, item["seed"]).testbed
    seed = item["seed"] + _ANOTHER_SEED
    for name in files:
        scenario = load_scenario(work / name, [f"seed={seed}"])
        bundle = make_bundle(resolve(scenario, file.testbed), file, work)
        # What begins late has begun.
        reality = conceal(file.testbed, item["amounts"], 0.0, seed)
        folder = work / Path(name).stem
        without = tuple(item["without"])
        try:
            record_concealed(
                bundle, reality, folder, note="", without=without, progress=lambda now: None
            )
        except DivergenceError:
            continue
        yield folder


def _words(diagnosis: Data | None) -> str:
    """Return what was found first, and what ties with it."""
    if diagnosis is None:
        return "no experiment"
    if not diagnosis["findings"]:
        return str(diagnosis["verdict"])
    first, *others = tie_set(diagnosis["findings"][0])
    on = ", ".join(diagnosis["findings"][0]["elements"])
    return f"{first} on {on}" + (f" (or {', '.join(others)})" if others else "")


def separating_table(cases: Sequence[SeparationCase], sha256: str, recordings: int) -> str:
    """Return the counts and a table of all ties."""
    run = [case for case in cases if case.after is not None]
    lines = [
        f"{recordings} recordings, truth file SHA-256 `{sha256}`. {len(cases)} are tied in what is"
        f" found first; for {len(run)} an experiment was promised and run."
    ]
    stages = {
        "before": [(c.item, c.before) for c in run],
        "with the experiments": [(c.item, c.after) for c in run if c.after is not None],
    }
    rows = [
        (
            stage,
            *(
                share_words(share(holds(*reported) for reported in pairs))
                for holds in _COUNTED.values()
            ),
        )
        for stage, pairs in stages.items()
    ]
    heads = ("", *_COUNTED)
    lines.append(markdown_table(heads, rows))
    cells = [
        (c.item["name"], _concealed(c.item), _words(c.before), *_ran(c), _words(c.after))
        for c in cases
    ]
    heads = ("recording", "concealed", "reported before", "experiment", "reported with it")
    lines.append(markdown_table(heads, cells))
    return "\n\n".join(lines)


def _ran(case: SeparationCase) -> tuple[str]:
    return (", ".join(case.experiments) or "none",)


def _concealed(item: Data) -> str:
    each = (
        f"{c['effect'] or c['phenomenon']} on {', '.join(c['elements'])}" for c in item["concealed"]
    )
    hidden = f" (fitted: {item['absorbed_by']})" if item["absorbed_by"] else ""
    return ("; ".join(each) or "nothing") + hidden


def _is_right(item: Data, diagnosis: Data) -> bool:
    return any(
        f["effect"] == c["effect"] and set(f["elements"]) == set(c["elements"])
        for f in diagnosis["findings"][:1]
        for c in item["concealed"]
    )


def _is_among(item: Data, diagnosis: Data) -> bool:
    reported = {e for f in diagnosis["findings"][:1] for e in tie_set(f)}
    return any(c["effect"] in reported for c in item["concealed"])


def _is_tied(diagnosis: Data) -> bool:
    return any(len(tie_set(f)) > 1 for f in diagnosis["findings"][:1])


def _is_named(item: Data, diagnosis: Data) -> bool:
    return _is_right(item, diagnosis) and not _is_tied(diagnosis)


def _misleads(item: Data, diagnosis: Data) -> bool:
    named = [f for f in diagnosis["findings"][:1] if f["effect"] != UNKNOWN]
    return bool(named) and not _is_tied(diagnosis) and not _is_right(item, diagnosis)


_COUNTED = {
    "right, no tie": _is_named,
    "right first": _is_right,
    "truth among the ties": _is_among,
    "something else, no tie": _misleads,
}


if __name__ == "__main__":
    main()
