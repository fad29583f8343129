"""The seconds by which plans are compared, and whether plans pay: `make bench`, or `python tests/bench_work.py [STUDY ...]`.

On one thread. Prints each constant of the effects' `work` and of `camera/plan/work.py` beside what it is here; a factor of 3
either way is said. Then every scene of every shipped study (or of those named), at four tolerances, for one design and
for all: everything on, and as a run does it, with the time to find its plan. Writes outputs/bench/plans.json, and
fails where plan and run take more than 1.1 times everything on, and do so again in five times as many measurements.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import numpy as np

from sweep.base.errors import StudyError
from sweep.base.types import FloatArray
from sweep.camera.effects import base, blur, noise, phase, quantization, sampling, saturation
from sweep.camera.forget import forget_scenes
from sweep.camera.imager import Imager
from sweep.camera.kernel_size import pixels_per_place
from sweep.camera.methods import REFERENCE
from sweep.camera.mosaic import Mosaic
from sweep.camera.noisy import table
from sweep.camera.pixel import Optics, Pixel
from sweep.camera.places import AnyPlace
from sweep.camera.plan import work
from sweep.camera.plan.bounds import Box
from sweep.camera.plan.promises import Promises
from sweep.camera.plan.scene_kernels import SceneKernels
from sweep.camera.plan.work import DesignCount
from sweep.camera.scenario import Scenario
from sweep.camera.scene import FixedExposure, Noise, Target
from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.camera.view import View, per_photon, signal_irradiance
from sweep.commands.accuracy.payments import PAID_AT_DN, Payment, payments
from sweep.curves.builtin.registry import BUILT_IN_LIGHTS
from sweep.curves.spectrum import WavelengthGrid
from sweep.designs.block import edges_of
from sweep.designs.products import row_products
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import separations_by_edges
from sweep.results.identity import CHUNK
from sweep.results.journal import Shard
from sweep.run.rows import jobs_of, rules_of, run_job
from sweep.study import load_study
from sweep.study.shipped import shipped_names, study_path

REPEATS = 5
MOST = 1.1
"""Plan and run may take this many times everything on."""
CLOCK_S = 5e-4
"""Seconds that do not count."""
OFF = 3.0
OUTPUT = Path(__file__).parent.parent / "outputs" / "bench" / "plans.json"
GRID = WavelengthGrid(step_nm=1)
SENSOR = BUILT_IN_SENSORS["ar0820"](GRID)
PIXEL = Pixel(read_noise_e=2.0, offset_dn=64.0)
LIMITS = ("within 1 DN", "within 0.01 DN", "within 0.0001 DN")


def shortest_s(run: Callable[[], object], *, cold: bool = False) -> float:
    """Shortest CPU time of `run`, once warm, but for what scenes keep where it is to be `cold`."""
    run()
    times = []
    for _ in range(REPEATS):
        if cold:
            forget_scenes()
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def view(distance_m: float, phase_px: str | tuple[float, float] = "any", *, noisy: bool = False) -> View:
    """RGGB before a light at a distance."""
    mosaic = Mosaic.from_name("RGGB")
    scenario = Scenario(
        target=Target(distance_m=distance_m, fov_deg=60, phase_px=phase_px),
        optics=Optics(f_number=2.0),
        exposure=FixedExposure(exposure_s=2e-3),
        noise=Noise() if noisy else None,
    )
    return View(
        GRID, mosaic, SENSOR.mosaic_qe(mosaic), (), SENSOR.qe["C"], BUILT_IN_LIGHTS["tl16"](GRID), PIXEL, scenario
    )


def of_values() -> Iterator[tuple[str, float, float]]:
    """A multiplication, and a value of the readout."""
    rng = np.random.default_rng(1)
    qe, scene = rng.uniform(size=(1000, GRID.size)), rng.uniform(size=(GRID.size, 500))
    electrons = rng.uniform(0, 12_000, 1_000_000)
    each = 1 / electrons.size
    product_s = shortest_s(lambda: row_products(qe, scene)) / (qe.size * scene.shape[1])
    yield "a multiplication", base.MULTIPLICATION_S, product_s
    clipped_s = shortest_s(lambda: saturation.clipped(electrons, PIXEL)) * each
    yield "a value that is clipped", saturation.CLIPPED_S, clipped_s
    rounded_s = shortest_s(lambda: quantization.rounded(electrons, PIXEL)) * each
    yield "a value that is rounded", quantization.ROUNDED_S, rounded_s
    looked_up_s = shortest_s(lambda: table.mean_rounded(electrons, PIXEL)) * each
    yield "a value through the table of noise", noise.LOOKED_UP_S, looked_up_s
    yield "the table of noise", noise.TABLE_S, shortest_s(lambda: table.mean_rounded(np.ones(1), PIXEL), cold=True)


def of_designs() -> Iterator[tuple[str, float, float]]:
    """Designs by their edges."""
    study = load_study(study_path(Path("stopband")))
    space = next(space for space in study.spaces if space.kind == "sweep")
    made = study.view(space, next(iter(study.scenarios)))
    block, rules = edges_of(space, 0, CHUNK), rules_of(study)
    assert block is not None
    job = next(job for job in jobs_of(study) if job.space is space)

    def rows() -> None:
        Shard.of(run_job(job, made, rules), 0.0)

    imager = Imager(made)

    def distances() -> None:
        changing = imager.read_changing(block)
        assert changing is not None
        separations_by_edges(changing, made.members)

    numbers_s = shortest_s(distances)
    row_s = shortest_s(rows) / (job.stop - job.start) - numbers_s / len(block)
    yield "a design's other columns and its row", work.ROW_S, row_s
    whole, unrounded = (
        Imager(replace(made, methods=replace(REFERENCE, quantization=name)))
        for name in (REFERENCE.quantization, "skip")
    )
    more_s = shortest_s(lambda: evaluate(unrounded, block)) - shortest_s(lambda: evaluate(whole, block))
    each_s = more_s / (len(block) * len(made.lights.photons))
    yield "a value that is not rounded, of a design by its edges", work.UNROUNDED_S, each_s


def of_images() -> Iterator[tuple[str, float, float]]:
    """The image of a light, and the mean over a readout."""
    wave_um = GRID.nodes_nm * 1e-3
    made = blur.Profile(7.7, 20.0, wave_um, 2.0, 0.0)
    made_s = shortest_s(lambda: blur.Profile(7.7, 20.0, wave_um, 2.0, 0.0))
    yield "a radius, frequency and wavelength of an image", blur.PROFILE_S, made_s / made.work
    whole_s = shortest_s(lambda: blur.mean_over_disc(7.7, 7.7, wave_um, 2.0, 0.0)) / wave_um.size
    yield "a wavelength of the mean over a readout", blur.WHOLE_IMAGE_S, whole_s


def search(made: View, light_dn: FloatArray, counted: Counter[str] | None = None) -> None:
    """The worst of all places of a design."""
    AnyPlace(made, Counter() if counted is None else counted).extremes(light_dn)


def of_lattices() -> Iterator[tuple[str, float, float]]:
    """What each pixel takes that a light may cover, at each place of a lattice."""
    for distance_m in (20.0, 100.0):
        made = view(distance_m)
        one, every = (replace(made, methods=replace(REFERENCE, phase=name)) for name in ("one", "quarter pixel"))
        across = 2 * sampling.radii_px(made, made.scenario.target)[1] + 1  # type: ignore[arg-type]
        values = (phase.n_places(every, "quarter pixel") - 1) * across**2 * len(made.mosaic.channels) * GRID.size
        every_s, one_s = (shortest_s(lambda made=own: Imager(made).electrons, cold=True) for own in (every, one))
        yield f"a pixel of a place, through a filter, {distance_m:g} m", sampling.PIXEL_S, (every_s - one_s) / values


def of_searches() -> Iterator[tuple[str, float, float]]:
    """The worst of all places of a light that is near or far: to begin, for each new place, and for each design."""
    for distance_m in (20.0, 60.0, 300.0):
        made = view(distance_m)
        light_dn = signal_irradiance(made)[:, None] * made.qe * per_photon(made) * 2e-3 * PIXEL.dn_per_e
        across = 2 * sampling.radii_px(made, made.scenario.target)[1] + 1  # type: ignore[arg-type]
        around = (across + sampling.AROUND_PX) ** 2 * sampling.MOST_FUNCTIONS
        new_s, new = [], []
        for method in LIMITS:
            chosen, counted, deep = (
                replace(made, methods=replace(REFERENCE, phase=method)),
                Counter[str](),
                phase.decades(method),
            )
            forget_scenes()
            search(chosen, light_dn, counted)
            again_s = shortest_s(partial(search, chosen, light_dn))
            new_s.append(shortest_s(partial(search, chosen, light_dn), cold=True) - again_s)
            new.append(counted["places"])
            at = f"{method}, {distance_m:g} m"
            ratio = new[-1] / len(phase.places_px(made, method))
            yield (
                f"places per place of the lattice, {at}",
                sampling.searched_places(phase.AT_ALL + phase.PER_DECADE * deep**2, across),
                ratio,
            )
            yield f"a design, {at}", phase.SEARCH_S + phase.SEARCH_DECADE_S * deep, again_s
        place_s = (new_s[-1] - new_s[0]) / (new[-1] - new[0])
        yield f"a place, {distance_m:g} m", sampling.PLACE_S + sampling.PLACE_PIXEL_S * around, place_s
        begun_s = sampling.SEARCHED_S + sampling.SEARCHED_PIXEL_S * around
        yield f"to begin a search, {distance_m:g} m", begun_s, new_s[0] - new[0] * place_s


def of_plans() -> Iterator[tuple[str, float, float]]:
    """What bounds take."""
    far, patch = view(250.0, (0.0, 0.0), noisy=True), replace(view(250.0), scenario=Scenario())
    bright = replace(
        far, scenario=far.scenario.model_copy(update={"exposure": FixedExposure(exposure_s=1.0)})
    )  # beyond the full well no closed form will do
    uneven = replace(bright, pixel=PIXEL.model_copy(update={"prnu": 0.01}))

    def promises(made: View) -> Promises:
        return Promises(Box(made, made.qe, made.qe, DesignCount(1)), SceneKernels(made))

    yield "the reach of a box", work.REACH_S, shortest_s(lambda: promises(patch).reach.brightest_pixels_dn)
    skipped = replace(REFERENCE, noise="skip")
    unrounded = replace(skipped, quantization="skip")

    def readout(made: View) -> None:
        looked = promises(made)
        looked.promise("noise", REFERENCE, skipped)
        looked.promise("quantization", skipped, unrounded)

    yield "the first bounds of a noisy readout", work.NOISE_S, shortest_s(lambda: readout(bright), cold=True)
    yield "the same with PRNU", work.UNEVEN_NOISE_S, shortest_s(lambda: readout(uneven), cold=True)
    straight = replace(unrounded, saturation="skip")

    def optics(*methods: str) -> None:
        looked = promises(far)
        for method in methods:
            looked.promise("blur", straight, replace(straight, blur=method))

    one_s = shortest_s(lambda: optics("every 10 nm"), cold=True)
    corners = pixels_per_place(far)
    yield f"a kernel and a bound of the optics, {corners} pixels", work.KERNEL_S + work.LINEAR_S, one_s
    more_s = shortest_s(lambda: optics("every 10 nm", "every 5 nm", "every 2 nm")) - shortest_s(
        lambda: optics("every 10 nm")
    )
    yield "a further bound of the optics", work.LINEAR_S, more_s / 2


def constants() -> None:
    """Print the table of constants."""
    for part in (of_values(), of_designs(), of_images(), of_lattices(), of_searches(), of_plans()):
        for name, constant, measured in part:
            ratio = measured / constant
            said = "" if 1 / OFF <= ratio <= OFF else f"  off by more than {OFF:g} times"
            print(f"{name:<58} {constant:>9.3g}  measured {measured:>9.3g}  ratio {ratio:>6.2f}{said}", flush=True)


def paid(names: list[str]) -> Iterator[Payment]:
    """Every scene of some studies."""
    for name in names:
        try:
            study = load_study(study_path(Path(name)))
        except StudyError as error:
            print(f"{name} is left out: {error.faults[0]}")
            continue
        if any(space.size for space in study.spaces):
            yield from payments(study, list(study.scenarios), PAID_AT_DN, REPEATS)


def loses(one: Payment) -> bool:
    """Whether plan and run take too long, by more than the clock says of work as short."""
    return one.plan_s + one.run_s > MOST * one.everything_s + CLOCK_S


def once_more(one: Payment) -> Payment:
    """The same, measured more often: a virtual machine is not always as fast."""
    study = load_study(study_path(Path(one.study)))
    (again,) = payments(study, [one.scenario], [one.tolerance_dn], 5 * REPEATS, [one.designs])
    return again


def main() -> int:
    """Print both tables; 1 where a plan does not pay."""
    constants()
    found = []
    for one in paid(sys.argv[1:] or shipped_names()):
        found.append(one)
        off = one.estimated_s / one.everything_s
        said = "" if 1 / OFF <= off <= OFF else f"  estimated {one.estimated_s:.3g} s"
        print(
            f"{one.study:<10} {one.scenario:<28} {one.n_designs:>7} designs, {one.tolerance_dn:5g} DN: everything on {one.everything_s:8.4f} s, "
            f"plan {one.plan_s:7.4f}, run {one.run_s:8.4f}, {one.factor:6.2f} times faster{said}",
            flush=True,
        )
    OUTPUT.parent.mkdir(parents=True, exist_ok=True)
    OUTPUT.write_text(json.dumps([asdict(one) | {"factor": one.factor} for one in found], indent=1))
    lost = [again for one in found if loses(one) and loses(again := once_more(one))]
    for one in lost:
        print(
            f"{one.study}, {one.scenario}, {one.designs}, {one.tolerance_dn:g} DN: plan and run take more than {MOST:g} times everything on"
        )
    return int(bool(lost))


if __name__ == "__main__":
    raise SystemExit(main())
