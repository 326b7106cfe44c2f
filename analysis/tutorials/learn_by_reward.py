"""Tutorial: learn to drum by the drum's sound alone, with Gymnasium.

    python analysis/tutorials/learn_by_reward.py --out out/learn

A contextual bandit from scikit-learn learns `Affetto/Drum-v0`: one movement an
episode, R of its sound as the reward. It takes about two minutes.
"""

# %% What is needed
import argparse
from pathlib import Path
import warnings

import gymnasium
import matplotlib
import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

import drake_affetto.envs  # noqa: F401  (registers the environments)

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--out", default="out/learn", help="folder for the curve")
parser.add_argument("--episodes", type=int, default=200)
parser.add_argument("--tests", type=int, default=30, help="places of a test")
parser.add_argument("--seed", type=int, default=0)
args = parser.parse_args()
rng = np.random.default_rng(args.seed)
env = gymnasium.make("Affetto/Drum-v0")
k = env.action_space.shape[0]


# %% The learner: how good is an action where the drum is seen?
class Bandit:
    """A Gaussian process of the reward over (τ, action)."""

    def __init__(self):
        # The bounds say what is known before: a hit tells of actions about
        # as far away as the drum's head is wide, not of all and not of none.
        kernel = ConstantKernel(1.0, (0.3, 3.0)) * Matern(
            [0.7] * (2 + k), (0.3, 3.0), nu=1.5
        )
        self.model = GaussianProcessRegressor(
            kernel + WhiteKernel(0.05, (1e-3, 0.3)), normalize_y=True
        )
        self.tried, self.heard = [], []

    def act(self, tau, curious):
        """The action whose reward may be highest (upper confidence bound)."""
        if len(self.heard) < 10:
            return rng.uniform(-1, 1, k)
        # Some anywhere, some near what has sounded best so far.
        best = np.array(self.tried)[np.argsort(self.heard)[-20:], 2:]
        near = rng.choice(best, 500) + 0.15 * rng.normal(size=(500, k))
        candidates = np.vstack(
            [rng.uniform(-1, 1, (500, k)), np.clip(near, -1, 1)]
        )
        x = np.hstack([np.tile(tau, (1000, 1)), candidates])
        mean, deviation = self.model.predict(x, return_std=True)
        return candidates[np.argmax(mean + curious * deviation)]

    def learn(self, tau, action, reward):
        """Takes in one episode; adapts the kernel now and then."""
        self.tried.append([*tau, *action])
        self.heard.append(reward)
        count = len(self.heard)
        self.model.optimizer = "fmin_l_bfgs_b" if count % 20 == 0 else None
        if count >= 10:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ConvergenceWarning)
                self.model.fit(self.tried, self.heard)
            self.model.kernel = self.model.kernel_


def test(policy):
    """Success and mean reward at places that are the same in every test."""
    said = []
    for i in range(args.tests):
        tau, _ = env.reset(seed=10_000 + i)
        action = np.asarray(policy(tau), np.float32)
        _, reward, _, _, info = env.step(action)
        said.append((info["success"], reward))
    return np.mean(said, axis=0)


# %% Without learning
print(f"success and mean reward at {args.tests} places, the same in all tests")
for name, policy in (
    ("any action", lambda tau: rng.uniform(-1, 1, k)),
    ("the lessons' mean", lambda tau: np.zeros(k)),
):
    success, mean = test(policy)
    print(f"   {name:<22} {success:4.0%} {mean:5.2f}", flush=True)

# %% Learning
bandit, curve = Bandit(), []
for episode in range(args.episodes):
    tau, _ = env.reset(seed=args.seed if episode == 0 else None)
    action = bandit.act(tau, curious=1.0).astype(np.float32)
    _, reward, _, _, info = env.step(action)
    bandit.learn(tau, action, reward)
    curve.append(info["success"])
    if (episode + 1) % 50 == 0:
        success, mean = test(lambda tau: bandit.act(tau, curious=0.0))
        # The tests draw from the same source: go on where no test has been.
        env.reset(seed=args.seed + episode + 1)
        name = f"after {episode + 1} episodes"
        print(f"   {name:<22} {success:4.0%} {mean:5.2f}", flush=True)

# %% The learning curve
matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402

window = min(20, args.episodes)
rate = np.convolve(curve, np.ones(window) / window, "valid")
figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
axes.plot(np.arange(window, len(curve) + 1), 100 * rate)
axes.set(
    xlabel="episode",
    ylabel=f"success while learning,\nlast {window} episodes, %",
    ylim=(0, 105),
)
Path(args.out).mkdir(parents=True, exist_ok=True)
figure.savefig(Path(args.out) / "learning_curve.png", dpi=150)
print(Path(args.out) / "learning_curve.png")
