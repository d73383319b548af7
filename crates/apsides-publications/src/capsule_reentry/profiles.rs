//! The paper's Table 1: forms of the bank profile, and how near each algorithm comes to the optimum over them.

use super::model::{Begin, Line, Model, SolveNumbers, bank_at_nodes, mission, solve, states};
use super::reference::{BASE, search_of};
use super::{AFTER_CYCLE, ALGORITHMS, COOPERATION, choice};
use crate::change::{Change, flag, number, word};
use crate::sheet::{Graph, GraphSeries, Sheet, median};
use crate::stop::Stop;
use crate::workers::Workers;
use crate::{Error, Pipeline};

/// A form of the bank profile.
pub(super) struct Form {
    name: &'static str,
    /// Values of the mission.
    changes: &'static [Change<'static>],
    /// Figure of its searches over energy.
    figure: &'static str,
}

pub(super) const FORMS: [Form; 4] = [
    Form {
        name: "3 constants",
        changes: &[
            number("search.degree", 0.0),
            number("search.least_intervals", 3.0),
            number("search.most_intervals", 3.0),
        ],
        figure: "searches_3_constants.svg",
    },
    Form {
        name: "5 lines",
        changes: &[
            number("search.degree", 1.0),
            number("search.least_intervals", 5.0),
            number("search.most_intervals", 5.0),
            flag("search.continuous", false),
        ],
        figure: "searches_5_lines.svg",
    },
    Form {
        name: "3 joined lines of free lengths",
        changes: &[
            number("search.degree", 1.0),
            number("search.least_intervals", 3.0),
            number("search.most_intervals", 3.0),
            flag("search.free_lengths", true),
        ],
        figure: "searches_3_joined_lines.svg",
    },
    // As the paper codes profiles: a largest number of sub-intervals and a largest degree; number, lengths and degrees are searched.
    Form {
        name: "up to 3 polynomials of degrees 0 to 3",
        changes: &[
            number("search.degree", 0.0),
            number("search.most_degree", 3.0),
            number("search.least_intervals", 1.0),
            number("search.most_intervals", 3.0),
            flag("search.free_lengths", true),
            flag("search.continuous", false),
        ],
        figure: "searches_free_degrees.svg",
    },
];

/// The abscissae of profiles, with the number of algorithms and the part of the searches: over time those of the paper alone.
const ABSCISSAE: [(&str, usize, u64); 2] = [("energy", ALGORITHMS.len(), 1), ("time", 4, 2)];
const LEVELS: [f64; 3] = [5.0, 2.0, 1.0];

/// One search.
struct Searched {
    /// Flights, and the best of what misses and excesses are added to.
    history: Vec<[f64; 2]>,
    variables: usize,
    bank: Vec<[f64; 2]>,
    states: Vec<Line>,
}

/// All searches of a form by one algorithm.
struct Group {
    form: usize,
    abscissa: usize,
    algorithm: usize,
    runs: Vec<Searched>,
}

impl Group {
    fn is_of(&self, form: usize, abscissa: usize) -> bool {
        self.form == form && self.abscissa == abscissa
    }

    fn median_excess(&self, optimum: f64) -> Option<f64> {
        median(self.runs.iter().filter_map(|r| r.history.last()).map(|h| excess(h[1], optimum)))
    }

    /// Median of the flights to a level of the excess, of the searches that got there, and their number.
    fn reached(&self, level: f64, optimum: f64) -> (Option<f64>, f64) {
        let first = |r: &Searched| r.history.iter().find(|h| excess(h[1], optimum) <= level).map(|h| h[0]);
        let found: Vec<f64> = self.runs.iter().filter_map(first).collect();
        (median(found.iter().copied()), found.len() as f64)
    }
}

/// In % of the optimum.
fn excess(value: f64, optimum: f64) -> f64 {
    100.0 * (value / optimum - 1.0)
}

