"""Optima of the problems in tests/problems that have a closed form, or whose conditions leave a few equations.

    python held_out_closed_forms.py

Each line of OPTIMA states the optimum of the file of its name; where it needs more than a formula, a function above says what is solved. Prints
name and value.
"""

from math import acos, acosh, asin, asinh, atan, atan2, cos, cosh, exp, hypot, inf, log, pi, sin, sinh, sqrt, tanh

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve, least_squares, minimize, minimize_scalar


def swing(x, t):
    """Least effort of an oscillator from rest at x to rest in time t."""
    a, b, d = t / 2 - sin(2 * t) / 4, sin(t) ** 2 / 2, t / 2 + sin(2 * t) / 4
    y, w = x * cos(t), -x * sin(t)
    return (d * y**2 - 2 * b * y * w + a * w**2) / (a * d - b * b)


def root(function, low, high):
    return brentq(function, low, high, xtol=1e-15, rtol=1e-15)


def least(function, low, high):
    return minimize_scalar(function, bounds=(low, high), method="bounded", options={"xatol": 1e-13}).fun


def riccati(a, b, q, time):
    """The cost of the states from which a linear plant is held over a time, its end free: the Riccati equation backward from nothing."""
    a, b, q = np.array(a), np.array(b).reshape(-1, 1), np.diag(q)
    n = len(a)

    def rate(_, flat):
        p = flat.reshape(n, n)
        return (a.T @ p + p @ a - p @ b @ b.T @ p + q).ravel()

    return solve_ivp(rate, (0, time), np.zeros(n * n), method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1].reshape(n, n)


def strut_beyond_buckling():
    """Half a wave of `s'' = -P s + 2 s^3` that turns at both ends; the energy is less the integral of `s^4`."""
    load = 1.02 * pi**2

    def along(amplitude, value):
        def rate(f):
            return sqrt(load - amplitude**2 * (1 + sin(f) ** 2))

        return quad(lambda f: value(amplitude * sin(f)) / rate(f), -pi / 2, pi / 2, epsabs=1e-13, epsrel=1e-13)[0]

    amplitude = root(lambda a: along(a, lambda s: 1) - 1, 1e-3, 1)
    return -along(amplitude, lambda s: s**4)


def least_time_by_a_thrust_that_turns_round():
    """Thrust against a costate that is linear in time; its length is one at the place, its least at a time at which the integrals are divided."""
    push, start, speed = sqrt(1.5), np.array([-3.61, -1.59]), np.array([-0.93, -0.861])

    def misses(unknowns):
        place, of_speed, end = np.array(unknowns[:2]), np.array(unknowns[2:4]), unknowns[4]
        turn = min(max(of_speed @ place / (place @ place), 0), end)

        def along(value):
            parts = [(0, turn), (turn, end)]
            return sum(quad(value, *part, epsabs=1e-13, epsrel=1e-13, limit=200)[0] for part in parts)

        def thrust(t, axis):
            costate = of_speed - place * t
            return -push * costate[axis] / np.hypot(*costate)

        speeds = [speed[i] + along(lambda t: thrust(t, i)) for i in (0, 1)]
        places = [start[i] + speed[i] * end + along(lambda t: (end - t) * thrust(t, i)) for i in (0, 1)]
        return [*places, *speeds, place @ place - 1]

    return fsolve(misses, [-0.84, -0.54, -2.46, -1.61, 4.87], xtol=1e-12)[4]


def moving_wall():
    touch = root(lambda t: 0.25 * t**1.5 + 0.5 * (0.375 * sqrt(t)) ** 2 - 5.5, 1, 20)
    return touch + 0.375 * sqrt(touch)


def least_fuel_in_a_cone_with_a_least_thrust():
    """Thrust against a costate that is linear in time, full where 1.2 of its length is above one, else a fifth, from 0.1 along y at the start."""
    distance, speed, end = np.array([4, 3]), np.array([0, 0.1]), 6

    def switches(p, q):
        a, b, c = q @ q, 2 * p @ q, p @ p - 1 / 1.44
        return [(-b + sign * sqrt(b * b - 4 * a * c)) / (2 * a) for sign in (-1, 1)]

    def misses(z):
        p, q = z[:2], z[2:]
        first, second = switches(p, q)
        along = lambda t, i: 1.2 * (p + q * t)[i] / np.linalg.norm(p + q * t)
        parts = [(0, first, 1), (first, -p @ q / (q @ q), 0.2), (-p @ q / (q @ q), second, 0.2), (second, end, 1)]
        of = lambda f, i: sum(g * quad(f, a, b, (i,), epsabs=1e-13, epsrel=1e-12, limit=400)[0] for a, b, g in parts)
        rates = [of(along, i) for i in range(2)]
        ways = [of(lambda t, i: (end - t) * along(t, i), i) for i in range(2)]
        return [*(speed + rates), *(speed * end + ways - distance)]

    p = fsolve(misses, np.array([0.93, 0.6, -0.31, -0.21]), xtol=1e-13)
    first, second = switches(p[:2], p[2:])
    return first + end - second + 0.2 * (second - first)


def thrust_that_turns_past_its_bound():
    """Tangent of the angle off straight back linear in time, from k/2 to -k/2; the displacement is that of the line."""
    k = brentq(lambda k: ((k / 2) * sqrt(1 + k * k / 4) - asinh(k / 2)) / k**2 - 0.1, 0.1, 20)
    return 2 / k * asinh(k / 2)


def plane_change_by_two_impulses():
    """Half an ellipse between the nodes: the first impulse turns a part of the inclination, the second one the rest."""
    mu, r1, r2, inclination = 398600.4418e9, 6678e3, 42164e3, np.radians(28.5)
    a = (r1 + r2) / 2
    v1, v2 = sqrt(mu / r1), sqrt(mu / r2)
    perigee, apogee = sqrt(mu * (2 / r1 - 1 / a)), sqrt(mu * (2 / r2 - 1 / a))
    turned = lambda v, w, angle: sqrt(v**2 + w**2 - 2 * v * w * cos(angle))
    total = lambda part: turned(v1, perigee, part) + turned(v2, apogee, inclination - part)
    return minimize_scalar(total, bounds=(0, inclination), method="bounded", options={"xatol": 1e-12}).fun


def cost_from_half_way():
    """Half of the way in t, the other half, which costs by the time, in the rest."""
    return minimize_scalar(lambda t: 0.25 / t + 0.25 / (1 - t) + 1 - t, bounds=(0.1, 0.9), method="bounded", options={"xatol": 1e-12}).fun


