//! Powered descents by lossless convexification: one conic program at a given flight time, and a divert decision.

use std::io::{Write, stdout};

use apsides_benches::CpuTime;
use apsides_benches::landing::Failure;
use apsides_convex::{
    DescentLimits, DescentProblem, DescentSettings, DescentSolver, DivertPlanner, DivertSettings, Outcome,
};
use clap::{Parser, Subcommand};
use serde::Serialize;

/// Powered descents by lossless convexification.
#[derive(Debug, Parser)]
#[command(name = "convex")]
struct Arguments {
    #[command(subcommand)]
    which: Which,
}

#[derive(Clone, Debug, Subcommand)]
enum Which {
    /// One descent on Mars at a given flight time with one pass, as JSON.
    Descent {
        /// Intervals.
        #[arg(long)]
        intervals: usize,
        /// Intervals per block of eliminated states.
        #[arg(long, default_value_t = DescentSettings::default().block)]
        block: usize,
        /// If given, it stays above a slope of 4 deg.
        #[arg(long)]
        glide_slope: bool,
        /// Flight time, s.
        #[arg(long)]
        flight_time: f64,
        /// Runs; the least time counts.
        #[arg(long, default_value_t = 20)]
        runs: usize,
    },
    /// One decision over 50 sites within 700 m on the Moon, as JSON.
    Divert {
        /// Intervals.
        #[arg(long, default_value_t = DivertSettings::default().descent.intervals)]
        intervals: usize,
        /// Runs; the least time counts.
        #[arg(long, default_value_t = 5)]
        runs: usize,
    },
}

/// One descent.
#[derive(Debug, Serialize)]
struct Descent {
    propellant: f64,
    variables: usize,
    rows: usize,
    iterations: u32,
    /// Problem to solution, ms.
    with_setup: f64,
    /// New data in place and a solve, ms.
    again: f64,
    landed: bool,
}

/// One decision.
#[derive(Debug, Serialize)]
struct Decision {
    sites: usize,
    landed: usize,
    solves: usize,
    milliseconds: f64,
    /// Largest excess of propellant over a search of its own for the site, kg.
    excess: f64,
}

fn main() -> Result<(), Failure> {
    match Arguments::parse().which {
        Which::Descent { intervals, block, glide_slope, flight_time, runs } => {
            let settings = DescentSettings { intervals, block, ..DescentSettings::default() };
            let record = descent(&mars(glide_slope), settings, flight_time, runs)?;
            serde_json::to_writer(stdout().lock(), &record)?;
        }
        Which::Divert { intervals, runs } => {
            serde_json::to_writer(stdout().lock(), &decision(intervals, runs)?)?;
        }
    }
    writeln!(stdout())?;
    Ok(())
}

/// B. Acikmese and S. Ploen, J. Guid. Control Dyn. 30 (2007) 1353, doi 10.2514/1.27553.
fn mars(glide_slope: bool) -> DescentProblem {
    let limits =
        DescentLimits { glide_slope: glide_slope.then_some(4_f64.to_radians()), ..DescentLimits::default() };
    DescentProblem { limits, ..DescentProblem::mars_lander() }
}

/// A lander of 1322 kg at 2.4 km, to hover at 100 m.
fn moon(target: [f64; 3]) -> DescentProblem {
    DescentProblem {
        gravity: [0.0, 0.0, -1.62494],
        rotation: [0.0; 3],
        mass: 1322.299,
        dry_mass: 1200.0,
        exhaust_velocity: 2940.0,
        thrust: [1500.0, 7500.0],
        position: [0.0, 0.0, 2400.0],
        velocity: [0.0, 0.0, -45.9785],
        target,
        target_velocity: [0.0; 3],
        limits: DescentLimits { pointing: Some(60_f64.to_radians()), ..DescentLimits::default() },
    }
}

fn descent(
    problem: &DescentProblem,
    settings: DescentSettings,
    flight_time: f64,
    runs: usize,
) -> Result<Descent, Failure> {
    let (mut with_setup, mut again) = (f64::INFINITY, f64::INFINITY);
    let mut record = None;
    for _ in 0..runs.max(1) {
        let clock = CpuTime::start();
        let mut solver = DescentSolver::new(problem, settings)?;
        let solution = solver.solve_at(flight_time, 1)?;
        with_setup = with_setup.min(clock.milliseconds());
        let clock = CpuTime::start();
        solver.solve_at(flight_time, 1)?;
        again = again.min(clock.milliseconds());
        record = Some((solution, solver.size()));
    }
    let (solution, (variables, rows)) = record.ok_or("no run")?;
    Ok(Descent {
        propellant: solution.propellant,
        variables,
        rows,
        iterations: solution.iterations,
        with_setup,
        again,
        landed: solution.outcome == Outcome::Landed,
    })
}

fn decision(intervals: usize, runs: usize) -> Result<Decision, Failure> {
    // A spiral of sites, so that neighbours are near.
    let sites: Vec<[f64; 3]> = (0..50)
        .map(|k| {
            let (distance, angle) = (14.0 * f64::from(k), 0.6 * f64::from(k));
            [distance * angle.cos(), distance * angle.sin(), 100.0]
        })
        .collect();
    let mut settings = DivertSettings::default();
    settings.descent.intervals = intervals;
    let mut milliseconds = f64::INFINITY;
    let mut result = None;
    for _ in 0..runs.max(1) {
        let clock = CpuTime::start();
        let mut planner = DivertPlanner::new(&moon(sites[0]), settings)?;
        let diverts = planner.plan(&sites)?;
        milliseconds = milliseconds.min(clock.milliseconds());
        result = Some((diverts, planner.solves()));
    }
    let (diverts, solves) = result.ok_or("no run")?;
    let mut excess = 0.0_f64;
    for d in &diverts {
        let own = DescentSolver::new(&moon(d.target), settings.descent)?.solve()?;
        excess = excess.max(d.propellant - own.propellant);
    }
    let landed = diverts.iter().filter(|d| d.outcome == Outcome::Landed).count();
    Ok(Decision { sites: sites.len(), landed, solves, milliseconds, excess })
}
