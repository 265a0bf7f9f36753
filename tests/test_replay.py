import gc
import threading

import numpy as np
import pytest

from affordance.exceptions import AffordanceError
from affordance.replay import Scene, write_replay


@pytest.fixture
def scenes(weight_config, arm):
    times = np.linspace(0, 0.2, 21)
    q = arm.home + np.zeros((21, 7))
    return [Scene(tool, times, q, f"{tool.name} <shown>") for tool in weight_config.tools[:2]]


def test_replay_is_one_page_that_needs_nothing_else(tmp_path, weight_config, scenes):
    path = tmp_path / "replay.html"
    write_replay(path, weight_config.settings.arm, scenes, title="A & B")
    page = path.read_text()
    assert "<title>A &amp; B</title>" in page
    assert "0.0 to 0.2 s: rod_10cm &lt;shown&gt;" in page
    assert "0.7 to 0.9 s: rod_15cm" in page
    # Everything is carried inside; nothing is fetched.
    assert 'src="http' not in page
    assert 1e6 < len(page) < 5e6


def test_nothing_is_left_for_another_thread_to_free(tmp_path, weight_config, scenes):
    """Meshcat would end the process, and with it this test."""
    write_replay(tmp_path / "replay.html", weight_config.settings.arm, scenes, title="")
    collector = threading.Thread(target=gc.collect)
    collector.start()
    collector.join()


def test_no_page_without_a_port(tmp_path, weight_config, scenes, monkeypatch):
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "package_map")
    with pytest.raises(AffordanceError, match=r"replay.html: cannot be drawn: .*DRAKE_ALLOW_NETWORK"):
        write_replay(tmp_path / "replay.html", weight_config.settings.arm, scenes, title="")
    assert not list(tmp_path.iterdir())
