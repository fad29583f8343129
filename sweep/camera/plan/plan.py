"""Which effects a scene calls for: the cheapest methods whose proven errors sum to at most the study's tolerance."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property

from ..effects.phase import LATTICES
from ..view import REFERENCE, Methods
from .bounds import Box
from .promises import EFFECTS, READOUT, Promises

_NOTHING_DN = 1e-9
_NOTHING = {
    "noise": "moves no mean where nothing clips",
    "saturation": "no signal reaches it",
    "pedestal": "cancels in every difference",
}
"""Why an effect that could matter in other scenes changes less than this here."""
_OF_NOISE = (*READOUT, "sampling")
"""What metrics of noise ask for."""


@dataclass(frozen=True)
class Choice:
    """One effect of a plan: its method, what that changes in any CSD at most (DN), and why."""

    effect: str
    method: str
    promised_dn: float
    reason: str


@dataclass(frozen=True)
class Plan:
    """How one scene is simulated; `work` estimates the operations for all designs, `reference_work` everything on.

    Everything on is a mathematical limit. What no method reaches (the last of all places of a light, and how a readout
    in whole numbers moves the worst of them) is part of every promise, so that `promised_dn` may be above
    `tolerance_dn`: all else keeps the tolerance then.
    """

    scenario: str
    tolerance_dn: float
    choices: tuple[Choice, ...]
    work: float
    reference_work: float
    rejected: tuple[tuple[str, str, float], ...] = ()

    @property
    def methods(self) -> Methods:
        """The methods, as a setup takes them."""
        return Methods(**{choice.effect: choice.method for choice in self.choices})

    @property
    def promised_dn(self) -> float:
        """No CSD differs by more from the reference."""
        return sum(choice.promised_dn for choice in self.choices)

    @property
    def kept(self) -> bool:
        """Whether the tolerance is kept."""
        return self.promised_dn <= self.tolerance_dn

    @cached_property
    def key(self) -> str:
        """Hash of the methods: part of every cache key, and in every row."""
        return hashlib.sha256(json.dumps(asdict(self.methods), sort_keys=True).encode()).hexdigest()[:12]

    @property
    def computed(self) -> tuple[str, ...]:
        """Effects that are not skipped."""
        return tuple(c.effect for c in self.choices if c.method not in ("skip", "one"))


class Planner:
    """Finds the plan of a scene for all its boxes of designs."""

    def __init__(self, boxes: Sequence[Box], *, for_noise: bool = False) -> None:
        """`for_noise`: metrics of noise are asked for, which need every pixel and what the readout does to it."""
        self._for_noise = for_noise
        self._scenes = [Promises(box) for box in boxes]
        self._exact = {effect: self._why_exact(effect) for effect in EFFECTS}

    def _why_exact(self, effect: str) -> str | None:
        """The reason when skipping an effect changes nothing in any box."""
        if effect == "saturation":
            # Rounding ends at the ADC's range, too: only where that is left out, all of the excess shows.
            before = replace(REFERENCE, quantization="skip")
            if any(scene.promise(effect, before, replace(before, saturation="skip")) for scene in self._scenes):
                return None
            if self._noisy:
                return None
            top = max(float(scene.reach.brightest_dn.max()) for scene in self._scenes)
            return f"the brightest signal has at most {top:.0f} DN"
        reasons = [EFFECTS[effect].skip_is_exact(scene.setup) for scene in self._scenes]
        return None if None in reasons else str(reasons[0])

    def promise(self, effect: str, before: Methods, after: Methods) -> float:
        """What switching an effect changes in any CSD of any box, DN."""
        return max((scene.promise(effect, before, after) for scene in self._scenes), default=0.0)

    def plan(self, scenario: str, tolerance_dn: float) -> Plan:
        """The cheapest plan whose promises sum to at most `tolerance_dn`; of equally cheap ones, what skips more.

        Where no plan does, one that keeps it but for what the places of a light leave open.
        """
        tried: dict[tuple[str, str], float] = {}
        kept = self._cheapest(tolerance_dn, tried) or self._cheapest(tolerance_dn, tried, besides=True)
        assert kept is not None  # everything on changes nothing but what is left open
        methods, promises = kept
        choices = tuple(
            Choice(e, method, promises.get(e, 0.0), self._reason(e, method, promises.get(e, 0.0), tried))
            for e, method in asdict(methods).items()
        )
        rejected = tuple((e, m, dn) for (e, m), dn in tried.items() if getattr(methods, e) != m)
        return Plan(scenario, tolerance_dn, choices, self._work(methods), self._work(REFERENCE), rejected)

    def _work(self, methods: Methods) -> float:
        return sum(scene.work_of(methods) for scene in self._scenes)

    @property
    def _start(self) -> Methods:
        """Everything on but what changes nothing."""
        return replace(REFERENCE, **{e: EFFECTS[e].METHODS[0] for e in EFFECTS if self._exact[e] is not None})

    def _left_over(self, methods: Methods) -> float:
        """What no method of `phase` takes away: over all places everything on is a limit."""
        return self.promise("phase", methods, replace(methods, phase=REFERENCE.phase))

    def _cheapest(
        self, tolerance_dn: float, tried: dict[tuple[str, str], float], *, besides: bool = False
    ) -> tuple[Methods, dict[str, float]] | None:
        """Branch and bound over the effects, cheapest methods first; `tried` takes each method's smallest promise.

        None where no plan keeps the tolerance; `besides`: what no method takes away does not count, so that all places
        are looked at, however little can be promised of them.
        """
        start = self._start
        active = [e for e in EFFECTS if self._exact[e] is None]
        best: list[tuple[float, Methods, dict[str, float]]] = []

        def deeper(at: int, methods: Methods, promises: dict[str, float]) -> None:
            # Every further effect at its cheapest: no completion of these methods costs less.
            least = self._work(replace(methods, **{e: EFFECTS[e].METHODS[0] for e in active[at:]}))
            if best and least >= best[0][0]:
                return
            if at == len(active):
                best[:] = [(least, methods, promises)]
                return
            effect = active[at]
            for method in EFFECTS[effect].METHODS:
                after = replace(methods, **{effect: method})
                if not self._allowed(effect, after) or (besides and effect == "phase" and method in LATTICES):
                    continue
                promised = self.promise(effect, methods, after)
                tried[effect, method] = min(promised, tried.get((effect, method), promised))
                # Behind a rounded readout, an error however small may move a value by a whole step.
                rounded = after.quantization == "round" and not self._noisy
                exactly = rounded and effect not in (*READOUT, "phase")
                allowed = promises.get("phase", 0.0) if exactly else tolerance_dn
                if besides and not exactly and ("phase" in promises or effect == "phase"):
                    allowed += self._left_over(after)
                if sum(promises.values()) + promised <= allowed:
                    deeper(at + 1, after, promises | {effect: promised})

        deeper(0, start, {})
        return best[0][1:] if best else None

    @property
    def _noisy(self) -> bool:
        return any(scene.setup.scenario.noise is not None for scene in self._scenes)

    def _allowed(self, effect: str, methods: Methods) -> bool:
        """Without pixels nothing saturates or is rounded one by one; noise moves a mean only where something clips, and
        rounding clips, too.
        """
        if self._for_noise and effect in _OF_NOISE:
            return bool(getattr(methods, effect) == getattr(REFERENCE, effect))
        if effect == "saturation" and methods.saturation == "skip":
            quiet = self._exact["noise"] is not None or methods.noise == "skip"
            return quiet and methods.quantization == "skip"
        return effect != "sampling" or methods.sampling != "skip" or methods.straight

    def _reason(self, effect: str, method: str, promised: float, tried: Mapping[tuple[str, str], float]) -> str:
        exact = self._exact[effect]
        if exact is not None:
            return exact
        if self._for_noise and effect in _OF_NOISE:
            return "the noise metrics ask for it"
        methods = EFFECTS[effect].METHODS
        if method == methods[0] and promised < _NOTHING_DN:
            return _NOTHING.get(effect, "changes nothing here")
        if promised > 0:
            return f"changes a CSD by at most {promised:.2g} DN"
        cheaper = {m: tried[effect, m] for m in methods[: methods.index(method)] if (effect, m) in tried}
        if not cheaper:
            return "what else is chosen needs it"
        nearest = min(cheaper, key=lambda m: cheaper[m])
        return f"else ({nearest}) a CSD changes by up to {cheaper[nearest]:.2g} DN"
