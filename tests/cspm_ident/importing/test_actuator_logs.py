"""Logs of single actuators: JSON of better-actuator-models, and arrays of simulators."""

import json
from pathlib import Path

import numpy as np
import pytest
from import_samples import imported

from cspm_msgs_py.errors import InputError

STATE = "/winches/state"
MAPPINGS = Path(__file__).parents[3] / "scenarios" / "mappings"
T = np.arange(200) / 100
Q, SPEED, TORQUE = np.sin(5 * T), 5 * np.cos(5 * T), 0.3 * np.sign(np.cos(5 * T))
ARRAYS = """
name: joints
clocks: {log: {column: time, unit: s}}
channels:
  /winches/state: {position/surge: {column: "dof_pos[1]", unit: rad}}
"""


def mapping_of(name):
    text = (MAPPINGS / f"{name}.yaml").read_text(encoding="utf-8")
    return text.replace("/joint:", "/surge:")


def bam_log(path, **without):
    rows = zip(T.tolist(), Q.tolist(), SPEED.tolist(), TORQUE.tolist(), strict=True)
    entries = [
        {"timestamp": t, "position": q, "speed": v, "torque_demand": u, "torque_enable": True}
        for t, q, v, u in rows
    ]
    log = {"mass": 0.5, "length": 0.1, "motor": "erob80", "entries": entries}
    path.write_text(json.dumps(log | without))
    return path


def assert_read(found):
    assert found.stamps[STATE].tolist() == [10_000_000 * i for i in range(200)]
    np.testing.assert_array_equal(found.rows[STATE], np.column_stack([Q, SPEED, TORQUE]))


def test_a_log_of_better_actuator_models_needs_its_mapping_alone(tmp_path):
    assert_read(imported(bam_log(tmp_path / "log.json"), mapping_of("bam")))


@pytest.mark.parametrize("kind", ["records", "arrays", "csv", "npz"])
def test_a_joint_log_may_be_rows_or_arrays(tmp_path, kind):
    columns = {"time": T, "position": Q, "velocity": SPEED, "torque": TORQUE}
    path = tmp_path / f"log.{'json' if kind in ('records', 'arrays') else kind}"
    lists = {name: values.tolist() for name, values in columns.items()}
    if kind == "records":
        rows = zip(*lists.values(), strict=True)
        path.write_text(json.dumps([dict(zip(lists, row, strict=True)) for row in rows]))
    elif kind == "arrays":
        path.write_text(json.dumps(lists))
    elif kind == "npz":
        np.savez(path, **columns)
    else:
        rows = [",".join(map(repr, row)) for row in zip(*lists.values(), strict=True)]
        path.write_text("\n".join([",".join(columns), *rows]))
    assert_read(imported(path, mapping_of("joint_log")))


def test_matrices_of_many_joints_have_a_column_for_each(tmp_path):
    positions = np.column_stack([np.zeros(200), Q])
    np.savez(tmp_path / "log.npz", time=T, dof_pos=positions, des_dof_pos=positions)
    (tmp_path / "log.json").write_text(
        json.dumps({"time": T.tolist(), "dof_pos": positions.tolist()})
    )
    for name in ("log.npz", "log.json"):
        found = imported(tmp_path / name, ARRAYS)
        np.testing.assert_array_equal(found.rows[STATE][:, 0], Q)


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("log.json", "{", "no JSON"),
        ("log.json", '{"a": 1}', "holds no column, allowed: a list of records, or an array"),
        ("log.npz", "PK\x03\x04 and then nothing", "no arrays of numpy that can be read"),
        ("log.pt", "PK\x03\x04", "a file of PyTorch, allowed: saved by numpy: numpy.savez("),
    ],
)
def test_what_cannot_be_read_is_one_line(tmp_path, name, content, line):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InputError) as caught:
        imported(path, ARRAYS)
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_value_that_an_entry_lacks_is_no_number_there(tmp_path):
    path = bam_log(tmp_path / "log.json")
    log = json.loads(path.read_text())
    del log["entries"][7]["torque_demand"]
    path.write_text(json.dumps(log))
    assert len(imported(path, mapping_of("bam")).stamps[STATE]) == 199
