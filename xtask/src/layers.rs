//! The dependencies that are allowed: the layers of the workspace as a table.
//!
//! A dependency of the library or program itself is checked; tests, examples and benches depend on what they need.
//! What the table allows is taken, and ARCHITECTURE.md draws it. Within a crate, modules do not import each other in a circle, and
//! a type has a name of its own.

use crate::circles;
use crate::finding::{Finding, report};
use crate::map;
use crate::signatures;
use crate::type_names;
use crate::workspace::{Package, Purpose, Workspace};

/// Dependencies that a crate of ours may have on others of ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Arrows {
    /// Dependencies on these, without the prefix `apsides-`; `apsides` is the facade.
    To(&'static [&'static str]),
    /// Dependencies on any crate.
    ToAny,
}

use Arrows::{To, ToAny};

/// Every crate of the workspace, lower layers first. A new crate gets a line here.
const ARROWS: &[(&str, Arrows)] = &[
    // Kernel: nothing of ours.
    ("ad", To(&[])),
    ("basis", To(&[])),
    ("iteration", To(&[])),
    ("kkt", To(&[])),
    ("expressions", To(&[])),
    // Engines.
    ("conic", To(&[])),
    ("stage-cone", To(&[])),
    ("metaheuristics", To(&[])),
    ("nlp", To(&["basis", "iteration", "kkt"])),
    ("ode", To(&["ad"])),
    // Domain.
    ("dynamics", To(&["ad", "basis"])),
    ("ephemeris", To(&["dynamics"])),
    ("terrain", To(&["ad"])),
    ("ocp", To(&["ad", "basis", "iteration"])),
    ("problem-file", To(&["ad", "expressions", "ocp"])),
    // Methods, and what their transcriptions have in common.
    ("transcription", To(&["ocp", "nlp"])),
    ("radau", To(&["ad", "ocp", "ode", "basis", "nlp", "transcription"])),
    ("flatness", To(&["ad", "ocp", "basis", "nlp", "transcription"])),
    ("shooting", To(&["ad", "basis", "ocp", "ode", "nlp", "transcription"])),
    // Piecewise-constant controls are a special case of the transcription of direct shooting, with unknown segment ends.
    ("piecewise", To(&["ad", "basis", "ocp", "nlp", "shooting"])),
    // A search over the control profiles of shooting, then any method.
    ("two-layer", To(&["iteration", "metaheuristics", "ocp", "shooting"])),
    ("convex", To(&["ad", "basis", "iteration", "ocp", "ode", "conic", "stage-cone"])),
    // What follows a solution: no solver and no method.
    ("control", To(&["ad", "dynamics", "ode"])),
    ("verify", To(&["ad", "basis", "ocp", "ode"])),
    // From missions to outcomes.
    (
        "pipeline",
        To(&[
            "ad",
            "control",
            "convex",
            "basis",
            "ephemeris",
            "expressions",
            "flatness",
            "metaheuristics",
            "nlp",
            "ocp",
            "ode",
            "piecewise",
            "radau",
            "shooting",
            "two-layer",
            "verify",
        ]),
    ),
    ("report", To(&["ad", "basis", "control", "ephemeris", "ocp", "pipeline", "terrain", "verify"])),
    (
        "missions",
        To(&[
            "ad",
            "basis",
            "control",
            "convex",
            "dynamics",
            "ephemeris",
            "expressions",
            "flatness",
            "metaheuristics",
            "ocp",
            "ode",
            "pipeline",
            "problem-file",
            "radau",
            "shooting",
            "terrain",
            "two-layer",
            "verify",
        ]),
    ),
    // Facade, reproductions, program.
    (
        "apsides",
        To(&[
            "ad",
            "basis",
            "control",
            "convex",
            "dynamics",
            "ephemeris",
            "flatness",
            "metaheuristics",
            "missions",
            "nlp",
            "ocp",
            "ode",
            "piecewise",
            "pipeline",
            "radau",
            "shooting",
            "terrain",
            "verify",
        ]),
    ),
    (
        "publications",
        To(&[
            "ad",
            "control",
            "convex",
            "dynamics",
            "flatness",
            "metaheuristics",
            "missions",
            "nlp",
            "ocp",
            "ode",
            "pipeline",
            "radau",
            "report",
            "shooting",
            "terrain",
            "verify",
        ]),
    ),
    ("cli", ToAny),
    // Development.
    ("optimality", To(&["nlp"])),
    ("problems", To(&["ad", "nlp", "ocp"])),
    ("tests", ToAny),
    ("benches", ToAny),
    ("xtask", To(&[])),
];

