"""Runs in compiled code are those of the staged loop, bit for bit."""

import numpy as np
import pytest
from loop_pairs import assert_same, with_stages
from loops import WILD
from run_samples import SCENARIOS, bundle_of

from bench.results.tracking import Case
from cspm_control.phases.make import stage_phase
from cspm_model.phase import DONE, LEAVE, Slots
from cspm_msgs_py.diagnostics import Level
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import EffectEntry
from cspm_run.assembly import assemble
from cspm_run.library import find_scenario
from cspm_run.recorded_run import parts_of

NAMES = sorted(p.stem for p in SCENARIOS.rglob("*.yaml") if "testbed:" in p.read_text())
STEPS = 260
# Of the scenarios' duration, short enough for a governor's plan to take no time.
SHORT = "duration=0.5"


@pytest.mark.compiled
@pytest.mark.parametrize("name", NAMES)
def test_every_scenario_is_the_same_bit_for_bit(name):
    events = load_scenario(find_scenario(name)).events
    sooner = f"events={[{'at': 0.1, 'cut': event.cut} for event in events]}"
    assert_same(bundle_of(name, SHORT, sooner, "operation=[]"), STEPS)


SINES = "[{amplitude: 0.05, frequency: 3, phase: 0.4}, {amplitude: 0.02, frequency: 11}]"
TORQUES = f"{{mode: torque, torque: {{sway_3: {{offset: -0.2, sines: {SINES}}}}}}}"
PATH = "{points: [[0, 0], [0.06, 0.3], [0.1, 0.3], [0.17, 0]], cycles: 2}"
ANGLES = f"{{mode: angle, bandwidth: 60, angle: {{hoist_1: {PATH}, sway_3: {PATH}}}}}"
COMPUTED = "control.motion={law: computed_wrench, mass_adaptation: {}}"
VARIANTS = {
    "internals": ("worst_case", "control.record_internals=true", "control.motion.gains=null"),
    "computed internals": ("worst_case", COMPUTED, "control.record_internals=true"),
    "pd_plus": ("worst_case", "control.motion={law: pd_plus}", "control.record_internals=true"),
    "lqr": ("worst_case", "control.motion={law: lqr}"),
    "lqr and a lost cable": (
        "worst_case",
        "control.motion={law: lqr}",
        "control.tension_distribution.lost_cable={}",
        "events=[{at: 0.1, cut: sway_3}]",
    ),
    "qp": ("worst_case", "control.tension_distribution={method: qp}"),
    "prescribed": (
        "worst_case",
        "control.tension_distribution={method: prescribed, null_space: [9, 0, 0]}",
    ),
    "removal": ("worst_case", "control.tension_distribution={method: removal}"),
    "slew": ("worst_case", "safety.torque_slew=1.0"),
    "dither": ("worst_case", "control.force.dither={amplitude: 0.02, frequency: 37}"),
    "dither and slew": (
        "worst_case",
        "control.force.dither={amplitude: {sway_3: 0.05}, frequency: 120}",
        "safety.torque_slew=5.0",
    ),
    "torques": ("rest", f"control={TORQUES}"),
    "torques and a cut cable": (
        "rest",
        f"control={TORQUES}",
        "events=[{at: 0.1, cut: sway_3}]",
    ),
    "angles": ("rest", f"control={ANGLES}"),
    "angles and trips": ("rest", f"control={ANGLES}", "safety.tension_trip=9.5"),
    "winch feedforward": ("worst_case", "control.force.winch_feedforward={}"),
    "stretched winch feedforward": (
        "worst_case",
        "control.force.winch_feedforward={stretch_bandwidth: 200}",
        "control.record_internals=true",
    ),
    "load cell bias": ("worst_case", "control.force.load_cell_bias={}"),
    "all ahead and trips": (
        "worst_case",
        "control.force.winch_feedforward={stretch_bandwidth: 50}",
        "control.force.load_cell_bias={}",
        "control.force.dither={amplitude: 0.02, frequency: 37}",
        "safety.tension_trip=8.5",
    ),
    "trips": ("worst_case", "safety.tension_trip=8.5"),
    "trips and brakes": ("worst_case", "safety={tension_trip: 8.5, state: brake}"),
    "other rates": ("worst_case", "rates.motion_capture=200", "rates.winches=500"),
}


@pytest.mark.compiled
@pytest.mark.parametrize("name", VARIANTS)
def test_every_setting_is_the_same_bit_for_bit(name):
    scenario, *settings = VARIANTS[name]
    assert_same(bundle_of(scenario, SHORT, *settings), STEPS)


@pytest.mark.compiled
@pytest.mark.parametrize(("name", "most"), [("trips", "8.5 N"), ("angles and trips", "9.5 N")])
def test_it_trips_in_compiled_steps(name, most):
    """The variants above do trip, and do so after the staged steps."""
    run = assert_same(bundle_of(*VARIANTS[name]), STEPS)
    alarms = [s for s in run.statuses if s.level == Level.ERROR]
    assert alarms
    assert f"allowed: at most {most}" in alarms[0].message


