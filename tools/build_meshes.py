"""Writes the meshes of Affetto and its drum beside this file.

Needs numpy alone. Every mesh is a smooth surface swept along a path or
deformed from a ball, in the frame of the link that carries it, in meters;
link lengths are those of `sdf/affetto.sdf`. Run it again after a change:

    python tools/build_meshes.py
"""

import dataclasses
from pathlib import Path

import numpy as np

Array = np.ndarray


@dataclasses.dataclass
class Mesh:
    """Vertices (n, 3) and faces, tuples of vertex indices seen from outside."""

    vertices: Array
    faces: list[tuple[int, ...]]

    def __add__(self, other: "Mesh") -> "Mesh":
        shift = len(self.vertices)
        moved = [tuple(i + shift for i in face) for face in other.faces]
        return Mesh(
            np.concatenate([self.vertices, other.vertices]), self.faces + moved
        )

    def mirrored(self) -> "Mesh":
        """The same on the other side of the xz plane."""
        return Mesh(
            self.vertices * [1, -1, 1], [face[::-1] for face in self.faces]
        )

    def moved(self, *by: float) -> "Mesh":
        return Mesh(self.vertices + by, self.faces)

    def normals(self) -> Array:
        """Unit vertex normals (n, 3): face normals, weighted by area."""
        total = np.zeros_like(self.vertices)
        for face in self.faces:
            corners = self.vertices[list(face)]
            normal = np.zeros(3)
            for i in range(1, len(face) - 1):
                normal += np.cross(
                    corners[i] - corners[0], corners[i + 1] - corners[0]
                )
            total[list(face)] += normal
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return total / np.maximum(length, 1e-12)

    def write(self, path: Path) -> None:
        lines = [
            f"v {x:.5f} {y:.5f} {z:.5f}".replace("-0.00000", "0.00000")
            for x, y, z in self.vertices
        ]
        lines += [f"vn {x:.3f} {y:.3f} {z:.3f}" for x, y, z in self.normals()]
        lines += [
            "f " + " ".join(f"{i + 1}//{i + 1}" for i in face)
            for face in self.faces
        ]
        path.write_text("\n".join(lines) + "\n", encoding="ascii")


def rings(points: Array, *, closed: bool = False) -> Mesh:
    """A surface over rings of points (m, n, 3), counter-clockwise around.

    Unless `closed` (a torus), the first and last ring must each be a point
    (n times the same); they become one vertex each.
    """
    m, n, _ = points.shape
    if closed:
        vertices = points.reshape(-1, 3)
        faces = [
            (
                i * n + j,
                i * n + (j + 1) % n,
                (i + 1) % m * n + (j + 1) % n,
                (i + 1) % m * n + j,
            )
            for i in range(m)
            for j in range(n)
        ]
        return Mesh(vertices, faces)
    body = points[1:-1].reshape(-1, 3)
    vertices = np.concatenate([points[0, :1], body, points[-1, :1]])
    last = len(vertices) - 1
    faces: list[tuple[int, ...]] = []
    for j in range(n):
        k = (j + 1) % n
        faces.append((0, 1 + k, 1 + j))
        for i in range(m - 3):
            a = 1 + i * n
            faces.append((a + j, a + k, a + n + k, a + n + j))
        a = 1 + (m - 3) * n
        faces.append((a + j, a + k, last))
    return Mesh(vertices, faces)


def hermite(knots: Array, values: Array, at: Array) -> Array:
    """Cubic interpolation of values (k, d) without overshoot (Fritsch)."""
    step = np.diff(knots)[:, None]
    slope = np.diff(values, axis=0) / step
    inner = slope[:-1] * slope[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(inner > 0, 2 * inner / (slope[:-1] + slope[1:]), 0.0)
    tangent = np.concatenate([slope[:1], mean, slope[-1:]])
    i = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(step) - 1)
    h = step[i]
    t = (at[:, None] - knots[i][:, None]) / h
    return (
        (1 + 2 * t) * (1 - t) ** 2 * values[i]
        + t * (1 - t) ** 2 * h * tangent[i]
        + t**2 * (3 - 2 * t) * values[i + 1]
        + t**2 * (t - 1) * h * tangent[i + 1]
    )


