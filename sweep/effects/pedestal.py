"""The pedestal: an offset that the readout adds. It cancels in a distance unless something clips."""

from __future__ import annotations

from ..setup import Setup

METHODS = ("skip", "add")


def skip_is_exact(setup: Setup) -> str | None:
    """Why leaving it out changes nothing; None when it may."""
    return "no pedestal" if setup.pixel.offset_dn == 0 else None


def promise(setup: Setup, brightest_dn: float, *, clipped: bool) -> float:
    """Range of what leaving it out changes in one coordinate, DN; `clipped`: a full well or ADC is simulated."""
    pixel = setup.pixel
    if not clipped:
        return 0.0
    return min(pixel.offset_dn, max(0.0, brightest_dn + pixel.offset_dn - pixel.full_scale_dn))
