"""What the report page of `cspm compare` opens with, whatever was compared."""

import re
from types import SimpleNamespace

import numpy as np

from cspm_ident.block_simulation import Input
from cspm_ident.comparison.channel_fit import ChannelFit
from cspm_ident.comparison.compare import Comparison
from cspm_ident.comparison.page import write_page

TIMES = np.linspace(0.0, 10.0, 500)
FLOOR = 0.01


def channel(cable, excess):
    """A tension whose error is so many times its noise floor, up and down by turns."""
    measured = np.sin(TIMES)
    error = excess * FLOOR * (-1.0) ** np.arange(len(TIMES))
    return ChannelFit(
        f"cables/tension/{cable}", "N", "cable", TIMES, measured, measured + error, FLOOR
    )


def page_of(path, channels):
    measurement = SimpleNamespace(path=path / "monday")
    found = Comparison(measurement, Input.WINCH, None, channels, [], {}, [], {}, (1, 0), {}, {})
    write_page(path / "report.html", found)
    return (path / "report.html").read_text(encoding="utf-8")


def test_a_page_opens_with_the_verdict_and_the_five_worst(tmp_path):
    page = page_of(tmp_path, [channel(f"c{i}", 10.0**i) for i in range(7)])
    title = "monday: tension of cable c6 is 1000000 × its noise from the simulation"
    assert f"<title>{title}</title>" in page
    assert f"<h1>{title}</h1>" in page
    opened, _, folded = page.partition("<details>")
    assert opened.index("class=verdict") < opened.index("<table>")
    assert re.findall(r'<a href="#[^"]*">tension of cable (\w+)</a>', opened) == [
        *("c6", "c5", "c4", "c3", "c2")
    ]
    assert opened.count("class=plotly-graph-div") == 5
    assert "The other 2 channels" in folded
    assert "below −100" in folded
    assert not re.search(r">−?\d{4,}\.\d", page)


def test_a_page_of_agreement_says_so_in_its_title(tmp_path):
    page = page_of(tmp_path, [channel(f"c{i}", 1.0) for i in range(3)])
    assert "<title>monday: all 3 channels agree with the simulation to their noise</title>" in page
    assert "nothing could be compared" in page_of(tmp_path, [])
