"""The main job and its resume without the modules that Unix alone has."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from sweep.study import load_study

from ..build import ran, study_file
from ..mischief import assert_same_tables

UNIX_ONLY = ("fcntl", "grp", "pwd", "resource", "termios")
HIDDEN = f"""
import signal, sys
import psutil  # has code of its own for each system
sys.modules.update(dict.fromkeys({UNIX_ONLY}, None))
for name in ("SIGKILL", "SIGHUP", "SIGXFSZ", "SIGALRM", "pthread_sigmask"):
    delattr(signal, name)
"""
INTERRUPTED = f"""{HIDDEN}
from pathlib import Path
from sweep.runs import run_study
from sweep.study import load_study

def stop(phase, done, total):
    if phase == "designs" and done > 3:
        raise KeyboardInterrupt

run_study(load_study(Path(sys.argv[1])), Path(sys.argv[2]) / "tiny", 1, stop)
"""
CONTINUED = f"""{HIDDEN}
from sweep.cli.start import start
sys.argv = ["sweep", "run", sys.argv[1], "--output", sys.argv[2], "--jobs", "1"]
start()
"""


def test_a_run_is_interrupted_and_continued(tmp_path: Path) -> None:
    path = study_file(tmp_path, 3)
    path.write_text(path.read_text().replace("max_evaluations: 200", "max_evaluations: 12"))
    paths = str(path), str(tmp_path / "out")
    first = subprocess.run([sys.executable, "-c", INTERRUPTED, *paths], capture_output=True, text=True, check=False)
    assert "InterruptedRunError" in first.stderr
    assert list((tmp_path / "out" / "tiny" / "results.parquet").iterdir())
    done = subprocess.run([sys.executable, "-c", CONTINUED, *paths], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "tiny" / "report.html").exists()
    ran(load_study(path), tmp_path / "whole", 1)
    assert_same_tables(tmp_path / "out" / "tiny", tmp_path / "whole")
