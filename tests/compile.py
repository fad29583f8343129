"""Compiles what tests share, before they begin: Numba keeps it on the disk, where every process finds it.

Two processes work side by side, each on kernels of its own; a kernel that is missed here is compiled in the first test
that calls it.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory


def phases_of_lights() -> None:
    """Images of a small light at any sampling phase, behind a linear readout and one in whole numbers."""
    from sweep.runs import run_study
    from sweep.study import load_study

    from .build import STUDY

    dim, budget = "exposure: {kind: fixed, exposure_s: 0.002}", "starts: 4, max_evaluations: 200"
    small = "target: {distance_m: 600, fov_deg: 60, phase_px: any}, optics: {f_number: 2}"
    text = (
        STUDY.replace("COUNT", "2").replace("count: 51", "count: 2").replace(budget, "starts: 1, max_evaluations: 10")
    )
    with TemporaryDirectory() as folder:
        for name, scene in (("whole numbers", small), ("linear", f"{small}, noise: {{read_noise_e: 10}}")):
            path = Path(folder) / f"{name}.yaml"
            path.write_text(text.replace(dim, scene))
            run_study(load_study(path), Path(folder) / name, 1, lambda *_: None)


def designs_and_metrics() -> None:
    """Blocks of filters, distances, errors under noise, worst cases over lamps."""
    import numpy as np

    from sweep.camera.noise import errors as confusion
    from sweep.camera.pixel import Pixel
    from sweep.features import FEATURES
    from sweep.runs import run_study
    from sweep.study import load_study

    from .build import STUDY

    dim, budget = "exposure: {kind: fixed, exposure_s: 0.002}", "starts: 4, max_evaluations: 200"
    assert dim in STUDY
    assert budget in STUDY
    text = (
        STUDY.replace("COUNT", "2").replace("count: 51", "count: 3").replace(budget, "starts: 1, max_evaluations: 10")
    )
    noisy = text.replace(dim, f"{dim}, noise: true") + "pixel: {read_noise_e: 2, prnu: 0.01, offset_dn: 64}\n"
    with TemporaryDirectory() as folder:
        for name, made in (("noisy", noisy), ("population", text + "population: {temperature_c: [-40, 85]}\n")):
            path = Path(folder) / f"{name}.yaml"
            path.write_text(made)
            run_study(load_study(path), Path(folder) / name, 1, lambda *_: None)
    channels, types = [np.arange(2), np.arange(2, 3)], {"a": np.array([0]), "b": np.array([1])}
    for well_e, bits in ((100.0, 8), (1e5, 16)):
        pixel = Pixel(well_e=well_e, bits=bits, read_noise_e=1.0)
        confusion.errors(np.array([[[9.0, 9, 9], [12.0, 12, 20]]]), channels, pixel, types)
    if "vision" in FEATURES:
        images()


def images() -> None:
    """Images of heads."""
    from sweep.features.vision.images import HeadCamera
    from sweep.features.vision.lamps import TEST, split_lamps
    from sweep.features.vision.scenes import SHUFFLED, draw_scenes

    from .features.vision.heads import NO_FILTERS, head_setup, vision

    requested, setup = vision(), head_setup()
    scenes = draw_scenes(requested, split_lamps(setup.lights, requested, (1, 0))[TEST], SHUFFLED, 1, (5,))
    HeadCamera(setup, NO_FILTERS, requested).images(scenes)


WORKS: tuple[Callable[[], None], ...] = (phases_of_lights, designs_and_metrics)


def compile_kernels() -> None:
    with ProcessPoolExecutor(len(WORKS), mp_context=get_context("spawn")) as pool:
        for done in [pool.submit(work) for work in WORKS]:
            done.result()


if __name__ == "__main__":
    compile_kernels()
