"""A Dask cluster as the executor of a study's trials."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
import contextlib

from drake_affetto.common.errors import InputError

# How long the scheduler and its first worker are waited for, s.
_PATIENCE = 20


@contextlib.contextmanager
def cluster_executor(
    address: str, software: Callable[[], dict[str, str]]
) -> Iterator[Executor]:
    """Hands calls to the workers of a Dask cluster.

    Dask runs the trials of a worker that dies again on another one.

    Args:
        address: Address of the scheduler, such as tcp://127.0.0.1:8786.
        software: Tells what must be the same wherever trials of one study
            run; it is called here and on each worker.

    Raises:
        InputError: if dask.distributed is not installed, nobody answers at
            the address, there are no workers, or they have another version of
            this package or of its models.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError(
            "a Dask cluster needs dask.distributed: pip install "
            "'drake_affetto[dask]'"
        ) from error
    try:
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"--dask: no Dask scheduler answers at {address}: {error}"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
        except TimeoutError as error:
            raise InputError(
                f"--dask: the scheduler at {address} has no workers"
            ) from error
        try:
            theirs = client.run(software)
        except Exception as error:
            raise InputError(
                f"--dask: the workers at {address} cannot run this package: "
                f"{error}"
            ) from error
        ours = software()
        for worker, found in theirs.items():
            if found != ours:
                raise InputError(
                    f"--dask: worker {worker} has {found}, expected {ours}"
                )
        # Not pure: each submission is a trial of its own.
        yield client.get_executor(pure=False)
