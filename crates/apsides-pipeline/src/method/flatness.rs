//! Flat outputs on B-splines by `apsides-flatness`.

use std::sync::Arc;

use apsides_flatness::{
    BoundRows, Breaks, FlatMethod, Flatness, FlatnessSettings, Placement, SplineSettings,
};
use apsides_ocp::Method;

use super::{Entry, MethodName, MethodSettings, PosedCase};
use crate::Error;
use crate::key::Key;
use crate::memory::{Foreseen, of_dense};
use crate::values::Values;

pub(super) const ENTRY: Entry = Entry {
    name: MethodName::Flatness,
    keys: KEYS,
    names: NAMES,
    refuses: Some(|posed, values| posed.flat_systems.is_none().then(|| not_flat(values))),
    read: |values| Ok(Arc::new(FlatnessMethod::read(values)?)),
};

const KEYS: &[Key] = &[
    Key::count("flatness.order", 0, 0, 32, "order of the splines; 0: four above their highest derivative"),
    Key::count("flatness.intervals", 4, 1, 1000, "equal polynomial segments per phase"),
    Key::count(
        "flatness.points",
        4,
        1,
        1000,
        "collocation points per phase; of each segment where they are placed by segment",
    ),
    Key::choice(
        "flatness.outputs",
        &[FLAT, ALL],
        "curves that are splines: the flat outputs, from which all states follow; or all states and the controls, whose equations of motion \
         are held at the points",
    ),
    Key::choice(
        "flatness.placement",
        &["gauss-per-segment", "uniform", "gauss", "lobatto", "chebyshev", "greville"],
        "where the points are: in each segment, of splines just as smooth as the states must be; or over the whole phase, \
         of splines as smooth as their order allows",
    ),
    Key::count(
        "flatness.max_refinements",
        15,
        0,
        999,
        "most refinements until the splines meet the equations of motion between the points; 0 switches refinement off",
    ),
];

const FLAT: &str = "flat";
const ALL: &str = "all";

/// Keys of settings, by the names of their fields.
const NAMES: &[(&str, &str)] =
    &[("refine", "flatness.max_refinements"), ("max_refinements", "flatness.max_refinements")];

/// Settings of the method.
#[derive(Clone, Debug)]
struct FlatnessMethod {
    splines: SplineSettings,
    intervals: usize,
    max_refinements: usize,
    /// True if all states and controls are splines.
    all: bool,
}

impl FlatnessMethod {
    fn read(v: &Values) -> Result<Self, Error> {
        let (order, segments) = (v.count("flatness.order")?, v.count("flatness.intervals")?);
        let max_refinements = v.count("flatness.max_refinements")?;
        let placement = match v.word("flatness.placement")? {
            "uniform" => Placement::Uniform,
            "gauss" => Placement::Gauss,
            "lobatto" => Placement::Lobatto,
            "chebyshev" => Placement::Chebyshev,
            "greville" => Placement::Greville,
            _ => Placement::GaussPerSegment,
        };
        let splines = SplineSettings {
            order: (order > 0).then_some(order),
            breaks: match placement {
                Placement::GaussPerSegment => Breaks::Collocation(segments),
                _ => Breaks::Uniform(segments),
            },
            points: v.count("flatness.points")?,
            placement,
            refine: max_refinements > 0,
        };
        Ok(Self { splines, intervals: segments, max_refinements, all: v.word("flatness.outputs")? == ALL })
    }
}

impl MethodSettings for FlatnessMethod {
    fn method(&self, case: &PosedCase<'_>) -> Result<Box<dyn Method>, Error> {
        let posed = &case.posed;
        let systems = if self.all { &posed.spline_systems } else { &posed.flat_systems };
        let systems = systems.clone().ok_or_else(|| Error::in_mission(NO_FLAT_OUTPUTS))?;
        let settings = FlatnessSettings {
            spline: self.splines.clone(),
            // Landings are well posed without the bounds of their states.
            bounds: BoundRows::WhereExceeded,
            max_refinements: self.max_refinements,
            ..FlatnessSettings::default()
        };
        Ok(Box::new(FlatMethod { flatness: Flatness { settings }, systems }))
    }

    fn foreseen(&self, case: &PosedCase<'_>) -> Foreseen {
        let intervals = self.intervals;
        Foreseen::new(of_dense(&case.posed.ocp, intervals), &[("flatness.intervals", intervals)])
    }
}

const NO_FLAT_OUTPUTS: &str =
    "`method` is \"flatness\", but the mission has no flat outputs; choose `method` = \"radau\"";

fn not_flat(values: &Values) -> Error {
    values.refused(if values.declares("throttle") {
        "`method` is \"flatness\", which flies full thrust in a direction that may jump; choose `throttle` = \
         \"full\" and `max_pitch_rate_deg_s` = inf, or `method` = \"radau\""
    } else {
        NO_FLAT_OUTPUTS
    })
}
