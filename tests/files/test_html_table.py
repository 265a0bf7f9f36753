"""Tables for notebooks."""

from affordance.files.html_table import build_table


def test_texts_are_escaped():
    table = build_table("a<b", ["x & y"], [["<script>", "1"]])
    row = "<tr><td>&lt;script&gt;</td><td>1</td></tr>"
    assert table == f"<table><caption>a&lt;b</caption><tr><th>x &amp; y</th></tr>{row}</table>"
