"""What `cspm identify geometry` prints."""

import io

import numpy as np
import pytest
from geometry_samples import measured
from rich.console import Console

from cspm.commands.identify_geometry_command import print_geometry
from cspm_ident.geometry.identify_geometry import identify_geometry


@pytest.fixture(scope="module")
def printed():
    """Of one exit that is 9 mm off, and one drum that is 4 % larger."""
    truth, scales = np.zeros((8, 6)), np.where(np.arange(8) == 5, 1.04, 1.0)
    truth[1, 0] = 9e-3
    result = identify_geometry([measured(truth, noise=1e-4, scales=scales)])
    console = Console(file=io.StringIO(), width=160)
    print_geometry(console, result)
    return result, console.file.getvalue()


def test_what_is_beyond_its_accuracy_is_said_in_words(printed):
    _, text = printed
    assert "• c1: exit x " in text
    assert " mm off, beyond its accuracy of 1 mm" in text
    assert "• c5: drum radius " in text
    assert "accuracy of 0.3 %: another drum radius, gear ratio or number of counts per turn" in text
    assert text.count("• ") == 2


def test_combinations_lateness_and_errors_are_listed(printed):
    result, text = printed
    for each in result.undetermined:
        assert each.name in text
    assert "poses are stamped late by" in text
    assert "synthetic_3" in text
