"""Injections into geostationary orbit with 2, 3 and 5 burns by apsides, by SciPy and by CasADi + Ipopt, in turns.

All burns, ignitions and thrust directions are free and chosen together. Every program starts from the same impulsive
transfer and must reach the known optimum. See README.md.
"""

import math
import sys
import time

import findings
from common import STRATEGIES, STATUS, STOCK, SUCCESS, built, casadi, numpy, output
from common.injection import Injection, guess

try:
    import scipy
    from scipy.integrate import DOP853, ode, solve_ivp
    from scipy.optimize import root
except ImportError:
    print("skipped: scipy is not installed (pip install scipy)")
    sys.exit(0)

# Propellant in kg by burns: indirect shooting and, independently, collocation, which agree to 2e-8 kg.
OPTIMA = {2: 15750.24733606, 3: 15565.67240267, 5: 15510.09993700}
LARGEST_ERROR = 1e-3
# What grids of fixed steps or points are made fine enough for, kg: one mesh of our own as coarse as theirs is held against the first,
# methods that choose their meshes or steps against the second, which is more than they are off.
GRID_ERRORS = (1e-4, 1e-7)
TOLERANCE = 1e-9
METHODS = ("radau", "multiple-shooting", "indirect")


class Scipy:
    """Pontryagin's conditions by DOP853 and MINPACK's hybrid method with differences.

    States p, f, g, L and their costates; the mass follows from the time spent on burns, whose costate comes last. The
    cost is that time. Unknowns: costates of p, f, g and time at the start, durations, and the longitudes of all
    ignitions but the first. Conditions: the switching function is zero at each ignition, the costate of L at each
    cut-off (at the last one by symmetry), the target is met, and the costate of time ends at zero.
    """

    rtol = 1e-10

    def __init__(self, injection, compiled):
        self.injection, self.compiled = injection, compiled
        self.build_ms, self.size = 0.0, 2 * injection.burns + 3

    def rate(self, y, begin, duration, t):
        """Per unit of t, which goes from 0 to 1 in a burn. Plain numbers: nine are too few for arrays to pay."""
        p, f, g, longitude, lp, lf, lg, ll, _ = y.tolist()
        flow = self.injection.flow
        mass = 1.0 - flow * (begin + duration * t)
        push = duration * self.injection.acceleration / mass
        sin, cos, q = math.sin(longitude), math.cos(longitude), math.sqrt(p)
        w = 1.0 + f * cos + g * sin
        x, z = lf * sin - lg * cos, lf * cos + lg * sin
        k = (2.0 * p * lp + lf * f + lg * g + z) / w
        radial, transverse = q * x, q * (k + z)
        size = math.sqrt(radial * radial + transverse * transverse)
        ar, at = -push * radial / size, -push * transverse / size
        n = duration * w / (p * q)
        v, u = q * at / w, ll * n
        return (
            2.0 * p * v,
            q * ar * sin + v * ((w + 1.0) * cos + f),
            -q * ar * cos + v * ((w + 1.0) * sin + g),
            n * w,
            1.5 * u * w / p - (ar * radial + at * transverse) / (2.0 * p) - 2.0 * lp * v,
            v * (k * cos - lf) - 2.0 * u * cos,
            v * (k * sin - lg) - 2.0 * u * sin,
            v * (x * (1.0 + w) + k * (g * cos - f * sin)) - q * ar * z - 2.0 * u * (g * cos - f * sin),
            push * flow / mass * size,
        )

    def burn(self, y, begin, duration):
        """To the end of a burn."""

        def rate(t, y):
            return self.rate(y, begin, duration, t)

        if self.compiled:
            integrator = ode(rate).set_integrator("dop853", rtol=self.rtol, atol=self.rtol, nsteps=10000)
            return integrator.set_initial_value(y).integrate(1.0)
        return solve_ivp(rate, (0.0, 1.0), y, method="DOP853", rtol=self.rtol, atol=self.rtol).y[:, -1]

    def switching(self, y, begin):
        p, f, g, longitude, lp, lf, lg, _, lt = y.tolist()
        sin, cos = math.sin(longitude), math.cos(longitude)
        z = lf * cos + lg * sin
        transverse = (2.0 * p * lp + lf * f + lg * g + z) / (1.0 + f * cos + g * sin) + z
        push = self.injection.acceleration / (1.0 - self.injection.flow * begin)
        return 1.0 + lt - push * math.sqrt(p) * math.hypot(lf * sin - lg * cos, transverse)

    def residuals(self, x):
        burns = self.injection.burns
        y = numpy.array([1.0, 0.0, 0.0, 0.0, x[0], x[1], x[2], 0.0, x[3]])
        begin, rows = 0.0, []
        for k in range(burns):
            if k:
                rows.append(y[7])
                y[3], y[7] = x[3 + burns + k], 0.0
            rows.append(self.switching(y, begin))
            duration = float(x[4 + k])
            y = self.burn(y, begin, duration)
            begin += duration
        return numpy.array([*rows, y[0] - self.injection.radius, y[1], y[2], y[8]])

    def build(self):
        pass

    def solve(self):
        clock = time.process_time()
        start = guess(self.injection)
        unknowns = [*start.costates, *start.durations, *start.longitudes[1:]]
        found = root(self.residuals, unknowns, method="hybr", options={"xtol": TOLERANCE})
        elapsed = 1e3 * (time.process_time() - clock)
        durations = found.x[4 : 4 + self.injection.burns]
        return elapsed, found.nfev, self.injection.propellant(durations), found.success


