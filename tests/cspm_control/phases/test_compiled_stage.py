"""A stage that compiled code steps sends, and says, what its Python does."""

import numpy as np
import pytest
from loop_pairs import MadeRun, Staged, assert_same_messages, with_stages
from run_samples import bundle_of

from cspm_control.phases.compiled_stage import CompiledStage, compiled_stage
from cspm_control.stages.make import make_controller
from cspm_msgs_py.diagnostics import Level
from cspm_msgs_py.schedule import schedule_of
from cspm_run.stage_warm_up import rest_rows

pytestmark = pytest.mark.compiled

STEPS = 260
SHORT = "duration=0.5"
NODES = ("motion_controller", "tension_distribution", "force_controller")
PATH = "{points: [[0, 0], [0.06, 0.3], [0.1, 0.3], [0.17, 0]], cycles: 2}"
RUNS = {
    "worst_case": ("worst_case",),
    "slow sensors": ("calm_4m",),
    "internals": ("worst_case", "control.record_internals=true"),
    "computed wrench": ("worst_case", "control.motion={law: computed_wrench, mass_adaptation: {}}"),
    "lost cable": (
        "worst_case",
        "control.motion={law: lqr}",
        "control.tension_distribution.lost_cable={}",
        "events=[{at: 0.1, cut: sway_3}]",
    ),
    "qp": ("worst_case", "control.tension_distribution={method: qp}"),
    "dither": ("worst_case", "control.force.dither={amplitude: 0.02, frequency: 37}"),
    "feedforward": ("worst_case", "control.force.winch_feedforward={}"),
    "angles": ("rest", f"control={{mode: angle, bandwidth: 60, angle: {{hoist_1: {PATH}}}}}"),
}


def compiled(bundle):
    """Return what makes the compiled form of each of a run's stages."""
    topics = bundle.testbed.testbed.topics
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)

    def make(stage):
        return compiled_stage(stage, schedule.nodes[stage.node], topics, schedule.period_ns)

    return make


@pytest.mark.parametrize("run", RUNS.values(), ids=RUNS)
def test_runs_are_the_same_bit_for_bit(run):
    bundle = bundle_of(*run, SHORT)
    change = with_stages(compiled(bundle))
    one, other = (MadeRun(bundle, STEPS, Staged, *more) for more in ((), (change,)))
    assert_same_messages(one, other)


class Bench:
    """A stage that hangs at rest, its compiled form, and how often Python stepped it."""

    def __init__(self, node, *overrides):
        bundle = bundle_of("worst_case", *overrides)
        stage = make_controller(node, bundle.scenario, bundle.testbed.testbed)
        self.inner, step = stage, stage.step
        self.by_python, self.at, self.sent = 0, 0, {}
        self.rows = rest_rows(node, bundle)
        self.stage = compiled(bundle)(stage)

        def counted(*arguments):
            self.by_python += 1
            step(*arguments)

        stage.step = counted

    def step(self, **changed):
        """Make a step; return whether compiled code made it."""
        before, self.sent = self.by_python, {}
        rows = {name: row for name, row in (self.rows | changed).items() if row is not None}
        self.stage.step(self.at, rows, lambda topic, row: self.sent.update({topic: row.copy()}))
        self.at += 1_000_000
        return self.by_python == before

    def stepped_by_python(self, steps):
        """Return the stage itself after so many steps."""
        for i in range(steps):
            self.inner.step(i * 1_000_000, self.rows, lambda topic, row: None)
        return self.inner


@pytest.mark.parametrize("node", NODES)
def test_python_makes_the_first_step_and_compiled_code_all_others(node):
    bench = Bench(node)
    assert isinstance(bench.stage, CompiledStage)
    assert bench.stage.node == node
    assert [bench.step() for _ in range(4)] == [False, True, True, True]
    assert bench.sent
    assert bench.stage.status() == Bench(node).stepped_by_python(4).status()


OPTIONAL = {"tension_distribution": "/winch_frame/pose", "force_controller": "/winches/state"}


@pytest.mark.parametrize("node", OPTIONAL)
def test_without_an_input_python_decides(node):
    bench = Bench(node)
    bench.step()
    missing = OPTIONAL[node]
    assert not bench.step(**{missing: None})
    assert bench.step()


def test_the_safe_state_is_pythons_and_compiled_code_goes_on_after_a_reset():
    bench = Bench("force_controller")
    bench.step()
    assert bench.step()
    healthy = bench.sent["/winches/torque_command"]
    bench.inner.trip(bench.at, "a test")
    assert not bench.step()
    assert not bench.step()
    assert bench.stage.status().level == Level.ERROR
    assert not np.array_equal(bench.sent["/winches/torque_command"], healthy)
    assert bench.inner.reset(bench.at) is None
    # The first step after the reset begins the controllers anew.
    assert [bench.step() for _ in range(2)] == [False, True]
    np.testing.assert_array_equal(bench.sent["/winches/torque_command"], healthy)


def test_what_compiled_code_cannot_judge_trips_by_python():
    bench = Bench("force_controller")
    bench.step()
    bad = bench.rows["/cables/tension"].copy()
    bad[3] = np.nan
    assert not bench.step(**{"/cables/tension": bad})
    assert bench.inner.safe


def test_a_stage_without_compiled_form_is_stepped_as_it_is():
    bench = Bench("tension_distribution", "control.tension_distribution={method: qp}")
    assert bench.stage is bench.inner