/// Heavy dependencies and the one crate that may use each; one that is listed twice has two owners.
const OWNERS: &[(&str, &str)] = &[
    ("faer", "kkt"),
    ("pulp", "ad"),
    ("pulp", "kkt"),
    ("pulp", "nlp"),
    ("pulp", "shooting"),
    ("pulp", "stage-cone"),
    ("pulp", "terrain"),
    ("clarabel", "conic"),
    ("parry3d-f64", "terrain"),
    ("png", "terrain"),
    ("parquet", "report"),
    ("clap", "cli"),
    ("indicatif", "cli"),
    ("nalgebra", "shooting"),
    ("nalgebra", "control"),
    ("nalgebra", "verify"),
];

/// Packages for development alone: heavy dependencies are free there.
const DEVELOPMENT: &[&str] = &["optimality", "problems", "tests", "benches", "xtask"];

/// Packages that no registry gets, and the map shows by their folders alone.
const UNPUBLISHED: &[&str] = &["tests", "benches", "xtask"];

/// The file of these tables, for messages.
const TABLE: &str = "xtask/src/layers.rs";

/// Crates whose types no public signature names.
const HIDDEN: &[&str] = &["faer", "pulp", "clarabel", "parry3d_f64", "parry3d", "glam"];

/// Checks the whole workspace.
pub(crate) fn run(workspace: &Workspace) -> Result<(), String> {
    let mut findings = check(&workspace.packages, ARROWS, OWNERS);
    findings.extend(idle(&workspace.packages, ARROWS, OWNERS));
    findings.extend(map::check(&read(workspace, map::FILE)?, &drawn()));
    let files = workspace.files()?;
    for package in &workspace.packages {
        findings.extend(lints(workspace, package)?);
        let source = format!("{}/src", folder(package));
        let own = files.iter().filter(|f| f.starts_with(&format!("{source}/")) && f.ends_with(".rs"));
        let texts: Vec<(&str, String)> =
            own.map(|f| Ok((f.as_str(), read(workspace, f)?))).collect::<Result<_, String>>()?;
        if source.starts_with("crates/") {
            findings.extend(type_names::check(texts.iter().map(|(path, text)| (*path, text.as_str()))));
        }
        findings.extend(circles::check(short(&package.name), &source, texts.into_iter()));
    }
    for path in files.iter().filter(|p| p.starts_with("crates/") && p.ends_with(".rs")) {
        if path.contains("/src/") {
            let text = read(workspace, path)?;
            findings.extend(signatures::check(path, &text, HIDDEN));
        }
    }
    report("layers", &findings)
}

fn read(workspace: &Workspace, path: &str) -> Result<String, String> {
    std::fs::read_to_string(workspace.root.join(path)).map_err(|e| format!("{path}: {e}"))
}

/// Lints that forbid `unsafe` and printing hold only where a member takes them over.
fn lints(workspace: &Workspace, package: &Package) -> Result<Option<Finding>, String> {
    let path = manifest(package);
    let text = read(workspace, &path)?;
    let mut lines = text.lines().map(str::trim).skip_while(|l| *l != "[lints]").skip(1);
    let inherits = lines.next() == Some("workspace = true");
    Ok((!inherits).then(|| {
        Finding::of(&path, "does not take over the lints of the workspace: add `[lints] workspace = true`")
    }))
}

fn manifest(package: &Package) -> String {
    format!("{}/Cargo.toml", folder(package))
}

/// Folder of a package from the root.
fn folder(package: &Package) -> String {
    package.folder.to_string_lossy().replace('\\', "/")
}

/// Name in the tables.
fn short(name: &str) -> &str {
    name.strip_prefix("apsides-").unwrap_or(name)
}

/// Checks declared dependencies against tables.
fn check(packages: &[Package], arrows: &[(&str, Arrows)], owners: &[(&str, &str)]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for package in packages {
        let path = manifest(package);
        let name = short(&package.name);
        let Some((_, allowed)) = arrows.iter().find(|(n, _)| *n == name) else {
            findings.push(Finding::of(
                &path,
                format!(
                    "`{}` is not in the table of layers: add it to ARROWS in xtask/src/layers.rs",
                    package.name
                ),
            ));
            continue;
        };
        for dependency in package.dependencies.iter().filter(|d| d.purpose != Purpose::Development) {
            if packages.iter().any(|p| p.name == dependency.name) {
                findings.extend(arrow(&path, &package.name, &dependency.name, *allowed));
            }
            let owned = owners.iter().filter(|(heavy, _)| *heavy == dependency.name);
            let owners: Vec<String> = owned.map(|(_, owner)| format!("`apsides-{owner}`")).collect();
            let free = owners.is_empty() || DEVELOPMENT.contains(&name);
            if !free && !owners.contains(&format!("`apsides-{name}`")) {
                findings.push(Finding::of(
                    &path,
                    format!("depends on `{}`, which only {} may use", dependency.name, owners.join(" and ")),
                ));
            }
        }
    }
    findings
}