class Shooting:
    """The same conditions by CasADi: costate equations and Jacobian by its derivatives, Newton's method.

    Fixed steps of DOP853's eighth order. The Jacobian of a burn is one function, so that it is built once; those of
    all burns are multiplied.
    """

    def __init__(self, injection, steps):
        self.injection, self.steps, self.size = injection, steps, 2 * injection.burns + 3

    def build(self):
        clock = time.process_time()
        acceleration, flow = self.injection.acceleration, self.injection.flow
        y, mass = casadi.SX.sym("y", 8), casadi.SX.sym("m")
        p, f, g, longitude, lp, lf, lg, ll = casadi.vertsplit(y)
        sin, cos, q = casadi.sin(longitude), casadi.cos(longitude), casadi.sqrt(p)
        w, z = 1 + f * cos + g * sin, lf * cos + lg * sin
        transverse = (2 * p * lp + lf * f + lg * g + z) / w + z
        size = q * casadi.sqrt((lf * sin - lg * cos) ** 2 + transverse**2)
        gradient = casadi.gradient(ll * q * (w / p) ** 2 - acceleration / mass * size, y)
        rate = casadi.vertcat(gradient[4:], -gradient[:4], acceleration * flow / mass**2 * size)
        rate = casadi.Function("rate", [y, mass], [rate])
        # Nine components and the time since the first ignition without coasts.
        state, step = casadi.SX.sym("z", 10), casadi.SX.sym("h")
        stages = []
        for row, fraction in zip(DOP853.A, DOP853.C):
            past = sum((step * a * k[:8] for a, k in zip(row, stages) if a), casadi.SX(8, 1))
            stages.append(rate(state[:8] + past, 1 - flow * (state[9] + fraction * step)))
        change = sum(b * k for b, k in zip(DOP853.B, stages) if b)
        end = casadi.Function("step", [state, step], [state + step * casadi.vertcat(change, 1)])
        inputs = casadi.MX.sym("x", 11)
        end = end.fold(self.steps)(inputs[:10], casadi.repmat(inputs[10] / self.steps, 1, self.steps))
        self.burn = casadi.Function("burn", [inputs], [end, casadi.jacobian(end, inputs)])
        size = casadi.Function("size", [y], [size])(state[:8])
        switching = 1 + state[8] - acceleration / (1 - flow * state[9]) * size
        self.switching = casadi.Function("switching", [state], [switching, casadi.gradient(switching, state)])
        self.build_ms = 1e3 * (time.process_time() - clock)

    def residuals(self, x):
        """With their Jacobian."""
        burns, size = self.injection.burns, self.size
        z, dz = numpy.zeros(10), numpy.zeros((10, size))
        z[0], z[[4, 5, 6, 8]], dz[[4, 5, 6, 8], range(4)] = 1.0, x[:4], 1.0
        rows, jacobian = [], []
        for k in range(burns):
            if k:
                rows.append(z[7])
                jacobian.append(dz[7].copy())
                z[3], z[7], dz[3], dz[7] = x[3 + burns + k], 0.0, 0.0, 0.0
                dz[3, 3 + burns + k] = 1.0
            value, slope = self.switching(z)
            rows.append(float(value))
            jacobian.append(slope.full().ravel() @ dz)
            z, slope = (v.full() for v in self.burn(numpy.append(z, x[4 + k])))
            z, dz = z.ravel(), slope[:, :10] @ dz
            dz[:, 4 + k] += slope[:, 10]
        rows += [z[0] - self.injection.radius, z[1], z[2], z[8]]
        return numpy.array(rows), numpy.vstack([*jacobian, dz[[0, 1, 2, 8]]])

    def solve(self):
        clock = time.process_time()
        start = guess(self.injection)
        x = numpy.array([*start.costates, *start.durations, *start.longitudes[1:]])
        for iteration in range(1, 21):
            rows, jacobian = self.residuals(x)
            change = numpy.linalg.solve(jacobian, rows)
            x -= change
            # Steps shrink quadratically: the next one would be below the tolerance.
            converged = numpy.max(numpy.abs(change)) < math.sqrt(TOLERANCE)
            if converged:
                break
        elapsed = 1e3 * (time.process_time() - clock)
        return elapsed, iteration, self.injection.propellant(x[4 : 4 + self.injection.burns]), converged


