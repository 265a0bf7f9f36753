"""The example of docs/excite.md runs, and prints what the page says."""

import re

from helpers.children import ROOT

PAGE = (ROOT / "docs" / "excite.md").read_text(encoding="utf-8")


def test_example_of_a_design_prints_what_the_page_says(capsys):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(block, {})
    (said,) = re.findall(r"It prints `(.*?)`", PAGE)
    assert capsys.readouterr().out.strip() == said
