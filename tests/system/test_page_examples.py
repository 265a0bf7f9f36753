"""Examples of docs/excite.md and docs/next.md run, and print what the pages say."""

import re

import pytest
from helpers.children import ROOT


@pytest.mark.parametrize(
    ("page", "said"), [("excite.md", r"It prints `(.*?)`"), ("next.md", r"print\(advice\.plan\)  # (.*)")]
)
def test_example_prints_what_its_page_says(page, said, capsys):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (expected,) = re.findall(said, text)
    exec(block, {})
    assert capsys.readouterr().out.strip() == expected