class Collocation:
    """States at Radau points by CasADi and Ipopt, one interval per burn."""

    def __init__(self, injection, points, settings, bounds, expand):
        self.injection, self.points, self.bounds, self.expand = injection, points, bounds, expand
        self.options = {f"ipopt.{k}": v for k, v in (STOCK | {"tol": TOLERANCE} | settings).items()}
        self.options |= {"expand": expand, "print_time": False, "record_time": True}

    def rate(self):
        """Equations of motion: p, f, g, L, mass, and the angle of the thrust above the local horizontal."""
        z = casadi.SX.sym("z", 6)
        p, f, g, longitude, mass, angle = casadi.vertsplit(z)
        sin, cos, q = casadi.sin(longitude), casadi.cos(longitude), casadi.sqrt(p)
        w = 1 + f * cos + g * sin
        push = self.injection.acceleration / mass * q
        ar, at = push * casadi.sin(angle), push * casadi.cos(angle) / w
        rates = (
            2 * p * at,
            ar * sin + at * ((w + 1) * cos + f),
            -ar * cos + at * ((w + 1) * sin + g),
            (w / p) ** 2 * q,
            -self.injection.flow,
        )
        return casadi.Function("rate", [z], [casadi.vertcat(*rates)])

    def build(self):
        """Elements and mass are continuous from burn to burn, the longitude of each ignition is free."""
        clock = time.process_time()
        start, radius, points = guess(self.injection), self.injection.radius, self.points
        fractions, matrix = radau(points)
        matrix = casadi.DM(matrix.T)
        rate = self.rate().map(points)
        shortest = 1.0 / self.injection.seconds if self.bounds else -numpy.inf
        variables, x0, lower, upper, rows, row_lower, row_upper = [], [], [], [], [], [], []

        def add(variable, values, low, high):
            variables.append(casadi.vec(variable))
            for part, value in zip((x0, lower, upper), (values, low, high)):
                part.append(numpy.broadcast_to(value, variable.shape).ravel(order="F"))

        def row(expression, low, high):
            rows.append(casadi.vec(expression))
            row_lower.append(numpy.full(rows[-1].numel(), low))
            row_upper.append(numpy.full(rows[-1].numel(), high))

        mass, end = 1.0, None
        for k, duration in enumerate(start.durations):
            grid, time_ = casadi.MX.sym(f"z{k}", 6, points), casadi.MX.sym(f"t{k}")
            values = numpy.zeros((6, points))
            ends = [
                (p, e * math.cos(start.perigee), e * math.sin(start.perigee)) for p, e in start.orbits[k : k + 2]
            ]
            ends[0] += (start.longitudes[k], mass)
            mass -= self.injection.flow * duration
            ends[1] += (start.longitudes[k] + start.swept[k], mass)
            begin_values, end_values = (numpy.array(v)[:, None] for v in ends)
            values[:5] = begin_values + (end_values - begin_values) * fractions[1:]
            low, high = numpy.full((6, points), -numpy.inf), numpy.full((6, points), numpy.inf)
            if self.bounds:
                # Those of the mission: they keep iterates on orbits.
                low[0], low[4], high[4] = 0.1, self.injection.dry_mass, 1.1
                low[5], high[5] = -math.pi, math.pi
            if k + 1 == self.injection.burns:
                low[:3, -1] = high[:3, -1] = values[:3, -1] = radius, 0.0, 0.0
            if k == 0:
                begin = casadi.DM([1.0, 0.0, 0.0, 0.0, 1.0])
            else:
                ignition = casadi.MX.sym(f"l{k}")
                add(ignition, start.longitudes[k], -numpy.inf, numpy.inf)
                if self.bounds:
                    # As in the mission: burns at the same apsis are apart.
                    same = k + 1 < self.injection.burns
                    row(ignition - end[3], 0.5 * math.pi if same else 0.0, numpy.inf)
                begin = casadi.vertcat(end[:3], ignition, end[4])
            add(time_, duration, shortest, numpy.inf)
            add(grid, values, low, high)
            states = casadi.horzcat(begin, grid[:5, :])
            row(casadi.mtimes(states, matrix) - time_ * rate(grid), 0.0, 0.0)
            end = grid[:5, -1]
        x = casadi.vertcat(*variables)
        nlp = {"x": x, "f": -end[4], "g": casadi.vertcat(*rows)}
        self.solver = casadi.nlpsol("peer", "ipopt", nlp, self.options)
        names = ("x0", "lbx", "ubx", "lbg", "ubg")
        parts = (x0, lower, upper, row_lower, row_upper)
        self.arguments = {name: numpy.concatenate(part) for name, part in zip(names, parts)}
        self.size = x.numel()
        self.build_ms = 1e3 * (time.process_time() - clock)

    def solve(self):
        solution = self.solver(**self.arguments)
        stats = self.solver.stats()
        status = STATUS.get(stats["return_status"], stats["return_status"])
        propellant = self.injection.kilograms * (1.0 + float(solution["f"]))
        return 1e3 * stats["t_proc_total"], stats["iter_count"], propellant, status in SUCCESS