def sweep(
    stations,
    *,
    around: int = 20,
    along: int = 14,
    side=(0.0, 1.0, 0.0),
    power: float = 2.0,
    ends: tuple[float, float] = (1.0, 1.0),
    caps: int = 4,
) -> Mesh:
    """A tube with rounded ends through elliptic stations.

    Args:
        stations: rows (x, y, z, a, b): center and half widths, a along
            `side` × path and b along `side`.
        power: of the super-ellipse; 2 is an ellipse, more is squarer.
        ends: how far each rounded end bulges out, in multiples of its mean
            half width.
    """
    rows = np.asarray(stations, dtype=float)
    length = np.concatenate(
        [[0], np.cumsum(np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1))]
    )
    at = np.linspace(0, length[-1], along)
    middle = hermite(length, rows, at)
    path = np.gradient(middle[:, :3], axis=0)
    path /= np.linalg.norm(path, axis=1, keepdims=True)
    angle = np.linspace(0, np.pi / 2, caps + 1)[1:]
    sections = [
        (*row[:3], row[3], row[4], t)
        for row, t in zip(middle, path, strict=True)
    ]
    first, last = [], []
    for turn in angle:
        for end, index, out in ((0, 0, first), (1, -1, last)):
            x, y, z, a, b = middle[index]
            sign = -1 if end == 0 else 1
            bulge = sign * ends[end] * 0.5 * (a + b) * np.sin(turn)
            center = middle[index, :3] + bulge * path[index]
            shrink = np.cos(turn) if turn < np.pi / 2 else 0.0
            out.append((*center, a * shrink, b * shrink, path[index]))
    phi = np.linspace(0, 2 * np.pi, around, endpoint=False)
    c, s = np.cos(phi), np.sin(phi)
    u = np.sign(c) * np.abs(c) ** (2 / power)
    v = np.sign(s) * np.abs(s) ** (2 / power)
    points = []
    for x, y, z, a, b, t in first[::-1] + sections + last:
        across = np.cross(side, t)
        across /= np.linalg.norm(across)
        lateral = np.cross(t, across)
        ring = np.outer(a * u, across) + np.outer(b * v, lateral)
        points.append(ring + [x, y, z])
    return rings(np.array(points))


def tube(points, radii, **options) -> Mesh:
    """A round tube through `points` (k, 3) with half widths `radii` (k)."""
    rows = np.column_stack([points, radii, radii])
    return sweep(rows, **options)


def revolve(profile, around: int = 40) -> Mesh:
    """A closed profile (k, 2) of (radius, z), turned about the z axis.

    The profile runs counter-clockwise with the radius to the right.
    """
    rz = np.asarray(profile, dtype=float)
    phi = np.linspace(0, 2 * np.pi, around, endpoint=False)
    points = np.stack(
        [
            np.outer(rz[:, 0], np.cos(phi)),
            np.outer(rz[:, 0], np.sin(phi)),
            np.repeat(rz[:, 1:], around, axis=1),
        ],
        -1,
    )
    return rings(points, closed=True)


# The head: a ball whose radius is a function of direction


HEAD_CENTER = np.array([-0.004, 0.0, 0.097])


def _bump(d: Array, at, width: float, height: float) -> Array:
    at = np.asarray(at, dtype=float) / np.linalg.norm(at)
    angle = np.arccos(np.clip(d @ at, -1, 1))
    return height * np.exp(-0.5 * (angle / width) ** 2)


def head_radius(d: Array) -> Array:
    """Distance [m] of the skin from the head's center along d (..., 3)."""
    front = np.where(d[..., 0] > 0, 0.072, 0.090)
    height = np.where(d[..., 2] > 0, 0.088, 0.080)
    r = 1 / np.sqrt(
        (d[..., 0] / front) ** 2
        + (d[..., 1] / 0.071) ** 2
        + (d[..., 2] / height) ** 2
    )
    # A child's face: round cheeks, small chin, high forehead, flat nose.
    r = r + _bump(d, (0.8, 0, 0.55), 0.45, 0.004)
    r = r + _bump(d, (1, 0, -0.62), 0.22, 0.0035)
    r = r + _bump(d, (0.9, 0, -1.0), 0.2, 0.003)
    r = r + _bump(d, (1, 0, -0.27), 0.1, 0.0085)
    r = r + _bump(d, (1, 0, -0.1), 0.09, 0.003)
    for y in (-1, 1):
        r = r + _bump(d, (0.75, 0.55 * y, -0.42), 0.28, 0.006)
        r = r + _bump(d, (0.9, 0.36 * y, -0.1), 0.13, -0.0045)
        r = r + _bump(d, (0.1, 0.6 * y, -0.8), 0.35, -0.009)
    r = r + _bump(d, (-0.6, 0, -0.8), 0.4, -0.012)
    return r


def _directions(rows: int, columns: int) -> tuple[Array, Array, Array]:
    """Elevation, azimuth and unit vectors; columns crowd at the front."""
    elevation = np.linspace(-np.pi / 2, np.pi / 2, rows)
    turn = np.linspace(-np.pi, np.pi, columns, endpoint=False)
    azimuth = turn - 0.45 * np.sin(turn)
    e, a = np.meshgrid(elevation, azimuth, indexing="ij")
    d = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], -1)
    return e, a, d


