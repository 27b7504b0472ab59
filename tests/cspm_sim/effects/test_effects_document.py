import runpy
from dataclasses import replace
from pathlib import Path

import pytest

from cspm_sim.effects import catalogue
from cspm_sim.effects.document import effects_page

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "effects.md"


def test_committed_page_is_up_to_date() -> None:
    committed = PAGE.read_text(encoding="utf-8")
    assert committed == effects_page(catalogue()), (
        "run: python -m cspm_sim.effects.document > docs/reference/effects.md"
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
    for name, grid in effect.signature.nonlinear.items():
        assert f"`{name}` {', '.join(f'{value:g}' for value in grid)}" in page
    words = effect.description
    for text in (words.equation, words.shows, words.separating_experiment, words.reference):
        assert f": {text}.\n" in page
    assert all(f"`{other}`" in page for other in words.confounded_with)


def test_an_effect_that_is_confounded_with_none_is_described_so() -> None:
    effect = next(iter(catalogue().values()))
    lonely = replace(effect, description=replace(effect.description, confounded_with=()))
    assert "- Confounded with: none known.\n" in effects_page({effect.id: lonely})
    assert "none known" not in effects_page({effect.id: effect})


def test_module_writes_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    path = PAGE.parents[2] / "cspm_sim" / "effects" / "document.py"
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out == effects_page(catalogue())
