"""SciPy's FITPACK on the test curve of the fit bench: control points and seconds at each tolerance.

    python3 -m venv venv && venv/bin/pip install numpy scipy
    venv/bin/python benches/peers/fitpack.py

FITPACK smooths to a sum of squares, not to a largest distance: the smoothing is bisected (on its logarithm) until the largest
distance of a point to the curve just keeps the tolerance. The same table for servosim: cargo bench --bench speed -- fit
"""

import time

import numpy as np
from scipy.interpolate import splev, splprep


def points(bump):
    t = np.linspace(0, 2 * np.pi, 500)
    z = 3 * np.sin(3 * t)
    if bump:
        z = z + 1.5 * np.sin(24 * (t - 4)) * np.exp(-(((t - 4) / 0.25) ** 2))
    return np.array([40 * np.cos(t), 25 * np.sin(t), z])


def largest_distance(tck, u, q):
    """Largest distance of a point to the curve: the nearest of dense samples around its parameter, refined by Newton."""
    for _ in range(4):
        c = np.array(splev(u, tck)) - q
        d1, d2 = np.array(splev(u, tck, 1)), np.array(splev(u, tck, 2))
        slope, bend = (c * d1).sum(0), (d1 * d1).sum(0) + (c * d2).sum(0)
        u = np.clip(u - slope / np.where(bend > 0, bend, (d1 * d1).sum(0)), 0, 1)
    return np.sqrt(((np.array(splev(u, tck)) - q) ** 2).sum(0)).max()


def fit(q, tolerance):
    low, high, best = np.log(1e-12), np.log(q.shape[1] * tolerance**2 * 4), None
    for _ in range(40):
        middle = 0.5 * (low + high)
        tck, u = splprep(q, s=np.exp(middle), k=3)
        if largest_distance(tck, u, q) <= tolerance:
            low, n = middle, len(tck[1][0])
            best = n if best is None else min(best, n)
        else:
            high = middle
    return best


for tolerance in [0.5, 0.25, 0.05, 0.01, 0.005]:
    row = []
    for bump in [True, False]:
        q = points(bump)
        start = time.perf_counter()
        n = fit(q, tolerance)
        row.append(f"{n:4d} control points {time.perf_counter() - start:6.3f} s")
    print(f"{tolerance:6g} mm   " + "   without the bump: ".join(row))
