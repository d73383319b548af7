"""A closed-loop descent of the capsule with moving masses by numba and by plain Python, in turns with `moving_mass`.

Six degrees of freedom over a plane, Runge-Kutta steps and PID samples of 10 ms, 205 s of flight. The same end state on
both sides. See README.md.
"""

import json
import math
import subprocess
import sys
import time
from bisect import bisect_right

import findings
from common import built, numpy, output

try:
    import numba
except ImportError:
    print("skipped: numba is not installed (pip install numba)")
    sys.exit(0)

# Relative to 1 m, 1 m/s, 1 and 1 rad/s and the magnitude: rounding, and the atmosphere above 86 km, which is interpolated.
LARGEST_DIFFERENCE = 1e-7

RADIUS = 6356766.0
HYDROSTATIC = 9.80665 * 28.9644 / 8314.32
SOUND = 1.4 * 8314.32 / 28.9644
# US Standard Atmosphere 1976: geopotential height, m, gradient, K/m, temperature, K, density, kg/m3.
LAYERS = (
    (0.0, -0.0065, 288.15, 1.2249991558877122),
    (11000.0, 0.0, 216.65, 0.36391777591155783),
    (20000.0, 0.001, 216.65, 0.08803480364710484),
    (32000.0, 0.0028, 228.65, 0.013224999644107832),
    (47000.0, 0.0, 270.65, 0.001427532512064436),
    (51000.0, -0.0028, 270.65, 0.0008616049125405525),
    (71000.0, -0.002, 214.65, 6.421098672004283e-05),
)
BASES = tuple(layer[0] for layer in LAYERS)


