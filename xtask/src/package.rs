//! Every crate as a package: what its tarball holds, each feature alone, a project of its own against each tarball, its tests.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use crate::command::{cargo, cargo_program, output, run as run_command};
use crate::workspace::{Package, Workspace};

/// Files that each package has as the root has them.
const LICENCES: [&str; 2] = ["LICENSE-APACHE", "LICENSE-MIT"];

/// Packages all crates and uses each from a project outside the repository.
pub(crate) fn run(workspace: &Workspace, names: &[String]) -> Result<(), String> {
    for name in names {
        workspace.package(name)?;
    }
    let packages: Vec<&Package> = workspace.packages.iter().filter(|p| p.publish).collect();
    let wanted = |p: &&&Package| names.is_empty() || names.contains(&p.name);
    for package in &packages {
        files(workspace, package)?;
    }
    for package in packages.iter().filter(wanted) {
        features_of(workspace, package)?;
    }
    // The projects below build what the tarballs hold; the verification of cargo takes older ones of the same version from its cache.
    let mut pack = cargo(&workspace.root, ["package", "--locked", "--allow-dirty", "--quiet", "--no-verify"]);
    for package in &packages {
        pack.args(["-p", &package.name]);
    }
    run_command(&mut pack)?;

    let scratch = Scratch::new()?;
    scratch.unpack(workspace, &packages)?;
    println!("{:24} {:>6} {:>9}  project", "crate", "crates", "build [s]");
    for package in packages.iter().filter(wanted) {
        println!("{}", scratch.use_alone(&packages, package)?);
    }
    Ok(())
}

/// Licences, README and metadata of a package.
fn files(workspace: &Workspace, package: &Package) -> Result<(), String> {
    let folder = workspace.root.join(&package.folder);
    let read = |path: PathBuf| std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()));
    for licence in LICENCES {
        if read(folder.join(licence))? != read(workspace.root.join(licence))? {
            return Err(format!("{}: {licence} is not that of the root", package.name));
        }
    }
    read(folder.join("README.md"))?;
    let documentation = format!("https://docs.rs/{}", package.name);
    if package.documentation != documentation {
        return Err(format!("{}: `documentation` is not {documentation}", package.name));
    }
    if !package.docs_rs {
        return Err(format!("{}: no `[package.metadata.docs.rs]`", package.name));
    }
    Ok(())
}

/// Each feature of each crate builds without the others.
pub(crate) fn features(workspace: &Workspace) -> Result<(), String> {
    workspace.packages.iter().filter(|p| p.publish).try_for_each(|package| features_of(workspace, package))
}

fn features_of(workspace: &Workspace, package: &Package) -> Result<(), String> {
    if package.features.is_empty() {
        return Ok(());
    }
    let check = || {
        cargo(&workspace.root, ["check", "--quiet", "--locked", "--no-default-features", "-p", &package.name])
    };
    run_command(&mut check())?;
    for feature in package.features.iter().filter(|f| *f != "default") {
        run_command(check().args(["--features", feature]))?;
    }
    Ok(())
}

