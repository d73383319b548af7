//! Progress on stderr.

use std::io::{IsTerminal, Write};

use crate::output::{print, scientific};
use crate::speech::{is_quiet, is_verbose};
use crate::stop::StopFlag;
use apsides::SearchProgress;
use apsides_nlp::{Flow, IterationRecord, Observer};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// The display of a solve while it runs; clones share it.
#[derive(Clone)]
pub(crate) enum Progress {
    Quiet(StopFlag),
    /// One line per iteration, in Ipopt's ten columns.
    Table(StopFlag),
    /// One line that changes.
    Line(StopFlag, ProgressBar),
}

impl Progress {
    /// Nothing is shown.
    pub(crate) fn silent(stop: StopFlag) -> Self {
        Self::Quiet(stop)
    }

    /// The table of iterations with `--verbose`, else a line that changes.
    pub(crate) fn of_solve(stop: StopFlag) -> Self {
        if is_verbose() { Self::Table(stop) } else { Self::clock(stop) }
    }

    /// A changing line that counts cases.
    pub(crate) fn line(stop: StopFlag, steps: u64) -> Self {
        Self::counted(stop, steps, "cases")
    }

    /// A changing line that counts `unit`, with the time that is left.
    pub(crate) fn counted(stop: StopFlag, steps: u64, unit: &str) -> Self {
        if is_quiet() || !std::io::stderr().is_terminal() {
            return Self::Quiet(stop);
        }
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template(&format!(
            "{{pos}} of {{len}} {unit} {{wide_bar}} {{elapsed}}, {{eta}} left {{msg}}"
        )) {
            bar.set_style(style);
        }
        Self::Line(stop, bar)
    }

    /// A changing line of reading, which a signal ends at once.
    pub(crate) fn reading(steps: u64, unit: &str) -> Self {
        Self::counted(StopFlag::of_short_work(), steps, unit)
    }

    /// A changing line of what is told.
    pub(crate) fn clock(stop: StopFlag) -> Self {
        let line = Self::counted(stop, 0, "");
        if let (Self::Line(_, bar), Ok(style)) = (&line, ProgressStyle::with_template("{elapsed} {msg}")) {
            bar.set_style(style);
        }
        line
    }

    /// Shows a text, ten times a second at most.
    pub(crate) fn tell(&self, text: impl Fn() -> String) {
        let Self::Line(_, bar) = self else { return };
        let tenth = (bar.elapsed().as_millis() / 100) as u64;
        if tenth != bar.position() {
            bar.set_position(tenth);
            bar.set_message(text());
        }
    }

    /// True for a line that changes.
    pub(crate) fn is_line(&self) -> bool {
        matches!(self, Self::Line(..))
    }

    /// Says how far work of hours came: beside the changing line, or as lines of their own where stderr is no terminal.
    pub(crate) fn note(&self, text: &str) {
        match self {
            Self::Line(_, bar) => bar.set_message(text.to_owned()),
            Self::Quiet(_) | Self::Table(_) => {
                // A closed stderr must not end the work.
                let _ = writeln!(std::io::stderr().lock(), "{text}");
            }
        }
    }

    /// Prints with the changing line out of the way.
    pub(crate) fn above(&self, text: &str) {
        match self {
            Self::Line(_, bar) => bar.suspend(|| print(text)),
            Self::Quiet(_) | Self::Table(_) => print(text),
        }
    }

    /// One case is done.
    pub(crate) fn step(&self) {
        self.advance(1);
    }

    /// So many more are done.
    pub(crate) fn advance(&self, count: u64) {
        if let Self::Line(_, bar) = self {
            bar.inc(count);
        }
    }

    /// Takes the changing line away.
    pub(crate) fn finish(&self) {
        if let Self::Line(_, bar) = self {
            bar.finish_and_clear();
        }
    }
}

const SEARCH_HEADER: &str = "generation    flights    best with misses  spread";
/// So many generations have a line of their own; of later ones every tenth, hundredth and so on.
const GENERATIONS_SHOWN: usize = 10;

const HEADER: &str = "iter      objective   inf_pr   inf_du lg_mu    ||d|| lg_rg alpha_du alpha_pr  ls";

impl Observer for Progress {
    fn iteration(&mut self, r: &IterationRecord) -> Flow {
        match self {
            Self::Quiet(stop) => stop.flow(),
            Self::Line(stop, bar) => {
                bar.set_message(format!(
                    "iteration {} infeasibility {:.1e}",
                    r.iteration, r.primal_infeasibility
                ));
                stop.flow()
            }
            Self::Table(stop) => {
                let mut err = std::io::stderr().lock();
                // A closed stderr must not end the solve.
                if r.iteration == 0 {
                    let _ = writeln!(err, "{HEADER}");
                }
                let regularisation = if r.regularisation > 0.0 {
                    format!("{:5.1}", r.regularisation.log10())
                } else {
                    "    -".into()
                };
                let _ = writeln!(
                    err,
                    "{:3}{} {:14.7} {} {} {:5.1} {} {} {} {}{} {:2}",
                    r.iteration,
                    if r.restoration { 'r' } else { ' ' },
                    r.objective,
                    scientific(r.primal_infeasibility),
                    scientific(r.dual_infeasibility),
                    r.barrier.log10(),
                    scientific(r.step_norm),
                    regularisation,
                    scientific(r.dual_step),
                    scientific(r.primal_step),
                    r.step_kind,
                    r.line_search_trials
                );
                stop.flow()
            }
        }
    }

    fn generation(&mut self, search: &SearchProgress) -> Flow {
        let (Self::Quiet(stop) | Self::Table(stop) | Self::Line(stop, _)) = &*self;
        let flow = stop.flow_of_part();
        match self {
            Self::Quiet(_) => {}
            Self::Line(_, bar) => {
                bar.set_message(format!("search: {} of {} flights", search.evaluations, search.budget));
            }
            Self::Table(_) => {
                let n = search.generation;
                let rounded = n.checked_ilog10().map_or(1, |digits| 10_usize.pow(digits));
                let last = search.evaluations >= search.budget || flow == Flow::Stop;
                let mut err = std::io::stderr().lock();
                // A closed stderr must not end the search.
                if n == 1 {
                    let _ = writeln!(err, "{SEARCH_HEADER}");
                }
                if n <= GENERATIONS_SHOWN || n.is_multiple_of(rounded) || last {
                    let best = search.best.map_or_else(|| "none".into(), |b| format!("{b:.8}"));
                    let _ = writeln!(
                        err,
                        "{n:>10} {:>10} {best:>19} {}",
                        search.evaluations,
                        scientific(search.spread)
                    );
                }
            }
        }
        flow
    }
}
