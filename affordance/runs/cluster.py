"""Runs repeats on a Dask cluster through joblib, instead of in processes of this machine.

Every worker must have one thread, because the internal models are not thread-safe. It must run the same version of
the program with the same libraries and models, because results depend on them.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import joblib

from affordance.exceptions import BadValueError
from affordance.runs.repeats import compute_key

_OPTION = "--cluster"
# Host name or IP address (IPv6 in brackets), and port.
_ADDRESS = re.compile(r"(tcp|tls)://([^\s/:\[\]]+|\[[0-9a-fA-F:]+\]):[0-9]{1,5}")
# Timeout for the scheduler to answer, and for workers to appear, [s].
_PATIENCE = 10.0


@contextmanager
def use_cluster(address: str, models: Path) -> Iterator[None]:
    """Context in which joblib runs its tasks on the cluster of a scheduler, such as tcp://host:8786.

    Raises:
        BadValueError: If Dask is not installed, no scheduler answers, it has no workers, a worker has several
            threads, or a worker has another program, other libraries or other models.
    """
    try:
        from distributed import Client
    except ImportError as error:
        problem = "needs the extra [cluster]: pip install '.[cluster]' in a clone"
        raise BadValueError(_OPTION, "", problem) from error
    if not _ADDRESS.fullmatch(address):
        raise BadValueError(_OPTION, "", f"is {address!r}, must be an address such as tcp://host:8786")
    try:
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:  # the host or the port does not exist
        raise BadValueError(_OPTION, "", f"is {address!r}, where no Dask scheduler answers") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
        except TimeoutError as error:
            raise BadValueError(_OPTION, "", f"is {address!r}, a scheduler without workers") from error
        for worker, num_threads in client.nthreads().items():
            if num_threads != 1:
                problem = f"has the worker {worker} with {num_threads} threads, must have one (--nthreads 1)"
                raise BadValueError(_OPTION, "", problem)
        ours = _identify(models)
        for worker, theirs in client.run(_identify, models, on_error="return").items():
            if theirs != ours:
                problem = f"has the worker {worker}, whose program, models or libraries differ from those here"
                raise BadValueError(_OPTION, "", problem)
        with joblib.parallel_config(backend="dask", client=client):
            yield


def _identify(models: Path) -> str:
    """Computes a digest of program, models and libraries; also called on the workers."""
    return compute_key("", models)
