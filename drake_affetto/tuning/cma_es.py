"""CMA-ES for each joint."""

from collections.abc import Mapping
import dataclasses

import numpy as np

from drake_affetto.common.typing import Array


class JointwiseCmaEs:
    """CMA-ES of each joint's own parameters, all on the same evaluations.

    Joints are searched side by side: a candidate is one sample of every
    joint's distribution, its evaluation gives a cost for every joint, and each
    distribution learns from its joint's. What the joints do to each other is
    noise to it, of which CMA-ES bears a good deal, as it goes by ranks. For 8
    joints with 4 gains it learns 8 covariances of 4 × 4 instead of one of
    32 × 32, which needs many times the evaluations.

    There is no state but the evaluations themselves: `ask` works out the
    distributions from them. What candidate k is depends on the seed and the
    generations before its own, not on who evaluates what when; a search that
    was stopped goes on as if nothing had happened.

    Candidate 0 is the start. The first candidate of each later generation is
    the mean of all joints' distributions: what the search would answer then,
    and usually the best so far. Distributions do not learn from these.
    """

    def __init__(
        self,
        joints: int,
        parameters: int,
        *,
        sigma: float,
        bound: float,
        population: int,
        seed: int,
    ):
        """Takes the search's shape.

        Args:
            joints: how many are searched.
            parameters: of each joint.
            sigma: first standard deviation about the start, which is 0.
            bound: parameters lie within -bound and bound.
            population: evaluations of a generation that are learned from.
            seed: of the samples.
        """
        self._shape = (joints, parameters)
        self._sigma, self.bound = sigma, bound
        self._population, self._seed = population, seed
        self._learned = 0
        self._cmas = self._start()

    def _start(self) -> list:
        import cmaes

        joints, parameters = self._shape
        return [
            cmaes.CMA(
                mean=np.zeros(parameters),
                sigma=self._sigma,
                bounds=np.tile([-self.bound, self.bound], (parameters, 1)),
                population_size=self._population,
                seed=self._seed,
            )
            for _ in range(joints)
        ]

    @property
    def generation_size(self) -> int:
        """Candidates of a generation, the first one included."""
        return self._population + 1

    def generation(self, candidate: int) -> int:
        """The generation that candidate number `candidate` belongs to."""
        return candidate // self.generation_size

    def ask(self, candidate: int, history: Mapping[int, "EvaluatedCandidate"]) -> Array:
        """Candidate number `candidate`, (joints, parameters).

        Args:
            candidate: counts from 0.
            history: evaluations by their candidates' numbers; those of all
                generations before this candidate's are needed.

        Raises:
            KeyError: where one of them is missing.
        """
        generation = self.generation(candidate)
        self._learn(generation, history)
        x = np.empty(self._shape)
        for j, cma in enumerate(self._cmas):
            if candidate % self.generation_size == 0:
                x[j] = cma.mean
                continue
            seeds = np.random.SeedSequence([self._seed, candidate, j])
            cma.reseed_rng(int(seeds.generate_state(1)[0]))
            x[j] = cma.ask()
        return np.clip(x, -self.bound, self.bound)

    def _learn(
        self, generation: int, history: Mapping[int, "EvaluatedCandidate"]
    ) -> None:
        """Brings the distributions to the beginning of `generation`."""
        if generation < self._learned:
            self._cmas, self._learned = self._start(), 0
        while self._learned < generation:
            first = self._learned * self.generation_size
            told = [history[first + 1 + k] for k in range(self._population)]
            for j, cma in enumerate(self._cmas):
                cma.tell([(item.x[j], item.cost[j]) for item in told])
            self._learned += 1


@dataclasses.dataclass(frozen=True)
class EvaluatedCandidate:
    """A candidate of `JointwiseCmaEs` and what it has cost.

    Attributes:
        x: (joints, parameters).
        cost: (joints,).
    """

    x: Array
    cost: Array
