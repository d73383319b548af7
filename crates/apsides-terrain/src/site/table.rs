//! Sites as text.

use std::fmt;

use super::{Reason, Rival, Site, SiteChoice};

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [east, north] = self.position_m;
        write!(
            f,
            "row {}, column {} (east {east:.2} m, north {north:.2} m, height {:.3} m): clearance {:.3} m, divert {:.2} m",
            self.row, self.col, self.height_m, self.clearance_m, self.divert_m
        )?;
        for &(layer, value) in &self.layers {
            write!(f, ", {layer} {}", layer.show(value))?;
        }
        Ok(())
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Unknown => f.write_str("footprint not known"),
            Reason::Breaks(layer) => write!(f, "{layer} beyond its threshold"),
            Reason::Clearance => f.write_str("too near to a hazard"),
            Reason::Separation => f.write_str("too near to a better site"),
        }
    }
}

impl fmt::Display for Rival {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; lost to site {} by {:.3}", self.site, self.lost_to + 1, self.by)
    }
}

impl fmt::Display for SiteChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.sites.is_empty() {
            writeln!(f, "no site")?;
        }
        for (k, site) in self.sites.iter().enumerate() {
            writeln!(f, "site {}: {site}", k + 1)?;
        }
        for rival in &self.rivals {
            writeln!(f, "rival: {rival}")?;
        }
        for (reason, count) in &self.passed_over {
            writeln!(f, "passed over {count} pixels: {reason}")?;
        }
        Ok(())
    }
}
