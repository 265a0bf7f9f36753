"""Loads Python files that users name on the command line.

This is the only user-written code that is ever run. Only options that document it load such a file (SECURITY.md);
tables, memories and caches never contain code.
"""

import hashlib
import re
import sys
from pathlib import Path
from types import ModuleType

import cloudpickle

from affordance.exceptions import BadValueError, show_value


def load_program(path: Path, option: str) -> ModuleType:
    """Runs the Python file that an option names, and returns its module.

    A file with the same content is run only once. The definitions of the file, and of modules that it imports from
    its folder, are sent to other processes by value, so those processes do not need the files.

    Raises:
        BadValueError: The path is not a Python file, or running it fails.
    """
    if path.suffix != ".py" or not path.is_file():
        raise BadValueError(option, "", f"is {show_value(str(path))}, which is not a Python file")
    source, file = path.read_bytes(), path.resolve()
    # The name contains a digest of the content, so that no process uses an earlier version of the file.
    name = f"{re.sub(r'\W', '_', path.stem)}_{hashlib.sha256(source).hexdigest()[:8]}"
    known = sys.modules.get(name)
    if known is not None and known.__file__ == str(file):
        return known
    module, before = ModuleType(name), set(sys.modules)
    module.__file__ = str(file)
    sys.modules[name] = module
    if str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))  # last, so that no file in the folder hides a library
    try:
        exec(compile(source, str(file), "exec"), vars(module))
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise BadValueError(path, *_describe(error, file)) from error
    loaded = [module, *(sys.modules[each] for each in set(sys.modules) - before)]
    for each in loaded:
        if (place := getattr(each, "__file__", None)) and Path(place).resolve().is_relative_to(file.parent):
            cloudpickle.register_pickle_by_value(each)
    return module


def _describe(error: BaseException, file: Path) -> tuple[str, str]:
    """Describes the error of a program by its line in the file and its message."""
    line, trace = getattr(error, "lineno", None) if isinstance(error, SyntaxError) else None, error.__traceback__
    while trace is not None:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == str(file) else line
        trace = trace.tb_next
    message = " ".join(str(getattr(error, "msg", None) or error).split())
    return "" if line is None else f"line {line}", f"cannot be run: {type(error).__name__}: {message}"
