"""Injections into geostationary orbit in the equatorial plane by indirect shooting: DOP853 at 1e-13, all burns at once.

    python geo_injection.py

Least burn time of N burns at 20 kN and 6.14 kg/s from a circular orbit of 200 km, ignitions, durations and directions free. Polar
coordinates, polar angle free, in units of the first orbit. On a coast nothing is spent, so that its Hamiltonian vanishes; at the start of
each burn and at its end the switching function does too. The first costates have the direction of the thrust at the first ignition,
which is listed with the burn times as a start.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

MU, FIRST, LAST = 3.986004418e14, 6.578137e6, 4.2164e7
THRUST, FLOW = 2.0e4, 6.14
SPEED = np.sqrt(MU / FIRST)
TIME = FIRST / SPEED
EXHAUST = THRUST / FLOW / SPEED
FINAL = LAST / FIRST

# Burns and coasts in s, first thrust angle in deg: starts to three digits.
STARTS = {
    2: ([2010.0, 556.0], [18170.0], -8.0),
    3: ([1019.0, 915.0, 601.0], [7977.0, 18280.0], -5.4),
    4: ([688.0, 641.0, 589.0, 610.0], [6546.0, 11390.0, 18370.0], -3.8),
}


def rate(t, y, flow):
    r, u, v, m, lr, lu, lv, lm = y
    size = np.hypot(lu, lv)
    a = EXHAUST * flow / m
    return [
        u,
        v * v / r - 1 / r**2 - a * lu / size,
        -u * v / r - a * lv / size,
        -flow,
        lu * (v * v / r**2 - 2 / r**3) - lv * u * v / r**2,
        -lr + lv * v / r,
        -2 * lu * v / r + lv * u / r,
        -a / m * size,
    ]


def fly(y, span, flow):
    return solve_ivp(rate, (0.0, span), y, "DOP853", rtol=1e-13, atol=1e-14, args=(flow,)).y[:, -1]


def switching(y):
    return np.hypot(y[5], y[6]) * EXHAUST / y[3] + y[7]


def injection(mass, burns, guess=None):
    flow = FLOW * TIME / mass
    times, coasts, degrees = STARTS[burns]
    angle = np.radians(degrees)

    def residual(z):
        lr, angle, spans = z[0], z[1], z[2:]
        # Costates of unit size for the velocity; the switching function is zero at the first ignition.
        y = np.array([1.0, 0.0, 1.0, 1.0, lr, -np.sin(angle), -np.cos(angle), -EXHAUST])
        zeros = []
        for k, span in enumerate(spans):
            y = fly(y, span, flow if k % 2 == 0 else 0.0)
            if k + 1 < len(spans):
                zeros.append(switching(y))
        return [y[0] - FINAL, y[1], y[2] - FINAL**-0.5, *zeros]

    if guess is None:
        spans = np.zeros(2 * burns - 1)
        spans[0::2], spans[1::2] = np.array(times) / TIME, np.array(coasts) / TIME
        tries = [np.array([lr, angle, *spans]) for lr in -np.linspace(0.6, 1.4, 9)]
        guess = min(tries, key=lambda z: np.linalg.norm(residual(z)))
    for _ in range(3):
        found = root(residual, guess, method="hybr", options={"xtol": 1e-15, "maxfev": 20000})
        guess = found.x
    assert np.max(np.abs(found.fun)) < 1e-9, found
    return guess


def main():
    print("initial mass kg, burns, propellant kg, burn times s, coasts s")
    for burns in STARTS:
        z = None
        for mass in (22100.0, 22170.0):
            z = injection(mass, burns, z)
            spans = z[2:] * TIME
            times, coasts = spans[0::2], spans[1::2]
            print(f"{mass:.0f} {burns} {FLOW * sum(times):.9f}", *(f"{t:.7f}" for t in times), *(f"{t:.5f}" for t in coasts))


if __name__ == "__main__":
    main()