const COLUMNS: &[(&str, usize)] = &[
    ("variables", 0),
    ("searches", 0),
    ("median_excess_percent", 3),
    ("reference_excess_percent", 3),
    ("flights_to_5_percent_excess", 0),
    ("reached_5_percent_excess", 0),
    ("reference_flights_to_5_percent_excess", 0),
    ("reference_reached_5_percent_excess", 0),
    ("flights_to_2_percent_excess", 0),
    ("reached_2_percent_excess", 0),
    ("reference_flights_to_2_percent_excess", 0),
    ("reference_reached_2_percent_excess", 0),
    ("flights_to_1_percent_excess", 0),
    ("reached_1_percent_excess", 0),
    ("reference_flights_to_1_percent_excess", 0),
    ("reference_reached_1_percent_excess", 0),
];

pub(super) fn sheet(
    forms: &[Form],
    seeds: u64,
    budget: usize,
    workers: &mut Workers<'_>,
) -> Result<Sheet, Stop> {
    let title = format!(
        "Bank profiles, model E with the limits of the paper: searches of {budget} flights each (Table 1 of the paper); flights to an \
         excess are medians of the searches that reached it"
    );
    let mut sheet = Sheet::new("profiles", title, "form, over, algorithm", COLUMNS);
    let optimum =
        match workers.all(&[()], |(), observer| solve(Model::E, BASE, Begin::Straight, observer))?.pop() {
            Some(Ok(solved)) => solved,
            Some(Err(why)) => return Err(Stop::NotSolved(why)),
            None => return Err(Stop::Interrupted),
        };
    let groups = groups(forms, seeds, budget, workers)?;
    let least = optimum.heat_load;
    for g in &groups {
        let (form, (word, label)) = (forms[g.form].name, ALGORITHMS[g.algorithm]);
        let reference = if g.abscissa == 0 { search_of(form, word) } else { None };
        let mut values = vec![
            g.runs.first().map(|r| r.variables as f64),
            Some(g.runs.len() as f64),
            g.median_excess(least),
            reference.as_ref().map(|r| r.excess),
        ];
        for (k, level) in LEVELS.into_iter().enumerate() {
            let (flights, count) = g.reached(level, least);
            let printed = reference.as_ref().map(|r| r.reached[k]);
            values.extend([flights, Some(count), printed.map(|p| p.0), printed.map(|p| p.1)]);
        }
        sheet.push(format!("{form}, {}, {label}", ABSCISSAE[g.abscissa].0), values);
    }
    sheet.findings = findings(forms, &groups, least);
    sheet.graphs = forms.iter().enumerate().map(|(k, form)| convergence(k, form, &groups, least)).collect();
    sheet.graphs.extend(profiles(forms, &groups, &optimum));
    Ok(sheet)
}

fn groups(forms: &[Form], seeds: u64, budget: usize, workers: &mut Workers<'_>) -> Result<Vec<Group>, Stop> {
    let mut groups = Vec::new();
    let mut jobs: Vec<(usize, Pipeline, u64)> = Vec::new();
    for (form, f) in forms.iter().enumerate() {
        for (abscissa, (over, algorithms, part)) in ABSCISSAE.iter().enumerate() {
            for (algorithm, (word, _)) in ALGORITHMS[..*algorithms].iter().enumerate() {
                let mission = searched(f.changes, over, word, budget)?;
                jobs.extend((0..seeds / part).map(|seed| (groups.len(), mission.clone(), seed)));
                groups.push(Group { form, abscissa, algorithm, runs: Vec::new() });
            }
        }
    }
    let results = workers.all(&jobs, |(_, mission, seed), observer| {
        let mission = mission.clone().with_seed(*seed);
        let posed = mission.pose()?;
        let found = mission.methods().search(&posed, observer)?;
        if found.summary.stop == "interrupted" {
            return Err(Stop::Interrupted);
        }
        Ok(Searched {
            variables: found.summary.variables,
            history: found.summary.history,
            bank: found.start.as_ref().map_or_else(Vec::new, |s| bank_at_nodes(&s.trajectory)),
            states: found.start.map_or_else(Vec::new, |s| states(&posed.ocp, &s.trajectory)),
        })
    })?;
    for ((group, ..), result) in jobs.iter().zip(results) {
        if let Ok(run) = result {
            groups[*group].runs.push(run);
        }
    }
    Ok(groups)
}

