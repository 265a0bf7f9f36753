"""Page of ``affordance watch``: Meshcat's scene with a panel next to it.

Only browsers of this machine are served.
"""

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
# Names under which a browser may ask: a page of another site that gives its own name this machine's address may not.
_HOSTS = (_HOST, "127.0.0.1")
_STATE = "/state"


class LivePage:
    """Page that is served until the process ends. The page asks for the state several times a second."""

    def __init__(
        self, meshcat: Meshcat, buttons: Sequence[tuple[str, str]], sliders: Sequence[tuple[str, str, float, float]]
    ) -> None:
        """Opens a local port. Buttons are name and key, sliders name, label and ends, all of Meshcat's controls.

        An AffordanceError means that no port can be opened.
        """
        folder = Path(FindResourceOrThrow("drake/geometry/meshcat.html")).parent
        panel = render_template(
            "affordance.extensions.watch", "live_panel.html.j2", escapes=True, buttons=buttons, sliders=sliders
        )
        page = (folder / "meshcat.html").read_text(encoding="utf-8")
        # Meshcat's own server answers the scene's connection alone.
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
        """Shows a state on all pages. The template reads every key of it."""
        text = json.dumps(state, allow_nan=False)
        self._server.answers[_STATE] = ("application/json", text.encode())


class _Server(ThreadingHTTPServer):
    """Server of a few prepared answers: type and content by path."""

    daemon_threads = True
    answers: dict[str, tuple[str, bytes]]

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignores a browser that leaves during an answer."""


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    timeout = 10.0  # of a connection on which nothing is asked, [s]

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
        """Keeps requests off the terminal."""