def on_face(azimuth: Array, elevation: Array, lift: float) -> Array:
    """Points (..., 3) `lift` meters above the skin."""
    a, e = np.asarray(azimuth), np.asarray(elevation)
    d = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], -1)
    return HEAD_CENTER + d * (head_radius(d) + lift)[..., None]


def face() -> Mesh:
    _, _, d = _directions(33, 48)
    skin = rings(HEAD_CENTER + d * head_radius(d)[..., None])
    ear = sweep(
        [
            (-0.010, 0.068, 0.074, 0.006, 0.003),
            (-0.012, 0.073, 0.084, 0.010, 0.004),
            (-0.015, 0.076, 0.095, 0.013, 0.005),
            (-0.016, 0.075, 0.104, 0.010, 0.004),
        ],
        around=14,
        along=8,
    )
    return skin + ear + ear.mirrored()


def hair() -> Mesh:
    e, a, d = _directions(29, 52)
    back = 0.5 * (1 - np.cos(a))
    # The hairline: high over the forehead, above the ears, low in the neck.
    line = 0.62 - 1.05 * back**0.6 - 0.25 * np.exp(-((a / 0.22) ** 2))
    line = line + 0.10 * np.cos(9 * a) * np.cos(a / 2) ** 4
    over = np.clip((e - line) / 0.22, 0, 1)
    over = over * over * (3 - 2 * over)
    strands = 0.0012 * np.sin(14 * a + 3 * np.sin(2 * e)) * np.cos(e)
    r = head_radius(d) - 0.005 + over * (0.0135 + strands)
    cap = rings(HEAD_CENTER + d * r[..., None])
    t = np.linspace(-1, 1, 6)
    brow = tube(
        on_face(0.40 + 0.16 * t, 0.19 - 0.05 * t**2 - 0.02 * t, 0.0006),
        0.0022 - 0.0010 * t**2,
        around=8,
        along=8,
        side=(1, 0, 0),
        caps=2,
    )
    return cap + brow + brow.mirrored()


def mouth() -> Mesh:
    t = np.linspace(-1, 1, 7)
    upper = tube(
        on_face(0.25 * t, -0.52 + 0.07 * t**2, -0.0004),
        0.0028 - 0.0018 * t**2,
        around=8,
        along=13,
        side=(1, 0, 0),
        caps=2,
    )
    lower = tube(
        on_face(0.20 * t, -0.575 + 0.09 * t**2, -0.0006),
        0.0032 - 0.0020 * t**2,
        around=8,
        along=13,
        side=(1, 0, 0),
        caps=2,
    )
    return upper + lower


# The trunk


def chest() -> Mesh:
    return sweep(
        [
            (0.000, 0, -0.012, 0.043, 0.055),
            (0.004, 0, 0.010, 0.051, 0.064),
            (0.006, 0, 0.035, 0.056, 0.071),
            (0.004, 0, 0.060, 0.053, 0.071),
            (0.000, 0, 0.082, 0.043, 0.058),
            (-0.002, 0, 0.096, 0.034, 0.040),
        ],
        around=32,
        along=18,
        power=2.4,
        ends=(0.25, 0.35),
    )


def pelvis() -> Mesh:
    return sweep(
        [
            (0, 0, -0.055, 0.036, 0.044),
            (0, 0, -0.040, 0.050, 0.064),
            (0, 0, -0.018, 0.055, 0.071),
            (0, 0, 0.002, 0.049, 0.062),
        ],
        around=32,
        along=12,
        power=2.3,
        ends=(0.3, 0.25),
    )


def bellows(height: float, ribs: int, a: float, b: float) -> Mesh:
    """A ribbed piece of the waist, from z = 0 to `height`."""
    n = 4 * ribs
    z = np.linspace(-0.004, height + 0.004, n + 1)
    swell = 0.0035 * np.cos(2 * np.pi * ribs * np.arange(n + 1) / n)
    rows = [(0, 0, h, a - s, b - s) for h, s in zip(z, swell, strict=True)]
    return sweep(
        rows, around=24, along=n + 1, power=2.2, ends=(0.12, 0.12), caps=2
    )


def neck() -> Mesh:
    return sweep(
        [
            (0, 0, -0.006, 0.0290, 0.0300),
            (-0.001, 0, 0.012, 0.0275, 0.0275),
            (-0.002, 0, 0.040, 0.0290, 0.0285),
            (-0.004, 0, 0.070, 0.0335, 0.0335),
        ],
        along=9,
        ends=(0.2, 0.3),
    )


# The arms hang along -z; the palms face backwards (-x)


def collar() -> Mesh:
    """From the breast-bone outwards along +y."""
    return sweep(
        [(0, 0.0, 0, 0.020, 0.027), (0, 0.03, 0.001, 0.024, 0.028)]
        + [(0, 0.058, 0, 0.0255, 0.0265)],
        side=(1, 0, 0),
        along=8,
        ends=(0.6, 0.9),
    )


