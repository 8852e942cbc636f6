#!/usr/bin/env python3
"""Integrates the drive of examples/drive_samples.rs with SciPy's solvers and compares, sample by sample.

    pip install numpy scipy
    cargo run --example drive_samples > samples.txt && python tests/drive_scipy.py samples.txt

Two masses, current loop, torque ripple, and friction: Coulomb with Stribeck (DOP853, events where the table stops and breaks away)
or bristles (DOP853 too: they are not that stiff). Nothing is shared with servosim but the equations. Prints the largest distance, exits 1 above 2 nm.
"""

import sys

import numpy as np
from scipy.integrate import solve_ivp

R, KT, K, TAU = 1.59, 1 / 0.716, 83.0089, 0.19936
B = 1 / (KT * K)
JT = 150.0 * (R * 1e-3) ** 2
JM = TAU * B - JT
KS, CS = 120e6 * (R * 1e-3) ** 2, 5e3 * (R * 1e-3) ** 2
WC = 2 * np.pi * 1000.0
TC, TS, WS, BF = 0.1, 0.15, 3.0 / R, 0.001
S0, S1 = 30.0, 0.2
DT, N = 1e-3, 700


def ripple(angle):
    return 0.03 * np.sin(6 * angle + 0.4) + 0.01 * np.sin(24 * angle + 1.1)


def curve(w):
    return TC + (TS - TC) * np.exp(-((w / WS) ** 2))


def motor(y, command):
    """Rates of torque, motor angle and speed; the screw's torque."""
    t, a, w, p, v = y[:5]
    g = KS * (a - p) + CS * (w - v)
    return WC * (command - t), w, (t + ripple(a) - B * w - g) / JM, g


def command_at(k):
    return 0.5 * np.sin(2 * np.pi * 3 * k * DT)


def coulomb():
    tight = dict(method="DOP853", rtol=1e-11, atol=1e-13)
    y, state = np.zeros(5), 0
    out = []
    for k in range(N):
        out.append((y[1] * R, y[3] * R))
        c, t = command_at(k), k * DT
        while t < (k + 1) * DT - 1e-15:

            def rates(_, y, s=state):
                dt, da, dw, g = motor(y, c)
                if s == 0:
                    return [dt, da, dw, 0.0, 0.0]
                return [dt, da, dw, y[4], (g - s * curve(y[4]) - BF * y[4]) / JT]

            if state == 0:
                event = lambda _, y: abs(motor(y, c)[3]) - TS
                event.direction = 1
            else:
                event = lambda _, y, s=state: s * y[4]
                event.direction = -1
            event.terminal = True
            solution = solve_ivp(rates, (t, (k + 1) * DT), y, events=event, **tight)
            y, t = solution.y[:, -1].copy(), solution.t[-1]
            if solution.status == 1:
                g = motor(y, c)[3]
                if state == 0:
                    state = int(np.sign(g))
                    # Off the event: a nudge that is far below the tolerance.
                    y[4] = state * 1e-12
                else:
                    y[4] = 0.0
                    g = motor(y, c)[3]
                    state = 0 if abs(g) <= TS else int(np.sign(g))
                    y[4] = state * 1e-12
    return np.array(out)


def lugre():
    y = np.zeros(6)
    out = []
    for k in range(N):
        out.append((y[1] * R, y[3] * R))
        c = command_at(k)

        def rates(_, y):
            dt, da, dw, g = motor(y, c)
            v, z = y[4], y[5]
            dz = v - S0 * abs(v) / curve(v) * z
            return [dt, da, dw, v, (g - S0 * z - S1 * dz - BF * v) / JT, dz]

        y = solve_ivp(rates, (0, DT), y, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    return np.array(out)


def main():
    rows = [line.split() for line in open(sys.argv[1], encoding="ascii")]
    worst = 0.0
    for name, run in [("coulomb", coulomb), ("lugre", lugre)]:
        ours = np.array([[float(x) for x in row[1:]] for row in rows if row[0] == name])
        theirs = run()
        apart = 1e6 * np.abs(ours - theirs).max(axis=0)
        span = np.ptp(theirs[:, 1])
        print(f"{name}: motor {apart[0]:.4f} nm, table {apart[1]:.4f} nm apart, over {span:.3f} mm of travel")
        worst = max(worst, apart.max())
    print("passed" if worst < 2.0 else "FAILED")
    return 0 if worst < 2.0 else 1


if __name__ == "__main__":
    sys.exit(main())
