"""The page of ``affordance watch`` is served to this machine's browsers alone."""

import http.client

import pytest

from affordance.extensions.watch.live_page import LivePage


class _Meshcat:
    def web_url(self):
        return "http://localhost:7"


@pytest.fixture(scope="module")
def page():
    return LivePage(_Meshcat(), [("<b>Next", "N")], [("Size, times", "Size", 0.5, 1.5)])


def ask(page, path, host="localhost"):
    """Asks for a path under a name of the machine; returns status and text."""
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10.0)
    connection.request("GET", path, headers={"Host": f"{host}:{page.port}"})
    answer = connection.getresponse()
    found = answer.status, answer.read().decode()
    connection.close()
    return found


def test_page_is_meshcats_with_a_panel_and_asks_nothing_of_others(page):
    status, text = ask(page, "/?anything")
    assert status == 200
    assert 'url = "http://localhost:7"' in text
    assert "&lt;b&gt;Next" in text
    assert "<b>Next" not in text
    assert 'src="http' not in text
    assert ask(page, "/meshcat.js")[0] == 200


def test_state_is_what_was_shown_last(page):
    page.show({"title": "</script>"})
    page.show({"title": "é"})
    assert ask(page, "/state") == (200, '{"title": "\\u00e9"}')


@pytest.mark.parametrize("path", ["/nothing", "/../meshcat.js", "/etc/passwd", "/meshcat.html"])
def test_nothing_else_is_served(page, path):
    assert ask(page, path)[0] == 404


@pytest.mark.parametrize(
    ("host", "status"), [("127.0.0.1", 200), ("example.org", 404), ("localhost.example.org", 404)]
)
def test_a_page_that_gives_its_own_name_to_this_machine_is_refused(page, host, status):
    assert ask(page, "/", host)[0] == status


def test_the_port_is_open_to_this_machine_alone(page):
    assert page._server.server_address[0] == "127.0.0.1"
