"""The search for a plan: methods that cost little, and whose proven errors sum to at most the study's tolerance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import cached_property

from ..effects.base import Effect, LinearEffect, ReadoutEffect, Stage
from ..effects.blur import Blur
from ..effects.image_height import HEIGHTS
from ..methods import REFERENCE, Methods, switched
from ..registry import EFFECTS
from .bounds import Box
from .plan import NOT_ASKED, Choice, Plan
from .promises import promises_of
from .scene_kernels import SceneKernels
from .work import LOOKING_SHARE, QUICK_S, READOUT_S, in_all, noise_s

_NOTHING_DN = 1e-9
_EVERYWHERE = "on wherever all places of the sensor count"
_LIMITS = tuple(name for name, effect in EFFECTS.items() if effect.is_limit)


class Planner:
    """Finds the plan of a scene for all its boxes of designs."""

    def __init__(self, boxes: Sequence[Box], *, for_noise: bool = False, budget_s: float = math.inf) -> None:
        """`for_noise`: metrics of noise are asked for, which need every pixel and what the readout does to it.

        `budget_s`: after so many counted seconds the best plan so far is taken; then, too, no method is looked at that
        saves less than it takes to look. Without it the cheapest plan of all is found.
        """
        self._for_noise, self._budget_s = for_noise, budget_s
        self._kernels: dict[tuple[tuple[int, ...], ...], SceneKernels] = {}
        self._scenes = promises_of(boxes, self._kernels)
        self._asked = list(self._scenes)
        self._exact = {name: self._why_exact(effect) for name, effect in EFFECTS.items()}
        self._works: dict[Methods, float] = {}
        self._noise_s, self._without_kernels = 0.0, False

    def _why_exact(self, effect: Effect) -> str | None:
        """The reason when skipping an effect changes nothing in any box."""
        signals_dn = max((float(scene.reach.brightest_dn.max()) for scene in self._scenes), default=0.0)
        reasons = [scene.why_exact(effect, signals_dn) for scene in self._scenes]
        return None if None in reasons else str(reasons[0])

    def promise(self, effect: str, before: Methods, after: Methods, enough_dn: float = math.inf) -> float:
        """What switching an effect changes in any CSD of any box, DN; above `enough_dn`, in some of them at least."""
        found = 0.0
        if isinstance(EFFECTS[effect], ReadoutEffect) or EFFECTS[effect].is_limit:
            self._noise_s = self._first_noise_s
        for at, scene in enumerate(self._asked):
            quick = scene.quick_promise(effect, before, after) if self._limited else None
            found = max(found, scene.promise(effect, before, after) if quick is None else quick)
            if found > enough_dn:
                self._asked.insert(0, self._asked.pop(at))  # it may well be too much for what comes next, too
                break
        return found

    def plan(self, scenario: str, tolerance_dn: float) -> Plan:
        """The cheapest plan found of those whose promises sum to at most `tolerance_dn`; without a budget, of all.

        Of equally cheap ones, what skips more.

        Where no plan does, one that keeps it but for what the places of a light leave open.
        """
        if self._everywhere:
            return self._over_sensor(scenario, tolerance_dn)
        tried: dict[tuple[str, str], float] = {}
        self._without_kernels = self._limited
        kept = self._cheapest(tolerance_dn, tried)
        if kept is None:
            kept = self._cheapest(tolerance_dn, tried, besides=True)
        elif self._limited:  # no more may still be saved than this plan takes
            self._budget_s = min(self._budget_s, self.spent_s + LOOKING_SHARE * self._work(kept[0]))
            self._without_kernels = self.spent_s + self._kernels_s(kept[0]) > self._budget_s
            if not self._without_kernels:
                kept = self._cheapest(tolerance_dn, tried, kept)
        if kept is None:  # everything on changes nothing but what is left open: the budget was too small for any other
            assert self._limited
            kept = self._start, {e: self.promise(e, self._start, self._start) for e in _LIMITS}
        methods, promises = kept
        choices = tuple(
            Choice(e, method, promises.get(e, 0.0), self._reason(e, method, promises.get(e, 0.0), tried))
            for e, method in asdict(methods).items()
        )
        rejected = tuple((e, m, dn) for (e, m), dn in tried.items() if getattr(methods, e) != m)
        return Plan(scenario, tolerance_dn, choices, self._work(methods), self._work(REFERENCE), rejected)

    def _work(self, methods: Methods) -> float:
        if methods not in self._works:
            self._works[methods] = in_all([(scene.work_of(methods), scene.box.designs) for scene in self._scenes])
        return self._works[methods]

    @property
    def has_time(self) -> bool:
        """Whether what must be known of any plan can be found out in time."""
        return self._everywhere or not self._anywhere or self.spent_s + self._first_noise_s <= self._budget_s

    @property
    def _limited(self) -> bool:
        return math.isfinite(self._budget_s)

    @property
    def spent_s(self) -> float:
        """Seconds that were spent on looking, counted."""
        looked = sum(scene.spent_s for scene in self._scenes)
        return self._noise_s + looked + sum(kernels.spent_s for kernels in self._kernels.values())

    @cached_property
    def _first_noise_s(self) -> float:
        """Seconds that the first bound of a noisy readout takes, counted."""
        return max((noise_s(scene.view, scene.brightest_dn) for scene in self._scenes), default=0.0)

    def _look_s(self, effect: Effect, methods: Methods, after: Methods) -> float:
        """Seconds that it takes to bound what another method of an effect changes, counted."""
        if isinstance(effect, ReadoutEffect):
            return READOUT_S * len(self._scenes) + self._first_noise_s - self._noise_s
        compared = _needs_kernels(effect, getattr(after, effect.name))
        return self._kernels_s(methods, after) if compared else QUICK_S * len(self._scenes)

    def _kernels_s(self, *methods: Methods) -> float:
        """Seconds that it takes to compare kernels of some methods, those made before counting no more."""
        kernels_s = sum(kernels.missing_s(*methods) for kernels in self._kernels.values())
        return kernels_s + sum(scene.linear_s for scene in self._scenes)

    def _worth(self, effect: Effect, methods: Methods, after: Methods, rest: Sequence[str]) -> bool:
        """Whether a method may save more than it takes to look at it: beside the others at their cheapest, or all on.

        `rest`: the effects of which nothing is chosen yet.
        """
        if self._without_kernels and _needs_kernels(effect, getattr(after, effect.name)):
            return False
        look_s, straight = self._look_s(effect, methods, after), isinstance(effect, ReadoutEffect) and self._anywhere
        # Behind a straight readout the search for the worst place is much shorter, as no count tells, and behind one
        # that is nearly straight it is not: all of it is looked at, or nothing.
        with_it = sum(isinstance(EFFECTS[name], ReadoutEffect) for name in rest) if straight else 0
        if self.spent_s + look_s + with_it * READOUT_S * len(self._scenes) > self._budget_s:
            return False
        if straight:
            return True
        saved = self._work(methods) - self._work(after)
        # Behind a rounded readout nothing may change anything: all the others stay on.
        frees = methods.quantization == "round" != after.quantization and not self._noisy
        others = methods if frees else self._completed(methods, rest)
        beside = self._work(others) - self._work(self._completed(after, rest))
        return max(saved, beside) > look_s

    @cached_property
    def _anywhere(self) -> bool:
        """Whether more than a lattice of places is looked at in any scene."""
        return any(scene.is_anywhere(self._start) for scene in self._scenes)

    def _over_sensor(self, scenario: str, tolerance_dn: float) -> Plan:
        """Everything on but what changes nothing: exact, but for how closely all places of the sensor are looked at."""
        methods, promised_dn = self._looked_at(self._start, tolerance_dn)

        def choice(effect: str, method: str) -> Choice:
            if effect == HEIGHTS:
                return Choice(effect, method, promised_dn, f"changes a CSD by at most {promised_dn:.2g} DN")
            exact = self._exact[effect]
            return Choice(effect, method, 0.0, _EVERYWHERE if exact is None else exact)

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
        self,
        tolerance_dn: float,
        tried: dict[tuple[str, str], float],
        known: tuple[Methods, dict[str, float]] | None = None,
        *,
        besides: bool = False,
    ) -> tuple[Methods, dict[str, float]] | None:
        """Branch and bound over the effects, cheapest methods first.

        `tried` takes what each method may change where it is tried first, or less; of one that is too much, for a CFA
        for which it is.

        None where no plan keeps the tolerance; `besides`: what no method takes away does not count, so that all places
        are looked at, however little can be promised of them.
        """
        start = self._start
        active = [e for e in EFFECTS if self._exact[e] is None]
        best = [] if known is None else [(self._work(known[0]), *known)]

        def deeper(at: int, methods: Methods, promises: dict[str, float]) -> None:
            # Every further effect at its cheapest: no completion of these methods costs less.
            least = self._work(self._completed(methods, active[at:]))
            if best and least >= best[0][0] - self._too_little_s:
                return
            if at == len(active):
                best[:] = [(least, methods, promises)]
                return
            name, effect = active[at], EFFECTS[active[at]]
            for method in effect.methods:
                after = switched(methods, name, method)
                if self._limited and after != methods and not self._worth(effect, methods, after, active[at + 1 :]):
                    continue
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
                seen = (name, method) in tried
                promised = self.promise(name, methods, after, left_dn)
                if not seen or promised <= left_dn:
                    tried[name, method] = min(promised, tried.get((name, method), promised))
                if sum(promises.values()) + promised <= allowed:
                    deeper(at + 1, after, promises | {name: promised})

        deeper(0, start, {})
        return best[0][1:] if best else None

    def _completed(self, methods: Methods, rest: Sequence[str]) -> Methods:
        """The methods with the cheapest one, of those that are looked at, of each effect of which none is chosen."""
        for name in rest:
            of = EFFECTS[name]
            every = (m for m in of.methods if not (self._without_kernels and _needs_kernels(of, m)))
            methods = switched(methods, name, next(every))
        return methods

    @property
    def _too_little_s(self) -> float:
        """What no plan is looked for to save, s."""
        return QUICK_S * len(self._scenes) if self._limited else 0.0

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
            return NOT_ASKED if self._limited else "what else is chosen needs it"
        nearest = min(cheaper, key=lambda m: cheaper[m])
        return f"else ({nearest}) a CSD may change by {cheaper[nearest]:.2g} DN or more"


def _needs_kernels(effect: Effect, method: str) -> bool:
    """Whether the bound of a method compares the light of pixels: those are looked at when all others have been."""
    if isinstance(effect, Blur):
        return method == effect.off
    return isinstance(effect, LinearEffect) and effect.limit_dn(method) is None and method != effect.reference
