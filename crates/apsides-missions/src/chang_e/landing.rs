//! The landing in six stages: its values in SI units and what follows from them.

use apsides_pipeline::Error;
use apsides_pipeline::values::Values;
use apsides_terrain::site::selection::SelectionRule;

use super::divert::Divert;
use super::keys::{self, COARSE, FINE};
use super::lander::{Lander, Motion};
use super::terrain::{MapSource, SiteMap, decided};

/// A path that counts so much is found from the guess, kg/m.
const FOUND_UNAIDED: f64 = 3.0;
/// One that counts so many times as much is found from the last.
const HEAVIER: f64 = 2.0;

/// The order in which phases are optimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StageOrder {
    /// All phases together.
    Jointly,
    /// The main braking for itself, then the others.
    ByStages,
}

/// Landing in six stages from the perilune of a lunar orbit to the cut-off of the engine, in SI units and rad: main braking, quick
/// adjustment, coarse avoidance, hover, fine avoidance, slow descent.
///
/// Altitudes count from the ground at the site that is aimed at until the coarse avoidance begins, and from the ground at the site that
/// the flight goes to from then on.
#[derive(Clone, Debug)]
pub struct SixStageLanding {
    /// The vehicle, its orbit, the site that is aimed at and the gate above it.
    pub lander: Lander,
    /// The order in which phases are optimised.
    pub order: StageOrder,
    /// Altitude at the end of the adjustment, where the coarse map is seen, m.
    pub coarse_altitude: f64,
    /// Largest tilt of the thrust from the vertical in the adjustment, rad.
    pub adjustment_tilt: f64,
    /// Propellant that a metre of path in the adjustment counts as, kg/m.
    pub path_weight: f64,
    /// Altitude at rest at the end of the coarse avoidance, where the fine map is seen, m.
    pub hover_altitude: f64,
    /// Time at rest there, s.
    pub hover_time: f64,
    /// Altitude at the end of the fine avoidance, m.
    pub fine_altitude: f64,
    /// Altitude at rest where the engine is cut off, m.
    pub cutoff_altitude: f64,
    /// Mass at the gate by the main braking's own optimum, where that is optimised for itself, kg.
    pub gate_mass: Option<f64>,
    /// Upward speed at the end of the adjustment where it is decided, m/s.
    pub adjusted_speed: Option<f64>,
    /// The map that is seen at the end of the adjustment.
    pub coarse: SiteMap,
    /// The map that is seen at the hover.
    pub fine: SiteMap,
    /// Seed of generated maps.
    pub seed: u64,
    /// The site that is taken of those within reach.
    pub rule: SelectionRule,
    /// Number of safe sites of a map to which diverts are planned.
    pub candidates: usize,
    /// Height of the centre of mass above the footpads at touchdown, m.
    pub centre_of_mass_height: f64,
}

impl SixStageLanding {
    /// The landing of values.
    pub(super) fn of(values: &Values) -> Result<Self, Error> {
        let number = |path| values.number(path);
        let [up, east, north] = keys::GATE_VELOCITY;
        let velocity = [decided(values, up)?, decided(values, east)?, decided(values, north)?];
        let gate_velocity = match velocity {
            [Some(up), Some(east), Some(north)] => Some([up, east, north]),
            _ => None,
        };
        let landing = Self {
            lander: Lander { gate_velocity, ..Lander::read(values)? },
            order: match values.word(keys::ORDER)? {
                keys::STAGES => StageOrder::ByStages,
                _ => StageOrder::Jointly,
            },
            coarse_altitude: number(keys::COARSE_ALTITUDE)? * 1e3,
            adjustment_tilt: number(keys::ADJUSTMENT_TILT)?.to_radians(),
            path_weight: number(keys::PATH_WEIGHT)?,
            hover_altitude: number(keys::HOVER_ALTITUDE)?,
            hover_time: number(keys::HOVER_TIME)?,
            fine_altitude: number(keys::FINE_ALTITUDE)?,
            cutoff_altitude: number(keys::CUTOFF_ALTITUDE)?,
            gate_mass: decided(values, keys::GATE_MASS)?,
            adjusted_speed: decided(values, keys::ADJUSTED_SPEED)?,
            coarse: SiteMap::read(values, &COARSE)?,
            fine: SiteMap::read(values, &FINE)?,
            seed: values.count(keys::TERRAIN_SEED)? as u64,
            rule: match values.word(keys::SITE_RULE)? {
                keys::SPIRAL => SelectionRule::Spiral,
                _ => SelectionRule::Weighed,
            },
            candidates: values.count(keys::CANDIDATES)?,
            centre_of_mass_height: number(keys::CENTRE_OF_MASS)?,
        };
        landing.check(values)?;
        Ok(landing)
    }

