//! A release: the order in which crates go to the registry, what has to stand before, and the one version of all.

use std::path::Path;

use crate::command::{cargo, output, run as run_command};
use crate::workspace::{Package, Purpose, Workspace};

/// Files with a version of their own, which is that of the workspace: the file, and how a line with it begins.
const VERSIONED: [(&str, &str); 3] =
    [("Cargo.toml", "version = "), ("python/Cargo.toml", "version = "), ("CITATION.cff", "version: ")];

/// Workspaces with a lock of their own.
const LOCKS: [&str; 2] = ["Cargo.toml", "python/Cargo.toml"];

/// Prints the order and what is missing; with `--dry-run` cargo goes through it without a registry getting anything, with `--set VERSION` all
/// versions are replaced.
pub(crate) fn run(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        [] => show(workspace),
        ["--dry-run"] => {
            show(workspace)?;
            let dry = ["publish", "--workspace", "--dry-run", "--locked", "--allow-dirty", "--no-verify"];
            run_command(&mut cargo(&workspace.root, dry))
        }
        ["--set", version] => set(workspace, version),
        _ => {
            Err(format!("`release` takes nothing, `--dry-run` or `--set VERSION`, not `{}`", words.join(" ")))
        }
    }
}

fn show(workspace: &Workspace) -> Result<(), String> {
    let order = order(&workspace.packages)?;
    println!("crates in the order in which they go to the registry, after `cargo xtask package`:");
    for package in &order {
        println!("  cargo publish --locked -p {}", package.name);
    }
    let read = |name: &str| std::fs::read_to_string(workspace.root.join(name)).unwrap_or_default();
    let missing = missing(&order, &read);
    if missing.is_empty() {
        println!("{} crates of version {} are ready", order.len(), version_of(&order));
        return Ok(());
    }
    Err(format!("not ready for a release:\n  {}", missing.join("\n  ")))
}

/// The packages for the registry, each behind those that it depends on.
fn order(packages: &[Package]) -> Result<Vec<&Package>, String> {
    let mut left: Vec<&Package> = packages.iter().filter(|p| p.publish).collect();
    left.sort_by(|a, b| a.name.cmp(&b.name));
    let mut order: Vec<&Package> = Vec::new();
    while !left.is_empty() {
        let waits = |package: &Package| {
            let needed = package.dependencies.iter().filter(|d| d.purpose != Purpose::Development);
            needed.map(|d| &d.name).any(|name| left.iter().any(|other| other.name == *name))
        };
        let (later, ready): (Vec<_>, Vec<_>) = left.iter().copied().partition(|package| waits(package));
        if ready.is_empty() {
            let names: Vec<&str> = later.iter().map(|p| p.name.as_str()).collect();
            return Err(format!("these depend on each other: {}", names.join(", ")));
        }
        order.extend(ready);
        left = later;
    }
    Ok(order)
}

fn version_of<'a>(order: &[&'a Package]) -> &'a str {
    order.first().map_or("", |package| package.version.as_str())
}

/// All that has to be done before, a line each.
fn missing(order: &[&Package], read: &dyn Fn(&str) -> String) -> Vec<String> {
    let version = version_of(order);
    let mut missing: Vec<String> = Vec::new();
    for package in order.iter().filter(|package| package.version != version) {
        missing.push(format!("{} has version {}, others {version}", package.name, package.version));
    }
    for (file, head) in VERSIONED {
        let stated = read(file).lines().any(|line| says(line, head, version));
        if !stated {
            missing.push(format!(
                "{file} does not state version {version}: cargo xtask release --set {version}"
            ));
        }
    }
    let changelog = read("CHANGELOG.md");
    match changelog.lines().find(|line| line.starts_with(&format!("## [{version}]"))) {
        None => missing.push(format!("CHANGELOG.md has no section `## [{version}]`")),
        Some(line) if line.contains("Unreleased") => {
            missing.push(format!("CHANGELOG.md: the section of {version} has no date"));
        }
        Some(_) => {}
    }
    missing
}

/// Returns true of a line that states this version behind this head.
fn says(line: &str, head: &str, version: &str) -> bool {
    line.strip_prefix(head).is_some_and(|stated| stated.trim().trim_matches('"') == version)
}