def shoulder() -> Mesh:
    return sweep(
        [(0, 0, -0.024, 0.0258, 0.0258), (0, 0, -0.006, 0.0285, 0.0285)]
        + [(0, 0, 0.010, 0.0280, 0.0280)],
        along=8,
        ends=(0.12, 1.0),
    )


def upper_arm() -> Mesh:
    return sweep(
        [
            (0, 0, -0.146, 0.0200, 0.0200),
            (0, 0, -0.125, 0.0207, 0.0205),
            (0.002, 0, -0.085, 0.0240, 0.0232),
            (0.001, 0, -0.045, 0.0250, 0.0244),
            (0, 0, 0.000, 0.0238, 0.0238),
        ],
        ends=(1.0, 0.6),
        along=14,
    )


def forearm() -> Mesh:
    return sweep(
        [
            (0, 0, -0.062, 0.0188, 0.0192),
            (0, 0, -0.040, 0.0212, 0.0216),
            (0.001, 0, -0.020, 0.0224, 0.0222),
            (0, 0, 0.000, 0.0202, 0.0202),
        ],
        ends=(0.3, 1.0),
        along=11,
    )


def wrist() -> Mesh:
    return sweep(
        [
            (0, 0, -0.056, 0.0125, 0.0158),
            (0, 0, -0.040, 0.0148, 0.0168),
            (0, 0, -0.015, 0.0180, 0.0186),
            (0, 0, 0.002, 0.0186, 0.0190),
        ],
        ends=(0.8, 0.3),
        along=10,
    )


def hand() -> Mesh:
    """A right hand: the thumb at +y, the palm towards -x."""
    palm = sweep(
        [
            (0.001, 0.000, -0.002, 0.0120, 0.0155),
            (-0.003, 0.001, -0.018, 0.0165, 0.0220),
            (-0.005, 0.000, -0.036, 0.0165, 0.0262),
            (-0.004, -0.001, -0.054, 0.0140, 0.0255),
        ],
        around=22,
        along=11,
        power=2.3,
        ends=(0.5, 0.35),
    )
    mesh = palm
    fingers = [
        (0.0190, 0.0065, 0.034),
        (0.0065, 0.0068, 0.038),
        (-0.0062, 0.0065, 0.035),
        (-0.0180, 0.0056, 0.027),
    ]
    for y, r, length in fingers:
        t = np.linspace(0, 1, 5)
        bend = -0.006 - 0.010 * t**2
        points = np.column_stack(
            [bend, y * (1 + 0.18 * t), -0.050 - length * t]
        )
        mesh = mesh + tube(
            points, r * (1.04 - 0.2 * t), around=10, along=7, caps=3
        )
    thumb = tube(
        [
            (-0.004, 0.014, -0.018),
            (-0.009, 0.027, -0.030),
            (-0.012, 0.034, -0.043),
            (-0.014, 0.036, -0.054),
        ],
        [0.0085, 0.0085, 0.0074, 0.0060],
        around=12,
        along=8,
        caps=3,
        side=(1, 0, 0),
    )
    return mesh + thumb


# The drum


def hoop() -> Mesh:
    """The ring that holds the drum's head, around z = 0."""
    t = np.linspace(0, 2 * np.pi, 10, endpoint=False)
    return revolve(
        np.column_stack([0.0645 + 0.0028 * np.cos(t), 0.0035 * np.sin(t)]), 48
    )


def drum_shell() -> Mesh:
    """A gently bellied wall, from z = 0 to 0.066."""
    z = np.linspace(0, 1, 7)
    outer = 0.0610 + 0.0030 * np.sin(np.pi * z)
    wall = np.column_stack([outer, 0.002 + 0.062 * z])
    inner = np.array([[0.056, 0.064], [0.056, 0.002]])
    return revolve(np.concatenate([wall, inner]), 48)


MESHES = {
    "face": face,
    "hair": hair,
    "mouth": mouth,
    "neck": neck,
    "chest": chest,
    "pelvis": pelvis,
    "waist_low": lambda: bellows(0.024, 2, 0.0425, 0.0545),
    "waist_pitch": lambda: bellows(0.030, 2, 0.044, 0.057),
    "waist_roll": lambda: bellows(0.050, 3, 0.043, 0.056),
    "lumbar": lambda: bellows(0.062, 4, 0.042, 0.055),
    "collar": collar,
    "shoulder": shoulder,
    "upper_arm": upper_arm,
    "forearm": forearm,
    "wrist": wrist,
    "right_hand": hand,
    "left_hand": lambda: hand().mirrored(),
    "drum_hoop": hoop,
    "drum_shell": drum_shell,
}


def main() -> None:
    folder = Path(__file__).resolve().parents[1] / "models" / "meshes"
    for name, build in MESHES.items():
        build().write(folder / f"{name}.obj")


if __name__ == "__main__":
    main()
