"""Run a study on the cores or a cluster.

Names are loaded at their first use: a worker process begins here, and needs few of them.
"""

from typing import TYPE_CHECKING

from ..base.modules import loaded_later

if TYPE_CHECKING:
    from ..results.folder import output_folder
    from .dry_run import to_do, to_do_lines
    from .runner import run_study
    from .sweep import RunOptions
    from .workers import BACKENDS, stopped_by_signals

__all__ = [
    "BACKENDS",
    "RunOptions",
    "output_folder",
    "run_study",
    "stopped_by_signals",
    "to_do",
    "to_do_lines",
]
__getattr__ = loaded_later(
    globals(),
    {
        "BACKENDS": ".workers",
        "RunOptions": ".sweep",
        "output_folder": "..results.folder",
        "run_study": ".runner",
        "stopped_by_signals": ".workers",
        "to_do": ".dry_run",
        "to_do_lines": ".dry_run",
    },
)
