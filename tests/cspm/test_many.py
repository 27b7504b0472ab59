"""Variants side by side are the runs that they are one by one."""

import warnings

import numpy as np
import pytest

import cspm

SHORT = {"scenario": "calm", "duration": 0.3}
TENSION = "/cables/tension"


class Still:
    """Torques that never change."""

    def step(self, time, inputs):
        return np.full(8, 0.1)


def variants():
    worn = cspm.load_testbed("thesis").with_effect("winch_coulomb_friction", "sway_3", torque=0.03)
    return [
        SHORT,
        SHORT | {"seed": 2},
        SHORT | {"testbed": worn},
        SHORT | {"scenario": "worst_case", "seed": 3},
        SHORT | {"controllers": {"force_controller": Still()}},
    ]


@pytest.mark.compiled
@pytest.mark.parametrize("workers", [1, 3])
def test_each_run_is_the_one_that_simulate_gives(workers):
    found = list(cspm.simulate_many(variants(), workers=workers))
    for given, run in zip(variants(), found, strict=True):
        alone = cspm.simulate(**given)
        np.testing.assert_array_equal(run.signal("tension").values, alone.signal("tension").values)
        assert {**run.summary, "real_time_factor": 0} == {**alone.summary, "real_time_factor": 0}


@pytest.mark.compiled
def test_a_run_keeps_what_is_asked_for(tmp_path):
    (none,) = cspm.simulate_many([SHORT], signals=())
    (some,) = cspm.simulate_many([SHORT], signals=[TENSION])
    assert none.summary["tension"] == some.summary["tension"]
    assert none.summary["messages"] == {}
    assert list(some.summary["messages"]) == [TENSION]
    assert some.tension.shape[1] == 8
    with pytest.raises(
        cspm.InputError, match="keeps but some signals, allowed: one that keeps all"
    ):
        some.save(tmp_path / "some")
    assert not (tmp_path / "some").exists()


@pytest.mark.compiled
def test_variants_are_taken_as_they_are_needed():
    taken = []

    def endless():
        for seed in range(1, 10_000):
            taken.append(seed)
            yield SHORT | {"duration": 0.01, "seed": seed}

    runs = cspm.simulate_many(endless(), signals=(), workers=2)
    assert [next(runs).summary["seed"] for _ in range(3)] == [1, 2, 3]
    runs.close()
    assert len(taken) < 12


@pytest.mark.compiled
def test_what_goes_wrong_with_a_run_is_raised_where_it_is_taken():
    wild = {"scenario": "rest", "duration": 0.3, "controllers": {"force_controller": Still()}}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        list(cspm.simulate_many([SHORT, wild], signals=()))
    alone = [str(w.message) for w in caught]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        cspm.simulate(**wild)
    assert alone == [str(w.message) for w in caught]


@pytest.mark.parametrize(
    ("given", "options", "words"),
    [
        ([SHORT, {"duration": 1.0}], {}, "variant 1: scenario: missing, allowed: scenario, and of"),
        (
            [SHORT | {"gain": 2}],
            {},
            "variant 0: gain: no setting, allowed: scenario, and of testbed",
        ),
        ([SHORT | {"seed": -1}], {}, "variant 0: .*seed.*allowed"),
        ([SHORT | {"plant": "external"}], {}, "variant 0: plant external: allowed: sim, mujoco"),
        ([SHORT], {"signals": ["/walk"]}, "variant 0: signals: /walk, allowed: /clock"),
        ([SHORT], {"workers": -1}, "workers: -1, allowed: 1 or more"),
    ],
)
def test_bad_input_is_one_line(given, options, words):
    with pytest.raises(cspm.InputError, match=words) as caught:
        list(cspm.simulate_many(given, **options))
    assert "\n" not in str(caught.value)
