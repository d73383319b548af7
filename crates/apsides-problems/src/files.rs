//! The problems of the gallery as files: the same statements without Rust.

/// The text of the file of a problem, by the name of the problem.
#[must_use]
pub fn file(name: &str) -> Option<&'static str> {
    FILES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        /// Name and text of every file.
        pub const FILES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../problems/", $name, ".toml")))),*];
    };
}

files![
    "lqr_scalar",
    "di_min_energy",
    "di_min_energy_free_speed",
    "brachistochrone_free_y",
    "brachistochrone_dymos",
    "linear_tangent",
    "hanging_chain",
    "hypersensitive",
    "hypersensitive_long",
    "orbit_raising",
    "cart_pole",
    "pvtol",
    "shuttle_reentry",
    "shuttle_heat_limit",
    "min_time_climb",
    "delta_iii",
    "van_der_pol",
    "rayleigh_path",
    "brachistochrone_wall",
    "bryson_denham",
    "bryson_denham_contact",
    "di_bang_bang",
    "moon_lander_soft",
    "free_flying_robot",
    "powered_descent",
    "powered_descent_above_ground",
    "powered_descent_glide_slope",
    "di_singular_arc",
    "catmix",
    "catmix_reversed",
    "catmix_arcs",
    "goddard_cops",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_problem_has_a_file_of_its_name() {
        let names: Vec<&str> = crate::GALLERY.iter().map(|p| p.name).collect();
        assert_eq!(FILES.iter().map(|f| f.0).collect::<Vec<_>>(), names);
        assert!(FILES.iter().all(|(name, text)| text.contains(&format!("name = \"{name}\""))));
    }
}
