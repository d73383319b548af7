"""Tutorial problems of dymos and CasADi as their tutorials solve them, and in this package: lines, time and accuracy.

    pip install dymos casadi
    python3 python/benches/side_by_side.py

Each problem is a function for each package; its lines are counted without its blank ones. The time is the least of `--turns` calls of the function,
statement included, without the import; the functions of this package leave the certificate out of it. The error is the relative difference of the
objective from the optimum: of the brachistochrone the cycloid (Johann Bernoulli, 1696), of the others that of this package on a mesh for 1e-10. What is
not installed is left out.
"""

import argparse
import contextlib
import importlib.util
import inspect
import io
import os
import tempfile
import time
import warnings

import numpy as np

import apsides

#: The time of the cycloid from (0, 10) to (10, 5) m with 9.80665 m/s2.
CYCLOID = 1.8016031224530815


def brachistochrone(**settings):
    p = apsides.Problem("brachistochrone")
    ph = p.phase("slide", duration=(0.5, 10))
    x = ph.state("x", unit="m", start=0, end=10)
    y = ph.state("y", unit="m", start=10, end=5)
    v = ph.state("v", unit="m/s", start=0)
    theta = ph.control("theta", unit="deg", lower=0.01, upper=179.9)
    ph.dynamics(x=v * np.sin(theta), y=-v * np.cos(theta), v=9.80665 * np.cos(theta))
    ph.guess([0, 2], v=[0, 9.9])
    p.minimize(ph.final_time)
    return p.solve(**settings)


def brachistochrone_of_dymos():
    # Tutorial "The brachistochrone" of dymos.
    import dymos as dm
    import openmdao.api as om

    class BrachistochroneODE(om.ExplicitComponent):
        def initialize(self):
            self.options.declare("num_nodes", types=int)

        def setup(self):
            nn = self.options["num_nodes"]
            self.add_input("v", val=np.zeros(nn), units="m/s")
            self.add_input("theta", val=np.ones(nn), units="rad")
            self.add_input("g", val=np.full(nn, 9.80665), units="m/s**2")
            self.add_output("xdot", val=np.zeros(nn), units="m/s")
            self.add_output("ydot", val=np.zeros(nn), units="m/s")
            self.add_output("vdot", val=np.zeros(nn), units="m/s**2")
            rows = np.arange(nn)
            self.declare_partials("vdot", ["g", "theta"], rows=rows, cols=rows)
            self.declare_partials("xdot", ["v", "theta"], rows=rows, cols=rows)
            self.declare_partials("ydot", ["v", "theta"], rows=rows, cols=rows)

        def compute(self, inputs, outputs):
            v, theta, g = inputs["v"], inputs["theta"], inputs["g"]
            outputs["vdot"] = g * np.cos(theta)
            outputs["xdot"] = v * np.sin(theta)
            outputs["ydot"] = -v * np.cos(theta)

        def compute_partials(self, inputs, partials):
            v, theta, g = inputs["v"], inputs["theta"], inputs["g"]
            partials["vdot", "g"] = np.cos(theta)
            partials["vdot", "theta"] = -g * np.sin(theta)
            partials["xdot", "v"] = np.sin(theta)
            partials["xdot", "theta"] = v * np.cos(theta)
            partials["ydot", "v"] = -np.cos(theta)
            partials["ydot", "theta"] = v * np.sin(theta)

    p = om.Problem(model=om.Group(), reports=False)
    p.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", disp=False)
    p.driver.declare_coloring()
    traj = p.model.add_subsystem("traj", dm.Trajectory())
    phase = dm.Phase(ode_class=BrachistochroneODE, transcription=dm.GaussLobatto(num_segments=10))
    traj.add_phase("phase0", phase)
    phase.set_time_options(fix_initial=True, duration_bounds=(0.5, 10))
    phase.add_state("x", rate_source="xdot", units="m", fix_initial=True, fix_final=True)
    phase.add_state("y", rate_source="ydot", units="m", fix_initial=True, fix_final=True)
    phase.add_state("v", rate_source="vdot", targets=["v"], units="m/s", fix_initial=True)
    phase.add_control("theta", targets=["theta"], units="deg", rate_continuity=False, lower=0.01, upper=179.9)
    phase.add_parameter("g", targets=["g"], units="m/s**2", val=9.80665, opt=False)
    phase.add_objective("time", loc="final")
    p.setup()
    phase.set_time_val(initial=0.0, duration=2.0)
    phase.set_state_val("x", [0, 10])
    phase.set_state_val("y", [10, 5])
    phase.set_state_val("v", [0, 9.9])
    phase.set_control_val("theta", [5, 100.5])
    p.run_driver()
    return float(p.get_val("traj.phase0.timeseries.time")[-1, 0])


def race_car(**settings):
    p = apsides.Problem("race car")
    ph = p.phase("race", duration="free")
    position, speed = ph.state("position", start=0, end=1), ph.state("speed", start=0)
    throttle = ph.control("throttle", lower=0, upper=1)
    ph.dynamics(position=speed, speed=throttle - speed)
    ph.path(speed <= 1 - np.sin(2 * np.pi * position) / 2)
    p.minimize(ph.duration)
    return p.solve(**settings)


