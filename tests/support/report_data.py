"""Made-up results of every study, in the form that the studies write."""

import json
from pathlib import Path
import struct
import zlib

import numpy as np
from scipy.io import wavfile

from drake_affetto import __version__

# True rates of success by scheme: who leads.
WINNERS = {
    "transfer": {
        "unchanged": 0.2,
        "relearn": 0.6,
        "continue": 0.5,
        "transfer": 0.97,
        "transfer_default": 0.98,
        "transfer_affine": 0.9,
        "gaussian_process": 0.6,
        "affine_regression": 0.5,
    },
    "relearn": {
        "unchanged": 0.2,
        "relearn": 0.98,
        "continue": 0.4,
        "transfer": 0.5,
        "transfer_default": 0.6,
        "transfer_affine": 0.5,
        "gaussian_process": 0.7,
        "affine_regression": 0.6,
    },
    "unchanged": {
        "unchanged": 0.98,
        "relearn": 0.4,
        "continue": 0.5,
        "transfer": 0.4,
        "transfer_default": 0.5,
        "transfer_affine": 0.4,
        "gaussian_process": 0.3,
        "affine_regression": 0.2,
    },
    "level": {
        "unchanged": 0.2,
        "relearn": 0.95,
        "continue": 0.5,
        "transfer": 0.95,
        "transfer_default": 0.96,
        "transfer_affine": 0.93,
        "gaussian_process": 0.9,
        "affine_regression": 0.8,
    },
}


def rate(per_repeat):
    """Mean with an interval that any test of the page may take as given."""
    per_repeat = np.asarray(per_repeat)
    mean = float(per_repeat.mean())
    half = 1.96 * float(per_repeat.std()) / np.sqrt(len(per_repeat))
    return {
        "mean": mean,
        "low": max(0.0, mean - half),
        "high": min(1.0, mean + half),
    }


def head(study, seed=0):
    return {"study": study, "version": __version__, "seed": seed}


def _positions(rng, count):
    return rng.uniform([0.195, -0.195], [0.333, 0.003], (count, 2))


def _tau(xy):
    return [float((xy[0] - 0.195) / 0.138), float(4.0 * (xy[1] + 0.09))]


def _reward(rng, success):
    low, high = (0.3, 0.9) if success else (0.0, 0.1)
    return float(rng.uniform(low, high))


def _taught(rng, count, **more):
    return [
        {
            **{key: value(i) for key, value in more.items()},
            "xy": xy.tolist(),
            "tau": _tau(xy),
            "attempts": 1 + int(i % 9 == 8),
            "reward": _reward(rng, True),
        }
        for i, xy in enumerate(_positions(rng, count))
    ]


