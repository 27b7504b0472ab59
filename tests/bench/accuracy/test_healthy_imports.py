"""The count of false suspicions, on one short recording."""

from rich.console import Console

from bench.accuracy import healthy_imports


def test_a_healthy_file_is_exported_and_what_is_wrong_with_it_is_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(healthy_imports, "DURATION", 5.0)
    console = Console(quiet=True)
    place = tmp_path / "one_winch_3"
    assert healthy_imports.suspected(place, "one_winch", 3, console) == []
    lines = (place / "lab.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("time [s],winches_state position/surge [deg],")
    wrong = [lines[0], *(f"{t},-{rest}" for t, _, rest in (x.partition(",") for x in lines[1:]))]
    text = "\n".join(wrong).replace(",--", ",")
    (place / "lab.csv").write_text(text + "\n", encoding="utf-8")
    found = healthy_imports.suspected(place, "one_winch", 3, console)
    assert any("velocity" in each for each in found)
