import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from cspm_control.waves.motion_file import motion_knots, read_motion
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError

HEADER = "t,x,y,z,roll,pitch,yaw\n"


def written(tmp_path, text):
    path = tmp_path / "motion.csv"
    path.write_text(text, encoding="utf-8")
    return path


def rows_or_line(path):
    try:
        return read_motion(path)
    except InputError as err:
        return str(err)


def recorded(times):
    """Return rows of a smooth motion at `times`, different in every coordinate."""
    columns = [0.1 * np.sin((1.0 + 0.2 * i) * times + i) for i in range(6)]
    return np.column_stack([times, *columns])


def as_text(rows):
    return HEADER + "".join(",".join(repr(float(v)) for v in row) + "\n" for row in rows)


def test_reads_what_was_written(tmp_path):
    rows = recorded(np.linspace(-0.5, 3.0, 40))
    assert (read_motion(written(tmp_path, as_text(rows))) == rows).all()


def test_spaces_byte_order_mark_and_blank_lines_do_not_matter(tmp_path):
    text = "\ufefft, x, y, z, roll, pitch, yaw\n0, 1,2,3,0,0,0\n\n1, 1,2,3,0,0,0\n\n"
    assert read_motion(written(tmp_path, text)).tolist() == [
        [0.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0],
        [1.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0],
    ]


def test_passes_through_the_rows_of_an_even_file():
    rows = recorded(np.round(np.arange(0.0, 5.0, 0.01), 2))
    knots, spacing = motion_knots(rows, None)
    assert len(knots) == len(rows)
    assert spacing == pytest.approx(0.01)
    assert knots[:, :6] == pytest.approx(rows[:, 1:], abs=1e-14)


@pytest.mark.parametrize("rate", [None, 200.0])
def test_follows_an_uneven_file_between_its_rows(rate):
    times = np.cumsum(np.random.default_rng(0).uniform(0.005, 0.02, 600)) - 0.3
    rows = recorded(times)
    knots, spacing = motion_knots(rows, rate)
    motion = Motion(knots, spacing)
    assert spacing <= (0.005 if rate else np.diff(times).min() * (1 + 1e-6))
    assert motion.duration == pytest.approx(times[-1])
    for time in np.linspace(0.1, times[-1] - 0.1, 57):
        expected = [0.1 * np.sin((1.0 + 0.2 * i) * time + i) for i in range(6)]
        rate_now = [0.1 * (1.0 + 0.2 * i) * np.cos((1.0 + 0.2 * i) * time + i) for i in range(6)]
        assert motion.at(time)[:6] == pytest.approx(expected, abs=1e-7)
        assert motion.at(time)[6:12] == pytest.approx(rate_now, abs=1e-4)


def test_is_the_cubic_spline_of_the_rows_with_continuous_acceleration():
    rows = recorded(np.linspace(0.0, 2.0, 21))
    knots, spacing = motion_knots(rows, 1000.0)
    motion, spline = Motion(knots, spacing), CubicSpline(rows[:, 0], rows[:, 1:])
    for time in np.linspace(0.01, 1.99, 41):
        assert motion.at(time)[:6] == pytest.approx(spline(time), abs=1e-9)
        assert motion.at(time)[12:] == pytest.approx(spline(time, 2), abs=2e-3)


def test_after_the_last_row_the_body_stands_still():
    rows = recorded(np.linspace(0.0, 2.0, 21))
    motion = Motion(*motion_knots(rows, None))
    assert motion.at(2.5)[:6] == pytest.approx(rows[-1, 1:])
    assert (motion.at(2.5)[6:] == 0.0).all()


GOOD = "0,0,0,0,0,0,0\n"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "an empty file, allowed: the header t,x,y,z,roll,pitch,yaw"),
        (GOOD, "line 1: header '0,0,0,0,0,0,0', allowed: t,x,y,z,roll,pitch,yaw"),
        ("t,x,y,z,yaw,pitch,roll\n", "line 1: header 't,x,y,z,yaw,pitch,roll', allowed: t,x"),
        (HEADER + "0,0,0\n", "line 2: 3 columns, allowed: 7"),
        (HEADER + GOOD + "1,0,0,none,0,0,0\n", "line 3: column z: 'none', allowed: a finite"),
        (HEADER + GOOD + "1,0,0,0,nan,0,0\n", "line 3: column roll: 'nan', allowed: a finite"),
        (HEADER + GOOD + "1,inf,0,0,0,0,0\n", "line 3: column x: 'inf', allowed: a finite"),
        (HEADER + GOOD + "\n0,0,0,0,0,0,0\n", "line 4: column t: 0 s, allowed: after 0 s"),
        (HEADER + GOOD + "1,0,0,0,0,-1.6,0\n", "line 3: column pitch: -1.6 rad, allowed: between"),
        (HEADER + GOOD + "1,0,0,0,1.6,0,0\n", "line 3: column roll: 1.6 rad, allowed: between"),
        (HEADER + "0,0,0,0,0,0,3.1\n1,0,0,0,0,0,-3.1\n", "line 3: column yaw: a step from 3.1 to"),
        (HEADER, "no rows, allowed: two rows or more"),
        (HEADER + GOOD, "1 rows from t = 0 to 0 s, allowed: two rows or more"),
        (HEADER + "1,0,0,0,0,0,0\n2,0,0,0,0,0,0\n", "2 rows from t = 1 to 2 s, allowed: two rows"),
        (HEADER + "-2,0,0,0,0,0,0\n0,0,0,0,0,0,0\n", "2 rows from t = -2 to 0 s, allowed: two"),
    ],
)
def test_faults_name_line_and_column(tmp_path, text, fault):
    path = written(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_motion(path)
    assert str(caught.value).startswith(f"{path}: {fault}")


def test_large_yaw_and_just_plausible_angles_are_taken(tmp_path):
    text = HEADER + "0,0,0,0,1.57,-1.57,3.1\n1,0,0,0,1.57,-1.57,6.2\n"
    assert read_motion(written(tmp_path, text))[1, 6] == 6.2


def test_a_missing_file_and_a_folder_and_bytes_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file, allowed: a CSV file"):
        read_motion(tmp_path / "absent.csv")
    with pytest.raises(InputError, match="not a readable CSV file"):
        read_motion(tmp_path)
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(InputError, match="not a readable CSV file"):
        read_motion(tmp_path / "bytes")


def test_a_step_too_short_for_the_whole_file_is_refused():
    rows = np.zeros((3, 7))
    rows[:, 0] = [0.0, 1e-6, 100.0]
    with pytest.raises(InputError, match="allowed: at most 2000000"):
        motion_knots(rows, None)
    assert len(motion_knots(rows, 10.0)[0]) == 1001


@settings(max_examples=150, deadline=None)
@given(text=st.text(alphabet='t,xyz 0123.-"e\n\x00π', max_size=60), header=st.booleans())
def test_any_text_is_read_or_refused_in_one_line(tmp_path_factory, text, header):
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_text(HEADER * header + text, encoding="utf-8")
    outcome = rows_or_line(path)
    if isinstance(outcome, str):
        assert "\n" not in outcome
    else:
        assert outcome.shape[1] == 7
