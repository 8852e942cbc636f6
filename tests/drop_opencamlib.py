"""OpenCAMLib's drop cutter beside ours: the same mesh, points and cutters, the same minute.

    python3 -m venv venv && venv/bin/pip install opencamlib
    SERVOSIM_DROP_HEIGHTS=heights.csv cargo bench --bench speed -- drop
    venv/bin/python tests/drop_opencamlib.py heights.csv
"""

import math
import sys
import time

import opencamlib as ocl

QUADS, WIDTH, COUNT, EVERY = 223, 100.0, 200, 100
ours = {}
for line in open(sys.argv[1]) if len(sys.argv) > 1 else []:
    name, height = line.split(",")
    ours.setdefault(name, []).append(float(height))


def point(i, j):
    step = WIDTH / QUADS
    x, y = step * i, step * j
    z = 3.0 * math.sin(x / 7.0) * math.cos(y / 9.0) + 0.3 * math.sin(x / 1.5) * math.sin(y / 1.7)
    return ocl.Point(x, y, z)


surface = ocl.STLSurf()
for i in range(QUADS):
    for j in range(QUADS):
        a, b, c, d = point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)
        surface.addTriangle(ocl.Triangle(a, b, c))
        surface.addTriangle(ocl.Triangle(a, c, d))

for name, cutter in [
    ("ball", ocl.BallCutter(10.0, 100.0)),
    ("flat", ocl.CylCutter(10.0, 100.0)),
    ("bull-nose", ocl.BullCutter(10.0, 1.0, 100.0)),
]:
    drop = ocl.BatchDropCutter()
    drop.setSTL(surface)
    drop.setCutter(cutter)
    step = WIDTH / COUNT
    # Every so many points: a thousand take it seconds.
    for k in range(0, COUNT * COUNT, EVERY + 1):
        i, j = divmod(k, COUNT)
        drop.appendPoint(ocl.CLPoint((i + 0.5) * step, (j + 0.5) * step, -1000.0))
    start = time.perf_counter()
    drop.run()
    took = time.perf_counter() - start
    heights = [p.z for p in drop.getCLPoints()]
    text = f"{name:<9} {len(heights) / took:>10.0f} points/s, {drop.getThreads()} threads"
    if name in ours:
        apart = [b - a for a, b in zip(heights, ours[name][:: EVERY + 1])]
        text += f"; ours - theirs {min(apart):.2e} … {max(apart):.2e} mm"
    print(text, flush=True)
