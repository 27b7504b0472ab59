"""Which recordings judge: those after `--held-out`, one each, and none by its place alone."""

import pytest
from error_lines import said

from cspm.cli.held_out import JudgedCommand, refuse_searched_after_held_out
from cspm_msgs_py.errors import InputError

JUDGED = [
    ("diagnose",),
    *(("identify", name) for name in ("geometry", "lengths", "system", "winch")),
]


def test_all_commands_with_the_option_look_at_the_order(commands):
    found = {k for k, v in commands.items() if any(p.name == "held_out" for p in v.params)}
    assert found == set(JUDGED)
    assert {k for k, v in commands.items() if isinstance(v, JudgedCommand)} == found


@pytest.mark.parametrize("words", JUDGED)
def test_a_recording_after_one_that_is_held_out_is_refused(refused, words):
    line = refused(*words, "one", "--held-out", "two", "three", "my four")
    assert line == (
        "three, my four: after --held-out two, allowed: --held-out three --held-out 'my four' to"
        " judge only, or before the first --held-out to be searched"
    )


@pytest.mark.parametrize("words", JUDGED)
def test_roles_are_printed_before_anything_is_read(cspm, words):
    role = "searched" if words == ("diagnose",) else "fitted"
    code, out, err = cspm(*words, "one", "two", "--held-out", "three", "--held-out", "four")
    assert (code, err.count("\n")) == (2, 1)
    assert out == f"{role}: one\n{role}: two\nheld out: three\nheld out: four\n"
    assert cspm(*words, "one", "--held-out", "two", "--quiet")[1] == ""


def test_a_diagnosis_without_held_out_recordings_says_what_judges(cspm):
    code, out, err = cspm("diagnose", "one", "two")
    assert (code, said(err)) == (2, "one: no such file or folder\n")
    role = "searched, its last three tenths held out"
    assert out == f"{role}: one\n{role}: two\n"


def test_help_is_printed_whatever_the_order(cspm):
    code, out, err = cspm("diagnose", "--held-out", "two", "three", "--help")
    assert (code, err) == (0, "")
    assert "Usage" in out


@pytest.mark.parametrize(
    ("typed", "after"),
    [
        ("one two --held-out three", ""),
        ("one --held-out=two --held-out three", ""),
        ("--testbed file one --held-out two --out folder --json -", ""),
        ("one --held-out two --no-closed-loop -q --out=folder", ""),
        ("one --out --held-out two", ""),
        ("-- one --held-out two", ""),
        ("--held-out two one", "one"),
        ("--held-out=two one", "one"),
        ("one --held-out two -- three", "three"),
        ("one --held-out two --out folder three", "three"),
        ("one --held-out two -q three", "three"),
        ("one --held-out two --closed-loop three", "three"),
        ("one --held-out two --held-out three four", "four"),
        ("one --held-out two three --held-out four", "three"),
    ],
)
def test_values_of_options_are_no_recordings(commands, typed, after):
    parameters, words = commands[("diagnose",)].params, typed.split()
    if not after:
        refuse_searched_after_held_out(parameters, words)
        return
    with pytest.raises(InputError, match=rf"^{after}: after --held-out \w+, allowed: "):
        refuse_searched_after_held_out(parameters, words)
