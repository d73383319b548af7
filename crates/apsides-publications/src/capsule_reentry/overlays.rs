//! Figures 11 to 19 of the paper: what each limit does to its own quantity, to the bank angle and to all states, a curve a limit.

use apsides_report::pretty;

use super::limits::Found;
use super::model::{Limits, Model, SolveNumbers};
use crate::sheet::{Graph, GraphSeries};

/// The quantities that have limits, in their order, with units and the figures of the paper.
const LIMITED: [(&str, &str, &str); 3] = [
    ("dynamic pressure", "kPa", "Figs 11 to 13"),
    ("acceleration", "m/s2", "Figs 17 to 19"),
    ("heat rate", "kW/m2", "Figs 14 to 16"),
];
/// The order of their figures.
const IN_THE_PAPER: [usize; 3] = [0, 2, 1];
/// Files of model E: the quantity itself, the bank angle, the six states.
const FILES_E: [[&str; 8]; 3] = [
    [
        "limits_pressure_e_pressure.svg",
        "limits_pressure_e_bank.svg",
        "limits_pressure_e_state_1.svg",
        "limits_pressure_e_state_2.svg",
        "limits_pressure_e_state_3.svg",
        "limits_pressure_e_state_4.svg",
        "limits_pressure_e_state_5.svg",
        "limits_pressure_e_state_6.svg",
    ],
    [
        "limits_load_e_load.svg",
        "limits_load_e_bank.svg",
        "limits_load_e_state_1.svg",
        "limits_load_e_state_2.svg",
        "limits_load_e_state_3.svg",
        "limits_load_e_state_4.svg",
        "limits_load_e_state_5.svg",
        "limits_load_e_state_6.svg",
    ],
    [
        "limits_heat_rate_e_heat_rate.svg",
        "limits_heat_rate_e_bank.svg",
        "limits_heat_rate_e_state_1.svg",
        "limits_heat_rate_e_state_2.svg",
        "limits_heat_rate_e_state_3.svg",
        "limits_heat_rate_e_state_4.svg",
        "limits_heat_rate_e_state_5.svg",
        "limits_heat_rate_e_state_6.svg",
    ],
];
/// Files of model U: the quantity itself and the bank angle.
const FILES_U: [[&str; 2]; 3] = [
    ["limits_pressure_u_pressure.svg", "limits_pressure_u_bank.svg"],
    ["limits_load_u_load.svg", "limits_load_u_bank.svg"],
    ["limits_heat_rate_u_heat_rate.svg", "limits_heat_rate_u_bank.svg"],
];

/// A figure a quantity, of all limits of a kind that stand alone and of the flight without limits.
pub(super) fn graphs(model: Model, found: &[Found<'_>]) -> Vec<Graph> {
    let mut graphs = Vec::new();
    for k in IN_THE_PAPER {
        let (limited, unit, figures) = LIMITED[k];
        let files: &[&'static str] = match model {
            Model::E => &FILES_E[k],
            Model::U => &FILES_U[k],
        };
        let flights = alone(k, found);
        let Some((_, first)) = flights.first() else { continue };
        for (quantity, file) in files.iter().enumerate() {
            let y = match quantity {
                0 => (limited, unit),
                1 => ("bank angle", "deg"),
                _ => match first.states.get(quantity - 2) {
                    Some(state) => (state.name, state.unit),
                    None => continue,
                },
            };
            let points = |s: &SolveNumbers| match quantity {
                0 => s.loads[k].clone(),
                1 => s.bank.clone(),
                _ => s.states.get(quantity - 2).map_or_else(Vec::new, |state| state.points.clone()),
            };
            let series = flights.iter().map(|(limits, s)| {
                let label = match limits[k].is_finite() {
                    true => format!("{} {}", limits[k], pretty(unit)),
                    false => "no limit".into(),
                };
                GraphSeries { label, line: points(s), dots: Vec::new() }
            });
            graphs.push(Graph {
                file,
                title: format!("{figures}, model {}: {}, limits on the {limited}", model.name(), y.0),
                x: ("time", "s"),
                y,
                series: series.collect(),
            });
        }
    }
    graphs
}

/// Flights under a limit of a kind alone, tightest first, and that without limits.
fn alone<'a>(k: usize, found: &'a [Found<'_>]) -> Vec<(Limits, &'a SolveNumbers)> {
    let others_open = |limits: &Limits| (0..3).all(|i| i == k || limits[i].is_infinite());
    let mut flights: Vec<_> = found
        .iter()
        .filter(|f| others_open(&f.reference.limits))
        .filter_map(|f| Some((f.reference.limits, f.solved.as_ref()?)))
        .collect();
    flights.sort_by(|a, b| a.0[k].total_cmp(&b.0[k]));
    flights
}