fn searched(form: &[Change<'_>], over: &str, algorithm: &str, budget: usize) -> Result<Pipeline, Error> {
    let [algorithm, exchange] = choice(algorithm);
    let search =
        [word("search.profile", over), algorithm, exchange, number("search.evaluations", budget as f64)];
    mission(Model::E, BASE, &[form, &search].concat())
}

/// Medians nearer to each other than this are equal, %.
const EQUAL: f64 = 0.005;

/// Where the cooperation is ahead of each algorithm alone, and where not.
fn findings(forms: &[Form], groups: &[Group], least: f64) -> Vec<String> {
    let mut findings = Vec::new();
    // Ahead, equal, behind.
    let mut score = [[0; 3]; ALGORITHMS.len()];
    for (form, f) in forms.iter().enumerate() {
        for (abscissa, (over, ..)) in ABSCISSAE.iter().enumerate() {
            let ends: Vec<(usize, f64)> = (groups.iter().filter(|g| g.is_of(form, abscissa)))
                .filter_map(|g| Some((g.algorithm, g.median_excess(least)?)))
                .collect();
            let Some(own) = ends.iter().find(|e| ALGORITHMS[e.0].0 == COOPERATION).map(|e| e.1) else {
                continue;
            };
            let mut lists: [Vec<String>; 3] = Default::default();
            for &(algorithm, end) in ends.iter().filter(|e| ALGORITHMS[e.0].0 != COOPERATION) {
                let place = placed(end, own);
                lists[place].push(format!("{} ({end:.2} %)", ALGORITHMS[algorithm].1));
                score[algorithm][place] += 1;
            }
            let [worse, equal, better] =
                lists.map(|names| if names.is_empty() { "none".into() } else { names.join(", ") });
            findings.push(format!(
                "{} over {over}: the cooperation ends {own:.2} % above the optimum; it beats: {worse}; equal: {equal}; better than it: \
                 {better}.",
                f.name
            ));
        }
    }
    let counts: Vec<String> = (ALGORITHMS.iter().zip(&score))
        .filter(|(_, s)| s.iter().sum::<usize>() > 0)
        .map(|((_, label), [ahead, equal, behind])| {
            format!("{label} in {ahead} of {} ({equal} equal)", ahead + equal + behind)
        })
        .collect();
    findings.push(format!(
        "By the median at the end, the cooperation beats each algorithm alone so often: {}.",
        counts.join(", ")
    ));
    let orders =
        [(COOPERATION, "in the order of the paper"), (AFTER_CYCLE, "with the exchange after the cycle")];
    let beside: Vec<String> =
        orders.iter().map(|(word, order)| against_single(groups, word, order, least)).collect();
    findings.push(format!("Against single algorithms: {}.", beside.join("; ")));
    findings
}

/// So often a cooperation ends lower than single algorithms, over energy, where both kinds of exchange are searched.
fn against_single(groups: &[Group], own: &str, order: &str, least: f64) -> String {
    // Ahead, equal, behind.
    let mut score = [0; 3];
    let is_single = |g: &Group| ![COOPERATION, AFTER_CYCLE].contains(&ALGORITHMS[g.algorithm].0);
    let cooperations = groups.iter().filter(|g| g.abscissa == 0 && ALGORITHMS[g.algorithm].0 == own);
    for cooperation in cooperations {
        let Some(end) = cooperation.median_excess(least) else { continue };
        let singles = groups.iter().filter(|g| g.is_of(cooperation.form, 0) && is_single(g));
        for other in singles.filter_map(|g| g.median_excess(least)) {
            score[placed(other, end)] += 1;
        }
    }
    let [ahead, equal, behind] = score;
    format!("{order} the cooperation beats {ahead}, equals {equal} and is worse than {behind}")
}

/// 0 where another median is above the own one, 1 where they are equal, 2 where it is below.
fn placed(other: f64, own: f64) -> usize {
    if (other - own).abs() <= EQUAL { 1 } else { 2 * usize::from(other < own) }
}

/// Largest excess that figures show, %.
const MOST_EXCESS: f64 = 10.0;

/// Median of the best so far over the flights.
fn convergence(form: usize, f: &Form, groups: &[Group], least: f64) -> Graph {
    let series = |g: &Group| {
        let mut flights: Vec<f64> = g.runs.iter().flat_map(|r| r.history.iter().map(|h| h[0])).collect();
        flights.sort_by(f64::total_cmp);
        flights.dedup();
        let so_far = |r: &Searched, at: f64| {
            let last = r.history.partition_point(|h| h[0] <= at).checked_sub(1);
            last.map_or(f64::INFINITY, |k| r.history[k][1])
        };
        let point = |at: f64| {
            let value = median(g.runs.iter().map(|r| so_far(r, at)))?;
            Some([at, excess(value, least)]).filter(|p| p[1] <= MOST_EXCESS)
        };
        let line = flights.into_iter().filter_map(point).collect();
        GraphSeries { label: ALGORITHMS[g.algorithm].1.into(), line, dots: Vec::new() }
    };
    Graph {
        file: f.figure,
        title: format!("{} over energy: median of the best so far over the flights", f.name),
        x: ("flights", "-"),
        y: ("excess over the optimum", "%"),
        series: groups.iter().filter(|g| g.is_of(form, 0)).map(series).collect(),
    }
}

/// Figures of the best profiles: bank angle, the six states in their order, and the path.
const PROFILE_FILES: [&str; 8] = [
    "bank_profiles.svg",
    "profiles_state_1.svg",
    "profiles_state_2.svg",
    "profiles_state_3.svg",
    "profiles_state_4.svg",
    "profiles_state_5.svg",
    "profiles_state_6.svg",
    "profiles_path.svg",
];
/// Among the states of a flight: radius or altitude over time, longitude, latitude.
const LONGITUDE: usize = 1;
const LATITUDE: usize = 2;

/// A flight of the figures.
struct DrawnFlight<'a> {
    label: &'a str,
    bank: &'a [[f64; 2]],
    states: &'a [Line],
}

