"""Identified winches in MuJoCo: what it reads, and how its joints move with it."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from cspm_model.scene.mujoco_joints import mujoco_joints
from cspm_msgs_py.testbed import EffectEntry, load_testbed

TESTBEDS = Path(__file__).parents[3] / "scenarios" / "testbeds"
MODEL = """
<mujoco>
  <option timestep="1e-4" integrator="implicitfast"/>
  <include file="joints.xml"/>
  <worldbody><body>
    <joint name="j" class="{name}" axis="0 0 1"/>
    <geom type="sphere" size="0.01" mass="1e-6" contype="0" conaffinity="0"/>
  </body></worldbody>
  <actuator><motor class="{name}" joint="j"/></actuator>
</mujoco>"""


def model_of(testbed, name):
    files = {"joints.xml": mujoco_joints(testbed).encode()}
    return mujoco.MjModel.from_xml_string(MODEL.format(name=name), files)


def test_mujoco_reads_what_was_identified_at_the_shaft():
    testbed = load_testbed(TESTBEDS / "emps.yaml").testbed
    model = model_of(testbed, "carriage")
    assert model.dof_armature[0] == pytest.approx(9.51089e-3)
    assert model.dof_damping[0] == pytest.approx(2.035034e-2)
    assert model.dof_frictionloss[0] == pytest.approx(0.203935)
    assert model.actuator_ctrlrange[0] == pytest.approx([-3.515065, 3.515065])


def test_numbers_of_a_geared_motor_are_those_behind_its_gear():
    plain = load_testbed(TESTBEDS / "thesis.yaml").testbed
    viscous = EffectEntry(effect="winch_viscous_friction", parameters={"coefficient": 1e-5})
    dry = EffectEntry(
        effect="winch_coulomb_friction", elements=("hoist_2",), parameters={"torque": 0.01}
    )
    testbed = plain.model_copy(update={"effects": (viscous, dry, dry)})
    ours, other = model_of(testbed, "hoist_2"), model_of(testbed, "sway_1")
    gear = testbed.cables[1].gear_ratio
    assert gear > 1.0
    assert ours.dof_armature[0] == pytest.approx(gear**2 * testbed.cables[1].rotor_inertia)
    assert ours.dof_damping[0] == pytest.approx(gear**2 * 1e-5)
    assert ours.dof_frictionloss[0] == pytest.approx(gear * 0.02)
    assert ours.actuator_gear[0, 0] == gear
    assert other.dof_frictionloss[0] == 0.0


def test_a_joint_slows_down_as_the_equation_says():
    """J·q̈ = −b·q̇ − c until it stands: q̇(t) = (q̇₀ + c/b)·exp(−b·t/J) − c/b."""
    model = model_of(load_testbed(TESTBEDS / "emps.yaml").testbed, "carriage")
    data = mujoco.MjData(model)
    data.qvel[0] = 20.0
    for _ in range(2000):
        mujoco.mj_step(model, data)
    inertia, damping, dry = 9.51089e-3, 2.035034e-2, 0.203935
    level = dry / damping
    expected = (20.0 + level) * np.exp(-damping * data.time / inertia) - level
    assert data.qvel[0] == pytest.approx(expected, rel=2e-3)


def test_what_a_joint_cannot_have_is_named():
    testbed = load_testbed(TESTBEDS / "one_winch.yaml").testbed
    load = EffectEntry(effect="winch_load_friction", parameters={"coefficient": 0.05})
    cable = EffectEntry(effect="cable_sag", parameters={"linear_density": 1e-3})
    text = mujoco_joints(testbed.model_copy(update={"effects": (load, load, cable)}))
    assert text.count("winch_load_friction: left out") == 1
    assert "cable_sag" not in text