def drum(seed=0, repeats=3, evaluations=10, active=True):
    rng = np.random.default_rng(seed)
    rewards = []

    def curve(speed, order):
        points = []
        for n in range(1, 26):
            share = 1.0 - np.exp(-speed * n)
            hits = rng.uniform(size=(repeats, evaluations)) < share
            hits |= n > 20
            for repeat, row in enumerate(hits):
                for success, xy in zip(
                    row, _positions(rng, evaluations), strict=True
                ):
                    impulse = rng.uniform(0.2, 2.0) if success else 0.0
                    rewards.append(
                        {
                            "order": order,
                            "repeat": repeat,
                            "n": n,
                            "xy": xy.tolist(),
                            "reward": _reward(rng, success),
                            "impulse": float(impulse),
                        }
                    )
            per_repeat = hits.mean(axis=1)
            points.append(
                {
                    "n": n,
                    "success_rate": rate(per_repeat),
                    "per_repeat": per_repeat.tolist(),
                }
            )
        return points

    def first_above(points):
        found = [p["n"] for p in points if p["success_rate"]["mean"] >= 0.9]
        return found[0] if found else None

    random = curve(0.22, "random")
    chosen = curve(0.4, "active") if active else None
    positions = []
    for repeat in range(repeats):
        for i, xy in enumerate(_positions(rng, evaluations)):
            success = (repeat, i) != (repeats - 1, 3)
            positions.append(
                {
                    "repeat": repeat,
                    "xy": xy.tolist(),
                    "tau": _tau(xy),
                    "reward": _reward(rng, success),
                    "success": success,
                    "contact_impulse": 0.8 if success else 0.0,
                }
            )
    t = np.arange(0, 3.0, 0.02)
    hits = [row for row in rewards if row["impulse"] > 0.05]
    return {
        **head("drum", seed),
        "scenario": "drumming",
        "demonstrations": 25,
        "evaluations": evaluations,
        "repeats": repeats,
        "taught": _taught(
            rng,
            25 * repeats,
            repeat=lambda i: i // 25,
            max_pull=lambda i: 18.0 + 0.1 * i,
        ),
        "first_try": 0.97,
        "by_demonstrations": random,
        "n_to_90": first_above(random),
        "active": chosen
        and {"by_demonstrations": chosen, "n_to_90": first_above(chosen)},
        "final": {
            "success_rate": float(np.mean([p["success"] for p in positions])),
            "positions": positions,
        },
        "separation": {
            "auc": 1.0,
            "threshold": 0.15,
            "false_hits": 0,
            "missed_hits": 0,
            "impulse_threshold": 0.05,
            "trials": len(rewards),
            "hits": len(hits),
        },
        "rewards": rewards,
        "similarity": {
            "t": t.tolist(),
            "hit": (0.05 + 0.7 * np.exp(-(((t - 1.4) / 0.1) ** 2))).tolist(),
            "miss": (0.03 + 0.02 * np.sin(9 * t)).tolist(),
        },
    }


def _mirror_body(scenario, rates, seed, samples, repeats, evaluations):
    rng = np.random.default_rng([seed, 5])
    schemes = {}
    for name, share in rates.items():
        schemes[name] = {}
        for n in samples:
            p = share if name == "unchanged" else share - 0.05 * (5 - n)
            # Even spread rather than luck, so that the order is the one asked.
            hits = np.arange(repeats * evaluations) < round(
                p * repeats * evaluations
            )
            hits = rng.permutation(hits).reshape(repeats, evaluations)
            per_repeat = hits.mean(axis=1)
            schemes[name][str(n)] = {
                "success_rate": rate(per_repeat),
                "per_repeat": per_repeat.tolist(),
                "rewards": [_reward(rng, s) for s in hits.ravel()],
                "landing": [0.01 if s else 0.09 for s in hits.ravel()],
                "grazes": 0.05,
            }
    comparisons = []
    for n in samples:
        names = list(schemes)
        for i, a in enumerate(names):
            for b in names[i + 1 :]:
                difference = (
                    schemes[a][str(n)]["success_rate"]["mean"]
                    - schemes[b][str(n)]["success_rate"]["mean"]
                )
                p = float(np.exp(-30.0 * abs(difference)))
                comparisons.append(
                    {
                        "a": a,
                        "b": b,
                        "samples": n,
                        "difference": difference,
                        "p": p / 15,
                        "p_corrected": min(1.0, p),
                        "effect_size": 3.0 * difference,
                    }
                )
        if {"transfer_default", "relearn"} <= rates.keys():
            comparisons.append(
                {
                    "a": "transfer_default",
                    "b": "relearn",
                    "samples": n,
                    "difference": -0.021,
                    "p": 0.002,
                    "p_corrected": 0.012,
                    "measure": "landing",
                    "primary": n == 3,
                }
            )
    axis = np.linspace(0.0, 1.0, 11)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    taught = rng.uniform(0.1, 0.9, (5, 2))

    def h(X):
        x, y = X.T
        return np.stack([0.9 - 0.7 * y + 0.1 * x * y, 0.4 - 0.8 * x], axis=1)

    return {
        **head("mirror", seed),
        "scenario": scenario,
        "samples": list(samples),
        "repeats": repeats,
        "evaluations": evaluations,
        "demonstrations": 25,
        "choice": "random",
        "variability": 1.0,
        "workspace": 1.0,
        "schemes": schemes,
        "comparisons": comparisons,
        "chance": {"mean": 0.17, "low": 0.1, "high": 0.27},
        "knowledge": {
            "angle": 0.0175,
            "position": 0.005,
            "focal": 0.01,
            "height": 0.003,
            "neck": 0.0,
        },
        "map": {
            "scheme": "transfer_default",
            "samples": max(samples),
            "input_names": ["x_img", "y_img"],
            "output_names": ["y_img", "q3* [rad]"],
            "shape": [11, 11],
            "input": grid.tolist(),
            "output": h(grid).tolist(),
            "taught_input": taught.tolist(),
            "taught_output": h(taught).tolist(),
        },
    }


