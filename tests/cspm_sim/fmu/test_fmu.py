"""A plant as a unit of FMI 2, and a unit that somebody else made as the plant of a run."""

import re
import sys

import numpy as np
import pytest

import cspm
from cspm.commands.exchange.fmu_command import fmu_command
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.reader import Recording
from cspm_run.library import find_scenario
from cspm_sim.fmu.unit_file import UnitFile, Variable

NEEDS = "needs the extra: pip install 'cspm[fmu]'"
DURATION = 0.2
# A carriage without friction, in m and N, whose motion under a held force is exact.
CARRIAGE = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Carriage(Fmi2Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.force, self.x, self.v, self.rope, self.mass = 0.0, 0.0, 0.0, 0.0, 1.0
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        self.register_variable(
            Real("mass", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
        )
        for name in ("x", "v", "rope"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        if current_time > 1.0:
            return False
        pull = self.force / self.mass
        self.x += step_size * (self.v + 0.5 * step_size * pull)
        self.v += step_size * pull
        return True
"""
NAMES = """
fmu: Carriage.fmu
variables:
  torque_command.carriage: {name: force, scale: 0.01}
  winch_angle.carriage: {name: x, scale: 100.0}
  tension.carriage: rope
parameters: {mass: 95.1089}
"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    pytest.importorskip("pythonfmu", reason=NEEDS)
    pytest.importorskip("fmpy", reason=NEEDS)
    place = tmp_path_factory.mktemp("exported") / "crane.fmu"
    fmu_command(find_scenario("calm"), place)
    return place


@pytest.fixture(scope="module")
def foreign(tmp_path_factory):
    builder = pytest.importorskip("pythonfmu", reason=NEEDS).FmuBuilder
    pytest.importorskip("fmpy", reason=NEEDS)
    folder = tmp_path_factory.mktemp("foreign")
    (folder / "carriage.py").write_text(CARRIAGE, encoding="utf-8")
    known = list(sys.path)
    builder.build_FMU(folder / "carriage.py", dest=folder)
    sys.path[:] = known
    (folder / "names.yaml").write_text(NAMES, encoding="utf-8")
    return folder / "names.yaml"


def test_a_run_on_the_exported_plant_is_that_on_the_plant(exported, tmp_path):
    ours = cspm.simulate("calm", duration=DURATION)
    theirs = cspm.simulate("calm", duration=DURATION, plant=str(exported))
    for name in ("bar_pose", "tension", "winch_angle", "winch_torque"):
        a, b = getattr(ours, name).values, getattr(theirs, name).values
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-9)
    assert np.ptp(theirs.tension.values) > 0.1
    theirs.save(tmp_path / "kept")
    with Recording(tmp_path / "kept") as recording:
        about = recording.metadata["cspm"]
    assert (about["plant"], about["fmu"]) == ("fmu", "crane.fmu")
    assert re.fullmatch("[0-9a-f]{64}", about["fmu_sha256"])


def test_a_winch_frame_that_moves_otherwise_is_refused(exported):
    with pytest.raises(InputError, match=r"its winch frame is .* allowed: the scenario that it"):
        cspm.simulate("worst_case", duration=10 * DURATION, plant=str(exported))


def test_a_foreign_unit_is_the_plant_under_names_of_its_own(foreign):
    bare = cspm.load_testbed("emps")
    for effect in ("winch_viscous_friction", "winch_coulomb_friction"):
        bare = bare.without_effect(effect)
    ours = cspm.simulate("emps", testbed=bare, duration=DURATION).truth
    theirs = cspm.simulate("emps", duration=DURATION, plant=str(foreign)).truth
    rubbing = cspm.simulate("emps", duration=DURATION).truth
    angles = theirs.winch_angle.values
    np.testing.assert_allclose(angles, ours.winch_angle.values, rtol=0.0, atol=1e-9)
    assert np.abs(angles - rubbing.winch_angle.values).max() > 1e-3


def test_a_unit_that_gives_up_ends_the_run_with_what_was_recorded(foreign):
    with pytest.warns(RuntimeWarning, match=r"Carriage\.fmu"):
        run = cspm.simulate("emps", duration=1.5, plant=str(foreign))
    assert run.failure.startswith("t = 1.001 s: Carriage.fmu: ")
    assert run.duration == pytest.approx(1.001, abs=2e-3)


@pytest.mark.parametrize(
    ("was", "becomes", "line"),
    [
        ("name: x,", "name: y,", "no variable y, it has: force, mass, rope, v, x"),
        ("mass: 95", "weight: 95", "no variable weight, it has: force, mass, rope, v, x"),
        ("Carriage.fmu", "none.fmu", "no such file, allowed: a unit of FMI 2, .fmu"),
        ("fmu: ", "unit: ", "fmu"),
    ],
)
def test_what_a_list_of_names_gets_wrong_is_said(foreign, was, becomes, line):
    wrong = foreign.with_name("wrong.yaml")
    wrong.write_text(NAMES.replace(was, becomes), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(line)):
        cspm.simulate("emps", duration=DURATION, plant=str(wrong))


def test_a_file_that_is_no_unit_is_said(tmp_path):
    pytest.importorskip("fmpy", reason=NEEDS)
    (tmp_path / "x.fmu").write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"x\.fmu: does not load \(.*\), allowed: a unit of FMI"):
        cspm.simulate("emps", duration=DURATION, plant=str(tmp_path / "x.fmu"))


def test_units_run_in_one_process_only(tmp_path):
    (tmp_path / "x.fmu").write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"x\.fmu in mode graph: allowed: mode inprocess"):
        cspm.simulate("emps", plant=str(tmp_path / "x.fmu"), mode="graph")


def test_without_the_extra_its_line_is_said(monkeypatch, tmp_path):
    (tmp_path / "x.fmu").write_bytes(b"nothing")
    monkeypatch.setitem(sys.modules, "fmpy", None)
    line = r"fmpy is not installed, allowed: after .*'cspm\[fmu\]'"
    with pytest.raises(InputError, match=line):
        cspm.simulate("emps", duration=DURATION, plant=str(tmp_path / "x.fmu"))
    monkeypatch.setitem(sys.modules, "pythonfmu", None)
    with pytest.raises(InputError, match=line.replace("fmpy", "pythonfmu")):
        fmu_command(find_scenario("calm"), tmp_path / "new.fmu")


def test_a_file_that_is_there_stays(exported):
    before = exported.read_bytes()
    with pytest.raises(InputError, match="already exists"):
        fmu_command(find_scenario("calm"), exported)
    with pytest.raises(InputError, match=r"allowed: a name that ends in \.fmu"):
        fmu_command(find_scenario("calm"), exported.with_suffix(".zip"))
    assert exported.read_bytes() == before


def test_names_that_a_list_leaves_out_are_the_plants():
    file = UnitFile(fmu="x.fmu", variables={"tension.a": "pull"})
    assert file.variable("tension.a") == Variable(name="pull", scale=1.0)
    assert file.variable("tension.b") == Variable(name="tension.b", scale=1.0)
