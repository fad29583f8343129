"""Summary, figures and HTML reports of a finished run.

Names are loaded at their first use: a worker that draws needs few of them.
"""

from typing import TYPE_CHECKING

from ..base.modules import lazy_import

if TYPE_CHECKING:
    from ..results.designs import study_of
    from ..results.output import Output, read_output
    from .page import make_report, summary_lines

__all__ = [
    "Output",
    "make_report",
    "read_output",
    "study_of",
    "summary_lines",
]
__getattr__ = lazy_import(
    globals(),
    {
        "Output": "..results.output",
        "make_report": ".page",
        "read_output": "..results.output",
        "study_of": "..results.designs",
        "summary_lines": ".page",
    },
)
