//! Candidates: sites with what it takes to fly to each.

use crate::site::choice::Site;

/// The effort of a flight from the place above a map to a site, as a planner of diverts finds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Divert {
    /// Propellant of the flight, kg, also of one that falls short of the site; none where there is no flight at all.
    pub propellant: Option<f64>,
    /// Flight time, s; the one that was tried last where there is no flight at all.
    pub flight_time: f64,
    /// The reason for which the flight does not end at the site; none where it does.
    pub unreached: Option<Unreached>,
}

/// The reason for which a flight does not end at its site.
#[derive(Clone, Debug, PartialEq)]
pub struct Unreached {
    /// The reason in words: "target out of reach by 12.00 m".
    pub reason: String,
    /// Distance by which the site is missed, m, where there is a flight.
    pub distance: Option<f64>,
}

impl Divert {
    /// The propellant of a flight that ends at the site, kg.
    #[must_use]
    pub fn reached(&self) -> Option<f64> {
        self.propellant.filter(|_| self.unreached.is_none())
    }

    /// The end of the flight in words: "landed", or why the site is not reached.
    #[must_use]
    pub fn outcome(&self) -> &str {
        self.unreached.as_ref().map_or("landed", |u| &u.reason)
    }
}

/// A candidate.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The site on its map.
    pub site: Site,
    /// East, north and up from the ground below the lander, m.
    pub offset: [f64; 3],
    /// The effort of the flight there.
    pub divert: Divert,
    /// Half of the least margin to a threshold and of the room around the site, both from 0 to 1, as what they lack: 0 to 1.
    pub hazard: f64,
    /// Propellant above that of the cheapest candidate and the worth of the hazard, kg; none when it cannot be reached.
    pub cost: Option<f64>,
    /// Largest tilt on the four pads over all headings, rad; none where the pads stand on a gap or the lander topples. Tried
    /// only until a candidate stands.
    pub tilt: Option<f64>,
}

impl std::fmt::Display for Candidate {
    /// The place as seen from the lander, and how the flight there ends.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [east, north, _] = self.offset;
        write!(f, "{} ({:.1} m away): {}", place(self.offset), east.hypot(north), self.divert.outcome())
    }
}

/// A place to the east and north in words.
pub(super) fn place([east, north, _]: [f64; 3]) -> String {
    let (x, y) = (if east < 0.0 { "west" } else { "east" }, if north < 0.0 { "south" } else { "north" });
    format!("{:.1} m {x} and {:.1} m {y}", east.abs(), north.abs())
}
