"""The machine of the thesis with other cables or another bar."""

from pathlib import Path

from cspm_msgs_py.testbed import Testbed, load_testbed

TESTBEDS = Path(__file__).resolve().parents[2] / "scenarios" / "testbeds"
THESIS = load_testbed(TESTBEDS / "thesis.yaml").testbed.model_copy(update={"effects": ()})
CENTRE = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)


def with_cables(testbed: Testbed, **changes) -> Testbed:
    cables = tuple(cable.model_copy(update=changes) for cable in testbed.cables)
    return testbed.model_copy(update={"cables": cables})


def with_bar(testbed: Testbed, **changes) -> Testbed:
    return testbed.model_copy(update={"bar": testbed.bar.model_copy(update=changes)})
