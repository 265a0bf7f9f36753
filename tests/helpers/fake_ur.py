"""A controller that speaks RTDE as Universal Robots' does, and remembers every package that it gets."""

import socket
import struct
import threading
from collections.abc import Iterable, Sequence

TYPES = {"timestamp": "DOUBLE", "actual_q": "VECTOR6D", "actual_qd": "VECTOR6D", "actual_current": "VECTOR6D"}
TYPES |= {"payload": "DOUBLE", "payload_cog": "VECTOR3D"}


class FakeController:
    """Server for one client, on a port of this machine."""

    def __init__(self, rows: Iterable[Sequence[float]], types: dict[str, str] = TYPES) -> None:
        """Listens; rows have all numbers of a sample."""
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self.packages: list[int] = []
        self._rows, self._types = rows, types
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def join(self) -> None:
        """Waits until the client is gone."""
        self._thread.join(20.0)
        self._server.close()

    def _serve(self) -> None:
        connection, _ = self._server.accept()
        with connection:
            file = connection.makefile("rwb")

            def receive() -> tuple[int, bytes]:
                head = file.read(3)
                if len(head) < 3:
                    raise ConnectionError
                size, kind = struct.unpack(">HB", head)
                self.packages.append(kind)
                return kind, file.read(size - 3)

            def send(kind: int, data: bytes) -> None:
                file.write(struct.pack(">HB", len(data) + 3, kind) + data)
                file.flush()

            try:
                while True:
                    kind, data = receive()
                    if kind == 86:
                        send(86, b"\x01")
                    elif kind == 79:
                        send(77, b"\x02hi\x02ur\x02")  # a text in between
                        names = data[8:].decode().split(",")
                        send(79, b"\x01" + ",".join(self._types.get(each, "NOT_FOUND") for each in names).encode())
                    elif kind == 83:
                        send(83, b"\x01")
                        for row in self._rows:
                            send(85, b"\x01" + struct.pack(f">{len(row)}d", *row))
                        return
            except (ConnectionError, OSError):
                return