def mirror(
    winner="transfer", seed=0, samples=(3, 4, 5), repeats=10, evaluations=6
):
    return _mirror_body(
        "mirror", WINNERS[winner], seed, samples, repeats, evaluations
    )


def bodies(seed=0):
    """Twelve robots; the heavier its elbow, the less one hits."""
    results = mirror("transfer", seed, samples=(3,), repeats=12)
    mass = np.linspace(0.8, 1.2, 12)
    results["bodies"] = [
        {"mass.right_elbow": float(m), "supply": 1.0 + 0.01 * (i % 3)}
        for i, m in enumerate(mass)
    ]
    cell = results["schemes"]["transfer_default"]["3"]
    cell["per_repeat"] = np.linspace(1.0, 0.8, 12).round(3).tolist()
    return results


def scenarios(seed=0):
    wins = {
        "mirror": "transfer",
        "camera_rolled": "level",
        "camera_replaced": "transfer",
        "mirror_moved": "relearn",
        "head_turned": "unchanged",
    }
    return {
        **head("scenarios", seed),
        "scenarios": {
            name: _mirror_body(name, WINNERS[winner], seed + i, (3, 5), 5, 6)
            for i, (name, winner) in enumerate(wins.items())
        },
    }


def conditions(seed=0):
    rng = np.random.default_rng(seed)
    rows = []
    varied = {
        "teacher": ["half", "as taught", "2 x"],
        "workspace": ["half", "as it is"],
        "positions": ["random", "spread"],
    }
    for factor, values in varied.items():
        for k, value in enumerate(values):
            several = value == "as taught"
            for n in (3, 4, 5, 8, 12) if several else (5,):
                for name, base in (
                    ("relearn", 0.35 + 0.06 * n - 0.1 * k),
                    ("transfer", 0.75 - 0.1 * k),
                    ("transfer_default", 0.85 + 0.01 * n - 0.05 * k),
                ):
                    per_repeat = np.clip(base + rng.normal(0, 0.1, 5), 0, 1)
                    rows.append(
                        {
                            "factor": factor,
                            "value": value,
                            "scheme": name,
                            "samples": n,
                            "success_rate": rate(per_repeat),
                            "per_repeat": per_repeat.tolist(),
                        }
                    )
    return {
        **head("conditions", seed),
        "scenario": "mirror",
        "repeats": 5,
        "evaluations": 6,
        "conditions": rows,
    }


