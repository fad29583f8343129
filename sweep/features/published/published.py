"""Published figures beside those of a run."""

from __future__ import annotations

import pandas as pd

from ...camera.scene import OBJECT_RESOLUTION
from ...results.output import Output


def comparison_with_published(output: Output) -> pd.DataFrame:
    """Compare each published value with the value of this run in the first scenario.

    Returns one row per published value: table, cfa (for the object resolution, the distance scenario), quantity, paper
    (published value), ours (rounded to the decimal places printed in the paper), error (ours - paper), relative_error
    (error / paper. None if paper is 0), ours_exact (not rounded).
    """
    named = output.named[output.named["scenario"] == output.scenarios[0]].set_index("name")
    rows = []
    for table, entries in output.study.key("published").items():
        for name, values in entries.items():
            for quantity, paper in values.items():
                if quantity == OBJECT_RESOLUTION:
                    exact = output.study.geometry[name].object_resolution_px
                else:
                    exact = float(named[quantity][name])
                printed_digits = len(f"{paper:g}".partition(".")[2])
                ours = round(exact, printed_digits)
                error = round(ours - paper, 12)  # 12 decimal places remove the rounding of binary floats
                rows.append((table, name, quantity, paper, ours, error, error / paper if paper else None, exact))
    columns = ["table", "cfa", "quantity", "paper", "ours", "error", "relative_error", "ours_exact"]
    return pd.DataFrame(rows, columns=columns)
