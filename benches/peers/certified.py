"""Trajectories of CasADi, dymos and OpenSCvx for problems of the gallery, as files that `apsides certify` judges.

    pip install casadi==3.8.2 dymos==1.15.1 openscvx==0.5.2
    python3 benches/peers/certified.py                  # writes benches/peers/certified/*.csv anew
    apsides certify van_der_pol benches/peers/certified/casadi_van_der_pol.csv

Each program is used as its own documentation shows it. A program that is not installed is named and left out.
"""

import argparse
import csv
import pathlib

import numpy as np

HERE = pathlib.Path(__file__).parent / "certified"

# m/s2, that of the gallery and of dymos' example.
GRAVITY = 9.80665


def write(name, columns, rows):
    with open(HERE / name, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(columns)
        table.writerows([repr(float(value)) for value in row] for row in rows)


def casadi_van_der_pol():
    """Multiple shooting with 100 constant controls, Runge-Kutta of fourth order and Ipopt."""
    import casadi as ca

    segments, end = 100, 5.0
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
    rate = ca.vertcat((1 - x[1] ** 2) * x[0] - x[1] + u, x[0])
    system = {"x": x, "p": u, "ode": rate, "quad": x[0] ** 2 + x[1] ** 2 + u**2}
    step = ca.integrator("step", "rk", system, 0, end / segments, {"number_of_finite_elements": 4})
    opti = ca.Opti()
    states, controls = opti.variable(2, segments + 1), opti.variable(1, segments)
    cost = 0
    for k in range(segments):
        after = step(x0=states[:, k], p=controls[k])
        opti.subject_to(states[:, k + 1] == after["xf"])
        cost += after["qf"]
    opti.subject_to(opti.bounded(-0.3, controls, 1))
    opti.subject_to(states[:, 0] == ca.DM([0, 1]))
    opti.minimize(cost)
    opti.solver("ipopt", {"ipopt.print_level": 0, "print_time": 0})
    solution = opti.solve()
    states, controls = solution.value(states), solution.value(controls)
    times = np.linspace(0, end, segments + 1)
    # The last sample has no segment of its own.
    write("casadi_van_der_pol.csv", ["time", "x1", "x2", "u"], zip(times, *states, [*controls, controls[-1]]))


def dymos_brachistochrone():
    """The example of dymos, on 15 Radau segments of order 5 with SLSQP."""
    import dymos as dm
    import openmdao.api as om
    from dymos.examples.brachistochrone.brachistochrone_ode import BrachistochroneODE

    problem = om.Problem(model=om.Group())
    problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-12, maxiter=500)
    problem.driver.options["disp"] = False
    problem.driver.declare_coloring()
    phase = dm.Phase(ode_class=BrachistochroneODE, transcription=dm.Radau(num_segments=15, order=5))
    problem.model.add_subsystem("traj", dm.Trajectory()).add_phase("phase0", phase)
    phase.set_time_options(fix_initial=True, duration_bounds=(0.5, 10))
    phase.add_state("x", fix_initial=True, fix_final=True)
    phase.add_state("y", fix_initial=True, fix_final=True)
    phase.add_state("v", fix_initial=True)
    phase.add_control("theta", units="deg", lower=0.01, upper=179.9)
    phase.add_parameter("g", units="m/s**2", val=GRAVITY, opt=False)
    phase.add_objective("time", loc="final")
    problem.setup()
    phase.set_time_val(0, 2)
    phase.set_state_val("x", [0, 10])
    phase.set_state_val("y", [10, 5])
    phase.set_state_val("v", [0, 9.9])
    phase.set_control_val("theta", [5, 100.5])
    dm.run_problem(problem, simulate=False)
    units = {"time": "s", "x": "m", "y": "m", "v": "m/s", "theta": "rad"}
    series = [problem.get_val(f"traj.phase0.timeseries.{name}", units=unit).ravel() for name, unit in units.items()]
    # Segments write their common ends twice.
    kept = np.append(np.diff(series[0]) > 1e-12, True)
    write("dymos_brachistochrone.csv", ["time", "x", "y", "v", "angle"], zip(*(s[kept] for s in series)))


def openscvx_brachistochrone():
    """The example of OpenSCvx on 20 nodes in double precision, with its default weights and tolerances."""
    import openscvx as ox

    nodes = 20
    position = ox.State("position", shape=(2,))
    position.min, position.max = [0.0, 0.0], [10.0, 10.0]
    position.initial, position.final = [0.0, 10.0], [10.0, 5.0]
    velocity = ox.State("velocity", shape=(1,))
    velocity.min, velocity.max = [0.0], [20.0]
    velocity.initial, velocity.final = [0.0], [ox.Free(9.9)]
    theta = ox.Control("theta", shape=(1,))
    theta.min, theta.max = [0.0], [np.pi]
    theta.guess = np.linspace(0.09, 1.755, nodes).reshape(-1, 1)
    dynamics = {
        "position": ox.Concat(velocity * ox.Sin(theta), -velocity * ox.Cos(theta)),
        "velocity": GRAVITY * ox.Cos(theta),
    }
    constraints = []
    for state in (position, velocity):
        constraints += [ox.ctcs(state <= state.max), ox.ctcs(state.min <= state)]
    problem = ox.Problem(
        dynamics=dynamics,
        constraints=constraints,
        states=[position, velocity],
        controls=[theta],
        time=ox.Time(initial=0.0, final=ox.Minimize(2.0), min=0.0, max=3.0),
        N=nodes,
        float_dtype="float64",
    )
    problem.initialize()
    problem.solve()
    flown = problem.post_process().trajectory
    times = flown["time"].ravel()
    kept = np.append(np.diff(times) > 1e-9, True)
    columns = [times, *flown["position"].T, flown["velocity"].ravel(), flown["theta"].ravel()]
    write("openscvx_brachistochrone.csv", ["time", "x", "y", "v", "angle"], zip(*(c[kept] for c in columns)))


def main():
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    HERE.mkdir(exist_ok=True)
    for make in (casadi_van_der_pol, dymos_brachistochrone, openscvx_brachistochrone):
        try:
            make()
        except ImportError as missing:
            print(f"{make.__name__}: left out, {missing.name} is not installed")


if __name__ == "__main__":
    main()
