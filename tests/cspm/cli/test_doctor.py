"""The command `cspm doctor`."""

import json


def test_it_lists_every_part_with_a_remedy_for_each_that_is_missing(cspm, tmp_path):
    code, out, err = cspm("doctor", "--json", "found.json")
    assert (code, err) == (0, "")
    found = json.loads((tmp_path / "found.json").read_text())
    names = [each["name"] for each in found["parts"]]
    assert names[:4] == ["python", "cspm", "numba", "ros"]
    assert {"extra campaign", "processors", "priorities", "browser"} <= set(names)
    for each in found["parts"]:
        assert each["there"] == (each["remedy"] == "")
        word = "there  " if each["there"] else "missing"
        assert f"{word}  {each['name']}: {each['found']}" in out
        assert f"remedy: {each['remedy']}" in out or each["there"]
    assert "dependencies" not in found


def test_it_lists_dependencies_with_licences_and_sizes(cspm, tmp_path):
    code, out, _ = cspm("doctor", "--dependencies", "--json", "found.json")
    assert code == 0
    found = json.loads((tmp_path / "found.json").read_text())["dependencies"]
    scipy = next(each for each in found if each["name"] == "scipy")
    assert (scipy["extra"], scipy["licence"]) == ("", "BSD-3-Clause")
    assert scipy["size"] > 10_000_000
    assert "all of these" in out
    assert f"{scipy['size'] / 1e6:.1f}" in out