def toy(seed=0, seeds=6):
    rng = np.random.default_rng(seed)

    def row(level):
        other = level * np.exp(rng.normal(0, 0.4, seeds))
        keys = {
            "train_mse_mean": 0.01 * other,
            "train_mse_std": 0.01 * other,
            "other_mse_mean": other,
            "other_mse_std": 1.5 * other,
            "other_mse_p95": 4.0 * other,
        }
        return {
            **{key: float(np.median(v)) for key, v in keys.items()},
            "per_seed": {key: v.tolist() for key, v in keys.items()},
        }

    def figures(scale):
        return {
            "source": {
                "train_mse": 0.001,
                "test_mse": 0.03,
                "rotated_mse": 42.0,
                "per_seed": {"train_mse": [0.001] * seeds},
            },
            "transfer": {
                "paper": row(0.3 * scale),
                "paper_single_start": row(0.6 * scale),
                "several_starts": row(0.18 * scale),
                "default": row(0.07 * scale),
                "true_map": row(0.04 * scale),
            },
            "baselines": {
                "unchanged": row(42.0 * scale),
                "relearn": row(0.7 * scale),
                "gaussian_process": row(0.4 * scale),
                "affine_regression": row(0.33 * scale),
            },
        }

    return {
        **head("toy", seed),
        "seeds": seeds,
        "repeats": 100,
        "function": "(x1 + 1)^3 + 2 (x2 + 1)^3 / 10 (Eq. 6), half a turn",
        "paper": {
            "source": {
                "train_mse": 0.0,
                "test_mse": 0.06,
                "rotated_mse": 41.71,
            },
            "transfer": {
                "train_mse_mean": 0.001,
                "train_mse_std": 0.001,
                "other_mse_mean": 0.354,
                "other_mse_std": 0.661,
            },
        },
        **figures(1.0),
        "wide": figures(6.0),
    }


def faults(seed=0):
    row = {
        "unit": "rad",
        "trials": 4,
        "success": 1,
        "false_success": 0,
        "detected": 3,
        "early": 0,
        "harmed": 2,
        "missed": 0,
        "detection_time": 0.12,
        "max_force": 7.5,
        "max_speed": 2.5,
        "reasons": {"angle reading jumps": 3},
    }
    return {
        **head("faults", seed),
        "scenario": "supervised",
        "demonstrations": 25,
        "repeats": 4,
        "force_limit": 40.0,
        "rows": [
            row | {"kind": "joint_offset", "size": 0.1},
            row
            | {
                "kind": "supply_lost",
                "size": None,
                "unit": "",
                "missed": 1,
                "detection_time": None,
            },
        ],
        "sound": {
            "trials": 8,
            "success": {"mean": 0.97, "low": 0.9, "high": 1.0},
            "false_success": 0,
            "false_alarms": 1,
            "reasons": {"joint does not follow": 1},
            "max_force": 4.0,
            "max_speed": 3.0,
            "highest_scores": {"tracking": 0.6},
        },
        "faulted": 8,
        "false_success": 0,
        "missed": 1,
        "false_alarms": 1,
        "beyond_limit": 0,
    }


def tune(seed=0):
    joints = ("waist_yaw", "right_elbow_flexion")

    def by_joint(value):
        return {joint: value * (1 + i) for i, joint in enumerate(joints)}

    def side(scale):
        costs = {
            "cost": 5.0 * scale,
            "tracking_error_deg": by_joint(2.0 * scale),
            "tracking_percent": by_joint(1.5 * scale),
            "effort_percent": by_joint(9.0 * scale),
            "oscillation_percent": by_joint(0.1 * scale),
        }
        gains = {"kP": 6e5, "kI": 2e5, "kD": 3e4, "kF": 5e-6}
        return {
            "cost": 5.0 * scale,
            "gains": {
                joint: {k: scale * v for k, v in gains.items()}
                for joint in joints
            },
            "trajectories": dict.fromkeys(
                ("sines_and_steps", "chirp", "strokes", "trapezoids"), costs
            ),
            "rest_oscillation_percent": by_joint(0.2 * scale),
        }

    return {
        **head("tune", seed),
        "scenario": "drumming",
        "start": "hand_tuned.yaml",
        "tuning": "tuning.yaml",
        "joints": list(joints),
        "trials": {
            "finished": 24,
            "complete": 21,
            "pruned": 3,
            "interrupted": 1,
            "best": 17,
        },
        "hand_tuned": side(1.0),
        "best": side(0.6),
        "improvement": 0.4,
        "held_out_improvement": {
            "chirp": 0.3,
            "strokes": -0.05,
            "trapezoids": 0.25,
        },
    }


