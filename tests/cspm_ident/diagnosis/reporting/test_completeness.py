"""How much of what was missing is explained."""

from dataclasses import replace

import pytest
from diagnosis_samples import diagnosis

from cspm_ident.diagnosis.reporting.completeness import (
    completeness_sentence,
    explained_share,
    left_entries,
)
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data


def with_levels(before, after, noise=1.0):
    """The sample's diagnosis with such levels of its one residual."""
    found = diagnosis()
    fits = tuple(replace(f, before=before, after=after, noise=noise) for f in found.fit)
    return replace(found, fit=fits)


@pytest.mark.parametrize(
    ("before", "after", "share"), [(10.0, 1.0, 1.0), (10.0, 10.0, 0.0), (3.0, 2.0, 5.0 / 8.0)]
)
def test_the_share_is_of_squares_beyond_the_noise(before, after, share):
    assert explained_share(with_levels(before, after)) == pytest.approx(share)
    assert explained_share(with_levels(7.0 * before, 7.0 * after, 7.0)) == pytest.approx(share)


def test_nothing_is_explained_where_nothing_was_missing_and_less_where_a_finding_harms():
    assert explained_share(with_levels(1.0, 1.0)) is None
    assert explained_share(with_levels(2.0, 3.0)) < 0.0
    assert completeness_sentence(with_levels(2.0, 3.0)) == ""


def test_the_sentence_names_the_share_and_the_rest():
    said = completeness_sentence(with_levels(10.0, 3.0))
    assert said.startswith(
        "It explains 92 % of what was missing on held-out data; 8 % is unmodelled"
    )
    assert completeness_sentence(with_levels(10.0, 1.0)).startswith("It explains 100.0 % of")


def test_the_file_has_both():
    found = with_levels(10.0, 3.0)
    data = diagnosis_data(found)
    assert data["explained"] == pytest.approx(91.0 / 99.0)
    assert data["left"] == left_entries(found)
    assert len(data["left"]) == len(found.beyond_noise)
