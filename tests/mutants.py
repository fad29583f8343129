"""Mutants: faults of meaning that the tests must see. `make mutants` plants each in a process of its own, and runs its tests.

A mutant lives if they pass. The libraries are imported once; each process forks, and reads the package with one text
replaced.
"""

from __future__ import annotations

import os
import sys
import time
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parent.parent
GOLDEN, EFFECTS, PLAN = "contracts/test_golden.py", "camera/test_effects.py", "camera/test_plan.py"
CAPTURES, LIMIT, SEARCH = "camera/test_captures.py", "search/test_limit.py", "search/test_search.py"
SMOOTH, DAMAGE, RUNNER = "search/test_smooth.py", "results/test_damage.py", "run/test_runner.py"
IDENTITY = "study/test_identity.py"


class Mutant(NamedTuple):
    """A text of a module, what it becomes, and the tests that see it, one or several."""

    module: str
    text: str
    becomes: str
    tests: str = GOLDEN


MUTANTS = (
    Mutant("camera/irradiance", "unscattered = 1 - share", "unscattered = 1 + share", PLAN),
    Mutant("camera/irradiance", "scene.off_axis_deg)) ** 4", "scene.off_axis_deg)) ** 3", EFFECTS),
    Mutant(
        "camera/irradiance",
        "(wavelength_nm / _REFERENCE_NM) ** -exponent",
        "(wavelength_nm / _REFERENCE_NM) ** exponent",
        EFFECTS,
    ),
    Mutant(
        "camera/irradiance",
        "luminance / per_photon_radiance * factor)[:, None]",
        "luminance * per_photon_radiance * factor)[:, None]",
    ),
    Mutant("camera/pixel", "cone = 1 + 4 * optics.f_number**2", "cone = 1 + 2 * optics.f_number**2"),
    Mutant(
        "camera/pixel",
        "(self.full_scale_dn - self.offset_dn) / self.dn_per_e)",
        "(self.full_scale_dn + self.offset_dn) / self.dn_per_e)",
        EFFECTS,
    ),
    Mutant("camera/pixel", "int(2**self.bits - 1)", "int(2**self.bits)"),
    Mutant(
        "camera/pixel",
        "electrons * pixel.dn_per_e + pixel.offset_dn)",
        "electrons * pixel.dn_per_e - pixel.offset_dn)",
    ),
    Mutant(
        "camera/pixel",
        "(self.pitch_um * 1e-6) ** 2 * self.fill_factor",
        "(self.pitch_um * 1e-6) ** 2",
        "camera/test_isetcam.py",
    ),
    Mutant("camera/exposure", "full_e = exposure.level * setup", "full_e = setup"),
    Mutant("camera/exposure", "radiance / (ratio * grid.span_nm)", "radiance / (ratio * grid.size)"),
    Mutant("camera/pwm", "on_time(drive, start)) / (length * drive.duty)", "on_time(drive, start)) / length", CAPTURES),
    Mutant("camera/pwm", "np.maximum(0, rest - (1 - drive.duty))", "np.maximum(0, rest - drive.duty)", EFFECTS),
    Mutant("camera/sampling", "(share / 4, down, right)", "(share / 8, down, right)", EFFECTS),
    Mutant("camera/sampling", "radius = target.object_resolution_px / 2", "radius = target.object_resolution_px"),
    Mutant("camera/sampling", "1 - np.abs(dx) / columns", "1 - np.abs(dx) / rows", EFFECTS),
    Mutant(
        "camera/sampling",
        "rows % tile.shape[0], columns % tile.shape[1]",
        "rows % tile.shape[1], columns % tile.shape[0]",
        EFFECTS,
    ),
    Mutant(
        "camera/psf",
        "/ (8 * scenario.optics.f_number**2)",
        "/ (4 * scenario.optics.f_number**2)",
        "camera/test_disc_image.py",
    ),
    Mutant(
        "camera/readout",
        "most_e = pixel.saturation_e if clips else np.inf",
        "most_e = np.inf",
        PLAN,
    ),
    Mutant(
        "camera/electrons",
        "+ camera.pixel.dark_e_per_s",
        "- camera.pixel.dark_e_per_s",
        PLAN,
    ),
    Mutant("camera/electrons", "lit += self.fixed(exposure)[0]", "lit -= self.fixed(exposure)[0]"),
    Mutant(
        "camera/angular",
        "1 / np.sqrt(1 - sine_squared / index**2)",
        "np.sqrt(1 - sine_squared / index**2)",
        "camera/test_angle.py",
    ),
    Mutant(
        "camera/angular",
        "math.asin(min(1.0, 0.5 / f_number))",
        "math.asin(min(1.0, 1.0 / f_number))",
        "camera/test_angle.py",
    ),
    Mutant("camera/plan", "budget_dn, computed = tolerance_dn / 2", "budget_dn, computed = tolerance_dn * 2", PLAN),
    Mutant("camera/effects", "lost = box.signals * (1 - kept)", "lost = box.signals * (1 - kept) / 50", PLAN),
    Mutant(
        "camera/effects",
        "change = (matrix.T @ light.T).T - light",
        "change = ((matrix.T @ light.T).T - light) / 50",
        PLAN,
    ),
    Mutant("spectra/spectrum", "bins[[0, -1]] /= 2", "bins[[0, -1]] /= 1"),
    Mutant(
        "spectra/color",
        "photons) * grid.bins_nm\n    return np.asarray(energy @ color_matching(grid).T",
        "photons) * grid.bins_nm\n    return np.asarray(energy @ color_matching(grid)[::-1].T",
    ),
    Mutant(
        "metrics/separation",
        "np.sqrt(4 * mosaic.counts / mosaic.counts.sum())",
        "np.sqrt(2 * mosaic.counts / mosaic.counts.sum())",
    ),
    Mutant(
        "metrics/separation",
        "weighted = np.moveaxis(total_qe * counts, -1, 0)",
        "weighted = np.moveaxis(total_qe, -1, 0)",
    ),
    Mutant("metrics/separation", "start=weighted[0]) / counts.sum()", "start=weighted[0]) / counts.size"),
    Mutant("metrics/objective", "weight * columns[name]", "columns[name] / weight", "features/tasks/test_search.py"),
    Mutant("metrics/bound", "self.min - values", "values - self.min", SEARCH),
    Mutant("metrics/bound", "end = max(abs(self.min or 0.0)", "end = min(abs(self.min or 0.0)", RUNNER),
    Mutant("metrics/bound", "if quantity not in leave_out", "if quantity in leave_out", RUNNER),
    Mutant("metrics/pareto", "maximise=True", "maximise=False", "report/test_report.py"),
    Mutant("metrics/smooth", "per = np.divide(0.5, values", "per = np.divide(1.0, values", SMOOTH),
    Mutant("metrics/smooth", "2 * self.values[:, None] * self.by_u", "self.values[:, None] * self.by_u", SMOOTH),
    Mutant(
        "search/filter_program",
        "self.low, self.high = self.base * least, highest(problem)",
        "self.low, self.high = self.base * least, self.base",
        LIMIT,
    ),
    Mutant("search/filter_program", "self.high * (1 + ROUNDING)", "self.high * 0.99", "search/test_limit_sides.py"),
    Mutant(
        "search/upper_bound",
        "Bound.model_construct(min=max(least, default=None)",
        "Bound.model_construct(min=min(least, default=None)",
        "search/test_produced_limit.py",
    ),
    Mutant(
        "search/upper_bound",
        "return 1 - min(value, proven) / proven",
        "return 1 - proven / min(value, proven)",
        "cli/test_evaluate.py",
    ),
    Mutant(
        "search/perturbed",
        "self.scale * curve[self.source] + self.constant",
        "curve[self.source] + self.constant",
        "search/test_produced_limit.py",
    ),
    Mutant(
        "search/sides",
        "reach = min(part.cap, program.top)",
        "reach = max(part.cap, program.top)",
        "search/test_limit_sides.py",
    ),
    Mutant("search/trade_off", "check_bound(best.objective, limit.proven, where)", "pass", SEARCH),
    Mutant("search/problem", "key=lambda e: e.objective", "key=lambda e: -e.objective", SEARCH),
    Mutant(
        "runs/as_read",
        "objective = np.minimum(objective,",
        "objective = np.maximum(objective,",
        "search/test_as_read.py",
    ),
    Mutant(
        "runs/as_read",
        "bound.violation(columns[name]) * bound.scale",
        "bound.violation(columns[name])",
        "search/test_as_read.py",
    ),
    Mutant("runs/rows", "[job.scenario, job.space, job.start, job.stop]", "[job.space, job.start, job.stop]", DAMAGE),
    Mutant("runs/kept", "answer {self._round}, {at}", "answer {at}", "search/test_search.py run/test_runner.py"),
    Mutant("runs/handovers", "capture.light * capture.qe_factor", "capture.qe_factor", "run/test_handovers.py"),
    Mutant(
        "features/draws/uncertainty",
        "weights * curve + rest",
        "weights + rest",
        "features/draws/test_uncertain_search.py",
    ),
    Mutant(
        "runs/check", "stored == exact or (math", "True or (math", "features/audit/test_audit.py run/test_runner.py"
    ),
    Mutant("results/identity", '"files": dict(study.digests)', '"files": {}', IDENTITY),
    Mutant("results/identity", '"lights": lights.hexdigest()', '"lights": ""', IDENTITY),
    Mutant("results/identity", '"curves": curves.hexdigest()', '"curves": ""', IDENTITY),
    Mutant("results/manifest", "digest_of(path) != self.files[name]", "False", DAMAGE),
    Mutant("results/manifest", 'self.fingerprint == str(facts["fingerprint"])', "True", "run/test_faults.py"),
    Mutant("designs/bands", "edges[:, :, 0] - edges[:, :, 1]", "edges[:, :, 1] - edges[:, :, 0]"),
)
"""Faults of sign, factor, axis, argument, clip, unit and key."""