def descent(model, compiled):
    """A function that flies once: end state, time, steps, RMS and peaks. Scalars and tuples, which suit both best."""
    jit = numba.njit(inline="always", error_model="numpy") if compiled else lambda f: f
    kept = numpy.array if compiled else tuple
    mach_knots, attack_knots = kept(model["mach"]), kept(model["attack"])
    columns = len(model["attack"])
    axial, normal, moment = (kept(c) for c in model["coefficients"])
    high_density, high_sound = kept(model["high_density"]), kept(model["high_sound"])
    high_from, _, high_step = model["high"]
    g0, g1, g2 = model["gravity"]
    roll, pitch, yaw = model["inertia"]
    mass, moving = model["masses"]
    diameter, travel, offset, h = model["diameter"], model["travel"], model["offset"], model["step"]
    (kp, ki, kd), (pitch_damping, roll_damping) = model["gains"], model["damping"]
    area = 0.25 * math.pi * diameter * diameter
    lowest, (window_low, window_high) = model["lowest"], model["window"]
    start = tuple(model["start"])
    highest_interval = len(model["high_density"]) - 2
    last_mach, last_attack = len(model["mach"]) - 2, columns - 2
    least_mach, most_mach, most_attack = model["mach"][0], model["mach"][-1], model["attack"][-1]

    if compiled:

        @jit
        def interval(knots, x, last):
            low, high = 0, last + 1
            while high - low > 1:
                middle = (low + high) // 2
                if knots[middle] <= x:
                    low = middle
                else:
                    high = middle
            return low

    else:

        def interval(knots, x, last):
            return min(bisect_right(knots, x) - 1, last)

    @jit
    def atmosphere(altitude):
        """Density and speed of sound."""
        if altitude > 86e3:
            place = (altitude - high_from) / high_step
            k = min(int(place), highest_interval)
            part = place - k
            density = math.exp(high_density[k] + part * (high_density[k + 1] - high_density[k]))
            return density, high_sound[k] + part * (high_sound[k + 1] - high_sound[k])
        height = RADIUS * altitude / (RADIUS + altitude)
        k = 0
        while k < 6 and BASES[k + 1] <= height:
            k += 1
        base, gradient, base_temperature, base_density = LAYERS[k]
        temperature = base_temperature + gradient * (height - base)
        if gradient == 0.0:
            density = base_density * math.exp(-HYDROSTATIC / base_temperature * (height - base))
        else:
            density = base_density * (temperature / base_temperature) ** (-1.0 - HYDROSTATIC / gradient)
        return density, math.sqrt(SOUND * temperature)

    @jit
    def air_velocity(vx, vy, vz, q0, q1, q2, q3):
        """Velocity in body axes and the rows of the matrix from body axes."""
        d = 2.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
        xx, yy, zz = q1 * q1, q2 * q2, q3 * q3
        xy, xz, yz = q1 * q2 * d, q1 * q3 * d, q2 * q3 * d
        wx, wy, wz = q0 * q1 * d, q0 * q2 * d, q0 * q3 * d
        a, b, c = 1.0 - (yy + zz) * d, xy - wz, xz + wy
        e, f, g = xy + wz, 1.0 - (xx + zz) * d, yz - wx
        i, j, k = xz - wy, yz + wx, 1.0 - (xx + yy) * d
        u = a * vx + e * vy + i * vz
        v = b * vx + f * vy + j * vz
        w = c * vx + g * vy + k * vz
        return u, v, w, a, b, c, e, f, g, i, j, k

    @jit
    def rate(x, cy, cz):
        _, _, down, vx, vy, vz, q0, q1, q2, q3, p, q, r = x
        altitude = -down
        u, v, w, a, b, c, e, f, g, i, j, k = air_velocity(vx, vy, vz, q0, q1, q2, q3)
        density, sound = atmosphere(altitude)
        speed = math.sqrt(u * u + v * v + w * w)
        across = math.sqrt(v * v + w * w)
        angle = math.atan2(across, u)
        # Coefficients: straight lines in Mach number and angle.
        m = min(max(speed / sound, least_mach), most_mach)
        held = min(angle, most_attack)
        row, column = interval(mach_knots, m, last_mach), interval(attack_knots, held, last_attack)
        s = (m - mach_knots[row]) / (mach_knots[row + 1] - mach_knots[row])
        t = (held - attack_knots[column]) / (attack_knots[column + 1] - attack_knots[column])
        n = row * columns + column
        w00, w01, w10, w11 = (1.0 - s) * (1.0 - t), (1.0 - s) * t, s * (1.0 - t), s * t
        o = n + columns
        ca = w00 * axial[n] + w01 * axial[n + 1] + w10 * axial[o] + w11 * axial[o + 1]
        cn = w00 * normal[n] + w01 * normal[n + 1] + w10 * normal[o] + w11 * normal[o + 1]
        cm = w00 * moment[n] + w01 * moment[n + 1] + w10 * moment[o] + w11 * moment[o + 1]
        if across > 1e-12:
            cn, cm = cn / across, cm / across
        else:
            cn, cm = 0.0, 0.0
        size = 0.5 * density * speed * speed * area
        lever = size * diameter
        damping = 0.25 * density * speed * area * diameter * diameter
        fx, fy, fz = -ca * size, -cn * v * size, -cn * w * size
        mx = roll_damping * damping * p - (cy * fz - cz * fy)
        my = cm * w * lever + pitch_damping * damping * q - cz * fx
        mz = -cm * v * lever + pitch_damping * damping * r + cy * fx
        gravity = (g2 * altitude + g1) * altitude + g0
        return (
            vx,
            vy,
            vz,
            (a * fx + b * fy + c * fz) / mass,
            (e * fx + f * fy + g * fz) / mass,
            (i * fx + j * fy + k * fz) / mass + gravity,
            -0.5 * (q1 * p + q2 * q + q3 * r),
            0.5 * (q0 * p + q2 * r - q3 * q),
            0.5 * (q0 * q + q3 * p - q1 * r),
            0.5 * (q0 * r + q1 * q - q2 * p),
            (mx - (yaw - pitch) * q * r) / roll,
            (my - (roll - yaw) * r * p) / pitch,
            (mz - (pitch - roll) * p * q) / yaw,
        )

    @jit
    def along(x, k, s):
        return (
            x[0] + s * k[0], x[1] + s * k[1], x[2] + s * k[2], x[3] + s * k[3], x[4] + s * k[4], x[5] + s * k[5],
            x[6] + s * k[6], x[7] + s * k[7], x[8] + s * k[8], x[9] + s * k[9],
            x[10] + s * k[10], x[11] + s * k[11], x[12] + s * k[12],
        )  # fmt: skip

    @jit
    def step(x, cy, cz, h):
        k1 = rate(x, cy, cz)
        k2 = rate(along(x, k1, 0.5 * h), cy, cz)
        k3 = rate(along(x, k2, 0.5 * h), cy, cz)
        k4 = rate(along(x, k3, h), cy, cz)
        y = along(along(along(along(x, k1, h / 6.0), k2, h / 3.0), k3, h / 3.0), k4, h / 6.0)
        n = 1.0 / math.sqrt(y[6] * y[6] + y[7] * y[7] + y[8] * y[8] + y[9] * y[9])
        return (
            y[0], y[1], y[2], y[3], y[4], y[5], y[6] * n, y[7] * n, y[8] * n, y[9] * n, y[10], y[11], y[12]
        )  # fmt: skip

    @jit
    def pid(error, before, integral, first):
        integral += h * error
        derivative = 0.0 if first else (error - before) / h
        wanted = kp * error + ki * integral + kd * derivative
        limited = min(max(wanted, -travel), travel)
        # No integration of an error that drives further beyond the end of the travel.
        if (wanted - limited) * ki * error > 0.0:
            integral -= h * error
        return limited, integral

    def fly():
        x, n = start, 0
        ia = ib = ea = eb = sa = sb = pa = pb = 0.0
        count = 0
        cy = cz = 0.0
        while True:
            u, v, w = air_velocity(x[3], x[4], x[5], x[6], x[7], x[8], x[9])[:3]
            attack, sideslip = math.atan2(w, u), math.atan2(v, math.hypot(u, w))
            if window_low <= -x[2] <= window_high:
                sa += attack * attack
                sb += sideslip * sideslip
                pa, pb = max(pa, abs(attack)), max(pb, abs(sideslip))
                count += 1
            along_y, ib = pid(-sideslip, eb, ib, n == 0)
            along_z, ia = pid(-attack, ea, ia, n == 0)
            ea, eb = -attack, -sideslip
            cy, cz = offset + moving / mass * along_y, offset + moving / mass * along_z
            y = step(x, cy, cz, h)
            n += 1
            if -y[2] <= lowest:
                # Where the height is met in this step, by secants.
                low, high, part = -x[2] - lowest, -y[2] - lowest, 1.0
                done, left = 0.0, 1.0
                for _ in range(60):
                    if high == 0.0 or left - done < 1e-14:
                        break
                    part = done + (left - done) * low / (low - high)
                    y = step(x, cy, cz, part * h)
                    here = -y[2] - lowest
                    if abs(here) < 1e-10:
                        break
                    if here > 0.0:
                        done, low = part, here
                    else:
                        left, high = part, here
                return y, (n - 1 + part) * h, n, math.sqrt(sa / count), math.sqrt(sb / count), pa, pb
            x = y

    return numba.njit(error_model="numpy")(fly) if compiled else fly


