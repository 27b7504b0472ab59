import runpy
from dataclasses import replace
from pathlib import Path

import pytest

from cspm_sim.effects import catalogue
from cspm_sim.effects.document import effects_page

PAGE = Path(__file__).resolve().parents[3] / "docs" / "effects.md"


def test_committed_page_is_up_to_date() -> None:
    committed = PAGE.read_text(encoding="utf-8")
    assert committed == effects_page(catalogue()), (
        "run: python -m cspm_sim.effects.document > docs/effects.md"
    )


@pytest.mark.parametrize("effect", catalogue().values(), ids=lambda effect: effect.id)
def test_page_holds_all_that_an_effect_declares(effect) -> None:
    page = effects_page({effect.id: effect})
    for parameter in effect.parameters:
        row = (
            f"| `{parameter.name}` | {parameter.unit} |"
            f" {parameter.minimum:g} to {parameter.maximum:g} |"
            + ("  |" if parameter.absent is None else f" {parameter.absent:g} |")
            + f" {parameter.meaning}"
            + ("" if parameter.default is None else f"; {parameter.default:g} where a file")
        )
        assert row in page
    for name, grid in effect.nonlinear.items():
        assert f"`{name}` {', '.join(f'{value:g}' for value in grid)}" in page
    for text in (effect.equation, effect.shows, effect.separating_experiment, effect.reference):
        assert f": {text}.\n" in page
    assert all(f"`{twin}`" in page for twin in effect.twins)


def test_effect_without_twins_says_so() -> None:
    effect = next(iter(catalogue().values()))
    assert "- Twins: none known.\n" in effects_page({effect.id: replace(effect, twins=())})
    assert "none known" not in effects_page({effect.id: effect})


def test_module_writes_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    path = PAGE.parents[1] / "cspm_sim" / "effects" / "document.py"
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out == effects_page(catalogue())
