"""The compiled kernel that rings the modes of the membrane."""

import numba
import numpy as np


@numba.njit(cache=True)
def _touch(first, second, third):
    """The part of an interval in which a contact sets in.

    Args:
        first: force at the contact's first sample; it was zero before.
        second: how much the force rises to the next sample.
        third: and from there to the one after that.

    Returns:
        How long before its first sample the contact began (0 to 1), and the
        slopes of the force there and at the first sample: by a parabola
        through the three samples, held monotone.
    """
    if first < 0.0:
        length, start, end = _touch(-first, -second, -third)
        return length, -start, -end
    bend = third - second
    end = min(max(second - 0.5 * bend, 0.0), 3.0 * max(second, 0.0))
    start = np.sqrt(max(end**2 - 2.0 * bend * first, 0.0))
    if start + end > 2.0 * first:
        return 2.0 * first / (start + end), start, end
    # It set in just after the sample before.
    end = min(end, 2.0 * first)
    return 1.0, 2.0 * first - end, end


@numba.njit(cache=True)
def _touches(drive):
    """How the forces (T, N) run between their samples.

    A soft contact sets in with a kink (F' = k v), and at some time between
    two samples: there its course is extrapolated, so that what the kink
    excites depends little on how the samples happen to lie. So with its end.

    Returns:
        Slopes at the samples (T, N) by period; and of the interval after
        each sample the length of the part in which there is force (T, N), 0
        to 1, and where that is not all of it, the slope at which the force
        sets in or ends (T, N).
    """
    rows, count = drive.shape
    slope = np.zeros((rows, count))
    length = np.ones((rows, count))
    edge = np.zeros((rows, count))
    for k in range(1, rows - 1):
        for i in range(count):
            force = drive[k, i]
            before = force - drive[k - 1, i]
            after = drive[k + 1, i] - force
            if before * after > 0.0:
                # Central difference, limited to what stays monotone.
                limit = 3.0 * min(abs(before), abs(after))
                slope[k, i] = max(-limit, min(limit, 0.5 * (before + after)))
            if force != 0.0 and drive[k - 1, i] == 0.0 and k + 2 < rows:
                length[k - 1, i], edge[k - 1, i], slope[k, i] = _touch(
                    force, after, drive[k + 2, i] - drive[k + 1, i]
                )
            elif force != 0.0 and drive[k + 1, i] == 0.0 and k > 1:
                length[k, i], edge[k, i], slope[k, i] = _touch(
                    force, -before, drive[k - 2, i] - drive[k - 1, i]
                )
                edge[k, i] *= -1.0
                slope[k, i] *= -1.0
    return slope, length, edge


@numba.njit(cache=True)
def ring(
    drive,
    dashpot,
    shape,
    transition,
    mass,
    stiffness,
    gain,
    period,
    rate,
    pressure,
):
    """Adds what the modes radiate to `pressure`.

    Between its samples the modal force follows a monotone cubic (C1, no
    overshoot): a hold or a chain of lines would ring at the sampling
    frequency of the simulation, a spline would swing before the touch. Where
    a contact begins or ends, see `_touches`.

    Args:
        drive: modal forces (T, N), N, `period` apart.
        dashpot: damping constant of the hand (T), N s/m.
        shape: mode shapes at the hand (T, N).
        transition: see `transition_matrix`.
        mass: modal masses (N).
        stiffness: modal stiffnesses (N).
        gain: pressure by acceleration (N).
        period: time between rows of `drive` [s].
        rate: sampling rate of `pressure` [Hz].
        pressure: the sound (S), added to.
    """
    rows, count = drive.shape
    slope, length, edge = _touches(drive)
    # What pushes from the start has done so for long: no jump at t = 0.
    force = drive[0].copy()
    q = force / stiffness
    v = np.zeros(count)
    step = 1.0 / rate
    quiet = True
    for n in range(1, len(pressure)):
        position = n / (rate * period)
        k = min(int(position), rows - 2)
        u = min(position - k, 1.0)
        if quiet:
            # Nothing moves and nothing pushes: skip to the next force.
            driven = False
            for i in range(count):
                if drive[k, i] != 0.0 or drive[k + 1, i] != 0.0:
                    driven = True
            if not driven:
                continue
            quiet = False
        c = dashpot[k] + u * (dashpot[k + 1] - dashpot[k])
        near = k if u < 0.5 else k + 1
        total = 0.0
        speed = 0.0
        mobility = 0.0
        for i in range(count):
            new = 0.0
            left, right = drive[k, i], drive[k + 1, i]
            if left != 0.0 or right != 0.0:
                part = length[k, i]
                rise_left, rise_right = slope[k, i], slope[k + 1, i]
                x = u
                if left == 0.0:
                    x = max((u - 1.0) / part + 1.0, 0.0)
                    rise_left = edge[k, i]
                elif right == 0.0:
                    x = min(u / part, 1.0)
                    rise_right = edge[k, i]
                y = 1.0 - x
                new = y * y * (
                    (1.0 + 2.0 * x) * left + x * part * rise_left
                ) + x * x * ((1.0 + 2.0 * y) * right - y * part * rise_right)
            a = transition[i]
            q_new = (
                a[0, 0] * q[i]
                + a[0, 1] * v[i]
                + a[0, 2] * force[i]
                + a[0, 3] * new
            )
            v_new = (
                a[1, 0] * q[i]
                + a[1, 1] * v[i]
                + a[1, 2] * force[i]
                + a[1, 3] * new
            )
            total += gain[i] * (v_new - v[i])
            q[i] = q_new
            v[i] = v_new
            force[i] = new
            speed += shape[near, i] * v_new
            mobility += shape[near, i] ** 2 / mass[i]
        if c > 0.0:
            # The hand slows the point that it touches (implicit step).
            impulse = c * step * speed / (1.0 + c * step * mobility)
            for i in range(count):
                change = -impulse * shape[near, i] / mass[i]
                v[i] += change
                total += gain[i] * change
        pressure[n] += total * rate
        if n % 1024 == 0:
            energy = 0.0
            for i in range(count):
                energy += v[i] ** 2 + force[i] ** 2
            if energy < 1e-24:
                q[:] = 0.0
                v[:] = 0.0
                force[:] = 0.0
                quiet = True