def tune_details(seed=0):
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 4.0, 101)

    def angles(error):
        return {
            joint: (10.0 * np.sin(t) + error * rng.normal(size=t.size)).tolist()
            for joint in ("waist_yaw", "right_elbow_flexion")
        }

    return {
        "trials": [
            {"number": i, "pruned": i % 8 == 7, "cost": 5.0 - 0.1 * i}
            for i in range(24)
        ],
        "importance": {
            joint: {"kP": 0.5, "kI": 0.3, "kD": 0.15, "kF": 0.05}
            for joint in ("waist_yaw", "right_elbow_flexion")
        },
        "references": {
            name: {
                "t": t.tolist(),
                "desired": angles(0.0),
                "hand_tuned": angles(2.0),
                "tuned": angles(1.0),
            }
            for name in ("sines_and_steps", "chirp", "postures")
        },
    }


def demo(seed=0):
    rng = np.random.default_rng([seed, 1])

    def tests(successes):
        return [
            {
                "xy": xy.tolist(),
                "tau": _tau(xy),
                "reward": _reward(rng, success),
                "success": bool(success),
            }
            for xy, success in zip(
                _positions(rng, len(successes)), successes, strict=True
            )
        ]

    hits = {
        "unchanged": 1,
        "relearn": 5,
        "continue": 2,
        "transfer": 4,
        "transfer_default": 5,
    }
    return {
        **head("demo", seed),
        "drumming": {
            "demonstrations": 12,
            "taught": _taught(rng, 12),
            "positions": tests([1] * 7 + [0]),
            "success_rate": 0.875,
        },
        "mirror": {
            "samples": 5,
            "taught": _taught(rng, 5),
            "positions": [{"xy": xy.tolist()} for xy in _positions(rng, 5)],
            "schemes": {
                name: {
                    "success_rate": n / 5,
                    "rewards": [_reward(rng, i < n) for i in range(5)],
                }
                for name, n in hits.items()
            },
        },
    }


def png(width=32, height=24, color=(90, 140, 190)):
    """A picture of one color."""

    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(
            ">I", zlib.crc32(body)
        )  # fmt: skip

    row = b"\0" + bytes(color) * width
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(row * height))
        + chunk(b"IEND", b"")
    )


REPLAY = """<!DOCTYPE html><html><head><title>replay</title></head><body>
<p id="said"></p><script>
document.getElementById("said").textContent = "The replay runs: <\\/script>";
fetch("data:text/plain,x").then(() => parent.postMessage("replay runs", "*"));
</script></body></html>
"""


def write_media(folder: Path):
    """Pictures, sounds and a replay that tells the page it runs."""
    for name in ("camera_direct", "camera_mirror", "trial"):
        (folder / f"{name}.png").write_bytes(png())
    t = np.arange(0, 0.5, 1 / 16000)
    hit = np.exp(-8 * t) * np.sin(2 * np.pi * 146 * t)
    for name, sound in (("hit", hit), ("miss", 0.01 * hit)):
        wavfile.write(
            folder / f"{name}.wav", 16000, (32767 * sound).astype(np.int16)
        )
    (folder / "replay.html").write_text(REPLAY)


def write(folder: Path, results, media=False) -> Path:
    """Makes a study's folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "results.json").write_text(json.dumps(results))
    if media:
        write_media(folder)
    return folder


def write_all(parent: Path) -> list[Path]:
    """A folder of each study."""
    return [
        write(parent / "demo", demo(), media=True),
        write(parent / "drum", drum()),
        write(parent / "mirror", mirror("level")),
        write(parent / "scenarios", scenarios()),
        write(parent / "conditions", conditions()),
        write(parent / "toy", toy()),
        write(parent / "faults", faults()),
    ]
