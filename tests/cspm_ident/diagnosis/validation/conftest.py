"""Recordings that several tests of the validation read."""

import pytest
from crept_cables import CREEP
from measured_samples import measured_with


@pytest.fixture(scope="session")
def crept(tmp_path_factory):
    """Sixteen seconds of the calm sea with a cable that creeps; the file knows nothing of it."""
    folder = tmp_path_factory.mktemp("judgement") / "bag"
    return measured_with(CREEP, folder, "calm_broadband", "duration=16")
