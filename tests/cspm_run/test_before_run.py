"""What a run says of its motions before it starts."""

import pytest
import yaml
from run_samples import SCENARIOS, bundle_of

from cspm_run.before_run import stopping_lines

GOES_ON = [(0, 0.0), (1, 0.01), (2, 0.02), (3, 0.03)]


def lines_of(folder, rows, duration, body="target"):
    """Return what is said of a scenario in which a body follows a file."""
    text = "\n".join(["t,x,y,z,roll,pitch,yaw", *(f"{t},0,{y},0,0,0,0" for t, y in rows)])
    (folder / "moved.csv").write_text(text)
    content = yaml.safe_load((SCENARIOS / "rest.yaml").read_text())
    content |= {"duration": duration, "testbed": str(SCENARIOS / "testbeds" / "thesis.yaml")}
    content.setdefault(body, {})["motion"] = {"type": "file", "path": "moved.csv"}
    (folder / "following.yaml").write_text(yaml.safe_dump(content))
    return stopping_lines(bundle_of(folder / "following.yaml"))


@pytest.mark.parametrize("body", ["target", "winch_frame"])
def test_a_file_that_ends_while_its_body_moves_is_told(tmp_path, body):
    (line,) = lines_of(tmp_path, GOES_ON, 5.0, body)
    assert line.startswith(f"{body}.motion ends at 3 s with 0.01 m/s in sway and stands still")


def test_a_file_that_lasts_as_long_as_the_run_is_not(tmp_path):
    assert lines_of(tmp_path, GOES_ON, 3.0) == []


def test_a_file_that_ends_at_rest_is_not(tmp_path):
    steady = [(t / 2.0, 0.02 if t > 6 else 0.0) for t in range(40)]
    assert lines_of(tmp_path, steady, 30.0) == []


@pytest.mark.parametrize("name", ["rest", "ipanema", "manual_hoist"])
def test_other_motions_are_not(name):
    assert stopping_lines(bundle_of(name)) == []
