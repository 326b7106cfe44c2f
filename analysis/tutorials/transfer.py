"""Tutorial: learn a skill, look at it through another camera, transfer it.

    python analysis/tutorials/transfer.py [--out DIR]

It runs top to bottom in well under half a minute, without Drake, and writes
four figures. Read it as a notebook: each `# %%` is a cell.
"""

# %% What is needed
import argparse
import warnings

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from drake_affetto.common.output import atomic_path, prepare_output
from drake_affetto.motion import Dmp
from drake_affetto.skill import (
    SCHEMES,
    ElmRegressor,
    Mapping,
    TransferRegressor,
    input_jacobian,
    loo_covariance,
    make_scheme,
)

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--out", default="out/tutorial_transfer", metavar="DIR")
out = prepare_output(parser.parse_args().out)
random = np.random.default_rng(4)


def save(figure, name):
    """Writes a figure and says so."""
    with atomic_path(out / name) as fresh:
        figure.savefig(fresh, dpi=120)
    plt.close(figure)
    print(f"   figure: {out / name}")


# %% 1. A movement is a vector: dynamic movement primitives
# An arm of two joints (0.16 m and 0.19 m) strikes at a place and returns. What
# a person shows is a path of both joints over 3 s; a Dmp turns it into 2·15
# policy parameters, and those into a movement again.
print("1. Movements as policy parameters")
dmp = Dmp()
t = np.linspace(0.0, 3.0, 301)
q_start = np.array([0.2, 2.4])


def reach(place):
    """Joint angles that bring the hand to `place` (2,), m."""
    x, y = place
    cosine = (x**2 + y**2 - 0.16**2 - 0.19**2) / (2 * 0.16 * 0.19)
    elbow = np.arccos(np.clip(cosine, -1.0, 1.0))
    shoulder = np.arctan2(y, x) - np.arctan2(
        0.19 * np.sin(elbow), 0.16 + 0.19 * cosine
    )
    return np.array([shoulder, elbow])


def demonstrate(place, noise=0.01):
    """A person's stroke: there in 1.4 s, a dwell, and back; never twice alike.

    What varies is how far the hand swings out on the way.
    """
    rise = np.clip(t / 1.4, 0.0, 1.0)
    fall = np.clip((t - 1.7) / 1.3, 0.0, 1.0)
    s = (3 * rise**2 - 2 * rise**3) * (1 - 3 * fall**2 + 2 * fall**3)
    path = q_start + s[:, None] * (reach(place) - q_start)
    out_and_in = np.sin(np.pi * rise) ** 2
    path += out_and_in[:, None] * random.normal(0.0, 10 * noise, 2)
    return path + random.normal(0.0, 0.002, path.shape)


shown = demonstrate([0.20, 0.10])
theta = dmp.encode(t, shown)
played = dmp.rollout(theta, shown[0], 0.01)
print(f"   {theta.size} parameters reproduce 2 x {len(t)} samples to", end=" ")
print(f"{np.std(played.q - shown):.4f} rad (their noise: 0.002)")

figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
axes[0].plot(t, shown, "k", lw=3, alpha=0.3, label=["shown", None])
axes[0].plot(played.t, played.q, "--", label=["shoulder", "elbow"])
axes[0].set(xlabel="time / s", ylabel="joint angle / rad")
axes[0].legend(fontsize=8)
axes[1].plot(t, dmp.basis(1.0 - t / 3.0))
axes[1].set(xlabel="time / s", title="the 15 basis functions")
save(figure, "1_movement.png")

# %% 2. A skill is a regressor from what is seen to policy parameters
# The camera tells where the drum is, τ. Twenty demonstrations teach the skill;
# the ELM learns them one by one, as they come.
print("2. A skill from 20 demonstrations")
corners = np.array([[0.14, 0.28], [0.00, 0.18]])  # m, where the drum may be


def places(n):
    """n places (n, 2) of the drum."""
    return random.uniform(corners[:, 0], corners[:, 1], (n, 2))


def direct_view(place):
    """What the camera sees: image coordinates in [0, 1]."""
    return (place - corners[:, 0]) / (corners[:, 1] - corners[:, 0])


skill = ElmRegressor(n_hidden=50, input_range=[0.0, 1.0], random_state=0)
taught = places(20)
thetas = np.array([dmp.encode(t, demonstrate(place)) for place in taught])
for place, theta in zip(taught, thetas, strict=True):
    skill.partial_fit(direct_view(place)[None], theta[None])


def hand(angles):
    """Where the hand is, (N, 2), for joint angles (N, 2)."""
    shoulder, elbow = angles.T
    return np.stack(
        [
            0.16 * np.cos(shoulder) + 0.19 * np.cos(shoulder + elbow),
            0.16 * np.sin(shoulder) + 0.19 * np.sin(shoulder + elbow),
        ],
        axis=1,
    )