impl DrawnFlight<'_> {
    fn state(&self, k: usize) -> &[[f64; 2]] {
        self.states.get(k).map_or(&[], |line| &line.points)
    }

    /// Latitude over longitude.
    fn path(&self) -> Vec<[f64; 2]> {
        self.state(LONGITUDE).iter().zip(self.state(LATITUDE)).map(|(e, n)| [e[1], n[1]]).collect()
    }
}

/// The best profile of each form, beside the optimum, as the figures 7 to 10 of the paper have them.
fn profiles(forms: &[Form], groups: &[Group], optimum: &SolveNumbers) -> Vec<Graph> {
    let mut flights = vec![DrawnFlight { label: "optimum", bank: &optimum.bank, states: &optimum.states }];
    for (form, f) in forms.iter().enumerate() {
        let runs = groups
            .iter()
            .filter(|g| g.is_of(form, 0) && ALGORITHMS[g.algorithm].0 == COOPERATION)
            .flat_map(|g| &g.runs);
        let end = |r: &&Searched| r.history.last().map_or(f64::INFINITY, |h| h[1]);
        if let Some(best) = runs.min_by(|a, b| end(a).total_cmp(&end(b))) {
            flights.push(DrawnFlight { label: f.name, bank: &best.bank, states: &best.states });
        }
    }
    const TIME: (&str, &str) = ("time", "s");
    let graph = |file, x, y: (&'static str, &'static str), of: &dyn Fn(&DrawnFlight<'_>) -> Vec<[f64; 2]>| {
        let series = flights.iter().map(|flight| GraphSeries {
            label: flight.label.into(),
            line: of(flight),
            dots: Vec::new(),
        });
        let subject = if x == TIME { y.0 } else { "path over the ground" };
        let title = format!("Figs 7 to 10: {subject}, optimum and best profiles by the cooperation");
        Graph { file, title, x, y, series: series.collect() }
    };
    let [bank_file, state_files @ .., path_file] = &PROFILE_FILES;
    let mut graphs = vec![graph(bank_file, TIME, ("bank angle", "deg"), &|f| f.bank.to_vec())];
    for (k, (file, state)) in state_files.iter().zip(&optimum.states).enumerate() {
        graphs.push(graph(file, TIME, (state.name, state.unit), &|f| f.state(k).to_vec()));
    }
    graphs.push(graph(path_file, ("longitude", "deg"), ("latitude", "deg"), &|f| f.path()));
    graphs
}
