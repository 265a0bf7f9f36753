"""Program files that are named on the command line: the only code written by a user that is loaded.

Only the options that say so load one (SECURITY.md); no table, memory or cache ever does.
"""

import hashlib
import re
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

from affordance.exceptions import BadValueError, show_value

# Modules by which functions and classes are sent to other processes, ours and those of a cluster.
_PICKLERS = ("joblib.externals.cloudpickle", "cloudpickle")


def load_program(path: Path, option: str) -> ModuleType:
    """Runs a Python file that an option names, and returns its module.

    What it defines is sent to other processes as it is, also to those of a cluster, which need no such file; so are
    modules of its folder that it imports. The same file is run once.

    Raises:
        BadValueError: The path is not a Python file, or running it fails.
    """
    if path.suffix != ".py" or not path.is_file():
        raise BadValueError(option, "", f"is {show_value(str(path))}, which is not a Python file")
    source, file = path.read_bytes(), path.resolve()
    # Named by its content, so that no process takes it for an earlier version.
    name = f"{re.sub(r'\W', '_', path.stem)}_{hashlib.sha256(source).hexdigest()[:8]}"
    known = sys.modules.get(name)
    if known is not None and known.__file__ == str(file):
        return known
    module, before = ModuleType(name), set(sys.modules)
    module.__file__ = str(file)
    sys.modules[name] = module
    if str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))  # last, so that no file of the folder hides a library
    try:
        exec(compile(source, str(file), "exec"), vars(module))
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise BadValueError(path, *_describe(error, file)) from error
    loaded = [module, *(sys.modules[each] for each in set(sys.modules) - before)]
    for each in loaded:
        if (place := getattr(each, "__file__", None)) and Path(place).resolve().is_relative_to(file.parent):
            _send_by_value(each)
    return module


def _describe(error: BaseException, file: Path) -> tuple[str, str]:
    """Describes an error of a program by the last line of the file that it comes from, and in words."""
    line, trace = getattr(error, "lineno", None) if isinstance(error, SyntaxError) else None, error.__traceback__
    while trace is not None:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == str(file) else line
        trace = trace.tb_next
    message = " ".join(str(getattr(error, "msg", None) or error).split())
    return "" if line is None else f"line {line}", f"cannot be run: {type(error).__name__}: {message}"


def _send_by_value(module: ModuleType) -> None:
    for name in _PICKLERS:
        try:
            pickler = import_module(name)
        except ImportError:  # there is no cluster here
            continue
        pickler.register_pickle_by_value(module)