def checked(label, found, report):
    """Stops unless the end of a flight is that of apsides."""
    state, flight_s, steps = found[:3]
    gap = max(abs(a - b) / (1.0 + abs(b)) for a, b in zip(state, report["state"]))
    gap = max(gap, abs(flight_s - report["flight_s"]) / report["flight_s"])
    rms = max(abs(math.degrees(a) - b) for a, b in zip(found[3:5], report["rms_deg"]))
    if gap > LARGEST_DIFFERENCE or steps != report["steps"] or rms > 1e-9:
        sys.exit(f"{label} ends elsewhere: {gap:.1e}, {steps} steps of {report['steps']}, RMS differs by {rms:.1e} deg")
    print(f"{label}: same end to {gap:.1e}, {steps} steps, {flight_s:.3f} s of flight")


def least(fly, turns):
    """Least CPU time of some flights, ms."""
    times = []
    for _ in range(turns):
        clock = time.process_time()
        fly()
        times.append(1e3 * (time.process_time() - clock))
    return min(times)


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--turns", type=int, default=5, help="turns; the least time counts")
    arguments = parser.parse_args()
    program = built("moving_mass")
    model = json.loads(subprocess.run([program, "--model"], check=True, capture_output=True, text=True).stdout)
    report = output(program, "--repeat", 1)
    clock = time.process_time()
    compiled, plain = descent(model, True), descent(model, False)
    checked("numba", compiled(), report)
    build_s = time.process_time() - clock
    checked("Python", plain(), report)
    times = {"apsides": math.inf, "numba": math.inf, "Python": math.inf}
    for _ in range(arguments.turns):
        times["apsides"] = min(times["apsides"], *output(program, "--repeat", 10)["milliseconds"])
        times["numba"] = min(times["numba"], least(compiled, 5))
        times["Python"] = min(times["Python"], least(plain, 1))
    print(f"\n{'':>10} {'ms':>10} {'ratio':>8}")
    for name, ms in times.items():
        print(f"{name:>10} {ms:10.2f} {ms / times['apsides']:8.1f}")
    found = findings.Findings("Closed-loop descent of a capsule with moving masses", "205 s of flight, 20 404 steps of 10 ms; the compilation of numba is not counted.")
    for name in ("numba", "Python"):
        found.add("one descent", name, times["apsides"], times[name], f"same end to {LARGEST_DIFFERENCE:.0e}")
    findings.write(arguments.findings, found)
    print(f"\nnumba compiles in {build_s:.1f} s")


if __name__ == "__main__":
    main()
