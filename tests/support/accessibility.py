"""What axe-core finds wrong with a page for people who do not see or point."""

from importlib.resources import files

AXE = files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8")


def serious_findings(browser):
    """Return rule and first element of each serious or critical finding on the open page."""
    browser.run(f"{AXE}; window.axe = axe")
    passed, found = browser.run(
        "const found = await window.axe.run();"
        "return [found.passes.length, found.violations.map("
        "  v => [v.impact, v.id, v.nodes.map(n => n.html).slice(0, 3)])]"
    )
    assert passed > 0
    return [each[1:] for each in found if each[0] in ("serious", "critical")]
