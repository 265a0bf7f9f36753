"""No text of a protocol is a template: text that looks like one is refused before anything runs."""

import pytest
from helpers.refusals import refuse

from affordance.files.model_folder import MODELS
from affordance.protocols.protocol import list_shipped, load_protocol, refuse_templates


@pytest.mark.parametrize("mark", ["{{", "{%", "{#"])
def test_every_beginning_of_a_template_is_refused_in_keys_and_deep_down(tmp_path, mark):
    path = tmp_path / "mine.yaml"
    for content in ({"a": [{"b": f"x {mark} y"}]}, {"a": {f"{mark}": 1}}):
        assert "must be plain text" in refuse(refuse_templates, path, content)
    refuse_templates(path, {"a": ["{ {", "100 %}", "}}", "# {"]})


@pytest.mark.parametrize("name", list_shipped())
def test_shipped_protocols_are_plain_and_name_their_prose(name):
    assert load_protocol(MODELS / "protocols" / f"{name}.yaml").report.section == name
