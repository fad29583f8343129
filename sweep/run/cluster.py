"""A cluster of Dask workers, which an extra installs."""

from __future__ import annotations

from typing import Any

from ..base.errors import SweepError


def client_of(scheduler: str | None) -> Any:
    """A client of the scheduler; raises SweepError when Dask is not installed or the scheduler does not answer."""
    if scheduler is None:
        raise SweepError("--backend dask needs --scheduler tcp://HOST:PORT")
    try:
        from distributed import Client  # noqa: PLC0415  (an extra)
    except ImportError:
        raise SweepError("--backend dask needs Dask: pip install 'cfa-sweep[dask]'") from None
    try:
        return Client(scheduler, timeout="10s", set_as_default=True)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise SweepError(f"--scheduler {scheduler}: {str(error).splitlines()[0]}") from None
