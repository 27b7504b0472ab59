"""The end of a line about a name that is not known."""

import pytest

from cspm_msgs_py.testbed_keys.near_name import allowed_names

NAMES = ("calm", "calm_4m", "worst_case")


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("clam", "; did you mean calm?"),
        ("worst_cas", "; did you mean worst_case?"),
        ("calm_4", "; did you mean calm_4m or calm?"),
        ("storm", ""),
        ("", ""),
    ],
)
def test_names_that_are_near_follow_those_that_are_allowed(given: str, meant: str) -> None:
    assert allowed_names(given, NAMES) == f"allowed: calm, calm_4m, worst_case{meant}"


def test_what_is_allowed_beside_names_is_no_name() -> None:
    assert allowed_names("a fil", ("calm",), "a file") == "allowed: calm or a file"
