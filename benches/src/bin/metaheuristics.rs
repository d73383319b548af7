//! Searches on shifted and rotated functions: instances for a peer. Prints JSON.

use apsides_benches::landing::Failure;
use apsides_problems::search::{Landscape, ShiftedRotated, Transform};
use clap::{Parser, Subcommand};
use serde::Serialize;

/// Shifted and rotated functions for searches without derivatives.
#[derive(Debug, Parser)]
#[command(name = "metaheuristics")]
struct Arguments {
    #[command(subcommand)]
    which: Which,
}

#[derive(Clone, Debug, Subcommand)]
enum Which {
    /// Writes shifts, rotations and sample values.
    Instances {
        /// Number of variables.
        #[arg(long)]
        dimension: usize,
        /// Instances 1 to this number.
        #[arg(long)]
        seeds: u64,
    },
}

/// One shift and rotation, and values that the peer's functions must have.
#[derive(Debug, Serialize)]
struct Instance {
    shift: Vec<f64>,
    rotation: Vec<f64>,
    point: Vec<f64>,
    values: Vec<f64>,
}

fn main() -> Result<(), Failure> {
    match Arguments::parse().which {
        Which::Instances { dimension, seeds } => {
            let instances: Vec<Instance> = (1..=seeds).map(|seed| instance(dimension, seed)).collect();
            serde_json::to_writer(std::io::stdout().lock(), &instances)?;
        }
    }
    Ok(())
}

fn instance(dimension: usize, seed: u64) -> Instance {
    let transform = Transform::seeded(dimension, seed);
    let point: Vec<f64> = (0..dimension).map(|k| 90.0 * (1.0 + k as f64).sin()).collect();
    let value = |landscape| ShiftedRotated { landscape, transform: transform.clone() }.value(&point);
    let values = Landscape::ALL.map(value).into();
    Instance { shift: transform.shift, rotation: transform.rotation, point, values }
}
