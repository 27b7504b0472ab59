"""Rows are kept whatever ends the program, and only of one campaign."""

import json

import pytest
from pyarrow import parquet

from cspm.campaign.campaign_folder import JOURNAL, TABLE, CampaignFolder, columns_of
from cspm_msgs_py.errors import InputError

ABOUT = {"schema": "x/1", "inputs_sha256": "a", "code": "1"}


def test_rows_are_in_the_table_in_their_order(tmp_path):
    with CampaignFolder(tmp_path / "c", ABOUT) as folder:
        folder.keep(2, {"seed": 2, "failure": None, "gain": 1})
        folder.keep(0, {"seed": 0, "failure": None, "gain": 0.5})
    table = parquet.read_table(tmp_path / "c" / TABLE).to_pydict()
    assert table == {"run": [0, 2], "seed": [0, 2], "failure": [None, None], "gain": [0.5, 1.0]}


def test_what_was_kept_is_there_again(tmp_path):
    with CampaignFolder(tmp_path / "c", ABOUT) as folder:
        folder.keep(3, {"seed": 7})
    with CampaignFolder(tmp_path / "c", ABOUT) as folder:
        assert folder.rows == {3: {"run": 3, "seed": 7}}


def test_a_row_is_on_disk_before_the_next_begins(tmp_path):
    with CampaignFolder(tmp_path / "c", ABOUT) as folder:
        folder.keep(3, {"seed": 7})
        assert json.loads((tmp_path / "c" / JOURNAL).read_text()) == {"run": 3, "seed": 7}


def test_a_line_that_was_cut_is_left_out_and_the_next_begins_a_line(tmp_path):
    with CampaignFolder(tmp_path / "c", ABOUT) as folder:
        folder.keep(0, {"seed": 7})
    journal = tmp_path / "c" / JOURNAL
    with journal.open("a") as file:
        file.write('{"run": 1, "se')
    with CampaignFolder(tmp_path / "c", ABOUT) as folder:
        assert [*folder.rows] == [0]
        folder.keep(1, {"seed": 8})
    assert [json.loads(line)["seed"] for line in journal.read_text().splitlines()] == [7, 8]


def test_two_programs_cannot_hold_a_folder(tmp_path):
    with (
        CampaignFolder(tmp_path / "c", ABOUT),
        pytest.raises(InputError, match=r"another campaign is writing to it, allowed: another"),
    ):
        CampaignFolder(tmp_path / "c", ABOUT)
    with CampaignFolder(tmp_path / "c", ABOUT):
        pass


@pytest.mark.parametrize("key", ["inputs_sha256", "code"])
def test_another_campaign_is_refused(tmp_path, key):
    with CampaignFolder(tmp_path / "c", ABOUT):
        pass
    with pytest.raises(InputError, match=f"begun with another {key.replace('_', ' ')}"):
        CampaignFolder(tmp_path / "c", ABOUT | {key: "b"})


def test_a_folder_with_other_things_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds notes\.txt, allowed: a new or empty folder"):
        CampaignFolder(tmp_path, ABOUT)


def test_what_is_of_several_kinds_becomes_text():
    rows = [{"a": 1, "b": "x", "c": {"d": 1}}, {"a": 2.5, "b": 3.0}]
    assert columns_of(rows) == {"a": [1.0, 2.5], "b": ["x", "3.0"], "c": ['{"d": 1}', None]}