/// Arrows and owners that the tables allow and no crate takes.
fn idle(packages: &[Package], arrows: &[(&str, Arrows)], owners: &[(&str, &str)]) -> Vec<Finding> {
    let depends = |from: &str, to: &str| {
        let of = |p: &&Package| short(&p.name) == from;
        packages.iter().find(of).is_some_and(|p| p.dependencies.iter().any(|d| short(&d.name) == to))
    };
    let ours = arrows.iter().flat_map(|(from, allowed)| match allowed {
        To(targets) => targets.iter().map(|to| (*from, *to)).collect(),
        ToAny => Vec::new(),
    });
    let heavy = owners.iter().map(|(heavy, owner)| (*owner, *heavy));
    let not_taken = ours.chain(heavy).filter(|(from, to)| !depends(from, to));
    not_taken
        .map(|(from, to)| {
            Finding::of(TABLE, format!("`{from}` may depend on `{to}` and does not: take it off"))
        })
        .collect()
}

/// The arrows that the map of the library's crates shows; packages for development alone are not in it.
fn drawn() -> Vec<(&'static str, Option<&'static [&'static str]>)> {
    let shown = ARROWS.iter().filter(|(name, _)| !UNPUBLISHED.contains(name));
    let targets = |allowed: Arrows| match allowed {
        To(targets) => Some(targets),
        ToAny => None,
    };
    shown.map(|(name, allowed)| (*name, targets(*allowed))).collect()
}

/// A dependency on a crate of ours.
fn arrow(path: &str, from: &str, to: &str, allowed: Arrows) -> Option<Finding> {
    let To(targets) = allowed else { return None };
    if targets.contains(&short(to)) {
        return None;
    }
    let allowed = match targets {
        [] => "no crate of ours".to_owned(),
        _ => targets.join(", "),
    };
    Some(Finding::of(path, format!("`{from}` depends on `{to}`; allowed: {allowed}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::Dependency;

    fn package(name: &str, dependencies: &[(&str, Purpose)]) -> Package {
        Package {
            name: name.into(),
            folder: format!("crates/{name}").into(),
            dependencies: dependencies
                .iter()
                .map(|(n, purpose)| Dependency { name: (*n).into(), purpose: *purpose })
                .collect(),
            ..Package::default()
        }
    }

    fn messages(packages: &[Package]) -> Vec<String> {
        check(packages, ARROWS, OWNERS).into_iter().map(|f| f.message).collect()
    }

    #[test]
    fn allowed_arrows_pass() {
        let packages = [
            package("apsides-kkt", &[("faer", Purpose::Normal), ("nalgebra", Purpose::Development)]),
            package("apsides-nlp", &[("apsides-kkt", Purpose::Normal), ("thiserror", Purpose::Normal)]),
            package("apsides-cli", &[("apsides-nlp", Purpose::Normal), ("clap", Purpose::Normal)]),
            package("apsides-tests", &[("apsides-cli", Purpose::Normal), ("nalgebra", Purpose::Normal)]),
        ];
        assert_eq!(messages(&packages), Vec::<String>::new());
    }

    #[test]
    fn upward_arrows_fail_and_development_ones_do_not() {
        let kkt = package("apsides-kkt", &[("apsides-nlp", Purpose::Development)]);
        let nlp = package("apsides-nlp", &[]);
        assert!(messages(&[kkt, nlp.clone()]).is_empty());
        for purpose in [Purpose::Normal, Purpose::Build] {
            let verify = package("apsides-verify", &[("apsides-nlp", purpose)]);
            assert_eq!(
                messages(&[verify, nlp.clone()]),
                ["`apsides-verify` depends on `apsides-nlp`; allowed: ad, basis, ocp, ode"]
            );
        }
    }

    #[test]
    fn heavy_dependencies_have_one_owner() {
        let ocp = package("apsides-ocp", &[("faer", Purpose::Normal)]);
        assert_eq!(messages(&[ocp]), ["depends on `faer`, which only `apsides-kkt` may use"]);
    }

    #[test]
    fn unknown_crates_are_told_where_to_go() {
        let message = &messages(&[package("apsides-warp", &[])])[0];
        assert!(message.contains("`apsides-warp`") && message.contains("ARROWS"), "{message}");
    }

    #[test]
    fn the_table_descends() {
        // Each crate depends on lines above its own, so that no circle can be written down.
        for (k, (name, arrows)) in ARROWS.iter().enumerate() {
            let To(targets) = arrows else { continue };
            for target in *targets {
                assert!(ARROWS[..k].iter().any(|(n, _)| n == target), "{name} -> {target}");
            }
        }
    }

    #[test]
    fn owners_are_in_the_table() {
        for (heavy, owner) in OWNERS {
            assert!(ARROWS.iter().any(|(n, _)| n == owner), "{heavy}: {owner}");
        }
    }
}
