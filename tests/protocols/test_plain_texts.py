"""No text of a protocol is a template: what looks like one is refused before anything runs."""

import pytest

from affordance.cli import main
from affordance.exceptions import BadValueError
from affordance.files.model_folder import MODELS
from affordance.protocols.protocol import list_shipped, load_protocol, refuse_templates

TEXT = (MODELS / "protocols" / "template.yaml.txt").read_text(encoding="utf-8").replace("NAME", "mine")
ATTACK = "{{ cycler.__init__.__globals__.os.popen('touch %s').read() }}"


@pytest.mark.parametrize(
    ("old", "key"),
    [
        ('"mine: an odd one in a family"', "report.title"),
        ('"Force before each lift of the odd one."', "report.figures[0].caption"),
        ("Observers with kinds learn more than half of what the odd one weighs beyond its family.", "claims[0].text"),
        ("{name: learned fraction", "report.claims[0].criteria[0].name"),
        ("Do people lift a heavy odd one by its family, or by what it weighs?", "question"),
        ("title: The odd one", "figures.odd_one.title"),
        ('"first lift of the odd one, N"', "numbers.first_N.meaning"),
    ],
)
def test_template_anywhere_is_refused_and_does_nothing(tmp_path, capsys, old, key):
    assert old in TEXT
    name, _, _ = old.rpartition(" learned fraction") if "learned fraction" in old else ("", "", "")
    trace, path = tmp_path / "owned", tmp_path / "mine.yaml"
    attack = '"' + ATTACK % trace + '"'
    new = f"{name} {attack}" if name else f"title: {attack}" if old.startswith("title") else attack
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    assert main(["run", str(path), "--repeats", "1", "--jobs", "1", "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1
    assert f"{key}: is " in printed.err
    assert "must be plain text without '{{'" in printed.err
    assert not trace.exists()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("mark", ["{{", "{%", "{#"])
def test_every_beginning_of_a_template_is_refused_in_keys_and_deep_down(tmp_path, mark):
    path = tmp_path / "mine.yaml"
    for content in ({"a": [{"b": f"x {mark} y"}]}, {"a": {f"{mark}": 1}}):
        with pytest.raises(BadValueError, match="must be plain text"):
            refuse_templates(path, content)
    refuse_templates(path, {"a": ["{ {", "100 %}", "}}", "# {"]})


@pytest.mark.parametrize("name", list_shipped())
def test_shipped_protocols_are_plain_and_name_their_prose(name):
    assert load_protocol(MODELS / "protocols" / f"{name}.yaml").report.section == name