def landing_in_a_cone_of_thrust():
    """Thrust of 16 along a linear function of time until it is cut off, and from its second ignition to the landing, with the least burnt."""
    thrust, speed, place, start = 16, 2000, np.array([100, 400]), np.array([-5, -20])

    def misses(z):
        angle, *q, cut, ignition, end = z
        mass = lambda t: 2 - thrust / speed * (min(t, cut) + max(t - ignition, 0))

        def along(t, i):
            w = [cos(angle) + q[0] * t, sin(angle) + q[1] * t]
            return thrust / mass(t) * w[i] / hypot(*w)

        burns = [(0, cut), (ignition, end)]
        of = lambda f, i: sum(quad(f, a, b, (i,), epsabs=1e-13, epsrel=1e-12, limit=200)[0] for a, b in burns)
        weight = np.array([0, -3.7])
        speeds = [of(along, i) for i in range(2)]
        ways = [of(lambda t, i: (end - t) * along(t, i), i) for i in range(2)]
        return [*(start + weight * end + speeds), *(place + start * end + weight * end**2 / 2 + ways)]

    burnt = lambda z: z[3] + z[5] - z[4]
    near = [2.6, 0.09, 0.07, 0.04, 6.1, 16]
    found = minimize(burnt, near, constraints=[{"type": "eq", "fun": misses}], options={"ftol": 1e-15})
    return 2 - thrust / speed * burnt(found.x)


def along_the_ground():
    """The rate leaves the ground with an effort of nothing, and is free at the end: `5 s (l - s)` at the time `s` of `l` since then, one at most."""
    effort = lambda l, s: min(1, 5 * s * (l - s))

    def corners(l):
        half = sqrt(l**2 / 4 - 0.2)
        return [0, l / 2 - half, l / 2 + half, l]

    over = lambda l, f: sum(quad(f, a, b, epsabs=1e-15)[0] for a, b in zip(corners(l), corners(l)[1:]))
    l = root(lambda l: over(l, lambda s: (l - s) * effort(l, s)) - 1, 1, 3)
    return over(l, lambda s: (l - s) ** 2 / 2 * effort(l, s) + 0.05 * effort(l, s) ** 2)


def effort_above_a_level():
    """The control is `l s` of the time to go `s` up to the level, and five times less steep above."""
    control = lambda l, s: l * s if l * s <= 1 else (l * s + 4) / 5
    reach = lambda l: quad(lambda s: s * control(l, s), 0, 1 / l)[0] + quad(lambda s: s * control(l, s), 1 / l, 1)[0]
    l = root(lambda l: reach(l) - 1, 1.5, 40)
    cost = lambda s: control(l, s) ** 2 / 2 + 2 * max(control(l, s) - 1, 0) ** 2
    return quad(cost, 0, 1 / l)[0] + quad(cost, 1 / l, 1)[0]


def square_wave_before_a_free_end():
    """The wave is 0.3 up to pi/2 and -0.3 after; the effort `a + b (l - t)` makes up for what it leaves of speed and distance."""

    def cost(l):
        c = pi / 2
        speed = -0.3 * (c - (l - c))
        distance = 1 - 0.3 * ((l**2 - (l - c) ** 2) / 2 - (l - c) ** 2 / 2)
        a, b = np.linalg.solve([[l, l**2 / 2], [l**2 / 2, l**3 / 3]], [speed, distance])
        return a * speed + b * distance + l

    return least(cost, pi / 2, pi)


def cost_with_a_spike():
    share = lambda t: 1 / (1 + 1e6 * exp(-(((t - 40321) / 200) ** 2)))
    ends = [0, *np.linspace(38321, 42321, 81), 86400]
    return 86400 / sum(integral(share, a, b) for a, b in zip(ends, ends[1:]))


def thrust_off_in_eclipse(end=100, gap=(31.4, 32.9)):
    # Moments of the time to go over the times with thrust.
    moment = lambda n: (end ** (n + 1) - (end - gap[0]) ** (n + 1) + (end - gap[1]) ** (n + 1)) / (n + 1)
    gramian = np.array([[moment(2), moment(1)], [moment(1), moment(0)]])
    return 600 * np.linalg.solve(gramian, [600, 0])[0]


def thrust_past_a_corner(gain=1.2, limit=0.9, start=pi / 3):
    """Use of a thrust in its best direction, at the corner of both limits, and along that of the component."""
    other = sqrt(1 - limit**2)
    corner, edge = acos(limit), asin(other / gain)
    full = (gain - 0.5) * (start - corner)
    at_corner = integral(lambda a: gain * (limit * cos(a) + other * sin(a)) - 0.5, edge, corner)
    along = integral(lambda a: gain * limit * cos(a) + (gain * sin(a)) ** 2 / 2 - limit**2 / 2, 0, edge)
    return (full + at_corner + along) / start


def slide_above_a_wall(width=1.01, steepest=1.55, wall=atan(0.5), height=0.1, gravity=32.174):
    """Straight down the steepest slope, a cycloid that is tangent to the wall, along the wall, and a cycloid that ends level."""
    def met(straight):
        # Along a cycloid cos(slope) / v is constant, and the slope falls at a constant rate.
        speed = gravity * sin(steepest) * straight
        constant = cos(steepest) / speed
        way = speed * straight / 2
        across = integral(lambda a: cos(a) ** 2, wall, steepest) / (gravity * constant**2)
        down = integral(lambda a: sin(a) * cos(a), wall, steepest) / (gravity * constant**2)
        x, y = way * cos(steepest) + across, way * sin(steepest) + down
        return x, y, straight + (steepest - wall) / (gravity * constant)

    straight = root(lambda t: met(t)[1] - met(t)[0] / 2 - height, 1e-4, 0.1)
    x, y, time = met(straight)
    speed = sqrt(2 * gravity * y)

    def left(along):
        after = speed + gravity * sin(wall) * along
        constant = cos(wall) / after
        across = integral(lambda a: cos(a) ** 2, 0, wall) / (gravity * constant**2)
        return x + (speed + after) / 2 * along * cos(wall) + across - width, along + wall / (gravity * constant)

    return time + left(root(lambda t: left(t)[0], 1e-4, 0.3))[1]


def effort_against(push, knots):
    """Least integral of u^2 + x^2, x' = u + push, x = 0 at 0 and 1: u'' - u = push with u' = 0 at both ends, by Green's function."""
    pieces = list(zip(knots, knots[1:]))
    before = lambda s: sum(integral(lambda t: push(t) * cosh(t), a, min(b, s)) for a, b in pieces if a < s)
    return 2 / sinh(1) * sum(integral(lambda s: push(s) * cosh(1 - s) * before(s), a, b) for a, b in pieces)


def race_car():
    limit = lambda s: 1 - sin(2 * pi * s) / 2
    # Full throttle from rest until the limit is met.
    place = lambda t: t - 1 + exp(-t)
    meeting = root(lambda t: 1 - exp(-t) - limit(place(t)), 0.5, 0.9)
    # Along the limit until it rises as fast as full throttle.
    leaving = root(lambda s: (1 - pi * cos(2 * pi * s)) * limit(s) - 1, place(meeting), 0.5)
    along = integral(lambda s: 1 / limit(s), place(meeting), leaving)
    missing = 1 - limit(leaving)
    return meeting + along + root(lambda t: leaving + t - missing * (1 - exp(-t)) - 1, 0, 5)