@pytest.mark.compiled
def test_a_run_that_diverges_ends_at_the_same_step_with_the_same_words():
    run = assert_same(bundle_of("rest", *WILD), 20_000)
    assert "infeasible since" in run.failure


@pytest.mark.compiled
@pytest.mark.parametrize(
    "effect",
    [
        ("tension_bias", ("sway_3",), {"bias": 0.4}),
        ("tension_drift", ("sway_3",), {"rate": 0.8}),
        ("tension_crosstalk", (), {"share": 0.05}),
        ("tension_lag", ("load_cells",), {"time_constant": 0.004}),
        ("pose_delay", ("bar",), {"delay": 0.0123}),
        ("winch_torque_lag", (), {"time_constant": 0.01}),
        ("winch_backlash", (), {"width": 0.01}),
    ],
    ids=lambda each: each[0],
)
def test_every_kind_of_effect_is_the_same_bit_for_bit(effect):
    name, elements, parameters = effect
    found, entry = (
        bundle_of("worst_case", SHORT),
        EffectEntry(effect=name, elements=elements, parameters=parameters),
    )
    changed = found.testbed.testbed.model_copy(update={"effects": (entry,)})
    assert_same(found, STEPS, lambda parts: assemble(parts.scenario, changed, SCENARIOS))


@pytest.mark.compiled
@pytest.mark.parametrize(
    "name",
    [
        "dither",
        "dither and slew",
        "torques",
        "angles",
        "slew",
        "stretched winch feedforward",
        "load cell bias",
    ],
)
def test_torques_are_computed_in_compiled_code(name):
    """Each of these settings has its phase: none of them is left to Python."""
    scenario, *settings = VARIANTS[name]
    bundle = bundle_of(scenario, SHORT, *settings)
    parts = assemble(bundle.scenario, bundle.testbed.testbed, SCENARIOS)
    (stage,) = (each for each in parts.stages if each.node == "force_controller")
    slots = Slots()
    topics = bundle.testbed.testbed.topics
    slots.add({name: topics[name].width for name in parts.schedule.topics})
    assert stage_phase(stage, slots, parts.schedule.period_ns) is not None


@pytest.mark.compiled
@pytest.mark.parametrize("more", [(), ("control.force.winch_feedforward={}",)])
def test_friction_fed_forward_is_the_same_bit_for_bit(more):
    """Its amount is that of the machine that the controllers believe in."""
    friction = (
        ("winch_coulomb_friction", (), {"torque": 0.01}),
        ("winch_load_friction", (), {"coefficient": 0.05}),
    )
    settings = SHORT, "control.force.friction_feedforward={}", *more
    bundle = Case("worst_case", settings, friction).bundle()
    run = assert_same(bundle, STEPS)
    assert not run.failure
    parts = parts_of(bundle)
    (stage,) = (each for each in parts.stages if each.node == "force_controller")
    assert stage.friction is not None


@pytest.mark.compiled
@pytest.mark.parametrize("topic", ["/bar/reference", "/winch_frame/reference"])
def test_a_reference_that_is_no_number_is_left_to_python(topic):
    bundle = bundle_of("worst_case", SHORT, "control.force.winch_feedforward={}")
    parts, topics = parts_of(bundle), bundle.testbed.testbed.topics
    (stage,) = (each for each in parts.stages if each.node == "force_controller")
    slots = Slots()
    slots.add({name: topics[name].width for name in parts.schedule.topics})
    phase = stage_phase(stage, slots, parts.schedule.period_ns)
    row = np.zeros(slots.width)
    for name in ("/bar/reference", "/winch_frame/reference"):
        row[slots[name]][6] = 1.0
    row[slots["/bar/reference"]][2] = 2.0
    assert phase.kernel(0, row, phase.places) == DONE
    row[slots[topic]][4] = np.nan
    assert phase.kernel(0, row, phase.places) == LEAVE


class Python:
    """A stage that is nobody's compiled phase."""

    def __init__(self, stage):
        self.node, self.status, self._stage = stage.node, stage.status, stage

    def step(self, now_ns, inputs, send):
        self._stage.step(now_ns, inputs, send)


@pytest.mark.compiled
@pytest.mark.parametrize("node", ["wave_trajectory", "motion_controller", "force_controller"])
def test_one_stage_in_python_gives_the_same_run(node):
    change = with_stages(lambda stage: Python(stage) if stage.node == node else stage)
    assert_same(bundle_of("worst_case", SHORT), STEPS, change)


@pytest.mark.compiled
def test_what_python_reads_is_its_own():
    """A stage may keep a row that it was given: later steps do not change it."""
    kept = []

    class Keeps(Python):
        def step(self, now_ns, inputs, send):
            row = inputs["/cables/tension"]
            kept.append((row, row.copy()))
            super().step(now_ns, inputs, send)

    change = with_stages(lambda stage: Keeps(stage) if stage.node == "force_controller" else stage)
    assert_same(bundle_of("worst_case", SHORT), 150, change)
    for row, copy in kept:
        np.testing.assert_array_equal(row, copy)
