"""Files of a finished run that someone changed, its manifest included: what the reading of them says then."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from sweep.base.disk import digest_of
from sweep.results.manifest import Manifest
from sweep.results.records import to_json
from sweep.search.problem import Evaluation, SearchRun


def listed_anew(folder: Path) -> None:
    """List the files of a run as they are now."""
    manifest = Manifest(folder)
    manifest.add({name: digest_of(folder / name) for name in manifest.files})


def hostile() -> list[bytes]:
    good = json.loads(to_json(SearchRun(1, "success", [Evaluation(np.arange(3.0), 1.0, 2.0, 3.0, 0.0)])))
    evaluation = good["log"][0]
    array = evaluation["x"]
    return [
        b"",
        b"null",
        b"\xff\xfe",
        b"cos\nsystem\n(S'true'\ntR.",  # a pickle
        b"[" * 1_000_000,
        b'{"a":' * 100_000 + b"1" + b"}" * 100_000,
        *(
            json.dumps(made).encode()
            for made in (
                [],
                good | {"start": "1"},
                good | {"start": True},
                good | {"start": 1.0},
                good | {"more": 1},
                {key: good[key] for key in ("start", "log")},
                good | {"log": {}},
                good | {"log": [1]},
                *(
                    good | {"log": [evaluation | change]}
                    for change in (
                        {"objective": "x"},
                        {"objective": "0x1p+99999"},
                        {"objective": None},
                        {"objective": [1.0]},
                        {"x": [1.0]},
                        {"x": array | {"shape": [4]}},
                        {"x": array | {"shape": [10**30, 0]}},
                        {"x": array | {"shape": [True, 3]}},
                        {"x": array | {"dtype": "|O"}},
                        {"x": array | {"base64": "!"}},
                        {"x": array | {"base64": None}},
                    )
                ),
            )
        ),
    ]