def pull_within_a_power():
    # Full force up to the speed of 1/2, then v^2 = 1/4 + t, then the brake of one.
    speed = root(lambda v: 1 / 8 + 2 * (v**3 - 1 / 8) / 3 + v * v / 2 - 2, 0.5, 2)
    return 1 / 2 + speed**2 - 1 / 4 + speed


def gate_in_an_instant(end=10, at=4.321, width=0.01):
    def effort(t):
        x = -10 + 11 * exp(-(((t - at) / width) ** 2))
        v = -22 * (t - at) / width**2 * exp(-(((t - at) / width) ** 2))
        leg = lambda time, v: 12 * x**2 / time**3 - 12 * x * v / time**2 + 4 * v**2 / time
        return leg(t, v) + leg(end - t, -v)

    return least(effort, at - 1e-4, at + 1e-4)


def integral(function, low, high):
    return quad(function, low, high, epsabs=1e-14, epsrel=1e-13, limit=500)[0]


def crossing(dx, dy, wx, wy):
    """|d - w T| = T."""
    a, b, c = 1 - wx**2 - wy**2, wx * dx + wy * dy, dx**2 + dy**2
    return (-b + sqrt(b * b + a * c)) / a


def around_disc(p, q, radius, other_side=False):
    """Two tangents and the arc between them."""
    dp, dq = hypot(*p), hypot(*q)
    angle = abs(atan2(p[1], p[0]) - atan2(q[1], q[0]))
    angle = min(angle, 2 * pi - angle)
    angle = 2 * pi - angle if other_side else angle
    return sqrt(dp**2 - radius**2) + sqrt(dq**2 - radius**2) + radius * (angle - acos(radius / dp) - acos(radius / dq))


def string_over_parabola():
    """Tangents from (-1, 0) and (1, 0) to 1/2 - t^2 meet it where a^2 - 2 a + 1/2 = 0."""
    a = 1 - sqrt(0.5)
    return 2 * ((2 * a) ** 2 * (1 - a) + 4 * a**3 / 3)


def two_touches():
    """Cubic pieces that touch the ceiling at t and 1 - t, for the best t."""
    at, rate = lambda t: 0.3 + 0.1 * cos(4 * pi * t), lambda t: -0.4 * pi * sin(4 * pi * t)

    def effort(x, v, y, w, time):
        d, e = y - x - v * time, w - v
        return 12 * d**2 / time**3 - 12 * d * e / time**2 + 4 * e**2 / time

    both = lambda t: 2 * effort(0, 2, at(t), rate(t), t) + effort(at(t), rate(t), at(t), -rate(t), 1 - 2 * t)
    return least(both, 0.24, 0.28)


def ceiling_touched_twice(height=0.3, end=6):
    """Least efforts of an oscillator from one touch of the ceiling to the next, for the best time of the first."""
    a, b = [[0, 1], [-1, 0]], [[0], [1]]
    touch = [height, 0]
    outer = lambda t: gramian(a, b, t, [-1, 1.2], touch)
    return least(lambda t: outer(t) + gramian(a, b, end - 2 * t, touch, touch) / 2, 2.1, 2.3)


def around_a_small_disc(radius=0.02, before=37.3, behind=62.7):
    side = lambda way: sqrt(way**2 - radius**2) + radius * asin(radius / way)
    return side(before) + side(behind)


def between_two_discs(radius=0.7, before=3, below=0.5):
    """Under the lower one, whose lowest point is nearer to the straight line than the highest one of the other."""
    way = hypot(before, below)
    return 2 * (sqrt(way**2 - radius**2) + radius * (acos(-below / way) - acos(radius / way)))


def fast_actuator(rate=1e3, effort=0.1, end=2):
    """The equation of Riccati, with the linear and the constant term, backward from the end."""
    a, b = np.array([[-1, 1], [0, -rate]]), np.array([[0], [rate]])
    q, target = np.diag([1.0, 0.0]), np.array([1.0, 0.0])

    def rates(_, y):
        p, s = y[:4].reshape(2, 2), y[4:6]
        gain = p @ b @ b.T / effort
        return [*(-(a.T @ p + p @ a + q - gain @ p)).ravel(), *(-(a.T @ s - gain @ s - q @ target)), -(1 - (s @ b)[0] ** 2 / effort)]

    found = solve_ivp(lambda t, y: [-r for r in rates(t, y)], (0, end), np.zeros(7), method="Radau", rtol=1e-12, atol=1e-14)
    return found.y[6, -1]


def well_of_two_controls(well=-21.7, width=0.01, depth=3000):
    """The best constant controls, at the bottom of the well."""
    return least(lambda v: (1 - 0.1 * v) ** 2 + v**2 - depth / (1 + ((v - well) / width) ** 2), well - width, well + width)