class Planted(MetaPathFinder):
    """Reads one module of the package with its text replaced."""

    def __init__(self, mutant: Mutant) -> None:
        self._mutant = mutant
        self._name = f"sweep.{mutant.module.replace('/', '.')}"

    def find_spec(self, name: str, path: object = None, _: object = None) -> ModuleSpec | None:  # type: ignore[override]
        """Find the module as Python does, with another loader."""
        if name != self._name:
            return None
        spec = PathFinder.find_spec(name, path)  # type: ignore[arg-type]
        assert spec is not None
        assert spec.origin is not None
        spec.loader = _Replaced(name, spec.origin, self._mutant)
        return spec


class _Replaced(SourceFileLoader):
    def __init__(self, name: str, path: str, mutant: Mutant) -> None:
        super().__init__(name, path)
        self._mutant = mutant

    def get_code(self, _: str) -> object:  # type: ignore[override]
        text = Path(self.path).read_text(encoding="utf-8")
        return compile(text.replace(self._mutant.text, self._mutant.becomes), self.path, "exec")


def misplaced() -> list[Mutant]:
    """Mutants whose text does not stand in its module exactly once, or whose tests are gone."""

    def is_placed(mutant: Mutant) -> bool:
        module = ROOT / "sweep" / f"{mutant.module}.py"
        known = module.is_file() and all((ROOT / "tests" / name).is_file() for name in mutant.tests.split())
        return known and module.read_text(encoding="utf-8").count(mutant.text) == 1

    return [mutant for mutant in MUTANTS if not is_placed(mutant)]