def radau(points):
    """Radau points of (0, 1] after 0, and the matrix of derivatives at them: points x (points + 1)."""
    legendre = numpy.polynomial.legendre
    nodes = numpy.sort(-legendre.legroots([0.0] * (points - 1) + [1.0, 1.0]).real)
    nodes[-1] = 1.0
    support = 0.5 * (numpy.append(-1.0, nodes) + 1.0)
    gaps = support[:, None] - support[None, :]
    numpy.fill_diagonal(gaps, 1.0)
    weights = 1.0 / gaps.prod(axis=1)
    matrix = weights[None, :] / weights[:, None] / gaps
    numpy.fill_diagonal(matrix, 0.0)
    numpy.fill_diagonal(matrix, -matrix.sum(axis=1))
    return support, matrix[1:]


class Apsides:
    """Calls of the program `geo`, some in a row."""

    build_ms = size = None

    def __init__(self, command):
        self.command = command

    def build(self):
        pass

    def solve(self):
        run = output(*self.command)
        self.size = run["variables"]
        self.build_ms = (min(run["load_us"]) + min(run["build_us"])) / 1e3
        self.call_ms = min(run["call_us"]) / 1e3
        return min(run["solve_us"]) / 1e3, run["iterations"], run["propellant_kg"], True


class Entry:
    """All runs of one program; times are the least ones. The grid errors that it is held against are those of its peers."""

    def __init__(self, kind, label, program, grid_errors):
        self.kind, self.label, self.program, self.grid_errors = kind, label, program, grid_errors
        self.build_ms = self.solve_ms = self.call_ms = math.inf

    def run(self, repeat):
        self.program.build()
        for _ in range(repeat):
            elapsed, self.iterations, self.propellant, success = self.program.solve()
            assert success, f"{self.label} fails"
            self.solve_ms = min(self.solve_ms, elapsed)
        self.build_ms = min(self.build_ms, self.program.build_ms)
        self.call_ms = min(self.call_ms, getattr(self.program, "call_ms", math.inf))

    @property
    def total_ms(self):
        return self.build_ms + self.solve_ms