def race_car_of_casadi():
    # The example race_car of CasADi's documentation: multiple shooting by one step of Runge-Kutta in each of 100 intervals.
    import casadi as ca

    N = 100
    opti = ca.Opti()
    X = opti.variable(2, N + 1)
    pos, speed = X[0, :], X[1, :]
    U = opti.variable(1, N)
    T = opti.variable()
    opti.minimize(T)
    f = lambda x, u: ca.vertcat(x[1], u - x[1])  # noqa: E731
    dt = T / N
    for k in range(N):
        k1 = f(X[:, k], U[:, k])
        k2 = f(X[:, k] + dt / 2 * k1, U[:, k])
        k3 = f(X[:, k] + dt / 2 * k2, U[:, k])
        k4 = f(X[:, k] + dt * k3, U[:, k])
        opti.subject_to(X[:, k + 1] == X[:, k] + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    limit = lambda pos: 1 - ca.sin(2 * ca.pi * pos) / 2  # noqa: E731
    opti.subject_to(speed <= limit(pos))
    opti.subject_to(opti.bounded(0, U, 1))
    opti.subject_to(pos[0] == 0)
    opti.subject_to(speed[0] == 0)
    opti.subject_to(pos[-1] == 1)
    opti.subject_to(T >= 0)
    opti.set_initial(speed, 1)
    opti.set_initial(T, 1)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    return float(opti.solve().value(T))


def van_der_pol(**settings):
    p = apsides.Problem("van der pol")
    ph = p.phase("damp", duration=10)
    x1, x2 = ph.state("x1", start=0, lower=-0.25), ph.state("x2", start=1)
    u = ph.control("u", lower=-1, upper=1)
    ph.dynamics(x1=(1 - x2**2) * x1 - x2 + u, x2=x1)
    p.minimize(ph.integral(x1**2 + x2**2 + u**2))
    return p.solve(**settings)


def van_der_pol_of_casadi():
    # The example direct_collocation of CasADi: degree 3, 20 intervals of constant control.
    import casadi as ca

    d, N, T = 3, 20, 10.0
    tau = np.append(0, ca.collocation_points(d, "legendre"))
    C, D, B = np.zeros((d + 1, d + 1)), np.zeros(d + 1), np.zeros(d + 1)
    for j in range(d + 1):
        p = np.poly1d([1])
        for r in range(d + 1):
            if r != j:
                p *= np.poly1d([1, -tau[r]]) / (tau[j] - tau[r])
        D[j] = p(1.0)
        C[j] = np.polyder(p)(tau)
        B[j] = np.polyint(p)(1.0)
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
    xdot = ca.vertcat((1 - x[1] ** 2) * x[0] - x[1] + u, x[0])
    f = ca.Function("f", [x, u], [xdot, x[0] ** 2 + x[1] ** 2 + u**2])
    h, opti, J = T / N, ca.Opti(), 0
    Xk = opti.variable(2)
    opti.subject_to(Xk == [0, 1])
    for k in range(N):
        Uk = opti.variable()
        opti.subject_to(opti.bounded(-1, Uk, 1))
        Xc = [opti.variable(2) for _ in range(d)]
        end = D[0] * Xk
        for j in range(1, d + 1):
            opti.subject_to(Xc[j - 1][0] >= -0.25)
            xp = C[0, j] * Xk
            for r in range(d):
                xp = xp + C[r + 1, j] * Xc[r]
            fj, qj = f(Xc[j - 1], Uk)
            opti.subject_to(h * fj == xp)
            end = end + D[j] * Xc[j - 1]
            J = J + B[j] * qj * h
        Xk = opti.variable(2)
        opti.subject_to(Xk == end)
        opti.subject_to(Xk[0] >= -0.25)
    opti.minimize(J)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    return float(opti.solve().value(J))


CASES = [
    (brachistochrone, brachistochrone_of_dymos, "dymos", CYCLOID),
    (race_car, race_car_of_casadi, "casadi", None),
    (van_der_pol, van_der_pol_of_casadi, "casadi", None),
]


def lines(function):
    return sum(bool(line.strip()) for line in inspect.getsource(function).splitlines())


def of_ours(function):
    begin = time.perf_counter()
    solution = function()
    return solution.objective, (time.perf_counter() - begin) * 1e3 - solution.summary["timing_ms"]["verify"]


def of_theirs(function):
    begin = time.perf_counter()
    # Their programs print.
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        objective = function()
    return objective, (time.perf_counter() - begin) * 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=3)
    turns = parser.parse_args().turns
    with tempfile.TemporaryDirectory() as folder:
        # OpenMDAO writes files.
        os.environ.update(OPENMDAO_REPORTS="0", OPENMDAO_WORKDIR=folder)
        compare(turns)


def compare(turns):
    print("| problem | by | lines | ms | objective | error |\n| --- | --- | ---: | ---: | ---: | ---: |")
    for ours, theirs, package, optimum in CASES:
        if optimum is None:
            optimum = ours(tolerance=1e-10).objective
        rows = [("apsides", ours, of_ours)]
        if importlib.util.find_spec(package):
            rows.append((package, theirs, of_theirs))
        for by, function, measure in rows:
            found = [measure(function) for _ in range(turns)]
            objective, least = found[0][0], min(ms for _, ms in found)
            print(f"| {ours.__name__} | {by} | {lines(function)} | {least:.1f} | {objective:.9g} | {abs(objective / optimum - 1):.1e} |", flush=True)


if __name__ == "__main__":
    main()
