"""Run a study on the cores or a cluster.

Names are loaded at their first use: a worker process begins here, and needs few of them.
"""

from typing import TYPE_CHECKING

from ..base.modules import lazy_import

if TYPE_CHECKING:
    from ..results.folder import output_folder
    from .dry_run import remaining_work, remaining_work_lines
    from .runner import run_study, usual_backend
    from .sweep import RunOptions
    from .workers import BACKENDS, stopped_by_signals

__all__ = [
    "BACKENDS",
    "RunOptions",
    "output_folder",
    "remaining_work",
    "remaining_work_lines",
    "run_study",
    "stopped_by_signals",
    "usual_backend",
]
__getattr__ = lazy_import(
    globals(),
    {
        "BACKENDS": ".workers",
        "RunOptions": ".sweep",
        "output_folder": "..results.folder",
        "run_study": ".runner",
        "usual_backend": ".runner",
        "stopped_by_signals": ".workers",
        "remaining_work": ".dry_run",
        "remaining_work_lines": ".dry_run",
    },
)
