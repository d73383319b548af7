//! Result directories: data files, figures and a report of what a solve returned.
//!
//! ```text
//! Outcome -> summary.json  certificate.json  trajectory.csv  multipliers.json  mission.toml  report.html
//! Simulated -> summary.json  states.csv  mission.toml  report.html
//! Footprint -> footprint.csv  footprint.json  footprint.svg
//! Sample .. -> montecarlo.csv  montecarlo.json  montecarlo.svg  montecarlo.html  shard.json
//! trajectory.csv, multipliers.json -> Trajectory     (the same polynomials, from the values at the nodes)
//! ```
//!
//! [`write_outcome`] replaces all files of a directory together, [`read_outcome_trajectory`] reads the trajectory back
//! for another verification. The crate solves and verifies nothing. `report.html` is one file with a small script of its own, which says
//! values below the cursor, and without references; missions add figures of their own to the standard ones:
//!
//! ```
//! use apsides_report::{Axis, Figure, Series};
//!
//! let descent = (0..=50).map(|k| f64::from(k) / 50.0).map(|s| [420e3 * s, 15e3 * (1.0 - s * s)]);
//! let svg = Figure::new("descent", Axis::new("downrange", "m"), Axis::new("altitude", "m"))
//!     .with(Series::line("flight path", descent.collect()))
//!     .horizontal("gate", 2000.0)
//!     .to_svg();
//! assert!(svg.contains("altitude (km)")); // 15000 m are shown as 15 km
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | `directory`, `files` | the files of a result, written together |
//! | `trajectory_csv`, `trajectory_reader`, `columns` | `trajectory.csv`: writing, reading, headers |
//! | `digests` | `digests.json`: files that were changed later are named |
//! | `multipliers` | `multipliers.json` |
//! | `samples_reader` | trajectories of other programs |
//! | `answers` | a certificate in plain words |
//! | `html`, `certificate_page`, `page.css`, `page.js`, `markup` | `report.html` |
//! | `page` | pages of tables, sentences and figures |
//! | `figure`, `axis_layout`, `palette`, `svg`, `canvas`, `legend` | what a figure shows, where its ticks stand, its colours, how it is drawn and by which elements, its names |
//! | `hazard_picture`, `map_picture` | a map with hazards and sites, and its frame with distances |
//! | `standard_figures` | figures of every result |
//! | `flight_figures` | figures of a flight about its body, and over time |
//! | `overlay` | several flights over each other |
//! | `limits` | limits that a flight comes near to |
//! | `simulation`, `root_locus` | simulated flights, poles of their loops |
//! | `footprint` | ends within reach, with a map |
//! | `sample_rows`, `sample_file`, `sample_faults` | rows of a Monte Carlo run; their file, written as they come; faults of the program among them |
//! | `montecarlo`, `sample_figure`, `sample_page` | what is made of samples, of a run or of its parts |
//! | `units`, `number` | units and numbers for readers |
//!
//! Reference: M. Okabe and K. Ito, Color Universal Design, 2008, <https://jfly.uni-koeln.de/color/> (the palette).
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod answers;
mod axis_layout;
mod canvas;
mod certificate_page;
mod columns;
mod digests;
mod directory;
mod error;
mod figure;
mod files;
mod flight_figures;
mod footprint;
mod hazard_picture;
mod html;
mod legend;
mod limits;
mod map_picture;
mod markup;
mod montecarlo;
mod multipliers;
mod number;
mod overlay;
mod page;
mod palette;
#[cfg(feature = "parquet")]
mod parquet_samples;
mod root_locus;
mod sample_faults;
mod sample_figure;
mod sample_file;
mod sample_page;
mod sample_rows;
mod samples_reader;
mod simulation;
mod site_files;
mod standard_figures;
mod svg;
mod trajectory_csv;
mod trajectory_reader;
mod units;

pub use answers::{Answer, answers, measure};
pub use digests::{FileState, changed_files};
pub use directory::{read_outcome_trajectory, write_outcome, write_outcome_with};
pub use error::ReportError;
pub use figure::{Axis, AxisScale, Figure, ReferenceLine, Series, SeriesStyle, Span};
pub use files::{Item, ephemeris_files, json, replace, table_error};
pub use flight_figures::{Presentation, curve_figures, with_scale};
pub use footprint::{footprint_map, write_footprint};
pub use hazard_picture::HazardPicture;
pub use html::{headline_beside_objective, render_html, render_page};
pub use map_picture::MapPicture;
pub use montecarlo::{SampleTable, merge_samples, recount, state_samples, write_samples, write_shard};
pub use multipliers::{
    ConstraintMultipliers, ContactMultiplier, CostateJump, IntegralMultipliers, Multipliers, PathMultipliers,
};
pub use overlay::{NamedFlight, overlaid};
pub use page::Page;
pub use sample_faults::FaultFile;
pub use sample_figure::{Picture, SampleFigure};
pub use sample_file::{SampleFile, SampleLayout, StoredSamples};
pub use samples_reader::{Samples, read_samples};
pub use simulation::{read_states, write_simulation};
pub use standard_figures::StandardFigures;
pub use svg::stacked_svg;
pub use trajectory_csv::write_trajectory;
pub use trajectory_reader::read_trajectory;
pub use units::pretty;
