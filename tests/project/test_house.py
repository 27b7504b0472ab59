"""The picture of the packages: up to date, and right about who imports whom."""

import pytest


@pytest.fixture
def draw_house(monkeypatch, root):
    monkeypatch.syspath_prepend(str(root / "docs" / "scripts"))
    import draw_house

    return draw_house


@pytest.fixture
def root(request):
    return request.config.rootpath


def written(folder, files):
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


HOUSE = {
    "ground/__init__.py": '"""What all use."""',
    "ground/cellar/__init__.py": '"""Deep."""',
    "left/__init__.py": '"""One of two."""',
    "left/room.py": "def f():\n    from ground.cellar import x",
    "right/__init__.py": '"""The other."""\nimport numpy, ground',
    "roof/__init__.py": '"""On top."""',
    "roof/tile.py": "import left.room\nfrom right import y\nimport ground",
    "loose.py": "import roof",
}


def test_the_picture_is_up_to_date(draw_house, root):
    drawn = draw_house.svg(draw_house.read_packages(root))
    hint = "run: python docs/scripts/draw_house.py"
    assert draw_house.PICTURE.read_text(encoding="utf-8") == drawn, hint


def test_the_picture_shows_every_package_that_the_wheel_has(draw_house, root):
    packages = draw_house.read_packages(root)
    wanted = {path.parent.name for path in root.glob("cspm*/__init__.py")} | {"bench"}
    assert set(packages) == wanted
    assert all(package.about for package in packages.values())


def test_imports_anywhere_in_a_package_are_arrows_but_for_those_that_follow(draw_house, tmp_path):
    packages = draw_house.read_packages(written(tmp_path, HOUSE))
    assert packages["ground"].parts == ("cellar",)
    assert packages["roof"].imports == {"left", "right", "ground"}
    assert set(draw_house.arrows(packages)) == {
        ("left", "ground"),
        ("right", "ground"),
        ("roof", "left"),
        ("roof", "right"),
    }


def test_a_package_is_drawn_above_all_that_it_imports(draw_house, tmp_path):
    packages = draw_house.read_packages(written(tmp_path, HOUSE))
    assert draw_house.floors(packages) == {"ground": 0, "left": 1, "right": 1, "roof": 2}
    place = draw_house.boxes(packages)
    assert place["roof"].top < place["left"].top == place["right"].top < place["ground"].top
    assert place["left"].left + place["left"].width < place["right"].left


def test_a_circle_is_refused(draw_house, tmp_path):
    circle = {"a/__init__.py": "import b", "b/__init__.py": "import a", "c/__init__.py": ""}
    packages = draw_house.read_packages(written(tmp_path, circle))
    with pytest.raises(ValueError, match=r"^import circle among \['a', 'b'\]$"):
        draw_house.floors(packages)
