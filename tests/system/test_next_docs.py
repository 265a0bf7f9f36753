"""The example of docs/next.md runs, and prints what the page says."""

import re

from helpers.children import ROOT

PAGE = (ROOT / "docs" / "next.md").read_text(encoding="utf-8")


def test_example_of_advice_plans_what_the_page_says(capsys):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(block, {})
    (said,) = re.findall(r"print\(advice\.plan\)  # (.*)", block)
    assert capsys.readouterr().out.strip() == said
