"""Planar lunar landings by indirect shooting: DOP853 at 1e-13, Newton on Pontryagin's conditions.

    python lunar_landing.py

Radius r, horizontal speed u, upward speed v; polar angle free. Thrust a = F/(m0 - q t) in the direction of minus the costate of the
velocity, which minimises the Hamiltonian. Radius and speed are in units of the Moon's radius and the circular speed there.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

MU, RADIUS, PARK, MASS = 4.9048695e12, 1.7371e6, 1.8371e6, 300.0
THRUST, ISP, G0, TOUCHDOWN = 440.0, 310.0, 9.807, -5.0
EXHAUST = ISP * G0
FLOW = THRUST / EXHAUST
SPEED = np.sqrt(MU / RADIUS)
TIME = RADIUS / SPEED
DUE = TOUCHDOWN / SPEED


def mass_at(perilune):
    """Mass after the impulse that leaves the parking orbit, and the speed at the perilune."""
    a = 0.5 * (PARK + perilune)
    speed = np.sqrt(MU * (2 / perilune - 1 / a))
    impulse = np.sqrt(MU / PARK) - np.sqrt(MU * (2 / PARK - 1 / a))
    return MASS * np.exp(-impulse / EXHAUST), speed


def rate(t, y, m0):
    r, u, v, lr, lu, lv = y
    size = np.hypot(lu, lv)
    a = THRUST / (m0 - FLOW * t * TIME) * TIME / SPEED
    return [
        v,
        -u * v / r - a * lu / size,
        u * u / r - 1 / r**2 - a * lv / size,
        -lu * u * v / r**2 + lv * (u * u / r**2 - 2 / r**3),
        lu * v / r - 2 * lv * u / r,
        -lr + lu * u / r,
    ]


def fly(m0, start, costates, t0, t1):
    result = solve_ivp(rate, (t0, t1), [*start, *costates], "DOP853", rtol=1e-13, atol=1e-14, args=(m0,))
    return result.y[:, -1]


def hamiltonian(t, y, m0):
    """Without the running cost 1."""
    return float(np.dot(y[3:6], rate(t, y, m0)[:3]))


def solve(residual, guess):
    found = root(residual, guess, method="hybr", options={"xtol": 1e-14, "maxfev": 4000})
    # A second start from the first answer: Powell's steps stop at the first that gains nothing.
    found = root(residual, found.x, method="hybr", options={"xtol": 1e-15, "maxfev": 4000})
    assert np.max(np.abs(found.fun)) < 1e-10, found
    return found.x


def start(altitude):
    perilune = RADIUS + altitude
    m0, speed = mass_at(perilune)
    return m0, [perilune / RADIUS, speed / SPEED, 0.0]


def one_phase(altitude, guess):
    """Least time to the ground at 5 m/s downwards: unknowns are the costates at the start and the time."""
    m0, begin = start(altitude)

    def residual(z):
        y = fly(m0, begin, z[:3], 0.0, z[3])
        return [y[0] - 1.0, y[1], y[2] - DUE, 1.0 + hamiltonian(z[3], y, m0)]

    z = solve(residual, guess)
    return z, z[3] * TIME, m0 - FLOW * z[3] * TIME


def vertical(r, v, t, m0, until):
    """Upright flight with full thrust: r and v after a time."""
    system = lambda s, y: [y[1], -1 / y[0] ** 2 + THRUST / (m0 - FLOW * (t + s) * TIME) * TIME / SPEED]
    y = solve_ivp(system, (0.0, until), [r, v], "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    return y - [1.0, DUE]


def to_ground(r12, t1, m0, guess):
    """Speed at the gate and time below it that end at the ground with the right speed."""
    return solve(lambda z: vertical(r12, z[0], t1, m0, z[1]), guess)


def two_phases(altitude, gate, guess):
    """Least total time when the last phase is vertical from a gate: phase 1 ends on the manifold v12 = V(t1), and the time of
    phase 2, T2(t1), counts. Its derivatives are central differences of a residual solved to 1e-13."""
    m0, begin = start(altitude)
    r12 = (RADIUS + gate) / RADIUS
    below = np.array([-50.0 / SPEED, 40.0 / TIME])

    def residual(z):
        nonlocal below
        y = fly(m0, begin, z[:3], 0.0, z[3])
        below = to_ground(r12, z[3], m0, below)
        h = 1e-3
        slope = (to_ground(r12, z[3] + h, m0, below) - to_ground(r12, z[3] - h, m0, below)) / (2 * h)
        # J = t1 + T2(t1) with v12 = V(t1): H(t1) + 1 + T2' - lambda_v V' = 0.
        free = 1.0 + slope[1] + hamiltonian(z[3], y, m0) - y[5] * slope[0]
        return [y[0] - r12, y[1], y[2] - below[0], free]

    z = solve(residual, guess)
    total = (z[3] + below[1]) * TIME
    return z, total, below[0] * SPEED, m0 - FLOW * total


def coast_first(altitude, guess):
    """Least propellant with a coast from the perilune: the burn starts where its Hamiltonian allows no gain from waiting.

    The burn is time-optimal for its own start, and the derivative of its duration by the time of ignition is lambda . (rate of the
    coast), which vanishes; mass at ignition is that at the perilune."""
    m0, begin = start(altitude)

    def coast(t):
        # Kepler's motion in the same equations, without thrust.
        system = lambda s, y: [y[2], -y[1] * y[2] / y[0], y[1] ** 2 / y[0] - 1 / y[0] ** 2]
        if t == 0.0:
            return np.array(begin)
        return solve_ivp(system, (0.0, t), begin, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]

    def residual(z):
        x = coast(z[4])
        y = fly(m0, x, z[:3], 0.0, z[3])
        drift = [x[2], -x[1] * x[2] / x[0], x[1] ** 2 / x[0] - 1 / x[0] ** 2]
        return [y[0] - 1.0, y[1], y[2] - DUE, 1.0 + hamiltonian(z[3], y, m0), np.dot(z[:3], drift)]

    z = solve(residual, guess)
    return z, z[4] * TIME, m0 - FLOW * z[3] * TIME


def main():
    guess = np.array([-0.1, 0.5, 0.05, 1000.0 / TIME])
    m0, begin = start(15e3)
    print(f"perilune of 15 km: speed {begin[1] * SPEED:.9f} m/s, mass {m0:.9f} kg")
    print("one phase: case, time s, final mass kg")
    guesses = {}
    for km in [15, 10, 5, 20, 25, 50, 100]:
        if km == 20:
            guess = guesses[15]
        z, time, mass = one_phase(1e3 * km, guess)
        guess = guesses[km] = z
        print(f"S2_{km}km {time:.12f} {mass:.12f}" if km < 100 else f"S1_100km {time:.12f} {mass:.12f}")
    print("two phases from 15 km: case, total time s, upward speed at the gate m/s, final mass kg")
    guess = guesses[15]
    for km in [1, 2, 3, 4, 5]:
        z, total, speed, mass = two_phases(15e3, 1e3 * km, guess)
        guess = z
        print(f"S3_{km}km {total:.12f} {speed:.12f} {mass:.12f}")
    print("coast from the perilune, then full thrust: case, coast s, final mass kg")
    for km, seconds in [(25, 92), (20, 116), (15, 141), (10, 167), (5, 195)]:
        z, coast, mass = coast_first(1e3 * km, [*guesses[km], seconds / TIME])
        print(f"S2_{km}km_throttled {coast:.9f} {mass:.12f}")


if __name__ == "__main__":
    main()
