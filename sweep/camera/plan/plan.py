"""Which effects a scene calls for: the cheapest methods whose proven errors sum to at most the study's tolerance."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property

from ..effects.base import Effect, Stage
from ..effects.image_height import HEIGHTS, all_heights_count
from ..field import over_field
from ..kernel import colorless
from ..methods import REFERENCE, Methods
from ..registry import EFFECTS
from .bounds import Box
from .filters import at_any_height
from .promises import Promises
from .scene_kernels import SceneKernels
from .work import PLANNED_PATCH, PLANNED_TARGET

_NOTHING_DN = 1e-9
_NOT_ASKED = "to find out whether it matters takes longer"
_EVERYWHERE = "on wherever all places of the sensor count"
_LIMITS = tuple(name for name, effect in EFFECTS.items() if effect.is_limit)


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
        """The methods, as a view takes them."""
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
        return tuple(c.effect for c in self.choices if c.method != EFFECTS[c.effect].off)


class Planner:
    """Finds the plan of a scene for all its boxes of designs."""

    def __init__(self, boxes: Sequence[Box], *, for_noise: bool = False) -> None:
        """`for_noise`: metrics of noise are asked for, which need every pixel and what the readout does to it."""
        self._for_noise = for_noise
        self._scenes = _promises(boxes)
        self._asked = list(self._scenes)
        self._exact = {name: self._why_exact(effect) for name, effect in EFFECTS.items()}

    def _why_exact(self, effect: Effect) -> str | None:
        """The reason when skipping an effect changes nothing in any box."""
        signals_dn = max((float(scene.reach.brightest_dn.max()) for scene in self._scenes), default=0.0)
        reasons = [scene.why_exact(effect, signals_dn) for scene in self._scenes]
        return None if None in reasons else str(reasons[0])

    def promise(self, effect: str, before: Methods, after: Methods, enough_dn: float = math.inf) -> float:
        """What switching an effect changes in any CSD of any box, DN; above `enough_dn`, in some of them at least."""
        found = 0.0
        for at, scene in enumerate(self._asked):
            found = max(found, scene.promise(effect, before, after))
            if found > enough_dn:
                self._asked.insert(0, self._asked.pop(at))  # it may well be too much for what comes next, too
                break
        return found

    def plan(self, scenario: str, tolerance_dn: float) -> Plan:
        """The cheapest plan whose promises sum to at most `tolerance_dn`; of equally cheap ones, what skips more.

        Where no plan does, one that keeps it but for what the places of a light leave open.
        """
        if self._everywhere:
            return self.everything(scenario, tolerance_dn)
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
        return sum(scene.work_of(methods).of(scene.box.n_designs) for scene in self._scenes)

    @property
    def pays(self) -> bool:
        """Whether everything on takes more than to look for what can be left out, both estimated in multiplications.

        How many places a light at any place needs is not known before, so that a plan is looked for there.
        """
        methods = self._start
        if self._everywhere:
            return False
        if any(scene.is_anywhere(methods) for scene in self._scenes):
            return True
        works = [scene.work_of(methods) for scene in self._scenes]
        once = max((work.kernel for work in works), default=0.0)
        every = sum(work.each * scene.box.n_designs for work, scene in zip(works, self._scenes, strict=True))
        is_patch = all(scene.view.scenario.target is None for scene in self._scenes)
        return once + every > len(works) * (PLANNED_PATCH if is_patch else PLANNED_TARGET)

    def everything(self, scenario: str, tolerance_dn: float) -> Plan:
        """Everything on but what changes nothing: exact, but for how closely all places of the sensor are looked at."""
        methods, promised_dn = self._start, 0.0
        if self._everywhere:
            methods, promised_dn = self._looked_at(methods, tolerance_dn)

        def choice(effect: str, method: str) -> Choice:
            if effect == HEIGHTS and self._everywhere:
                return Choice(effect, method, promised_dn, f"changes a CSD by at most {promised_dn:.2g} DN")
            exact = self._exact[effect]
            on = _EVERYWHERE if self._everywhere else _NOT_ASKED
            return Choice(effect, method, 0.0, on if exact is None else exact)

        choices = tuple(choice(effect, method) for effect, method in asdict(methods).items())
        return Plan(scenario, tolerance_dn, choices, self._work(methods), self._work(REFERENCE))

    def _looked_at(self, methods: Methods, tolerance_dn: float) -> tuple[Methods, float]:
        """How closely all places of the sensor are looked at within a tolerance, and what that may change, DN.

        What a readout that is not straight adds, however closely they are looked at, does not count.
        """
        closest = self.promise(HEIGHTS, methods, methods)
        allowed = tolerance_dn if closest <= tolerance_dn else tolerance_dn + closest
        ways = (replace(methods, **{HEIGHTS: way}) for way in EFFECTS[HEIGHTS].methods[1:])
        found = next(way for way in ways if self.promise(HEIGHTS, methods, way) <= allowed)
        return found, self.promise(HEIGHTS, methods, found)

    @property
    def _everywhere(self) -> bool:
        """Whether all places of the sensor count in any box; everything is on then."""
        return any(scene.everywhere for scene in self._scenes)

    @property
    def _start(self) -> Methods:
        """Everything on but what changes nothing."""
        return replace(REFERENCE, **{e: EFFECTS[e].methods[0] for e in EFFECTS if self._exact[e] is not None})

    def _left_over(self, methods: Methods) -> float:
        """What no method takes away of effects whose reference is a limit, as all places of a light are."""
        return sum(self.promise(e, methods, replace(methods, **{e: EFFECTS[e].reference})) for e in _LIMITS)

    def _cheapest(
        self, tolerance_dn: float, tried: dict[tuple[str, str], float], *, besides: bool = False
    ) -> tuple[Methods, dict[str, float]] | None:
        """Branch and bound over the effects, cheapest methods first.

        `tried` takes what each method may change where it is tried first, or less; of one that is too much, for a CFA
        for which it is.

        None where no plan keeps the tolerance; `besides`: what no method takes away does not count, so that all places
        are looked at, however little can be promised of them.
        """
        start = self._start
        active = [e for e in EFFECTS if self._exact[e] is None]
        best: list[tuple[float, Methods, dict[str, float]]] = []

        def deeper(at: int, methods: Methods, promises: dict[str, float]) -> None:
            # Every further effect at its cheapest: no completion of these methods costs less.
            least = self._work(replace(methods, **{e: EFFECTS[e].methods[0] for e in active[at:]}))
            if best and least >= best[0][0]:
                return
            if at == len(active):
                best[:] = [(least, methods, promises)]
                return
            name, effect = active[at], EFFECTS[active[at]]
            for method in effect.methods:
                after = replace(methods, **{name: method})
                endless = besides and effect.is_limit and effect.limit_dn(method) is None
                if endless or not self._allowed(name, after):
                    continue
                # Behind a rounded readout, an error however small may move a value by a whole step.
                rounded = after.quantization == "round" and not self._noisy
                exactly = rounded and effect.stage is not Stage.READOUT and not effect.is_limit
                allowed = sum(promises.get(e, 0.0) for e in _LIMITS) if exactly else tolerance_dn
                if besides and not exactly and (effect.is_limit or any(e in promises for e in _LIMITS)):
                    allowed += self._left_over(after)
                left_dn = allowed - sum(promises.values())
                known = (name, method) in tried
                promised = self.promise(name, methods, after, left_dn)
                if not known or promised <= left_dn:
                    tried[name, method] = min(promised, tried.get((name, method), promised))
                if sum(promises.values()) + promised <= allowed:
                    deeper(at + 1, after, promises | {name: promised})

        deeper(0, start, {})
        return best[0][1:] if best else None

    @property
    def _noisy(self) -> bool:
        return any(scene.view.scenario.noise is not None for scene in self._scenes)

    def _allowed(self, name: str, methods: Methods) -> bool:
        """Whether the method of an effect goes together with the others, and with what is asked of the scene."""
        effect = EFFECTS[name]
        if self._everywhere and not effect.is_limit:
            return bool(getattr(methods, name) == getattr(self._start, name))
        if self._for_noise and effect.needed_for_noise:
            return bool(getattr(methods, name) == effect.reference)
        return all(effect.allowed(scene.view, methods) for scene in self._scenes)

    def _reason(self, effect: str, method: str, promised: float, tried: Mapping[tuple[str, str], float]) -> str:
        exact = self._exact[effect]
        if exact is not None:
            return exact
        if self._for_noise and EFFECTS[effect].needed_for_noise:
            return "the noise metrics ask for it"
        methods = EFFECTS[effect].methods
        if method == methods[0] and promised < _NOTHING_DN:
            return EFFECTS[effect].without
        if promised > 0:
            return f"changes a CSD by at most {promised:.2g} DN"
        cheaper = {m: tried[effect, m] for m in methods[: methods.index(method)] if (effect, m) in tried}
        if not cheaper:
            return "what else is chosen needs it"
        nearest = min(cheaper, key=lambda m: cheaper[m])
        return f"else ({nearest}) a CSD may change by {cheaper[nearest]:.2g} DN or more"


def _promises(boxes: Sequence[Box]) -> list[Promises]:
    """Those of each box; boxes whose CFAs have the same tile share their kernels."""
    kernels: dict[tuple[tuple[int, ...], ...], SceneKernels] = {}
    found = []
    for box in boxes:
        if (tile := box.view.mosaic.tile) not in kernels:
            kernels[tile] = SceneKernels(colorless(over_field(box.view)[0]))
        # Each named place of the field sees a scene of its own; the worst changes by no more than any of them.
        everywhere = all_heights_count(box.view)
        own = [at_any_height(box)] if everywhere else [replace(box, view=place) for place in over_field(box.view)]
        found += [Promises(one, kernels[tile]) for one in own]
    return found