def coarsest(make, optimum, error, sizes):
    """The least size of a grid whose optimum is exact to an error."""
    for size in sizes:
        program = make(size)
        program.build()
        _, _, propellant, success = program.solve()
        if success and abs(propellant - optimum) < error:
            return size
    raise AssertionError(f"no grid up to {sizes[-1]} is fine enough")


def compare(program, burns, methods, arguments):
    """Entries of all programs, after they took turns."""
    call = [program, f"geo-{burns}-burn", "--repeat", arguments.repeat]
    injection = Injection.read(output(program, call[1])["mission_file"])

    def ipopt(points, strategy="monotone", bounds=True, expand=True):
        return Collocation(injection, points, STRATEGIES[strategy], bounds, expand)

    entries = [
        Entry("SciPy", "SciPy solve_ivp", Scipy(injection, compiled=False), GRID_ERRORS),
        Entry("SciPy", "SciPy ode", Scipy(injection, compiled=True), GRID_ERRORS),
    ]
    for error in GRID_ERRORS:
        points = coarsest(lambda n: ipopt(n, bounds=False), OPTIMA[burns], error, range(4, 20))
        steps = coarsest(lambda n: Shooting(injection, n), OPTIMA[burns], error, range(1, 20))
        same = ["intervals=1", f"points={points}", "max_refinements=0", f"nlp_tolerance={TOLERANCE}"]
        same = [word for key in same for word in ("--set", f"radau.{key}")]
        on = f"{points} points"
        entries += [
            Entry("shooting", f"CasADi, {steps} steps", Shooting(injection, steps), (error,)),
            Entry("Ipopt", f"Ipopt monotone, {on}", ipopt(points), (error,)),
            Entry("Ipopt", f"Ipopt adaptive, {on}", ipopt(points, "quality"), (error,)),
            Entry("Ipopt", f"Ipopt without bounds, {on}", ipopt(points, bounds=False), (error,)),
            Entry("Ipopt", f"the same, not expanded, {on}", ipopt(points, bounds=False, expand=False), (error,)),
            Entry("apsides", f"radau, {on}", Apsides([*call, "--method", "radau", *same]), (error,)),
        ]
    finest = GRID_ERRORS[-1:]
    entries += [Entry("apsides", method, Apsides([*call, "--method", method]), finest) for method in methods]
    for _ in range(arguments.turns):
        for entry in entries:
            # The calls of apsides repeat by themselves.
            entry.run(1 if entry.kind == "apsides" else arguments.repeat)
    for entry in entries:
        error = abs(entry.propellant - OPTIMA[burns])
        assert error < LARGEST_ERROR, f"{entry.label}: {entry.propellant} kg, not {OPTIMA[burns]}"
    return entries