/// A folder outside the repository; removed in the end.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // What is left is in the folder for temporary files.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Scratch {
    fn new() -> Result<Self, String> {
        let folder = std::env::temp_dir().join(format!("apsides-package-{}", std::process::id()));
        std::fs::create_dir_all(folder.join(".cargo")).map_err(|e| format!("{}: {e}", folder.display()))?;
        Ok(Self(folder))
    }

    fn write(&self, name: &str, text: &str) -> Result<(), String> {
        let path = self.0.join(name);
        let parent = path.parent().unwrap_or(&self.0);
        std::fs::create_dir_all(parent)
            .and_then(|()| std::fs::write(&path, text))
            .map_err(|e| format!("{}: {e}", path.display()))
    }

    /// All tarballs, and a cargo configuration that puts them in place of the registry's.
    fn unpack(&self, workspace: &Workspace, packages: &[&Package]) -> Result<(), String> {
        let mut patch = "[patch.crates-io]\n".to_owned();
        for package in packages {
            let stem = format!("{}-{}", package.name, package.version);
            let tarball = workspace.target.join("package").join(format!("{stem}.crate"));
            output(Command::new("tar").current_dir(&self.0).arg("-xzf").arg(&tarball))?;
            let path = self.0.join(&stem).to_string_lossy().replace('\\', "/");
            patch += &format!("{} = {{ path = \"{path}\" }}\n", package.name);
        }
        self.write(".cargo/config.toml", &patch)
    }

    /// Cargo in a folder below, with a build directory of that folder.
    fn cargo(&self, folder: &Path, arguments: &[&str]) -> Command {
        let mut command = Command::new(cargo_program());
        command.current_dir(folder).args(arguments).env("CARGO_TARGET_DIR", folder.join("target"));
        command
    }

    /// A project whose program is the first example of the crate, or which builds the crate's own program.
    fn use_alone(&self, packages: &[&Package], package: &Package) -> Result<String, String> {
        let unpacked = self.0.join(format!("{}-{}", package.name, package.version));
        let example = package.examples.first();
        let folder = if package.library {
            let text = match example {
                Some(name) => read(&unpacked.join("examples").join(format!("{name}.rs")))?,
                None => format!("use {} as _;\n\nfn main() {{}}\n", package.name.replace('-', "_")),
            };
            let folder = format!("use-{}", package.name);
            self.write(&format!("{folder}/Cargo.toml"), &manifest(packages, package, &text))?;
            self.write(&format!("{folder}/src/main.rs"), &text)?;
            self.0.join(folder)
        } else {
            unpacked.clone()
        };
        let clock = Instant::now();
        run_command(&mut self.cargo(&folder, &["build", "--quiet"]))?;
        let time = clock.elapsed().as_secs_f64();
        if package.library {
            run_command(&mut self.cargo(&folder, &["run", "--quiet"]))?;
        }
        let tree = ["tree", "--quiet", "-p", &package.name, "-e", "normal", "--prefix", "none"];
        let crates = count(&output(&mut self.cargo(&folder, &tree))?);
        // Its tests from its own tarball, so that they name nothing of the repository; dependencies are compiled once for all.
        let tests = self.0.join("tests");
        let mut build = self.cargo(&unpacked, &["test", "--no-run", "--quiet"]);
        run_command(build.env("CARGO_TARGET_DIR", &tests))?;
        // A build directory of its own for each: the disk holds one at a time.
        let _ = std::fs::remove_dir_all(folder.join("target"));
        let project = match (package.library, example) {
            (false, _) => "its program",
            (true, Some(name)) => name,
            (true, None) => "empty",
        };
        Ok(format!("{:24} {crates:>6} {time:>9.1}  {project}", package.name))
    }
}

fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

/// The manifest of a project that uses a crate, and those of ours besides that its program names.
fn manifest(packages: &[&Package], package: &Package, program: &str) -> String {
    let mut text =
        "[package]\nname = \"project\"\nedition = \"2024\"\n\n[workspace]\n\n[dependencies]\n".to_owned();
    for other in packages {
        let named = program.contains(&format!("{}::", other.name.replace('-', "_")));
        if other.name == package.name || named {
            text += &format!("{} = \"={}\"\n", other.name, other.version);
        }
    }
    text
}

/// Different packages in the output of `cargo tree --prefix none`.
fn count(tree: &str) -> usize {
    let names = tree.lines().filter(|l| !l.trim().is_empty()).map(|l| l.trim_end_matches(" (*)"));
    names.collect::<std::collections::BTreeSet<_>>().len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_counted_once() {
        assert_eq!(count("a v1\nb v1\nc v2\nb v1 (*)\n\n"), 3);
    }

    #[test]
    fn a_project_depends_on_what_its_program_names() {
        let package =
            |name: &str| Package { name: name.into(), version: "0.1.0".into(), ..Package::default() };
        let (ad, ocp, nlp) = (package("apsides-ad"), package("apsides-ocp"), package("apsides-nlp"));
        let text = manifest(&[&ad, &ocp, &nlp], &ocp, "use apsides_ad::Scalar;\nuse apsides_ocp::Ocp;\n");
        assert!(
            text.ends_with("[dependencies]\napsides-ad = \"=0.1.0\"\napsides-ocp = \"=0.1.0\"\n"),
            "{text}"
        );
    }
}