def stages_without_a_coast():
    """Both burns at once, then free flight to the time 60."""
    drag = lambda h, v, m: 0.0005 * v**2 * exp(-h / 50) / m
    stages = [(10, 12, 0.5, 0), (5, 6, 0.3, 2), (45, 0, 0, 0)]
    state = [0, 0, 10]
    for duration, thrust, flow, drop in stages:
        rate = lambda _, y: [y[1], thrust / y[2] - 0.1 - drag(*y), -flow]
        start = [state[0], state[1], state[2] - drop]
        state = solve_ivp(rate, (0, duration), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return state[0]


def thin_gate(speed=0.5, gate=(3.71, 3.717), way=10, start=2, time=5):
    """Cubics to the gate and from it, at the speed that is allowed in it."""
    within = (gate[1] - gate[0]) / speed

    def effort(d, v, w, time):
        d, e = d - v * time, w - v
        return 12 * d**2 / time**3 - 12 * d * e / time**2 + 4 * e**2 / time

    before = lambda t: effort(gate[0], start, speed, t)
    return least(lambda t: before(t) + effort(way - gate[1], speed, start, time - within - t), 1, 4)


def thin_layer(width=0.02, most=3000, end=100, at=37.3):
    """The Hamiltonian is constant: x' = sqrt(c + g^2) against a drift of -g, for the c that arrives in time."""
    g = lambda x: most * exp(-(((x - at) / width) ** 2))
    ends = [0, *(at + width * k / 4 for k in range(-28, 29)), end]
    along = lambda f: sum(integral(f, a, b) for a, b in zip(ends, ends[1:]))
    c = root(lambda c: along(lambda x: 1 / sqrt(c + g(x) ** 2)) - 1, 1e3, 1e5)
    speed = lambda x: sqrt(c + g(x) ** 2)
    return along(lambda x: (speed(x) + g(x)) ** 2 / speed(x))


def string_over_a_wave():
    """Tangents from (0, 0) and (pi, 0) to sin^2/2 meet it where tan a = 2 a."""
    a = root(lambda a: sin(a) - 2 * a * cos(a), 1, 1.4)
    return 2 * ((sin(2 * a) / 2) ** 2 * a + integral(lambda t: (sin(2 * t) / 2) ** 2, a, pi / 2))


def string_over_bump(t=0.5137, w=0.001):
    """Tangents to a narrow bump of height one."""
    g = lambda s: exp(-(((s - t) / w) ** 2))
    slope = lambda s: -2 * (s - t) / w**2 * g(s)
    a = root(lambda s: g(s) - s * slope(s), t - 0.5 * w, t)
    b = root(lambda s: g(s) - (s - 1) * slope(s), t, t + 0.5 * w)
    return g(a) ** 2 / a + g(b) ** 2 / (1 - b) + integral(lambda s: slope(s) ** 2, a, b)


def least_root_of_a_cubic(rate=0.1):
    """The integral over the time 1 of the least u with u^3 - 3 u = rate t: of u (3 u^2 - 3) / rate over u."""
    part = lambda u: (3 * u**4 / 4 - 3 * u**2 / 2) / rate
    return part(root(lambda u: u**3 - 3 * u - rate, -2, -1.5)) - part(-sqrt(3))


def across_a_kink(way, reward):
    """From -way to way in the time 1 with the least integral of u^2 - reward |x|: a parabola on each side of the time at which x is zero."""
    def side(time):
        speed = way / time + reward * time / 4
        return speed**2 * time - reward * speed * time**2 + reward**2 * time**3 / 6

    return least(lambda time: side(time) + side(1 - time), 0.01, 0.45)


def oscillator(x, v):
    """x'' = -x + u to rest: circles about 1 and -1 by turns, pi each but for the first and the last."""
    best = inf
    for sign in (1, -1):
        for arcs in range(2, 15):

            def end(ends):
                z, u = complex(x, v), sign
                for t in [ends[0]] + [pi] * (arcs - 2) + [ends[1]]:
                    z, u = u + (z - u) * np.exp(-1j * t), -u
                return [z.real, z.imag]

            for a in np.linspace(0.1, 3.1, 7):
                for b in np.linspace(0.1, 3.1, 7):
                    p, _, found, _ = fsolve(end, [a, b], full_output=True, xtol=1e-14)
                    if found == 1 and np.abs(end(p)).max() < 1e-10 and 0 <= min(p) and max(p) <= pi + 1e-9:
                        best = min(best, p[0] + p[1] + pi * (arcs - 2))
    return best


def oscillator_speed_limit(x=1.5, most=0.7):
    """u = -1, then 1, so that v = -most is met at x = 1, where it can be held; along it to the circle into the origin."""

    def meets(p):
        z = -1 + (x + 1) * np.exp(-1j * p[0])
        z = 1 + (z - 1) * np.exp(-1j * p[1])
        return [z.real - 1, z.imag + most]

    first, second = fsolve(meets, [0.22, 0.68], xtol=1e-14)
    leaves = 1 - sqrt(1 - most**2)
    return first + second + (1 - leaves) / most + asin(most)


def two_masses():
    """Bang-bang with three switches, odd about the middle: distance of the centre of mass, no vibration left."""
    w = sqrt(2)

    def rest(p):
        t, b = p
        switches = [0, t - b, t, t + b, 2 * t]
        spans = list(zip((1, -1, 1, -1), switches, switches[1:]))
        way = sum(s * ((2 * t - a) ** 2 - (2 * t - c) ** 2) / 4 for s, a, c in spans)
        return [way - 1, sum(s * (cos(w * (a - t)) - cos(w * (c - t))) / w for s, a, c in spans)]

    best = inf
    for a in np.linspace(1, 4, 13):
        for part in np.linspace(0.1, 0.9, 9):
            p, _, found, _ = fsolve(rest, [a, part * a], full_output=True, xtol=1e-14)
            if found == 1 and 0 < p[1] < p[0] and np.abs(rest(p)).max() < 1e-10:
                best = min(best, 2 * p[0])
    return best


def fuller(x=1.0, v=0.0):
    """Switches on x + C v |v| = 0 (A. T. Fuller, 1963); the arcs between them in closed form."""
    c = sqrt((sqrt(33) - 1) / 24)
    total, u = 0.0, -1
    while abs(v) + abs(x) > 1e-9:
        g = lambda t: x + v * t + u * t * t / 2 + c * (v + u * t) * abs(v + u * t)
        step = 1e-3 * (abs(v) + sqrt(abs(x)))
        a = step
        while g(a) * g(step) > 0:
            a += step
        t = brentq(g, a - step, a, xtol=1e-16, rtol=1e-15)
        total += x * x * t + x * v * t**2 + (v * v + x * u) * t**3 / 3 + v * u * t**4 / 4 + t**5 / 20
        x, v, u = x + v * t + u * t * t / 2, v + u * t, -u
    return total


def staging():
    """Tsiolkovsky's equation for both stages."""
    speed = lambda m: 3 * log(100 / (100 - 0.9 * m)) + 3.5 * log((100 - m) / (1 + 0.1 * (99 - m)))
    return -least(lambda m: -speed(m), 40, 98.9)


def chain(d, h, length):
    """y = c + a cosh((x - b)/a)."""
    a = root(lambda a: 2 * a * sinh(d / (2 * a)) - sqrt(length**2 - h**2), 0.05, 10)
    b = d / 2 - a * asinh(h / (2 * a * sinh(d / (2 * a))))
    c = -a * cosh(b / a)
    return integral(lambda x: (c + a * cosh((x - b) / a)) * cosh((x - b) / a), 0, d)


def asinh(x):
    return log(x + sqrt(x * x + 1))


def catenoid(d):
    c = root(lambda c: c * cosh(d / 2 / c) - 1, 0.42 * d, 5)
    return c * (d / 2 + 0.5 * c * sinh(d / c))


def newton_body(length):
    """y = y0/4 (1 + p^2)^2/p^3, x = y0/4 (3/(4 p^4) + 1/p^2 - 7/4 + ln p) from p = 1 at the nose (I. Newton, Principia, book 2)."""
    y = lambda y0, p: y0 / 4 * (1 + p * p) ** 2 / p**3
    last = lambda y0: root(lambda p: y(y0, p) - 1, 1e-3, 1)
    x = lambda y0, p: y0 / 4 * (3 / (4 * p**4) + 1 / p**2 - 7 / 4 + log(p))
    y0 = root(lambda y0: x(y0, last(y0)) - length, 1e-4, 0.999)
    rate = lambda p: y0 / 4 * (3 / p**5 + 2 / p**3 - 1 / p)
    return y0**2 / 2 + integral(lambda p: y(y0, p) * p**3 / (1 + p * p) * rate(p), last(y0), 1)


def gramian(a, b, time, start, end):
    """Least integral of u'u between two states of a linear system."""
    a, b = np.array(a, float), np.array(b, float)
    n = len(a)
    e = expm(np.block([[-a, b @ b.T], [np.zeros((n, n)), a.T]]) * time)
    d = np.array(end) - expm(a * time) @ np.array(start)
    return float(d @ np.linalg.solve(e[n:, n:].T @ e[:n, n:], d))


def dubins(x, y, heading):
    """The best of the six words (L. E. Dubins, 1957), at the heading as it is stated, whole turns included."""

    def end(word, parts):
        p, q, h = 0.0, 0.0, 0.0
        for letter, t in zip(word, parts):
            k = {"L": 1, "R": -1}.get(letter)
            if k is None:
                p, q = p + t * cos(h), q + t * sin(h)
            else:
                p, q, h = p + k * (sin(h + k * t) - sin(h)), q - k * (cos(h + k * t) - cos(h)), h + k * t
        return p - x, q - y, h - heading

    best = inf
    starts = np.linspace(0.1, 6, 6)
    for word in ("LSL", "RSR", "LSR", "RSL", "LRL", "RLR"):
        for guess in [(a, b, c) for a in starts for b in starts for c in starts]:
            p, _, found, _ = fsolve(lambda p: end(word, p), guess, full_output=True, xtol=1e-14)
            if found == 1 and min(p) > -1e-9 and max(map(abs, end(word, p))) < 1e-10:
                best = min(best, sum(p))
    return best


def quadrature(time):
    points, weights = np.polynomial.legendre.leggauss(400)
    return 0.5 * time * (points + 1), 0.5 * time * weights


def fit_of_logistic_growth():
    t, w = quadrature(10)
    data = 2 / (1 + 19 * np.exp(-0.9 * t)) + 0.05 * np.sin(3 * t)
    misses = lambda p: np.sqrt(w) * (p[1] / (1 + (p[1] / p[2] - 1) * np.exp(-p[0] * t)) - data)
    return 2 * least_squares(misses, [0.9, 2, 0.1], xtol=1e-15, ftol=1e-15, gtol=1e-15).cost


def fit_of_a_product():
    t, w = quadrature(2)
    return least(lambda k: float(w @ (np.exp(-k * t) - np.exp(-2 * t) - 0.1 * np.sin(5 * t)) ** 2), 0.5, 5)


def fit_of_a_frequency():
    """The local minimum next to the guess."""
    over = lambda a: sin(6 * a) / a
    return least(lambda k: 6 + over(2 * sqrt(k)) / 2 + over(10) / 2 - over(sqrt(k) - 5) - over(sqrt(k) + 5), 5, 9)


def full_rate_beyond_the_crest():
    """An admissible control, not the optimum."""
    near = integral(lambda t: (1 + 10 * t) ** 2 + 1, 0, 2.9)
    return near + integral(lambda t: 900 - 200 * (1 + 10 * t - 30) + 1, 2.9, 10)


def well(depth, at, width, low, high):
    """The least of u^2 - depth exp(-((u - at)/width)^2)."""
    return least(lambda u: u * u - depth * exp(-(((u - at) / width) ** 2)), low, high)


def wells(depth, at, square):
    """The same in several controls."""
    at = np.array(at)
    f = lambda z: sum(z**2) - depth * np.exp(-sum((z - at) ** 2) / square)
    return float(minimize(f, 0.98 * at, tol=1e-14).fun)


def cycloid(x, y, g):
    p = root(lambda p: (p - sin(p)) / (1 - cos(p)) - x / y, 1e-3, 2 * pi - 1e-3)
    return p * sqrt(y / (1 - cos(p)) / g)


def intercept(t):
    return (60 / t**2) ** 2 + (80 / t**2) ** 2 + (40 / t**2 + 1.62) ** 2 - 16


def hill(n=1.1e-3):
    return [[0, 0, 1, 0], [0, 0, 0, 1], [3 * n**2, 0, 0, 2 * n], [0, 0, -2 * n, 0]]


TROLLEY = [[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, -2, 0]]

def fuel_and_energy():
    """u = +-(|lambda| - 1) / 0.2 up to one, with lambda a line through zero in the middle; its slope follows from the distance."""

    def thrust(slope, t):
        return min(max((slope * (1 - t / 3) - 1) / 0.2, 0.0), 1.0)

    def corners(slope):
        return [t for t in (3 * (1 - 1.2 / slope), 3 * (1 - 1 / slope)) if 0 < t < 3]

    def over_half(function, slope):
        return quad(function, 0, 3, points=corners(slope), epsabs=1e-14, epsrel=1e-13, limit=500)[0]

    slope = root(lambda c: over_half(lambda t: thrust(c, t) * (6 - 2 * t), c) - 1, 1.001, 10)
    return 2 * over_half(lambda t: thrust(slope, t) + 0.1 * thrust(slope, t) ** 2, slope)


def fuel_in_a_plane():
    """Each axis thrusts, coasts and thrusts back; two conditions at its end leave the two durations."""
    a = 3 - sqrt(8)

    def x(t):
        return 1 - t**2 / 2 if t < a else 1 - a**2 / 2 - a * (t - a) if t < 6 - a else (6 - t) ** 2 / 2

    pull = 0.1 * quad(x, 0, 6, points=[a, 6 - a], epsabs=1e-14)[0]
    moved = 0.1 * quad(lambda t: (6 - t) * x(t), 0, 6, points=[a, 6 - a], epsabs=1e-14)[0]

    def end(durations):
        p, q = durations
        return [0.2 + p - q - pull, -1 + 0.2 * 6 + p * (6 - p / 2) - q**2 / 2 - moved]

    return 2 * a + sum(fsolve(end, [0.2, 0.1], xtol=1e-14))


def rocket_sled():
    """Thrust, coast, thrust back: the speed gained is lost again, so that masses have one ratio; the first duration is the best one."""

    def cost(burn):
        kept = 1 - burn / 3
        speed, back = -3 * log(kept), 3 * (kept - kept**2)
        way = integral(lambda t: -3 * log(1 - t / 3), 0, burn)
        way += integral(lambda t: speed + 3 * log(1 - t / (3 * kept)), 0, back)
        return 2 * (burn + back) + (1 - way) / speed - 3

    return least(cost, 0.3, 1.0)


def tabulated_hill():
    """The bottom of a monotone spline with a well (PCHIP: F. N. Fritsch, R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238)."""
    hill = PchipInterpolator([-10, -8, -6, -4, -2, 0, 2, 4, 6, 7, 8, 9, 10], [0] * 10 + [-100, 0, 0])
    return least(lambda u: u**2 + float(hill(u)), 7.5, 8.5)


def solar_sail(end=1.524, au=149597870700, mu=132712440018e9, characteristic=1e-3):
    """The extremal of the least time: the sail's normal makes the costate of the velocity gain most, the Hamiltonian is zero. In units of 1 au
    and mu = 1; the start is that of a search over 60 s of random ones, whose extremals had no less time."""
    push = characteristic / (mu / au**2)

    def rates(_, y):
        r, u, v, lr, lu, lv = y
        normal = atan2(-2 * lv, -3 * lu + sqrt(9 * lu**2 + 8 * lv**2))
        c, s, k = cos(normal), sin(normal), push / r**2
        return [
            u,
            v * v / r - 1 / r**2 + k * c**3,
            -u * v / r + k * c * c * s,
            lu * (v * v / r**2 - 2 / r**3 + 2 * k / r * c**3) - lv * (u * v / r**2 - 2 * k / r * c * c * s),
            lv * v / r - lr,
            (lv * u - 2 * lu * v) / r,
        ]

    def missed(p):
        y = solve_ivp(rates, (0, p[3]), [1, 0, 1, *p[:3]], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        return [y[0] - end, y[1], y[2] - 1 / sqrt(end), 1 + float(np.dot(y[3:], rates(0, y)[:3]))]

    found = fsolve(missed, [-7.43, -4.24, -7.93, 7.02], xtol=1e-13)
    return found[3] * sqrt(au**3 / mu) / 86400


GUST = PchipInterpolator([0, 0.50, 0.502, 0.504, 1.0], [0, 0, 1, 0, 0])

def hinges_beside_a_dead_band():
    """Full thrust for a time, then 0.1 up to half of the way, and mirrored; thrust beyond 0.1 costs."""
    half = 2.5
    way = lambda full: full**2 + 2 * full * (half - full) + 0.1 * (half - full) ** 2
    return 2 * 0.9 * root(lambda full: way(full) - 2, 0, half)


def store_held_empty_by_both():
    """Filled between two times about the least price, at 9/10 of the price at which it is emptied at last; both controls hold it between."""
    filled = lambda last: (pi + 2.5 - last) / 2
    last = root(lambda last: cos(2 * last) - 0.9 * cos(2 * filled(last)), 1.7, 2)
    price = lambda a, b: (sin(2 * b) - sin(2 * a)) / 2
    begin, end = pi - filled(last), filled(last)
    both = price(pi / 4, begin) + price(end, last)
    return -0.9 * (price(0, 0.5) + price(last, 2)) + price(begin, end) + 0.1 * both


OPTIMA = {
    "along_the_ground": along_the_ground,
    "around_a_small_disc": around_a_small_disc,
    "astronomical_unit": lambda: 2 * sqrt(149597870700 / 4e-3),
    "best_damping": lambda: 1,
    "between_two_discs": between_two_discs,
    "body_of_least_drag": lambda: newton_body(1.0),
    "bound_on_a_ratio_of_integrals": lambda: 3 / 4 + sqrt(3) / 2,
    "brake_stronger_than_push": lambda: 1.2 * sqrt(2 * 4 / 1.2),
    "car_to_a_pose": lambda: dubins(4.0, 3.0, 2.0),
    "car_turns_round": lambda: dubins(0.0, 0.0, pi),
    "ceiling_by_an_exponential": lambda: 4 / (9 * 0.1),
    "ceiling_kept_to_the_end": lambda: 4 - acosh(2) + 2 * sqrt(3),
    "ceiling_touched_twice": ceiling_touched_twice,
    "chain_between_unequal_ends": lambda: chain(1.0, 0.4, 1.6),
    "cosines_constant_current": lambda: crossing(10, 4, 0.5, 0.3),
    "cosines_intercept_under_gravity": lambda: root(intercept, 1, 50),
    "cosines_moving_target": lambda: root(lambda t: (5 + 0.4 * t) ** 2 + (3 - 0.2 * t) ** 2 - t**2, 0.1, 50),
    "cosines_rest_to_rest_in_space": lambda: 2 * sqrt(13),
    "cost_with_a_spike": cost_with_a_spike,
    "crane_by_least_effort": lambda: gramian(TROLLEY, [[0], [1], [0], [-1]], 6, [0, 0, 0, 0], [1, 0, 0, 0]),
    "deep_well_in_kilometres": lambda: 2 * sqrt(7e6 / 2.5),
    "descent_by_one_burn": lambda: 2 * sqrt(10),
    "dido_along_a_shore": lambda: pi / 2,
    "double_integrator_from_speed": lambda: 3 + 2 * sqrt(4.5 + 10),
    "draining_tank": lambda: 2 * (1 - 0.01),
    "effort_above_a_level": effort_above_a_level,
    "effort_and_time_with_a_limit_of_the_speed": lambda: 8 * 1.5**2 / (3 * 3) + (10 + 2 * 1.5 * 3 / 3) / 1.5,
    "effort_of_a_growing_gain": lambda: 3,
    "effort_with_a_limit_of_the_speed": lambda: 8 * 0.6**2 / (3 * 0.5),
    "end_at_bounds": lambda: 12 / 8,
    "end_at_the_bottom_of_a_well": lambda: least(lambda x: (x**2 - 1) ** 2 + 0.3 * x, -1.2, -1),
    "end_in_a_one_sided_range": lambda: 5,
    "end_in_a_wide_range": lambda: 3,
    "far_end_time": lambda: 2 * sqrt(1e-8),
    "far_parameter": lambda: 1,
    "far_slow_boat": lambda: 1 / 1e-5,
    "fast_actuator": fast_actuator,
    "first_phase_of_no_length": lambda: 0.75,
    "fishery": lambda: 0.25 * (10 - log(9) - 2 * atan(0.6)) + atan(0.6),
    "fit_of_logistic_growth": fit_of_logistic_growth,
    "fit_that_is_exact": lambda: 0,
    "floor_between_falling_and_rising": lambda: 4 / (9 * 0.1) / 2,
    "floor_to_the_end": lambda: 0.5**2 / (2 * 0.7),
    "floor_with_a_far_ceiling": lambda: 4 / 9 / 0.08,
    "free_initial_time": lambda: 0.25,
    "free_start_linear_quadratic": lambda: 0.5,
    "free_start_on_a_circle": lambda: 3 * (3 - sqrt(2)) ** 2,
    "friction_of_coulomb": lambda: sqrt(2 * (1 / 0.7 + 1 / 1.3)),
    "fuel_and_energy": fuel_and_energy,
    "fuel_in_a_plane_by_magnitudes": fuel_in_a_plane,
    "fuel_of_a_rocket_by_magnitude": rocket_sled,
    "fuller": fuller,
    "gate_in_an_instant": gate_in_an_instant,
    "gust_from_a_table": lambda: effort_against(lambda t: 20 * float(GUST(t)), [0.5, 0.502, 0.504]),
    "harmonic_five_switches": lambda: oscillator(9.3, 2.1),
    "hinges_beside_a_dead_band": hinges_beside_a_dead_band,
    "hover_by_any_thrust": lambda: 1.62 * 100,
    "integral_with_a_far_side": lambda: 20 * 0.3**2,
    "jerk_within_limits": lambda: 4 / 1.2 + 1.2 / 1 + 1 / 2,
    "jump_at_a_time": lambda: 1 / (0.3 + 4 * 0.7),
    "jump_at_the_start": lambda: 12 / 2**3 + 0.3**2 * 2,
    "jump_before_a_free_end": lambda: 1 + 0.75 * 0.737,
    "landing_in_a_cone_of_thrust": landing_in_a_cone_of_thrust,
    "least_effort_with_a_limited_length": lambda: 12 / 6**3 + 12 * 0.5**2 / 6**3 - 12 * 0.5 * 0.3 / 6**2 + 4 * 0.3**2 / 6,
    "least_fuel_between_two_rows": lambda: 2 * (2 - sqrt(3)),
    "least_fuel_by_length": lambda: 6 - sqrt(36 - 4 * hypot(1, 0.5)),
    "least_fuel_by_magnitude": lambda: 2 * (2 - sqrt(3)),
    "least_fuel_by_two_thrusters": lambda: 2 * (2 - sqrt(3)),
    "least_fuel_in_a_cone": lambda: 2 * (3 - sqrt(9 - 5 / 1.2)),
    "least_fuel_in_a_cone_with_a_least_thrust": least_fuel_in_a_cone_with_a_least_thrust,
    "least_fuel_in_space_by_length": lambda: 2 * (2 - sqrt(3)),
    "least_fuel_under_a_magnitude": lambda: 2 * (3 - sqrt(9 - 5 / 1.2)),
    "least_time_by_a_thrust_that_turns_round": least_time_by_a_thrust_that_turns_round,
    "least_time_by_an_angle": lambda: 2,
    "least_time_in_an_ellipse": lambda: 2 * sqrt(hypot(4 / 2, 3 / 1)),
    "least_time_with_an_energy": lambda: 4 ** (1 / 3),
    "limit_by_a_logarithm": lambda: (1 - 2) ** 2 / 2,
    "limit_of_the_speed_from_the_start": lambda: 4 * 0.6**2 / 3,
    "limit_that_steps_at_a_time": lambda: 0.8**2 / 0.5 + 0.2**2 / 0.5,
    "limit_until_a_time": lambda: 0.2**2 + 12 * 0.9**2 / 3**3 - 12 * 0.9 * 0.2 / 3**2 + 4 * 0.2**2 / 3,
    "limit_with_a_far_side": string_over_parabola,
    "long_way_on_a_sphere": lambda: (2 * pi - 4) ** 2,
    "mean_value_over_a_free_time": lambda: 1 / 2,
    "micrometre": lambda: 12e-12,
    "micronewton_drag_free": lambda: 2 * sqrt(1e-6 / 1e-9),
    "miss_by_its_magnitude": lambda: 0.2,
    "moving_wall": moving_wall,
    "nothing_to_correct": lambda: 0,
    "oscillator_three_switches": lambda: oscillator(-5.0, 1.0),
    "oscillator_with_limited_speed": oscillator_speed_limit,
    "parameter_in_a_one_sided_range": lambda: 4,
    "peak_of_a_slew": lambda: 1,
    "plane_change_by_a_parameter": lambda: plane_change_by_two_impulses() / 1000,
    "plane_change_by_two_impulses": plane_change_by_two_impulses,
    "product_of_integrals_of_two_phases": lambda: 1 / 2 + 1 / 16,
    "pull_within_a_power": pull_within_a_power,
    "pulse_of_a_disturbance": lambda: effort_against(lambda t: 50 * exp(-(((t - 0.377) / 0.002) ** 2)), np.linspace(0.361, 0.393, 9)),
    "push_that_halves_at_a_place": lambda: 2 * sqrt(3 / 2) + 1,
    "push_that_the_speed_lowers": lambda: 1 + root(lambda t: 2 * t - 1 + exp(-t) - 3 / 2, 0, 5),
    "quadruple_integrator": lambda: 384 ** (1 / 4),
    "race_car": race_car,
    "ratio_of_integrals": lambda: 3,
    "ratio_of_integrals_from_zero": lambda: 3 / 4 + sqrt(3) / 2,
    "refraction_with_an_if": lambda: least(lambda s: hypot(s, 1) + hypot(2 - s, 1) / 0.5, 0, 2),
    "rendezvous_by_least_effort": lambda: gramian(hill(), [[0, 0], [0, 0], [1, 0], [0, 1]], 2400, [-800, -3000, 0.5, 1.2], [0, 0, 0, 0]),
    "rest_beside_a_reward_for_the_end": lambda: 0,
    "saturated_actuator": lambda: 2,
    "saturated_by_conditions": lambda: 2,
    "saturated_without_bounds": lambda: 2,
    "singular_tracking": lambda: integral(lambda t: (0.5 - t - sin(t)) ** 2, 0, root(lambda s: 0.5 - s - sin(s), 0, 1)),
    "singular_with_nothing_left": lambda: 0,
    "slew_with_limited_total_torque": lambda: 2 * sqrt(pi / 2),
    "slide_above_a_wall": slide_above_a_wall,
    "slow_leak_in_large_numbers": lambda: 0.1,
    "small_step_beside_a_switch": lambda: 1 + 0.005**2 - 0.02 * 0.82 + 1 + 0.01**2 + 0.02 * 0.805,
    "soap_film": lambda: catenoid(1.0),
    "solar_sail_to_mars": solar_sail,
    "speed_at_a_kink": lambda: 2 / (3 * 1.5),
    "speed_limit_in_large_units": lambda: 1 / 0.7 + 0.7,
    "speed_limit_in_small_units": lambda: 1 / 0.7 + 0.7,
    "speed_limit_with_drag": lambda: log(3) + 10 + 2 * log(0.75),
    "square_wave_before_a_free_end": square_wave_before_a_free_end,
    "stages_without_a_coast": stages_without_a_coast,
    "staging": staging,
    "steps_beyond_the_end": lambda: least(lambda l: 12 / l**3 + l, 1, 5),
    "store_empty_for_a_while": lambda: -0.75,
    "store_held_empty_by_both": store_held_empty_by_both,
    "string_over_a_parabola": string_over_parabola,
    "string_over_a_wave": string_over_a_wave,
    "swing_of_many_turns": lambda: swing(30, 100),
    "switch_at_a_time": lambda: 0.737 + (1.9 - 0.737) / 2,
    "there_and_back_with_limits": lambda: 1 / 0.7 + 0.7 + 1 / 0.5 + 0.5,
    "through_a_waypoint": lambda: 24,
    "thrust_off_in_eclipse": thrust_off_in_eclipse,
    "thrust_past_a_corner": thrust_past_a_corner,
    "thrust_that_turns_past_its_bound": thrust_that_turns_past_its_bound,
    "thrust_up_at_the_end": lambda: 3 / 8 + 1 / pi**2,
    "thrusters_by_two_hinges": lambda: 5 - sqrt(5**2 - 4 * 2),
    "touch_of_the_ground": lambda: 50**2 / 20 * (2 + 6 * (1 - 4 * 200 / (50 * 20)) ** 2),
    "trap_any_meridian": lambda: pi**2,
    "trap_any_way_around_a_ball": lambda: around_disc((-1, 0), (1, 0), 0.5) ** 2,
    "trap_any_phase_of_an_oscillation": lambda: 0,
    "trap_any_time_of_departure": lambda: 2,
    "trap_any_way_is_as_good": lambda: 1,
    "trap_around_the_wrong_side": lambda: around_disc((-2, 0), (2, 0.5), 1.0, other_side=True),
    "trap_axis_with_slack": lambda: 4,
    "trap_between_two_circles": lambda: 1,
    "trap_between_two_circles_with_a_budget": lambda: 1,
    "trap_boundary_at_its_bound": lambda: 2**2 - 2 * 2**2,
    "trap_constant_in_the_cost": lambda: 1e5 + least(lambda u: 2 * (u**2 - 1) ** 2 + 0.375 * (1 - u), 0.5, 1.5),
    "trap_cost_from_half_way": cost_from_half_way,
    "trap_cost_that_turns_far_away": full_rate_beyond_the_crest,
    "trap_curvature_of_one_quadrant": lambda: 2 * (pi * sqrt(20) - 20),
    "trap_curvature_of_one_side": lambda: pi * sqrt(20) - 20,
    "trap_curvature_of_one_side_of_an_end": lambda: 1 - 5,
    "trap_end_by_its_magnitude": lambda: 0.7**2,
    "trap_end_on_a_ridge": lambda: -1 / 4,
    "trap_end_that_can_only_just_be_met": lambda: sqrt(1.5**2 + 0.75) / sqrt(2**2 - 1),
    "trap_far_side_of_a_circle": lambda: 0.5**2,
    "trap_faster_current_on_both_sides": lambda: 0.1**2 / 2 + 2**2 / 2 + 2 * (3 - 2.1),
    "trap_film_that_breaks": lambda: catenoid(1.2),
    "trap_four_thrusters": lambda: wells(8, [0.75, 0.25, -0.75, 0.25], 0.06),
    "trap_frequency_fit": fit_of_a_frequency,
    "trap_integral_on_a_ridge": lambda: -1 / 12,
    "trap_large_terms_that_cancel": lambda: 1 + least(lambda u: 2 * (u * u - 1) ** 2 + 0.375 * (1 - u), 0, 2),
    "trap_largest_of_a_square": lambda: -9,
    "trap_length_in_any_measure": lambda: 5,
    "trap_longest_axis_of_an_end": lambda: 1,
    "trap_narrow_well": lambda: well(90, 9, 0.1, 8.9, 9.1),
    "trap_narrow_well_nonlinear": lambda: well(90, 9, 0.1, 8.9, 9.1),
    "trap_no_effect_to_first_order": lambda: 16 - 3 * 16,
    "trap_one_sided_kink": lambda: 0.9 - 4.5,
    "trap_other_root_of_an_equation": least_root_of_a_cubic,
    "trap_parameter_at_a_maximum": lambda: 0,
    "trap_parameter_at_its_bound": lambda: -1,
    "trap_periodic_rest": lambda: -0.25 * 4,
    "trap_rest_at_a_bound_of_the_end": lambda: 1 - 3,
    "trap_reward_at_a_corner": lambda: -1 / 12,
    "trap_reward_in_a_quarter": lambda: -1,
    "trap_ridge": lambda: -1 / 3,
    "trap_rival_beside_a_parked_state": lambda: 0,
    "trap_rival_under_wide_bounds": lambda: 1,
    "trap_saddle_across_a_kink": lambda: across_a_kink(0.25, 8),
    "trap_second_mode": lambda: pi**2,
    "trap_shifted_time_weight": lambda: least(lambda t: 1 / t + 0.1 * t + sin(3 * t), 1.2, 2.0),
    "trap_small_debris": lambda: around_disc((-1.9863, 0.001), (2.0137, 0.001), 0.004),
    "trap_small_objective_beside_a_large_one": lambda: 1e6 + 12e-6,
    "trap_strut_beyond_buckling": strut_beyond_buckling,
    "trap_tabulated_hill": tabulated_hill,
    "trap_thin_gate": thin_gate,
    "trap_thin_layer": thin_layer,
    "trap_thin_wall": string_over_bump,
    "trap_three_thrusters": lambda: wells(12, [0.5, 0.5, -0.5], 0.02),
    "trap_through_the_middle_of_a_disc": lambda: around_disc((-2, 0), (2, 0), 1.0),
    "trap_time_at_a_maximum": lambda: -1,
    "trap_two_parameters_as_one": fit_of_a_product,
    "trap_two_switches_too_many": lambda: 2,
    "trap_unbounded_nonlinear": lambda: least(lambda u: u**2 * (1 - u / 20) ** 2 + 0.01 * u**2 - 0.3 * u, 15, 25),
    "trap_wall_that_a_state_raises": string_over_bump,
    "trap_way_off_a_magnitude": lambda: -3,
    "trap_weak_not_strong": lambda: -3,
    "trap_well_beside_a_wide_control": lambda: 300**2 + least(lambda u: 4 * (u**2 - 0.64) ** 2 + 0.47 * u, -1, -0.5),
    "trap_well_of_an_unbounded_control": lambda: well(900, 20, 1.5, 18, 20.5),
    "trap_well_of_two_unbounded_controls": well_of_two_controls,
    "trap_wider_well": lambda: well(90, 7, 0.7, 6.5, 7.2),
    "trap_wrong_half_of_the_controls": lambda: 0.4**2,
    "triple_integrator": lambda: 32 ** (1 / 3),
    "two_masses_and_a_spring": two_masses,
    "two_media": lambda: 6,
    "two_media_given_time": lambda: least(lambda s: 1 / s + 4 / (3 - s), 0.1, 2.9),
    "two_phases_on_a_limit": lambda: 8 * 0.6**2 / (3 * 0.5),
    "two_touches": two_touches,
    "unstable_aircraft": lambda: 0.1**2 * riccati([[-0.6, 1], [5, -0.5]], [0, 3], [1, 0.1], 10)[0, 0],
    "unstable_plant": lambda: 2 + sqrt(5),
    "unstable_plant_over_two_phases": lambda: riccati([[0, 1], [4, 0]], [0, 1], [1, 0], 17)[0, 0],
    "way_around_a_disc": lambda: around_disc((-2, 0), (2, 0.5), 1.0),
    "wide_bounds": lambda: 12,
    "wide_time": lambda: 2,
    "wind_from_a_table": lambda: crossing(5, 3, 0.4, 0.0),
    "within_reach_by_a_billionth": lambda: 0.499999999**2,
}

if __name__ == "__main__":
    for name, value in OPTIMA.items():
        print(f"{name:44} {float(value())!r}")