def rivals(own, kind, entries):
    """Programs of a kind whose grids are as fine as one of our own asks for."""
    return [e for e in entries if e.kind == kind and set(own.grid_errors) <= set(e.grid_errors)]


COLUMNS = (
    ("burns", 5), ("program", 33), ("size", 5), ("iterations", 10), ("build ms", 9), ("solve ms", 9), ("both", 9),
    ("certified", 9), ("error kg", 9),
)
KINDS = ("SciPy", "shooting", "Ipopt")


def line(*cells):
    return " ".join(f"{cell:>{width}}" for cell, (_, width) in zip(cells, COLUMNS))


def report(burns, entries):
    for e in entries:
        label = f"apsides {e.label}" if e.kind == "apsides" else e.label
        certified = f"{e.call_ms:.2f}" if math.isfinite(e.call_ms) else ""
        print(
            line(
                burns, label, e.program.size, e.iterations, f"{e.build_ms:.2f}", f"{e.solve_ms:.2f}",
                f"{e.total_ms:.2f}", certified, f"{e.propellant - OPTIMA[burns]:.1e}",
            )
        )
    sys.stdout.flush()


def ratios(results):
    """How many times longer the fastest program of each kind takes than apsides."""
    print(f"{'burns':>5} {'apsides':>18} " + " ".join(f"{kind:>8} {'solve':>6}" for kind in KINDS))
    for burns, entries in results.items():
        for own in (e for e in entries if e.kind == "apsides"):
            cells = []
            for kind in KINDS:
                others = rivals(own, kind, entries)
                total, solve = min(e.total_ms for e in others), min(e.solve_ms for e in others)
                cells.append(f"{total / own.total_ms:8.2f} {solve / own.solve_ms:6.2f}")
            print(f"{burns:>5} {own.label:>18} " + " ".join(cells))


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--burns", type=int, nargs="+", choices=OPTIMA, default=list(OPTIMA))
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=None, help="of apsides; all that it has")
    parser.add_argument("--turns", type=int, default=5, help="turns of each program")
    parser.add_argument("--repeat", type=int, default=10, help="solves per turn")
    parser.add_argument("--program", default=None, help="the built program `geo`")
    arguments = parser.parse_args()
    program = arguments.program or built("geo")
    known = output(program, "--methods")
    methods = arguments.methods or [m for m in METHODS if m in known]
    print(f"CasADi {casadi.__version__}, SciPy {scipy.__version__}. Times: least of all runs; both: build and solve;")
    print("certified: with the whole flight and its certificate. Iterations of SciPy: calls of the residuals.")
    print(line(*(name for name, _ in COLUMNS)))
    results = {}
    for burns in arguments.burns:
        results[burns] = compare(program, burns, methods, arguments)
        report(burns, results[burns])
    found = findings.Findings(
        "Injection into geostationary orbit",
        "Solves alone, beside the fastest program of each kind. The peers' grids are the coarsest that are exact to 1e-4 kg beside one mesh as coarse, and to 1e-7 kg beside another and beside methods that refine meshes or choose steps; they are found with the known optimum.",
    )
    for burns, entries in results.items():
        for own in (e for e in entries if e.kind == "apsides"):
            for kind in KINDS:
                rival = min(rivals(own, kind, entries), key=lambda e: e.solve_ms)
                errors = " and ".join(f"{abs(e.propellant - OPTIMA[burns]):.0e}" for e in (own, rival))
                found.add(f"{burns} burns, {own.label}", rival.label, own.solve_ms, rival.solve_ms, f"propellant off by {errors} kg")
    findings.write(arguments.findings, found)
    print("Time of the fastest other program of each kind / time of apsides: build and solve, solve alone.")
    ratios(results)


if __name__ == "__main__":
    main()
