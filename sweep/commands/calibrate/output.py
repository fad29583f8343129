"""What a calibration leaves: the parameter file that the package ships, a record, and lines for a person."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from ...results.atomic import write_text
from ...results.tables import write_json
from .fit import Fit, printed_order
from .model import DISTANCES, Figures
from .run import Calibration

_HEADER = """\
Parameters of the built-in surrogate curves: sensor `ar0820` and traffic lights `tl16`. Modeled, not measured.
Made by the command below; the models are sweep/curves/builtin and sweep/designs/families/stopband.py.
photon_ratio: photons of a signal patch over those of the white patch.
clear_pixel: QE joined by a monotone cubic. ir_cut: falling logistic edge before all pixels.
filters: transmission = leak + (peak - leak) * product of logistic edges; leak at 400, 600 and 700 nm; 10-90 % widths.
lights: peak in photons, decay lengths toward blue and red; the lamps of a region spread evenly over peak +- spread.
stopbands: our counterparts of the paper's N_1 to N_4."""
_SURE, _GUESS = 0.5, 0.9


def write(calibration: Calibration, folder: Path) -> list[str]:
    """Write parameter file and record; returns lines for a person. Raises OutputError when the disk refuses."""
    write_text(parameter_file(calibration), folder / "surrogate.yaml")
    write_json(record(calibration), folder / "calibration.json")
    files = f"Files: {folder}/: surrogate.yaml (ships as sweep/curves/builtin/surrogate.yaml), calibration.json."
    return [*lines(calibration), files]


def parameter_file(calibration: Calibration) -> str:
    """The final fit as `surrogate.yaml`."""
    tree = dict(calibration.final.tree)
    tree["provenance"] = {
        "made_by": f"sweep calibrate studies/paper.yaml --seed {calibration.seed} --starts {calibration.starts}",
        "fitted_to": "CSDs and the sensitivity printed by Weikl, Schroeder and Stechele, Tables 2 and 3",
        "largest_csd_error_over_allowed": round(worst(calibration.shipped, calibration.printed), 3),
        "figures": sum(len(values) for values in calibration.printed.values()),
        "free_parameters": len(calibration.final.certainty),
        "directions_determined_by_the_figures": int((calibration.final.singular_values > 1).sum()),
    }
    root = CommentedMap(_styled(tree, 0))
    root.yaml_set_start_comment(_HEADER)
    text = io.StringIO()
    yaml = YAML()
    yaml.width = 4096
    yaml.dump(root, text)
    return text.getvalue()


def _styled(node: Any, depth: int) -> Any:
    """Leaves of the file in one line each."""
    if isinstance(node, dict):
        made = CommentedMap((key, _styled(value, depth + 1)) for key, value in node.items())
        if not any(isinstance(value, dict) for value in node.values()) and depth > 0 and "made_by" not in node:
            made.fa.set_flow_style()
        return made
    if isinstance(node, list):
        found = CommentedSeq(_styled(value, depth + 1) for value in node)
        found.fa.set_flow_style()
        return found
    return node


def allowed_dn(printed_dn: float) -> float:
    """What counts as met: 3 % or 2 DN, the larger."""
    return max(0.03 * printed_dn, 2.0)


def worst(found: Figures, printed: Figures) -> float:
    """The largest CSD error over what is allowed."""
    return max(
        abs(found[row][name] - value) / allowed_dn(value)
        for row, values in printed.items()
        if row in found
        for name, value in values.items()
        if name in DISTANCES
    )


def wrong_ranks(found: Figures, printed: Figures) -> list[str]:
    """Rows whose CSDs do not rank as printed."""
    return [row for row in found if any(found[row][a] >= found[row][b] for a, b in printed_order(printed[row]))]


def record(calibration: Calibration) -> dict[str, Any]:
    """Everything, for a machine."""
    return {
        "seed": calibration.seed,
        "starts": calibration.starts,
        "costs": {"validation": list(calibration.validation_costs), "final": list(calibration.final_costs)},
        "printed": calibration.printed,
        "validation_fitted": calibration.fitted,
        "validation_predicted": calibration.predicted,
        "validation_predicted_sensitivity_of_both_yellow_pixels": calibration.predicted_pair,
        "final": calibration.shipped,
        "left_out": calibration.left_out,
        "certainty": {"validation": calibration.validation.certainty, "final": calibration.final.certainty},
        "at_bound": {"validation": calibration.validation.at_bound, "final": calibration.final.at_bound},
        "singular_values": {
            "validation": calibration.validation.singular_values.tolist(),
            "final": calibration.final.singular_values.tolist(),
        },
        "validation_parameters": dict(calibration.validation.tree),
    }


def lines(calibration: Calibration) -> list[str]:
    """The calibration in lines for a person."""
    printed = calibration.printed
    said = [_fit_line("Final fit", calibration.final, calibration.shipped, printed)]
    said.append(_fit_line("Validation fit", calibration.validation, calibration.fitted, printed))
    said += [f"  predicted {row}: {_errors(values, printed[row])}" for row, values in calibration.predicted.items()]
    for row, values in calibration.predicted_pair.items():
        said.append(f"  predicted {row}, sensitivity read as (Y + N) / 2Y: {_errors(values, printed[row])}")
    wrong = wrong_ranks(calibration.fitted | calibration.predicted, printed)
    ranks = f"wrong for {', '.join(wrong)}" if wrong else "right for every row"
    said.append(f"  ranking of the six pairs: {ranks}")
    said.append("Left out in turn:")
    said += [f"  {row}: {_errors(values, printed[row])}" for row, values in calibration.left_out.items()]
    said.append(_certainty(calibration.final))
    return said


def _fit_line(name: str, fit: Fit, found: Figures, printed: Figures) -> str:
    figures = sum(len(printed[row]) for row in found)
    directions = int((fit.singular_values > 1).sum())
    return (
        f"{name}: {figures} figures, {len(fit.certainty)} parameters, cost {fit.cost:.1f}; worst CSD error "
        f"{worst(found, printed):.2f} of the allowed 3 % or 2 DN; the figures determine {directions} directions."
    )


def _errors(found: Mapping[str, float], printed: Mapping[str, float]) -> str:
    return ", ".join(
        f"{DISTANCES.get(name, name)} {100 * (found[name] / printed[name] - 1):+.1f} %" for name in printed
    )


def _certainty(fit: Fit) -> str:
    values = np.array(list(fit.certainty.values()))
    sure = [name for name, value in fit.certainty.items() if value < _SURE]
    return (
        f"Determined by the figures (posterior below half of the prior's spread): {len(sure)} parameters "
        f"({', '.join(sure)}); still at the prior (above 0.9): {int((values > _GUESS).sum())} of {values.size}."
    )
