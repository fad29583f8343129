"""What a person sees of a finished run: summary lines, figures, the HTML reports."""

from ..results.output import Output, check_kept, read_output, study_of
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
