import pytest
from machines import THESIS, rig_content

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.provenance import unwrap_provenance
from cspm_msgs_py.testbed import load_testbed, parse_testbed
from cspm_msgs_py.yaml_file import dump_yaml

SHA = "0123456789abcdef" * 4


def test_values_are_separated_from_where_they_come_from():
    content = {
        "a": {"value": 1.5, "provenance": "thesis"},
        "b": [{"c": {"value": [1, 2], "provenance": "fitted", "recording": SHA, "note": "n"}}],
        "d": {"value": 3},
        "e": {"provenance": "thesis"},
        "f": "plain",
    }
    plain, found = unwrap_provenance(content, "t.yaml")
    assert plain == {
        "a": 1.5,
        "b": [{"c": [1, 2]}],
        "d": {"value": 3},
        "e": {"provenance": "thesis"},
        "f": "plain",
    }
    assert list(found) == ["a", "b[0].c"]
    assert found["a"].provenance == "thesis"
    assert found["a"].recording is None
    assert found["b[0].c"].recording == SHA
    assert found["b[0].c"].note == "n"


@pytest.mark.parametrize(
    ("about", "fault"),
    [
        (
            {"provenance": "guess"},
            "provenance: 'guess', allowed: 'thesis', 'reconstructed', 'fitted', 'measured', 'data",
        ),
        ({"provenance": None}, "provenance: None, allowed: 'thesis',"),
        (
            {"provenance": "fitted"},
            "recording: missing, allowed: the SHA-256 of the fitted recording",
        ),
        (
            {"provenance": "fitted", "recording": "abc"},
            "recording: 'abc', allowed: text that matches ^[0-9a-f]{64}$",
        ),
        (
            {"provenance": "fitted", "recording": SHA.upper()},
            "recording: '0123456789ABCDEF0123456789ABCDEF0123456789ABCDEF0123456789…, allowed: tex",
        ),
        (
            {"provenance": "thesis", "nte": "n"},
            "nte: unknown key, allowed: provenance, recording, n",
        ),
        ({"provenance": "thesis", "note": 3}, "note: 3, allowed: text"),
    ],
)
def test_faults_name_file_key_value_and_what_is_allowed(about, fault):
    with pytest.raises(InputError) as caught:
        unwrap_provenance({"bar": {"mass": {"value": 4.0, **about}}}, "t.yaml")
    assert str(caught.value).startswith(f"t.yaml: bar.mass: {fault}")
    assert "\n" not in str(caught.value)


def test_the_value_inside_is_still_checked():
    content = rig_content()
    content["cables"][0]["drum_radius"] = {"value": -0.025, "provenance": "thesis"}
    with pytest.raises(InputError) as caught:
        parse_testbed(dump_yaml(content), "t.yaml")
    assert str(caught.value) == "t.yaml: cables[0].drum_radius: -0.025, allowed: greater than 0"


def test_a_wrapper_without_provenance_is_no_number():
    content = rig_content()
    content["cables"][0]["drum_radius"] = {"value": 0.025}
    with pytest.raises(InputError) as caught:
        parse_testbed(dump_yaml(content), "t.yaml")
    assert str(caught.value) == "t.yaml: cables[0].drum_radius: {'value': 0.025}, allowed: a number"


def test_every_number_of_the_thesis_machine_says_where_it_comes_from():
    file = load_testbed(THESIS)
    found = set(file.provenance)
    for i, cable in enumerate(file.testbed.cables):
        for key in cable.model_fields_set - {"name"}:
            path = f"cables[{i}].{key}"
            inner = {f"{path}.{k}" for k in ("a", "b", "c", "d", "youngs_modulus", "diameter")}
            if key == "stiffness":
                assert inner <= found
            elif key == "damping":
                assert {f"{path}.{k}" for k in ("constant", "slope", "factor")} <= found
            else:
                assert path in found
    assert {"bar.mass", "bar.dimensions", "bar.inertia.ixx", "bar.inertia.iyy"} <= found
    assert file.provenance["cables[0].damping.constant"].provenance == "thesis"
    assert file.provenance["cables[0].stiffness.a"].provenance == "reconstructed"
