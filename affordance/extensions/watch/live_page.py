"""Web page of ``affordance watch``, with a Meshcat scene and a panel, for browsers on the same machine."""

import json
import threading
from collections.abc import Mapping, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from pydrake.common import FindResourceOrThrow
from pydrake.geometry import Meshcat

from affordance.exceptions import AffordanceError
from affordance.files.template import render_template

_HOST = "localhost"
# Accepted host names. Others are rejected to prevent DNS rebinding by pages of other sites.
_HOSTS = (_HOST, "127.0.0.1")
_STATE = "/state"


class LivePage:
    """Web page that polls the state several times per second, served until the process ends."""

    def __init__(
        self, meshcat: Meshcat, buttons: Sequence[tuple[str, str]], sliders: Sequence[tuple[str, str, float, float]]
    ) -> None:
        """Serves the page at a free local port.

        Args:
            meshcat: Scene.
            buttons: Name and key of each Meshcat button.
            sliders: Name, label, and smallest and largest value of each Meshcat slider.

        Raises:
            AffordanceError: No port can be opened.
        """
        folder = Path(FindResourceOrThrow("drake/geometry/meshcat.html")).parent
        panel = render_template(
            "affordance.extensions.watch", "live_panel.html.j2", escapes=True, buttons=buttons, sliders=sliders
        )
        page = (folder / "meshcat.html").read_text(encoding="utf-8")
        # The websocket of the scene connects to the server of Meshcat.
        page = page.replace("url = location.toString();", f"url = {json.dumps(meshcat.web_url())};")
        page = page.replace(
            "<title>Drake MeshCat</title>", '<title>affordance watch</title><link rel="icon" href="data:,">'
        )
        page = page.replace("</body>", f"{panel}</body>")
        try:
            self._server = _Server((_HOST, 0), _Handler)
        except OSError as error:
            raise AffordanceError(f"the live page cannot be served: {error}") from error
        self._server.answers = {
            "/": ("text/html; charset=utf-8", page.encode()),
            "/meshcat.js": ("text/javascript", (folder / "meshcat.js").read_bytes()),
        }
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    @property
    def port(self) -> int:
        """Port of the page."""
        return int(self._server.server_address[1])

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{_HOST}:{self.port}"

    def show(self, state: Mapping[str, object]) -> None:
        """Publishes a state, which has all keys of the template, to all open pages."""
        text = json.dumps(state, allow_nan=False)
        self._server.answers[_STATE] = ("application/json", text.encode())


class _Server(ThreadingHTTPServer):
    """Server of prepared answers: content type and content by path."""

    daemon_threads = True
    answers: dict[str, tuple[str, bytes]]

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignores browsers that disconnect during an answer."""


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    timeout = 10.0  # of an idle connection, [s]

    def do_GET(self) -> None:
        """Sends the prepared answer for the path."""
        answer = self.server.answers.get(self.path.partition("?")[0])
        host = self.headers.get("Host", "").rpartition(":")[0] or self.headers.get("Host", "")
        if answer is None or host not in _HOSTS:
            self.send_error(404)
            return
        kind, content = answer
        self.send_response(200)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(content))),
            ("Cache-Control", "no-store"),
            ("X-Frame-Options", "DENY"),
        ):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_: object) -> None:
        """Suppresses the log of requests."""