/// Replaces the version of all crates, and where they name each other.
fn set(workspace: &Workspace, version: &str) -> Result<(), String> {
    let parts: Vec<_> = version.split('.').map(str::parse::<u64>).collect();
    if parts.len() != 3 || parts.iter().any(Result::is_err) {
        return Err(format!("`{version}` is no version: three whole numbers, such as 0.2.0"));
    }
    let earlier = order(&workspace.packages)?;
    let earlier = version_of(&earlier).to_owned();
    for (file, head) in VERSIONED {
        let path = workspace.root.join(file);
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{file}: {e}"))?;
        let text = replaced(&text, head, &earlier, version);
        std::fs::write(&path, text).map_err(|e| format!("{file}: {e}"))?;
    }
    for manifest in LOCKS {
        let manifest = workspace.root.join(manifest);
        update(&workspace.root, &manifest)?;
    }
    println!("version {version} in place of {earlier}; CHANGELOG.md needs its section `## [{version}]`");
    Ok(())
}

/// The lines of our crates in a lock, and no others.
fn update(root: &Path, manifest: &Path) -> Result<(), String> {
    let manifest = manifest.display().to_string();
    output(&mut cargo(root, ["update", "--workspace", "--quiet", "--manifest-path", &manifest])).map(drop)
}

/// The text with another version: in lines that state it, and in those of our own crates.
fn replaced(text: &str, head: &str, earlier: &str, version: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let own = line.contains("path = ") && line.contains(&format!("version = \"{earlier}\""));
        if own || says(line.trim_end(), head, earlier) {
            out += &line.replace(earlier, version);
        } else {
            out += line;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::Dependency;

    fn package(name: &str, needs: &[(&str, Purpose)]) -> Package {
        let dependency =
            |(name, purpose): &(&str, Purpose)| Dependency { name: (*name).into(), purpose: *purpose };
        Package {
            name: name.into(),
            version: "0.2.0".into(),
            publish: true,
            dependencies: needs.iter().map(dependency).collect(),
            ..Package::default()
        }
    }

    #[test]
    fn a_crate_comes_after_those_that_it_needs() {
        use Purpose::{Build, Development, Normal};
        let packages = [
            package("a", &[("c", Normal), ("serde", Normal)]),
            package("b", &[("a", Build)]),
            package("c", &[("b", Development)]),
        ];
        let names: Vec<&str> = order(&packages).unwrap().iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["c", "a", "b"]);
        let circle = [package("a", &[("b", Normal)]), package("b", &[("a", Normal)])];
        assert_eq!(order(&circle).unwrap_err(), "these depend on each other: a, b");
    }

    #[test]
    fn what_is_missing_is_named() {
        let packages = [package("a", &[])];
        let order: Vec<&Package> = packages.iter().collect();
        let ready = |file: &str| match file {
            "CHANGELOG.md" => "## [0.2.0] - 2026-11-26\n".to_owned(),
            "CITATION.cff" => "version: 0.2.0\n".to_owned(),
            _ => "[package]\nversion = \"0.2.0\"\n".to_owned(),
        };
        assert_eq!(missing(&order, &ready), Vec::<String>::new());
        let found = missing(&order, &|_| "version = \"0.1.0\"\n## [0.2.0] - Unreleased\n".to_owned());
        assert_eq!(found.len(), 4, "{found:?}");
        assert!(found[0].contains("Cargo.toml does not state version 0.2.0"), "{found:?}");
        assert!(found[3].contains("no date"), "{found:?}");
    }

    #[test]
    fn versions_of_others_stay() {
        let text = "version = \"0.1.0\"\na = { path = \"a\", version = \"0.1.0\" }\nb = { version = \"0.1.0\" }\nb = \"0.1.0\"\n";
        let expected = "version = \"0.2.0\"\na = { path = \"a\", version = \"0.2.0\" }\nb = { version = \"0.1.0\" }\nb = \"0.1.0\"\n";
        assert_eq!(replaced(text, "version = ", "0.1.0", "0.2.0"), expected);
    }
}
