"""The costs by which plans are compared, measured: `make bench`, or `python tests/bench_work.py`, on one thread.

Prints each constant of the effects' `work` beside what it is here, in multiplications of the response of a design, or
in places of the light per place of the lattice. Plans only compare these; a factor of 3 changes hardly any.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sweep.camera.effects import blur, noise, phase, quantization, saturation
from sweep.camera.effects.base import Load
from sweep.camera.kernel import make_kernel
from sweep.camera.methods import REFERENCE
from sweep.camera.mosaic import Mosaic
from sweep.camera.noisy import table
from sweep.camera.pixel import Optics, Pixel
from sweep.camera.places import AnyPlace, forget_geometries
from sweep.camera.plan import work
from sweep.camera.plan.bounds import Box
from sweep.camera.plan.plan import Planner
from sweep.camera.scenario import Scenario
from sweep.camera.scene import FixedExposure, Noise, Target
from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.camera.view import View, per_photon, signal_irradiance
from sweep.curves.builtin.registry import BUILT_IN_LIGHTS
from sweep.curves.spectrum import WavelengthGrid
from sweep.designs.products import row_products

REPEATS = 15
GRID = WavelengthGrid(step_nm=5)
SENSOR = BUILT_IN_SENSORS["ar0820"](GRID)
PIXEL = Pixel(read_noise_e=2.0, offset_dn=64.0)
LIMITS = ("within 10 DN", "within 1 DN", "within 0.1 DN")


def shortest_s(work: Callable[[], object]) -> float:
    """Shortest wall time of `work`, once warm: what else runs on the machine only adds to it."""
    work()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def view(target: Target, pixel: Pixel = PIXEL) -> View:
    """RGGB before a light at a distance."""
    mosaic = Mosaic.from_name("RGGB")
    scenario = Scenario(target=target, optics=Optics(f_number=2.0), exposure=FixedExposure(exposure_s=2e-3))
    return View(
        GRID, mosaic, SENSOR.mosaic_qe(mosaic), (), SENSOR.qe["C"], BUILT_IN_LIGHTS["tl16"](GRID), pixel, scenario
    )


def multiplication_s() -> float:
    """One multiplication of the product of curves and scene."""
    rng = np.random.default_rng(1)
    qe, scene = rng.uniform(size=(1000, GRID.size)), rng.uniform(size=(GRID.size, 500))
    return shortest_s(lambda: row_products(qe, scene)) / (qe.size * scene.shape[1])


def readout_s() -> tuple[float, float, float]:
    """A pixel that is clipped, one that is rounded, and one that is looked up in the table of noise."""
    electrons = np.random.default_rng(1).uniform(0, 12_000, 1_000_000)
    clipped = shortest_s(lambda: saturation.clipped(electrons, PIXEL)) / electrons.size
    rounded = shortest_s(lambda: quantization.rounded(electrons, PIXEL)) / electrons.size
    return clipped, rounded, shortest_s(lambda: table.mean_rounded(electrons, PIXEL)) / electrons.size


def image_s() -> tuple[float, float]:
    """A wavelength of a blurred image: for each pixel that is looked at, and for the mean over a whole readout."""
    made = view(Target(distance_m=100, fov_deg=60))
    load = Load(units=3.0, nodes=GRID.size)
    methods = replace(REFERENCE, blur="every 5 nm")
    for effect in (blur.Blur(), phase.Phase()):
        load = effect.work(made, methods, load)

    def kernel(method: str) -> None:
        blur.PROFILES.clear()
        chosen = replace(methods, blur=method)
        make_kernel(made, chosen, GRID.nodes_nm, by_pixel=False, work=Counter(), cases=phase.cases(made, "one"))

    across = max(made.scenario.target.object_resolution_px + 1, 4.0)  # type: ignore[union-attr]
    more_s = shortest_s(lambda: kernel("every 5 nm")) - shortest_s(lambda: kernel("skip"))
    knots_um = GRID.nodes_nm * 1e-3
    whole_s = shortest_s(lambda: blur.mean_over_disc(7.7, 7.7, knots_um, 2.0, 0.0))
    return more_s / (across**2 * load.knots), whole_s / GRID.size


def planning_s() -> tuple[float, float]:
    """A plan of one CFA on a patch, and before a light at one place."""
    far = view(Target(distance_m=100, fov_deg=60, phase_px=(0.0, 0.0)))
    patch = replace(far, scenario=Scenario(noise=Noise()))
    boxes = (Box(replace(made, pixel=PIXEL), made.qe, made.qe, 1) for made in (patch, far))
    times = [shortest_s(lambda box=box: Planner([box]).plan("", 1.0)) for box in boxes]
    return times[0], times[1]


def places_per_decade() -> list[float]:
    """What a search adds for each decade below 100 DN, in places of the lattice, for some limits."""
    made = view(Target(distance_m=300, fov_deg=60, phase_px="any"))
    found = []
    for method in LIMITS:
        forget_geometries()
        work = Counter[str]()
        chosen = replace(made, methods=replace(REFERENCE, phase=method, blur="every 10 nm"))
        light_dn = signal_irradiance(made)[:, None] * made.qe * per_photon(made) * 2e-3 * PIXEL.dn_per_e
        AnyPlace(chosen, work).extremes(light_dn)
        decades = 2 - np.log10(phase.within_dn(method) or np.nan)
        found.append((work["places"] / len(phase.places_px(made, method)) - 1) / decades)
    return found


def main() -> None:
    """Print the table."""
    unit_s = multiplication_s()
    (clipped_s, rounded_s, looked_up_s), (pixel_s, whole_s) = readout_s(), image_s()
    rows = [
        ("a pixel that is clipped, in multiplications", saturation.CLIPPED, clipped_s / unit_s),
        ("a pixel that is rounded, in multiplications", quantization.ROUNDED, rounded_s / unit_s),
        ("a pixel through the table of noise, in pixels that are clipped", noise.LOOKED_UP, looked_up_s / clipped_s),
        ("a wavelength of the image of a pixel, in multiplications", blur.IMAGE, pixel_s / unit_s),
        ("a wavelength of the mean over a readout, in multiplications", blur.WHOLE_IMAGE, whole_s / unit_s),
    ]
    per_decade = places_per_decade()
    planned_s = planning_s()
    rows += [
        ("a plan of a patch, in multiplications", work.PLANNED_PATCH, planned_s[0] / unit_s),
        ("a plan before a light at a distance, in multiplications", work.PLANNED_TARGET, planned_s[1] / unit_s),
    ]
    rows += [(f"places per decade of {m}", phase.PER_DECADE, n) for m, n in zip(LIMITS, per_decade, strict=True)]
    print(f"a multiplication takes {unit_s * 1e9:.3g} ns")
    for name, constant, measured in rows:
        print(f"{name:<66} {constant:>8.3g}  measured {measured:>8.3g}  ratio {measured / constant:>6.2f}")


if __name__ == "__main__":
    main()
