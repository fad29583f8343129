"""What a person sees of a finished run: summary lines, figures, the HTML report."""

from .make import make_report
from .outputs import Output, read_output
from .summary import summary_lines

__all__ = ["Output", "make_report", "read_output", "summary_lines"]
