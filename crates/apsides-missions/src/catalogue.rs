//! The missions, mission files and vehicles that come with apsides.

use apsides_pipeline::Registry;

use crate::data::{BODIES, RENAMED, SITES, VEHICLES};

/// A mission file: its name and its text.
#[cfg(any(
    feature = "lunar",
    feature = "geo",
    feature = "entry",
    feature = "chang-e",
    feature = "moving-mass",
    feature = "problem"
))]
type File = (&'static str, &'static str);

// A file that is not named like its kind says what is special about it.

#[cfg(feature = "lunar")]
const LUNAR: &[File] = &[
    ("lunar-direct", include_str!("../missions/lunar-direct.toml")),
    ("lunar-perilune", include_str!("../missions/lunar-perilune.toml")),
    ("lunar-two-phase", include_str!("../missions/lunar-two-phase.toml")),
    ("lunar-transfer", include_str!("../missions/lunar-transfer.toml")),
    ("lunar-coast", include_str!("../missions/lunar-coast.toml")),
    ("lunar-throttled", include_str!("../missions/lunar-throttled.toml")),
    ("lunar-vertical", include_str!("../missions/lunar-vertical.toml")),
];

#[cfg(feature = "geo")]
const GEO: &[File] = &[
    ("geo-1-burn", include_str!("../missions/geo-1-burn.toml")),
    ("geo-2-burn", include_str!("../missions/geo-2-burn.toml")),
    ("geo-3-burn", include_str!("../missions/geo-3-burn.toml")),
    ("geo-4-burn", include_str!("../missions/geo-4-burn.toml")),
    ("geo-5-burn", include_str!("../missions/geo-5-burn.toml")),
    ("geo-6-burn", include_str!("../missions/geo-6-burn.toml")),
    ("geo-7-burn", include_str!("../missions/geo-7-burn.toml")),
    ("geo-8-burn", include_str!("../missions/geo-8-burn.toml")),
];

#[cfg(feature = "chang-e")]
const CHANG_E: &[File] = &[
    ("chang-e-3", include_str!("../missions/chang-e-3.toml")),
    ("chang-e-3-flat", include_str!("../missions/chang-e-3-flat.toml")),
    ("chang-e-3-braking", include_str!("../missions/chang-e-3-braking.toml")),
];

#[cfg(feature = "entry")]
const ENTRY: &[File] = &[
    ("capsule-reentry", include_str!("../missions/capsule-reentry.toml")),
    ("capsule-reentry-steered", include_str!("../missions/capsule-reentry-steered.toml")),
    ("capsule-reentry-us76", include_str!("../missions/capsule-reentry-us76.toml")),
];

#[cfg(feature = "moving-mass")]
const MOVING_MASS: &[File] = &[
    ("moving-mass-cross", include_str!("../missions/moving-mass-cross.toml")),
    ("moving-mass-radial", include_str!("../missions/moving-mass-radial.toml")),
];

#[cfg(feature = "problem")]
const PROBLEMS: &[File] = &[
    ("mars-descent", include_str!("../missions/mars-descent.toml")),
    ("mars-descent-down", include_str!("../missions/mars-descent-down.toml")),
    ("mars-descent-aside", include_str!("../missions/mars-descent-aside.toml")),
];

/// A registry of all kinds of mission whose features are on, their files and their data.
#[must_use]
pub fn registry() -> Registry {
    let registry =
        Registry::new().with_data(BODIES).with_data(VEHICLES).with_data(SITES).with_renamed(RENAMED);
    #[cfg(feature = "lunar")]
    let registry = with_files(LUNAR, registry)
        .with::<crate::lunar::DirectLanding>()
        .with::<crate::lunar::PeriluneLanding>()
        .with::<crate::lunar::TwoPhaseLanding>()
        .with::<crate::lunar::LunarTransfer>();
    #[cfg(feature = "geo")]
    let registry = with_files(GEO, registry).with::<crate::geo::GeoInjection>();
    #[cfg(feature = "entry")]
    let registry = with_files(ENTRY, registry).with::<crate::entry::CapsuleEntry>();
    #[cfg(feature = "chang-e")]
    let registry = with_files(CHANG_E, registry)
        .with::<crate::chang_e::MainBraking>()
        .with::<crate::chang_e::SixStageLanding>();
    #[cfg(feature = "moving-mass")]
    let registry = with_files(MOVING_MASS, registry)
        .with::<crate::moving_mass::CrossMasses>()
        .with::<crate::moving_mass::RadialMasses>();
    #[cfg(feature = "problem")]
    let registry = with_files(PROBLEMS, registry).with_kind_of_file(
        crate::problem::WORD,
        crate::problem::read,
        apsides_problem_file::schema::properties,
    );
    registry
}

#[cfg(any(
    feature = "lunar",
    feature = "geo",
    feature = "entry",
    feature = "chang-e",
    feature = "moving-mass",
    feature = "problem"
))]
fn with_files(files: &[File], registry: Registry) -> Registry {
    files.iter().fold(registry, |registry, (name, text)| registry.with_file(name, text))
}
