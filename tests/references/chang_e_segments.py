"""The main braking of Chang'e-3 in the plane with constant thrust and direction on equal segments: multiple shooting with Ipopt.

    python chang_e_segments.py

The problem is that of chang_e_braking.py, whose optimum is taken from it. Angles are constant in the local frame along a segment; the time of
flight is free. Each segment is integrated by Runge-Kutta steps of order 4, 1200 in all. Prints what each number of segments loses, from starts
with full thrust all along and with least thrust in the first one or two segments: there are several local optima.
"""

import casadi as ca
import numpy as np

from chang_e_braking import EXHAUST, GATE, LEAST, MASS, MOST, RADIUS, SPEED, START, TIME, solve

UNIT = MASS * SPEED / TIME
C = EXHAUST / SPEED


def step_of(steps):
    """One segment: state (r, u, v, m), control (direction, thrust), duration."""
    x, w, h = ca.SX.sym("x", 4), ca.SX.sym("w", 2), ca.SX.sym("h")

    def rate(x):
        r, u, v, m = ca.vertsplit(x)
        a = w[1] / m
        return ca.vertcat(v, -u * v / r + a * ca.cos(w[0]), u * u / r - 1 / r**2 + a * ca.sin(w[0]), -w[1] / C)

    y, d = x, h / steps
    for _ in range(steps):
        k1 = rate(y)
        k2 = rate(y + d / 2 * k1)
        k3 = rate(y + d / 2 * k2)
        k4 = rate(y + d * k3)
        y = y + d / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return ca.Function("segment", [x, w, h], [y])


def final_mass(segments, guess_time, low_segments):
    segment = step_of(max(1200 // segments, 1))
    begin = [(RADIUS + 15e3) / RADIUS, 1692.0 / SPEED, 0.0, 1.0]
    time = ca.MX.sym("time")
    x = [ca.DM(begin)] + [ca.MX.sym(f"x{k}", 4) for k in range(segments)]
    w = [ca.MX.sym(f"w{k}", 2) for k in range(segments)]
    defects = [segment(x[k], w[k], time / segments) - x[k + 1] for k in range(segments)]
    last = x[-1]
    ends = [last[0] - GATE, (last[1] ** 2 + last[2] ** 2) * (SPEED / 57.0) ** 2 - 1.0]
    unknowns = ca.vertcat(time, *w, *x[1:])
    nlp = {"x": unknowns, "f": -last[3], "g": ca.vertcat(*defects, *ends)}
    solver = ca.nlpsol("solver", "ipopt", nlp, {"ipopt.print_level": 0, "print_time": False, "ipopt.tol": 1e-11, "ipopt.bound_relax_factor": 0.0, "ipopt.mu_init": 1e-4, "ipopt.bound_push": 1e-6, "ipopt.sb": "yes"})
    low, high = LEAST / UNIT, MOST / UNIT
    start = [guess_time]
    for k in range(segments):
        start += [np.pi - 0.02 - 0.4 * (k + 0.5) / segments, low if k < low_segments else high]
    for k in range(segments):
        s = (k + 1) / segments
        start += list((1 - s) * np.array(begin) + s * np.array([GATE, 51.6 / SPEED, -24.2 / SPEED, 0.56]))
    lower = [0.5 * guess_time] + [0.0, low] * segments + [0.9, -1.0, -1.0, 0.1] * segments
    upper = [2.0 * guess_time] + [2 * np.pi, high] * segments + [1.1, 2.0, 1.0, 1.0] * segments
    found = solver(x0=start, lbx=lower, ubx=upper, lbg=0.0, ubg=0.0)
    assert solver.stats()["success"], solver.stats()["return_status"]
    return -MASS * float(found["f"])


def main():
    z, y = solve(guess=START)
    optimum = MASS * y[4]
    print(f"optimum {optimum:.9f} kg; segments, kg below it from each start")
    for segments in (2, 5, 10, 20, 30, 60):
        losses = [optimum - final_mass(segments, z[4] + z[5], low) for low in range(3)]
        print(segments, *(f"{loss:.6f}" for loss in losses))


if __name__ == "__main__":
    main()
