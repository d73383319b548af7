//! Ground with craters and boulders, what of it is safe for a lander, and where to land: the roomiest site and the nearest.
#![allow(clippy::print_stdout)]

use apsides_terrain::TerrainError;
use apsides_terrain::hazard::{SiteCriteria, hazard_map};
use apsides_terrain::site::{SiteRequest, SiteRule, choose_sites};
use apsides_terrain::synthetic::{Synthetic, Terrain};

fn main() -> Result<(), TerrainError> {
    // 50 m x 50 m of ground; the same seed gives the same ground.
    let terrain = Terrain { rows: 500, cols: 500, ..Terrain::fine() };
    let map = Synthetic::new(terrain, 7)?.map()?;
    let criteria = SiteCriteria::CHANG_E_3_FINE;
    let hazards = hazard_map(&map, &criteria)?;
    let counts = hazards.counts();
    println!(
        "{} pixels safe, {} not, {:.1} % of them safe",
        counts.safe,
        counts.unsafe_,
        100.0 * counts.safe_fraction()
    );

    for rule in [SiteRule::Clearance, SiteRule::Spiral] {
        let choice = choose_sites(&map, &hazards, &SiteRequest { rule, ..SiteRequest::default() })?;
        let site = choice.sites.first();
        println!("{rule:?}: {site:#?}");
        for (reason, count) in &choice.passed_over {
            println!("  passed over {count}: {reason:?}");
        }
        // Nothing that is not safe is nearer than the criteria ask for.
        assert!(site.is_some_and(|site| site.clearance_m >= criteria.clearance_min_m));
    }
    Ok(())
}
