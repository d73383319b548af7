//! The missions, mission files and vehicles that come with apsides.

use apsides_pipeline::Registry;

use crate::data::{BODIES, RENAMED, SITES, VEHICLES};

/// Files by their names; one that is not named like its kind says what is special about it.
const FILES: &[(&str, &str)] = &[
    ("lunar-direct", include_str!("../missions/lunar-direct.toml")),
    ("lunar-perilune", include_str!("../missions/lunar-perilune.toml")),
    ("lunar-two-phase", include_str!("../missions/lunar-two-phase.toml")),
    ("lunar-transfer", include_str!("../missions/lunar-transfer.toml")),
    ("lunar-coast", include_str!("../missions/lunar-coast.toml")),
    ("lunar-throttled", include_str!("../missions/lunar-throttled.toml")),
    ("lunar-vertical", include_str!("../missions/lunar-vertical.toml")),
    ("geo-1-burn", include_str!("../missions/geo-1-burn.toml")),
    ("geo-2-burn", include_str!("../missions/geo-2-burn.toml")),
    ("geo-3-burn", include_str!("../missions/geo-3-burn.toml")),
    ("geo-4-burn", include_str!("../missions/geo-4-burn.toml")),
    ("geo-5-burn", include_str!("../missions/geo-5-burn.toml")),
    ("geo-6-burn", include_str!("../missions/geo-6-burn.toml")),
    ("geo-7-burn", include_str!("../missions/geo-7-burn.toml")),
    ("geo-8-burn", include_str!("../missions/geo-8-burn.toml")),
    ("chang-e-3", include_str!("../missions/chang-e-3.toml")),
    ("chang-e-3-flat", include_str!("../missions/chang-e-3-flat.toml")),
    ("chang-e-3-braking", include_str!("../missions/chang-e-3-braking.toml")),
    ("capsule-reentry", include_str!("../missions/capsule-reentry.toml")),
    ("capsule-reentry-steered", include_str!("../missions/capsule-reentry-steered.toml")),
    ("capsule-reentry-us76", include_str!("../missions/capsule-reentry-us76.toml")),
    ("moving-mass-cross", include_str!("../missions/moving-mass-cross.toml")),
    ("moving-mass-radial", include_str!("../missions/moving-mass-radial.toml")),
];

/// A registry of all kinds of mission, their files and their data.
#[must_use]
pub fn registry() -> Registry {
    let registry = Registry::new()
        .with::<crate::lunar::DirectLanding>()
        .with::<crate::lunar::PeriluneLanding>()
        .with::<crate::lunar::TwoPhaseLanding>()
        .with::<crate::lunar::LunarTransfer>()
        .with::<crate::geo::GeoInjection>()
        .with::<crate::entry::CapsuleEntry>()
        .with::<crate::chang_e::MainBraking>()
        .with::<crate::chang_e::SixStageLanding>()
        .with::<crate::moving_mass::CrossMasses>()
        .with::<crate::moving_mass::RadialMasses>()
        .with_data(BODIES)
        .with_data(VEHICLES)
        .with_data(SITES)
        .with_renamed(RENAMED);
    FILES.iter().fold(registry, |registry, (name, text)| registry.with_file(name, text))
}
