"""Run a study over the cores or a cluster and keep what it found.

Names are loaded when they are first used: a worker process begins here, and needs few of them.
"""

from typing import TYPE_CHECKING

from ..base.later import loaded_later

if TYPE_CHECKING:
    from ..results.folder import output_folder
    from .dry_run import to_do, to_do_lines
    from .stop import stop_on_signals
    from .whole import run_study
    from .wishes import Wishes
    from .workers import BACKENDS, usable_backend

__all__ = [
    "BACKENDS",
    "Wishes",
    "output_folder",
    "run_study",
    "stop_on_signals",
    "to_do",
    "to_do_lines",
    "usable_backend",
]
__getattr__ = loaded_later(
    globals(),
    {
        "BACKENDS": ".workers",
        "Wishes": ".wishes",
        "output_folder": "..results.folder",
        "run_study": ".whole",
        "stop_on_signals": ".stop",
        "to_do": ".dry_run",
        "to_do_lines": ".dry_run",
        "usable_backend": ".workers",
    },
)
