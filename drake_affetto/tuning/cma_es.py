"""CMA-ES of each joint's gains, side by side on the same simulations.

The cost of a joint depends almost only on its own four gains, which act on
the other joints only through the body. So one small CMA-ES for each joint
suffices, and every simulation serves all of them at once.

Hansen, N.: The CMA Evolution Strategy: A Tutorial (2016), arXiv:1604.00772.
"""

from collections.abc import Mapping
import dataclasses

import numpy as np

from drake_affetto.common.typing import Array


@dataclasses.dataclass(frozen=True)
class EvaluatedCandidate:
    """A candidate of `JointwiseCmaEs` and its costs.

    Attributes:
        x: Parameters, (joints, parameters).
        cost: Cost of each joint, (joints,).
    """

    x: Array
    cost: Array


class JointwiseCmaEs:
    """CMA-ES of each joint's own parameters, all on the same evaluations.

    Joints are searched side by side: a candidate is one sample of every
    joint's distribution. Its evaluation gives a cost for every joint, and
    each distribution learns from the cost of its own joint. The influence of
    the joints on each other is noise to it; CMA-ES tolerates much noise, since
    it uses only the ranks of the costs. For 8 joints with 4 gains it learns 8
    covariances of 4 × 4 instead of one of 32 × 32, which needs many times the
    evaluations.

    The evaluations are the only state: `ask` computes the distributions from
    them. Candidate k depends on the seed and on the generations before its
    own, not on the worker or the order of evaluations; so an interrupted
    search continues exactly as an undisturbed one.

    Candidate 0 is the start. The first candidate of each later generation is
    the mean of all joints' distributions: the answer of the search at that
    time, and usually the best so far. Distributions do not learn from these.
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
        """Takes the size of the search.

        Args:
            joints: Number of joints.
            parameters: Number of parameters of each joint.
            sigma: First standard deviation about the start, which is 0.
            bound: Limit of the parameters, which lie in [-bound, bound].
            population: Evaluations of a generation that are learned from.
            seed: Seed of the samples.
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

    def ask(
        self, candidate: int, history: Mapping[int, EvaluatedCandidate]
    ) -> Array:
        """Candidate number `candidate`, (joints, parameters).

        Args:
            candidate: Number of the candidate, from 0.
            history: Evaluated candidates by number; those of all generations
                before this candidate's own are needed.

        Raises:
            KeyError: If one of them is missing.
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
        self, generation: int, history: Mapping[int, EvaluatedCandidate]
    ) -> None:
        """Updates the distributions to the beginning of `generation`."""
        if generation < self._learned:
            self._cmas, self._learned = self._start(), 0
        while self._learned < generation:
            first = self._learned * self.generation_size
            evaluated = [
                history[first + 1 + k] for k in range(self._population)
            ]
            for j, cma in enumerate(self._cmas):
                cma.tell([(item.x[j], item.cost[j]) for item in evaluated])
            self._learned += 1
