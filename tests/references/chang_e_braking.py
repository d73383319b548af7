"""The main braking of Chang'e-3 in the plane by indirect shooting: DOP853 at 1e-13, Newton on Pontryagin's conditions.

    python chang_e_braking.py

Largest final mass from 15 km and 1692 m/s, horizontal, to 3 km and 57 m/s in any direction; range and time free. Thrust between 1500 N
and 7500 N at an exhaust velocity of 2940 m/s: least thrust first, then the largest. Radius and speed are in units of the Moon's radius
and the circular speed there, mass in units of the initial one. Costates are those of the negated final mass.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

MU, RADIUS = 4.902793455e12, 1.737013e6
MASS, EXHAUST, LEAST, MOST = 2400.0, 2940.0, 1500.0, 7500.0
SPEED = np.sqrt(MU / RADIUS)
TIME = RADIUS / SPEED
GATE = (RADIUS + 3e3) / RADIUS


def rate(t, y, force, c):
    r, _, u, v, m, lr, lu, lv, lm = y
    size = np.hypot(lu, lv)
    a = force / m
    return [
        v,
        u / r,
        -u * v / r - a * lu / size,
        u * u / r - 1 / r**2 - a * lv / size,
        -force / c,
        -lu * u * v / r**2 + lv * (u * u / r**2 - 2 / r**3),
        lu * v / r - 2 * lv * u / r,
        -lr + lu * u / r,
        -a / m * size,
    ]


def fly(y, span, force, c):
    return solve_ivp(rate, (0.0, span), y, "DOP853", rtol=1e-13, atol=1e-14, args=(force, c)).y[:, -1]


def solve(mass=MASS, exhaust=EXHAUST, least=LEAST, most=MOST, speed=1692.0, altitude=15.0, guess=None):
    unit = MASS * SPEED / TIME
    c, low, high = exhaust / SPEED, least / unit, most / unit
    begin = [(RADIUS + 1e3 * altitude) / RADIUS, 0.0, speed / SPEED, 0.0, mass / MASS]

    def flight(z):
        middle = fly([*begin, *z[:4]], z[4], low, c)
        return middle, fly(middle, z[5], high, c)

    def residual(z):
        s, y = flight(z)
        r, _, u, v, m, _, lu, lv, lm = y
        switching = -np.hypot(s[6], s[7]) / s[4] - s[8] / c
        end = np.array(rate(0.0, y, high, c))
        hamiltonian = y[5] * end[0] + lu * end[2] + lv * end[3] + lm * end[4]
        return [r - GATE, (u * u + v * v) * (SPEED / 57.0) ** 2 - 1.0, lu * v - lv * u, lm + 1.0, switching, hamiltonian]

    for _ in range(2):
        found = root(residual, guess, method="hybr", options={"xtol": 1e-15, "maxfev": 4000})
        guess = found.x
    assert np.max(np.abs(found.fun)) < 1e-10, found
    return guess, flight(guess)[1]


# Costates, time of least thrust and of the largest: from a thrust against the motion all along.
START = np.array([0.5, 0.3, 0.0, -0.55, 14.0 / TIME, 410.0 / TIME])


def main():
    z, y = solve(guess=START)
    print(f"final mass {MASS * y[4]:.12f} kg, time {(z[4] + z[5]) * TIME:.7f} s, switch {z[4] * TIME:.7f} s")
    print(f"central angle {np.degrees(y[1]):.8f} deg, speeds {SPEED * y[2]:.7f} {SPEED * y[3]:.7f} m/s")
    print("costates of the final mass in kg per m, m/s, m/s, kg:")
    print(-z[0] * MASS / RADIUS, -z[1] * MASS / SPEED, -z[2] * MASS / SPEED, -z[3])
    print("derivatives of the final mass, central differences of solutions:")
    cases = [("mass", MASS, 0.1), ("exhaust", EXHAUST, 0.1), ("most", MOST, 1.0), ("least", LEAST, 20.0), ("speed", 1692.0, 0.1), ("altitude", 15.0, 1e-3)]
    for name, value, step in cases:
        ends = [MASS * solve(guess=z, **{name: value + side * step})[1][4] for side in (1.0, -1.0)]
        print(f"  {name} {(ends[0] - ends[1]) / (2 * step):.10e}")


if __name__ == "__main__":
    main()
