"""Reads a Universal Robots controller's real-time data (RTDE over TCP), with the standard library only.

Only an output recipe is set up. Without an input recipe the controller accepts no values, so no command can be sent.
A package consists of size (uint16), type (uint8) and payload, big endian. Types are 86 version, 79 outputs, 83 start,
85 data, 77 text. Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide".
"""

import socket
import struct
from collections.abc import Iterator

import numpy as np

from affordance.exceptions import BadValueError
from affordance.extensions.payload.live.samples import Sample
from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.settings import SignalKind

PORT = 30004
VERSION, OUTPUTS, START, DATA = 86, 79, 83, 85
_SIZES = {"DOUBLE": "d", "VECTOR3D": "3d", "VECTOR6D": "6d"}
_JOINTS = tuple(
    f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
)
# Variable for each kind of signal; actual_current_as_torque exists from PolyScope 5.23 and 10.11 on.
_SIGNALS = {SignalKind.CURRENT: "actual_current", SignalKind.MOTOR_TORQUE: "actual_current_as_torque"}
_FREQUENCY, _PATIENCE = 500.0, 5.0  # largest rate of samples, [Hz], and timeout for the controller's answers, [s]


def read_rtde(host: str, kind: SignalKind, port: int = PORT) -> Iterator[Sample]:
    """Reads joint states and the set payload until the controller closes the connection.

    Args:
        host: Name or address of the controller.
        kind: Kind of signal in the empty runs: motor currents or motor torques.
        port: TCP port of the controller.

    Raises:
        BadValueError: The controller cannot be reached, or does not offer these data.
    """
    if kind not in _SIGNALS:
        problem = f"offers {', '.join(each.value for each in _SIGNALS)}, but the empty runs have {kind.value}"
        raise BadValueError(host, "signal", problem)
    return _connect(host, port, ["timestamp", "actual_q", "actual_qd", _SIGNALS[kind], "payload", "payload_cog"])


def _connect(host: str, port: int, names: list[str]) -> Iterator[Sample]:
    try:
        with socket.create_connection((host, port), timeout=_PATIENCE) as connection:
            yield from _read(connection, host, names)
    except (OSError, struct.error) as error:
        raise BadValueError(host, f"port {port}", f"cannot be read: {error}") from error


def _read(connection: socket.socket, host: str, names: list[str]) -> Iterator[Sample]:
    if _ask(connection, VERSION, struct.pack(">H", 2)) != b"\x01":
        raise BadValueError(host, "RTDE", "refuses version 2 of the protocol")
    answer = _ask(connection, OUTPUTS, struct.pack(">d", _FREQUENCY) + ",".join(names).encode())
    types = answer[1:].decode("ascii", "replace").split(",")
    if missing := [name for name, type_ in zip(names, types, strict=False) if type_ not in _SIZES]:
        raise BadValueError(host, "RTDE", f"does not offer {', '.join(missing)}: is its software older than needed?")
    layout = struct.Struct(">" + "".join(_SIZES[type_] for type_ in types))
    if _ask(connection, START) != b"\x01":
        raise BadValueError(host, "RTDE", "refuses to start")
    while True:
        try:
            type_, data = _receive(connection)
        except ConnectionError:
            return
        if type_ == DATA and data[:1] == answer[:1]:
            t, *values = layout.unpack(data[1:])
            q, v, signal, (mass, *centre) = values[:6], values[6:12], values[12:18], values[18:]
            yield Sample(t, _JOINTS, q, v, signal, PayloadSetting(mass, np.array(centre)))


def _ask(connection: socket.socket, type_: int, payload: bytes = b"") -> bytes:
    """Sends a package and returns the payload of the answer. Text packages are skipped."""
    connection.sendall(struct.pack(">HB", len(payload) + 3, type_) + payload)
    while True:
        answer, data = _receive(connection)
        if answer == type_:
            return data


def _receive(connection: socket.socket) -> tuple[int, bytes]:
    size, type_ = struct.unpack(">HB", _receive_exactly(connection, 3))
    return type_, _receive_exactly(connection, max(size - 3, 0))


def _receive_exactly(connection: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        more = connection.recv(size - len(data))
        if not more:
            raise ConnectionError("the controller closed the connection")
        data += more
    return data
