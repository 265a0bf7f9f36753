"""Program that expands one xacro template in a sandboxed process; see ``xacro_file.py``.

It reads a job from standard input as JSON, restricts its own rights, and writes the result to standard output. It
imports only Python's standard library and xacrodoc, nothing of this package.
"""

import ctypes
import json
import os
import resource
import sys
from pathlib import Path
from typing import Any

# System calls and structures of Landlock (linux/landlock.h); their numbers are the same on all architectures.
_CREATE, _ADD, _RESTRICT, _VERSION_FLAG, _PATH_BENEATH = 444, 445, 446, 1, 1
_NO_NEW_PRIVILEGES = 38  # option of prctl
# Number of file rights by version of Landlock: 13, then 14 with refer, 15 with truncate, 16 with ioctl on devices.
_NUM_RIGHTS = {1: 13, 2: 14, 3: 15, 4: 15}
_READ_FILE, _READ_FOLDER = 1 << 2, 1 << 3
# Rights of TCP (bind and connect), from version 4 on; scopes of signals and abstract sockets, from version 6 on.
_TCP, _SCOPES = 0b11, 0b11
# Exit status if the kernel cannot restrict what the process reads and writes.
UNLIMITED = 9
# Flag for opening a folder only as a reference to it.
_O_PATH = 0o10000000


class _Ruleset(ctypes.Structure):
    _fields_ = (("files", ctypes.c_uint64), ("network", ctypes.c_uint64), ("scoped", ctypes.c_uint64))


class _Rule(ctypes.Structure):
    _pack_ = 1
    _layout_ = "ms"
    _fields_ = (("allowed", ctypes.c_uint64), ("parent", ctypes.c_int32))


def restrict(folders: list[str]) -> bool:
    """Restricts this process to reading files below some folders, with no writing, execution or network.

    Returns: True if the kernel supports this.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    libc.syscall.restype = ctypes.c_long
    version = int(libc.syscall(_CREATE, None, ctypes.c_size_t(0), ctypes.c_uint32(_VERSION_FLAG)))
    if version < 1:
        return False
    rights = (1 << _NUM_RIGHTS.get(version, 16)) - 1
    rules = _Ruleset(rights, _TCP if version >= 4 else 0, _SCOPES if version >= 6 else 0)
    size = 8 if version < 4 else 16 if version < 6 else 24
    ruleset = int(libc.syscall(_CREATE, ctypes.byref(rules), ctypes.c_size_t(size), ctypes.c_uint32(0)))
    if ruleset < 0:
        return False
    for folder in folders:
        try:
            parent = os.open(folder, _O_PATH | os.O_CLOEXEC)
        except OSError:
            continue
        rule = _Rule(_READ_FILE | _READ_FOLDER, parent)
        added = libc.syscall(_ADD, ctypes.c_int(ruleset), ctypes.c_int(_PATH_BENEATH), ctypes.byref(rule), 0)
        os.close(parent)
        if added:
            return False
    is_bound = int(libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)) == 0
    is_bound = is_bound and int(libc.syscall(_RESTRICT, ctypes.c_int(ruleset), 0)) == 0
    os.close(ruleset)
    return is_bound


def main() -> int:
    """Expands the template that standard input names; returns the exit status."""
    job: dict[str, Any] = json.load(sys.stdin)
    sys.path[:] = job["libraries"]
    resource.setrlimit(resource.RLIMIT_CPU, (job["seconds"], job["seconds"]))
    resource.setrlimit(resource.RLIMIT_AS, (job["bytes"], job["bytes"]))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    import xacrodoc  # lets xacro find packages without ROS
    from xacro import all_includes, process_file

    xacrodoc.packages.update_package_cache(job["packages"])
    python = [path for path in (*job["libraries"], sys.prefix, sys.base_prefix) if Path(path).is_absolute()]
    if not restrict([*job["folders"], *python]) and not job["trusted"]:
        return UNLIMITED
    text = process_file(job["file"], mappings=job["values"]).toxml()
    json.dump({"text": text, "sources": list(all_includes)}, sys.stdout)
    return 0


if __name__ == "__main__":
    try:
        status = main()
    except BaseException as error:  # a template can raise anything; it is reported in one line
        cause = getattr(error, "exc", None) or error  # xacro wraps exceptions
        sys.stderr.write(f"\n{type(cause).__name__}: {error}\n")
        status = 1
    sys.exit(status)