def misses(predictions, where):
    """m, the least distance of the hand from the drum during each stroke."""
    distances = []
    for theta, place in zip(predictions, where, strict=True):
        path = hand(dmp.rollout(theta, q_start, 0.01).q)
        distances.append(np.linalg.norm(path - place, axis=1).min())
    return np.array(distances)


unseen = places(60)


def report(what, predictions):
    """Prints by how much the hand misses the unseen drums."""
    missed = 1e3 * np.median(misses(predictions, unseen))
    print(f"   {what:<50}{missed:6.1f} mm missed")


report("unseen drums", skill.predict(direct_view(unseen)))

# %% 3. The view changes: a mirror
# Now the drum is seen in a leaning mirror: left and right are swapped, the
# picture is turned and seen from farther away. The skill as it is, is lost.
print("3. The same drums in a mirror")


def mirror_view(place):
    """What the camera sees in the mirror."""
    u, v = direct_view(place).T
    return np.stack(
        [0.9 - 0.5 * u + 0.2 * v, 0.3 + 0.15 * u + 0.45 * v], axis=1
    )


report("the skill unchanged", skill.predict(mirror_view(unseen)))

# %% 4. Transfer: find the map, not the skill
# Four new demonstrations in the mirror. A transfer searches for the map h that
# makes the old skill predict what they showed. Its `starts_` tell how the
# search went: the cost has many minima, and one start alone may end in a bad
# one.
print("4. Transfer from four demonstrations")
new = places(4)
X_new = mirror_view(new)
y_new = np.array([dmp.encode(t, demonstrate(place)) for place in new])
transfer = TransferRegressor(skill).fit(X_new, y_new)
print("   H =", np.round(transfer.H_, 2).tolist())
print("   c =", np.round(transfer.c_, 2).tolist())
best = sorted(transfer.starts_, key=lambda s: s.cost)
print(f"   {len(best)} starts; least cost {best[0].cost:.4g} from", end=" ")
print(f"'{best[0].name}', the identity ended at", end=" ")
print(f"{transfer.starts_[0].cost:.4g}")
report("after transfer", transfer.predict(mirror_view(unseen)))

axis = np.linspace(0.0, 1.0, 9)
square = np.stack(np.meshgrid(axis, axis), axis=-1)
as_places = corners[:, 0] + square * (corners[:, 1] - corners[:, 0])
in_mirror = mirror_view(as_places.reshape(-1, 2))
back = transfer.transform(in_mirror).reshape(9, 9, 2)
figure, axes = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained")
for a, grid, title in zip(
    axes,
    [square, in_mirror.reshape(9, 9, 2), back],
    ["direct view", "in the mirror: x", "back through the map: h(x)"],
    strict=True,
):
    a.plot(*grid.transpose(2, 0, 1), "C0", lw=0.8)
    a.plot(*grid.transpose(2, 1, 0), "C1", lw=0.8)
    a.set(title=title, aspect="equal", xlim=(-0.15, 1.25), ylim=(-0.1, 1.1))
axes[0].plot(*direct_view(taught).T, "k.", label="taught")
axes[1].plot(*X_new.T, "r*", ms=10, label="shown in the mirror")
axes[2].plot(*transfer.transform(X_new).T, "r*", ms=10)
axes[0].legend(fontsize=8, loc="lower right")
axes[1].legend(fontsize=8, loc="lower right")
save(figure, "4_map.png")

# %% 5. Is it worth it? The schemes side by side
# All have fit and predict. Which one wins depends on how many demonstrations
# there are and how much they vary: measure it for your task.
print("5. The schemes, over 12 draws (median miss in mm)")
counts = [3, 4, 5, 8, 12]
table = {name: [] for name in SCHEMES}
for count in counts:
    rows = {name: [] for name in SCHEMES}
    for _ in range(12):
        where = places(count)
        X = mirror_view(where)
        y = np.array([dmp.encode(t, demonstrate(place)) for place in where])
        for name in SCHEMES:
            with warnings.catch_warnings():
                # Three random places may lie nearly on a line: that counts too.
                warnings.simplefilter("ignore", UserWarning)
                scheme = make_scheme(name, skill).fit(X, y)
            predicted = scheme.predict(mirror_view(unseen[:20]))
            rows[name].append(np.median(misses(predicted, unseen[:20])))
    for name in SCHEMES:
        table[name].append(1e3 * np.median(rows[name]))
print("   " + " " * 18 + "".join(f"{n:>8}" for n in counts))
for name, row in table.items():
    print(f"   {name:<18}" + "".join(f"{value:8.1f}" for value in row))
figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
for name, row in table.items():
    axes.plot(counts, row, "o-", label=name)
axes.set(
    xlabel="demonstrations in the mirror",
    ylabel="median miss / mm",
    yscale="log",
)
figure.legend(fontsize=8, loc="outside right")
save(figure, "5_schemes.png")

# %% 6. What you know, put to use
# Of the sensor: say how it is built, and fewer demonstrations do. A map is an
# object with parameters, h, its derivative and starts. This one knows that the
# image is flipped, and looks for a turn and a scale only.
print("6. What is known of the sensor")


class FlippedCamera(Mapping):
    """h(x) = (-a u + b v, b u + a v) + c, with x = (u, v)."""

    def count(self, n_in, n_out):
        """Two for the turn and scale, two for the shift."""
        return 4

    def apply(self, parameters, X):
        """Where X (N, 2) would be in the direct view."""
        a, b, *shift = parameters
        u, v = X.T
        return np.stack([-a * u + b * v, b * u + a * v], axis=1) + shift

    def derivative(self, parameters, X):
        """By a, b and the shift, (N, 2, 4)."""
        u, v = X.T
        result = np.zeros((len(X), 2, 4))
        result[:, :, 0] = np.stack([-u, v], axis=1)
        result[:, :, 1] = np.stack([v, u], axis=1)
        result[:, :, 2:] = np.eye(2)
        return result

    def starts(self, target, source, n_starts, random):
        """Eight turns about the middle."""
        found = []
        for angle in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
            p = np.array([2.0 * np.cos(angle), 2.0 * np.sin(angle), 0.0, 0.0])
            p[2:] = source.mean - self.apply(p, target.mean[None])[0]
            found.append((f"{np.degrees(angle):.0f} degrees", p))
        return found[:n_starts]


known = TransferRegressor(skill, FlippedCamera()).fit(X_new[:2], y_new[:2])
report(
    "2 demonstrations, a map of 4 parameters",
    known.predict(mirror_view(unseen)),
)

# Of the demonstrations: some parameters follow the drum, others only the
# person's mood. How well the skill could predict each while it learned tells
# which is which, and a transfer weighs them by that; without, it fits moods.
# What is known better can be given as `metric`.
blind = TransferRegressor(skill, metric=None).fit(X_new, y_new)
report(
    "4 demonstrations, all parameters weighed alike",
    blind.predict(mirror_view(unseen)),
)
metric = loo_covariance(skill, direct_view(taught), thetas)
weighed = TransferRegressor(skill, metric=metric).fit(X_new, y_new)
report(
    "4 demonstrations, leave-one-out metric",
    weighed.predict(mirror_view(unseen)),
)

# Of where drums stand: pictures without demonstrations cost nothing.
further = mirror_view(places(50))
more = TransferRegressor(skill).fit(X_new[:3], y_new[:3], further)
report("3 demonstrations, 50 pictures", more.predict(mirror_view(unseen)))

# Of what a map cannot do: a smooth residual on top, once there are enough
# demonstrations to learn it from.
several = places(12)
y_several = np.array([dmp.encode(t, demonstrate(p)) for p in several])
tuned = TransferRegressor(skill, residual="smooth")
tuned.fit(mirror_view(several), y_several)
report(
    "12 demonstrations, a smooth residual", tuned.predict(mirror_view(unseen))
)

# %% 7. Other skills than ELMs
# Any fitted regressor will do. Where it offers no Jacobian and none is known
# in closed form, it is differentiated numerically, which is slower.
print("7. Other regressors")
from sklearn.frozen import FrozenEstimator  # noqa: E402
from sklearn.kernel_ridge import KernelRidge  # noqa: E402

kernel = KernelRidge(kernel="rbf", gamma=1.0, alpha=1e-3)
kernel.fit(direct_view(taught), thetas)
print("   Jacobian of a kernel ridge:", input_jacobian(kernel, X_new).shape)
other = TransferRegressor(FrozenEstimator(kernel)).fit(X_new, y_new)
report("a kernel ridge after transfer", other.predict(mirror_view(unseen)))

figure, axes = plt.subplots(figsize=(4.6, 4.2), layout="constrained")
paths = {
    "unchanged": skill.predict(mirror_view(unseen[:1]))[0],
    "transferred": transfer.predict(mirror_view(unseen[:1]))[0],
}
for label, theta in paths.items():
    axes.plot(*hand(dmp.rollout(theta, q_start, 0.01).q).T, label=label)
axes.plot(*unseen[0], "k*", ms=14, label="drum")
axes.set(xlabel="x / m", ylabel="y / m", aspect="equal")
axes.legend()
save(figure, "7_strokes.png")
