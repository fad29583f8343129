"""What a person sees of a finished run: summary lines, figures, the HTML reports."""

from ..results.again import check_kept, study_of
from ..results.output import Output, read_output
from .page import make_report
from .summary import summary_lines

__all__ = [
    "Output",
    "check_kept",
    "make_report",
    "read_output",
    "study_of",
    "summary_lines",
]
