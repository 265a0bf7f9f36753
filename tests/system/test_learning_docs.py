"""The example of docs/learning.md runs, and the systems and ports that it names are those of the Diagram."""

import re

from helpers.children import ROOT

PAGE = (ROOT / "docs" / "learning.md").read_text(encoding="utf-8")


def test_example_of_a_logged_posterior_runs(capsys):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(block, {})
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == [f"{0.5 * k:.1f} s" for k in range(7)]
    widths = [float(high) - float(low) for low, _, high in (re.findall(r"(\d+)\.", line[5:]) for line in lines)]
    assert widths[1] < 0.5 * widths[0]


def test_systems_and_ports_named_are_those_of_the_diagram():
    drawn = (ROOT / "diagrams" / "weight.svg").read_text(encoding="utf-8")
    for name in (
        "material_memory",
        "visual_prior",
        "density_estimator",
        "mpc_controller",
        "proprioception",
        "posterior",
    ):
        assert name in PAGE
        assert name in drawn