def killer_of(mutant: Mutant) -> str:
    """The test that fails first; empty if the mutant lives."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        _test(mutant, write)
    os.close(write)
    with os.fdopen(read) as said:
        text = said.read()
    os.waitpid(child, 0)
    return text


def _test(mutant: Mutant, write: int) -> None:
    import pytest

    failed: list[str] = []

    class Listener:
        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            if report.failed:
                failed.append(report.nodeid)

        def pytest_collectreport(self, report: pytest.CollectReport) -> None:
            if report.failed:
                failed.append(report.nodeid)

    sys.meta_path.insert(0, Planted(mutant))
    os.environ |= {"UNCHECKED_TYPES": "1", "UNLIMITED_CPU": "1"}
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    tests = [str(ROOT / "tests" / name) for name in mutant.tests.split()]
    pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-m", "slow or not slow", *tests], plugins=[Listener()])
    os.write(write, (failed[0] if failed else "").encode())
    os._exit(0)


def main(wanted: list[str]) -> int:
    """Plant the mutants of the named modules, or all; print what kills each, and return how many live."""
    for name in ("numpy", "scipy.optimize", "scipy.stats", "pandas", "pyarrow.parquet", "numba", "pydantic", "pytest"):
        __import__(name)
    wrong, planted = misplaced(), 0
    alive = len(wrong)
    for mutant in wrong:
        print(f"not planted: {mutant.module}: {mutant.text}")
    for mutant in MUTANTS:
        if mutant in wrong or (wanted and mutant.module not in wanted):
            continue
        began, planted = time.monotonic(), planted + 1
        killer = killer_of(mutant)
        alive += not killer
        print(
            f"{killer or 'LIVES':70} {mutant.module}: {mutant.becomes} ({time.monotonic() - began:.0f} s)", flush=True
        )
    print(f"{planted - alive} of {planted} mutants are killed.")
    return alive


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]) > 0)
