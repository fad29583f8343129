"""What a worker of a sweep does not load."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from ..build import study_file

CODE = """
import sys
from pathlib import Path
from sweep.results.tables import LIMITED_BY, POINTS
from sweep.run.looks import Looking
from sweep.run.rows import jobs_of, rules_of
from sweep.run.sweep import _shards
from sweep.study import load_study

study = load_study(Path(sys.argv[1]))
rules, looking = rules_of(study), Looking.of(study, [LIMITED_BY, POINTS])
kinds = set()
for job in jobs_of(study):
    path = Path(sys.argv[2]) / f"{job.first_id}.parquet"
    _shards([(job, study.setup(job.space, job.scenario), path)], rules, looking)
    kinds.add(job.space.kind)
print(*sorted(kinds), *({"pandas", "matplotlib", "scipy.stats", "sklearn"} & sys.modules.keys()))
"""


def test_a_sweep_loads_no_pandas(tmp_path: Path) -> None:
    """PyArrow loads it on the first conversion that is its own."""
    ran = subprocess.run(
        [sys.executable, "-c", CODE, study_file(tmp_path, 3), tmp_path], capture_output=True, text=True, check=True
    )
    assert ran.stdout.split() == ["design", "reference", "sweep"]
