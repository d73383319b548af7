//! The columns of `trajectory.csv`: which quantity stands under which header.

use std::collections::{HashMap, HashSet};

use apsides_ephemeris::header;
use apsides_ocp::{Ocp, Phase};

use crate::units::quotient;

/// Header of the phase names.
pub(crate) const PHASE: &str = "phase";
/// Header of the interval indices, from zero in each phase.
pub(crate) const INTERVAL: &str = "interval";
/// Header of the error estimates of the intervals.
pub(crate) const INTERVAL_ERROR: &str = "interval_relative_error";
/// Header of the mark: 1 at collocation points, 0 at the end of a phase.
pub(crate) const COLLOCATED: &str = "collocated";

/// Headers of the quantities of one phase.
pub(crate) struct PhaseColumns {
    pub(crate) time: String,
    pub(crate) states: Vec<String>,
    pub(crate) controls: Vec<String>,
    pub(crate) costates: Vec<String>,
}

/// Headers of a problem: phases share the columns of quantities of equal kind, name and unit.
pub(crate) struct Columns {
    /// Every header, in the order written.
    pub(crate) all: Vec<String>,
    pub(crate) phases: Vec<PhaseColumns>,
    pub(crate) parameters: Vec<String>,
    pub(crate) objective: String,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Time,
    State,
    Control,
    Costate,
    Parameter,
    Objective,
}

/// Gives every quantity one header; a quantity that has one keeps it, a header in use gets a number.
struct Naming {
    all: Vec<String>,
    used: HashSet<String>,
    known: HashMap<(Kind, String, String), String>,
}

impl Naming {
    fn header(&mut self, kind: Kind, name: &str, unit: &str) -> String {
        let key = (kind, name.to_owned(), unit.to_owned());
        if let Some(header) = self.known.get(&key) {
            return header.clone();
        }
        let prefix = match kind {
            Kind::Costate => "costate_",
            Kind::Parameter => "parameter_",
            Kind::Objective => "objective_",
            Kind::Time | Kind::State | Kind::Control => "",
        };
        let plain = format!("{prefix}{}", header(name, unit));
        let mut header = plain.clone();
        let mut number = 1;
        while self.used.contains(&header) {
            number += 1;
            header = format!("{plain}_{number}");
        }
        self.push(&header);
        self.known.insert(key, header.clone());
        header
    }

    fn push(&mut self, header: &str) {
        self.used.insert(header.to_owned());
        self.all.push(header.to_owned());
    }
}

impl Columns {
    /// Columns of a problem; `with_costates` adds those of the costates of every phase.
    pub(crate) fn new(ocp: &Ocp, with_costates: bool) -> Self {
        let mut naming = Naming {
            all: Vec::new(),
            // Fixed headers are reserved, also those that come last.
            used: [PHASE, INTERVAL, INTERVAL_ERROR, COLLOCATED].map(str::to_owned).into(),
            known: HashMap::new(),
        };
        naming.all.extend([PHASE, INTERVAL].map(str::to_owned));
        let mut of_phases =
            |headers: &mut dyn FnMut(&mut Naming, &Phase) -> Vec<String>| -> Vec<Vec<String>> {
                ocp.phases.iter().map(|p| headers(&mut naming, p)).collect()
            };
        let times = of_phases(&mut |n, p| vec![n.header(Kind::Time, "time", &p.time_unit)]);
        let states = of_phases(&mut |n, p| {
            let states = p.states.iter().map(|s| &s.variable);
            states.map(|v| n.header(Kind::State, &v.name, &v.unit)).collect()
        });
        let controls = of_phases(&mut |n, p| {
            p.controls.iter().map(|v| n.header(Kind::Control, &v.name, &v.unit)).collect()
        });
        let costates = of_phases(&mut |n, p| {
            let states = p.states.iter().map(|s| &s.variable).filter(|_| with_costates);
            states
                .map(|v| n.header(Kind::Costate, &v.name, &quotient(&ocp.objective.unit, &v.unit)))
                .collect()
        });
        let parameters =
            ocp.parameters.iter().map(|v| naming.header(Kind::Parameter, &v.name, &v.unit)).collect();
        let objective = naming.header(Kind::Objective, &ocp.objective.name, &ocp.objective.unit);
        naming.push(INTERVAL_ERROR);
        naming.push(COLLOCATED);
        let phases = times
            .into_iter()
            .zip(states)
            .zip(controls)
            .zip(costates)
            .map(|(((mut time, states), controls), costates)| PhaseColumns {
                time: time.remove(0),
                states,
                controls,
                costates,
            })
            .collect();
        Self { all: naming.all, phases, parameters, objective }
    }
}