    /// Refuses altitudes that do not follow each other downwards, and maps of a flight in the plane.
    fn check(&self, values: &Values) -> Result<(), Error> {
        let gate = |key, unit: f64| Ok::<_, Error>((key, values.number(key)?, unit));
        let gates = [
            gate(keys::GATE_ALTITUDE, 1e3)?,
            gate(keys::COARSE_ALTITUDE, 1e3)?,
            gate(keys::HOVER_ALTITUDE, 1.0)?,
            gate(keys::FINE_ALTITUDE, 1.0)?,
            gate(keys::CUTOFF_ALTITUDE, 1.0)?,
        ];
        for pair in gates.windows(2) {
            let [(above, high, unit), (below, low, unit_below)] = [pair[0], pair[1]];
            if unit_below * low >= unit * high {
                return Err(
                    values.conflict(format!("`{below}` is {low}, it must be below `{above}` = {high}"))
                );
            }
        }
        if let Some(reason) = self.ground_too_high() {
            return Err(values.conflict(reason));
        }
        let ends = [
            (&self.coarse, COARSE.clearance, keys::HOVER_ALTITUDE, self.hover_altitude),
            (&self.fine, FINE.clearance, keys::FINE_ALTITUDE, self.fine_altitude),
        ];
        for (map, key, end, altitude) in ends {
            if let Some(clearance) = map.clearance.filter(|c| *c >= altitude) {
                return Err(values.conflict(format!(
                    "`{key}` is {clearance}, it must be below `{end}` = {altitude}, where the way over the map ends"
                )));
            }
        }
        let maps = [(COARSE.map, &self.coarse), (FINE.map, &self.fine)];
        if let Some((key, _)) = maps.into_iter().find(|(_, m)| m.source != MapSource::None)
            && self.lander.motion == Motion::Plane
        {
            return Err(values.conflict(format!(
                "`{key}` needs `{}` = \"{}\": a site lies beside the plane",
                keys::MOTION,
                keys::SPACE
            )));
        }
        Ok(())
    }

    /// The same landing with paths that count less, each a start of the next: the more a path counts, the shorter are the arcs between full
    /// thrust against the flight and the fall, so that no mesh finds them unaided.
    pub(super) fn lighter_paths(&self) -> Vec<Self> {
        let weights = std::iter::successors(Some(FOUND_UNAIDED), |w| Some(w * HEAVIER));
        let lighter = weights.take_while(|w| *w < self.path_weight);
        lighter.map(|path_weight| Self { path_weight, ..self.clone() }).collect()
    }

    /// Says in words that the ground at the site is too high for the altitudes of the stages; none where it is not.
    pub(super) fn ground_too_high(&self) -> Option<String> {
        let follow = self.hover_radius() < self.coarse_radius() && self.fine_radius() < self.hover_radius();
        (!follow).then(|| {
            format!(
                "the ground at the site is {:.1} m above the one aimed at, too high for `{}` = {} and `{}` = {}; choose a lower site",
                self.coarse_divert().rise + self.fine_divert().rise,
                keys::COARSE_ALTITUDE,
                self.coarse_altitude / 1e3,
                keys::HOVER_ALTITUDE,
                self.hover_altitude
            )
        })
    }

    /// The divert from above the site that is aimed at to the coarse one; of no length without maps.
    #[must_use]
    pub fn coarse_divert(&self) -> Divert {
        let Lander { site, body, .. } = &self.lander;
        Divert::new(*site, self.coarse.site, body.radius, self.coarse.tilt)
    }

    /// The divert from above the coarse site to the landing site; of no length without maps.
    #[must_use]
    pub fn fine_divert(&self) -> Divert {
        Divert::new(self.coarse_divert().to, self.fine.site, self.lander.body.radius, self.fine.tilt)
    }

    /// Distance from the centre where the coarse avoidance begins, m.
    #[must_use]
    pub fn coarse_radius(&self) -> f64 {
        self.lander.body.radius + self.coarse_altitude
    }

    /// Distance of the hover from the centre, m.
    #[must_use]
    pub fn hover_radius(&self) -> f64 {
        self.lander.body.radius + self.coarse_divert().rise + self.hover_altitude
    }

    /// Distance of the ground at the landing site from the centre, m.
    #[must_use]
    pub fn ground_radius(&self) -> f64 {
        self.lander.body.radius + self.coarse_divert().rise + self.fine_divert().rise
    }

    /// Distance from the centre where the fine avoidance ends, m.
    #[must_use]
    pub fn fine_radius(&self) -> f64 {
        self.ground_radius() + self.fine_altitude
    }

    /// Speed at the ground after the free fall from the cut-off, m/s.
    #[must_use]
    pub fn touchdown_speed(&self) -> f64 {
        let inverses = self.ground_radius().recip() - self.cutoff_radius().recip();
        (2.0 * self.lander.body.gravitational_parameter * inverses).sqrt()
    }

    /// Distance from the centre where the engine is cut off, m.
    #[must_use]
    pub fn cutoff_radius(&self) -> f64 {
        self.ground_radius() + self.cutoff_altitude
    }
}
