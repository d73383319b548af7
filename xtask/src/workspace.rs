//! Packages of the workspace, from `cargo metadata`, and its files, from git.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::command::{cargo_program, output};

/// The purpose of a dependency.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// The library or program itself.
    Normal,
    /// Tests, examples, benches.
    Development,
    /// A build script.
    Build,
}

/// A dependency as declared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Dependency {
    pub(crate) name: String,
    pub(crate) purpose: Purpose,
}

/// A member of the workspace.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Package {
    pub(crate) name: String,
    pub(crate) version: String,
    /// It may go to a registry.
    pub(crate) publish: bool,
    pub(crate) repository: String,
    pub(crate) documentation: String,
    /// It says how docs.rs builds it.
    pub(crate) docs_rs: bool,
    pub(crate) features: Vec<String>,
    /// It has a library target.
    pub(crate) library: bool,
    /// Folder of its manifest, relative to the root.
    pub(crate) folder: PathBuf,
    pub(crate) dependencies: Vec<Dependency>,
    /// Names of its bench targets.
    pub(crate) benches: Vec<String>,
    /// Names of its example targets.
    pub(crate) examples: Vec<String>,
}

/// The workspace.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Workspace {
    pub(crate) root: PathBuf,
    /// Folder in which cargo builds.
    pub(crate) target: PathBuf,
    pub(crate) packages: Vec<Package>,
}

impl Workspace {
    /// The workspace of the current directory.
    pub(crate) fn load() -> Result<Self, String> {
        let mut metadata = Command::new(cargo_program());
        Self::parse(&output(metadata.args(["metadata", "--format-version", "1", "--no-deps"]))?)
    }

    /// Reads the JSON text of `cargo metadata --no-deps`.
    pub(crate) fn parse(metadata: &str) -> Result<Self, String> {
        let json: Value = serde_json::from_str(metadata).map_err(|e| format!("cargo metadata: {e}"))?;
        let root = PathBuf::from(text(&json, "workspace_root")?);
        let packages =
            array(&json, "packages")?.iter().map(|p| package(p, &root)).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { target: PathBuf::from(text(&json, "target_directory")?), root, packages })
    }

    /// A member by name.
    pub(crate) fn package(&self, name: &str) -> Result<&Package, String> {
        self.packages
            .iter()
            .find(|p| p.name == name)
            .ok_or_else(|| format!("the workspace has no package `{name}`"))
    }

    /// Files that git tracks or would track, relative to the root, sorted; symbolic links to folders are left out.
    pub(crate) fn files(&self) -> Result<Vec<String>, String> {
        let mut git = Command::new("git");
        git.current_dir(&self.root).args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]);
        let names = match git.output() {
            Ok(out) if out.status.success() => String::from_utf8(out.stdout)
                .map_err(|_| "git ls-files: a file name is not UTF-8".to_owned())?
                .split_terminator('\0')
                .map(str::to_owned)
                .collect(),
            _ => self.files_without_git()?,
        };
        let files: BTreeSet<String> = names.into_iter().filter(|n| self.root.join(n).is_file()).collect();
        Ok(files.into_iter().collect())
    }

    /// All files but those of builds and runs: for a copy of the sources without a repository.
    fn files_without_git(&self) -> Result<Vec<String>, String> {
        let mut found = Vec::new();
        let mut folders = vec![self.root.clone()];
        while let Some(folder) = folders.pop() {
            let unreadable = |e: std::io::Error| format!("{}: {e}", folder.display());
            for entry in std::fs::read_dir(&folder).map_err(unreadable)? {
                let entry = entry.map_err(unreadable)?;
                let name = entry.file_name();
                let kind = entry.file_type().map_err(unreadable)?;
                let path = entry.path();
                if kind.is_dir() {
                    let skipped = ["target", "results", ".git", "__pycache__"].iter().any(|s| name == *s);
                    if !skipped && path != self.target {
                        folders.push(path);
                    }
                } else if let Ok(relative) = path.strip_prefix(&self.root) {
                    found.push(relative.to_string_lossy().replace('\\', "/"));
                }
            }
        }
        Ok(found)
    }
}

fn package(json: &Value, root: &Path) -> Result<Package, String> {
    let manifest = PathBuf::from(text(json, "manifest_path")?);
    let folder = manifest.parent().unwrap_or(&manifest);
    let targets = array(json, "targets")?;
    let of_kind = |kind: &str| {
        let has = |t: &&Value| t["kind"].as_array().is_some_and(|k| k.iter().any(|v| v == kind));
        targets.iter().filter(has).filter_map(|t| t["name"].as_str()).map(str::to_owned).collect()
    };
    let optional = |key: &str| json[key].as_str().unwrap_or_default().to_owned();
    Ok(Package {
        name: text(json, "name")?.to_owned(),
        version: optional("version"),
        // An empty list of registries is `publish = false`.
        publish: json["publish"].as_array().is_none_or(|registries| !registries.is_empty()),
        repository: optional("repository"),
        documentation: optional("documentation"),
        docs_rs: json["metadata"]["docs"]["rs"].is_object(),
        features: json["features"].as_object().map(|f| f.keys().cloned().collect()).unwrap_or_default(),
        library: targets.iter().any(|t| t["kind"].as_array().is_some_and(|k| k.iter().any(|v| v == "lib"))),
        folder: folder.strip_prefix(root).unwrap_or(folder).to_owned(),
        dependencies: array(json, "dependencies")?.iter().map(dependency).collect::<Result<_, _>>()?,
        benches: of_kind("bench"),
        examples: of_kind("example"),
    })
}

fn dependency(json: &Value) -> Result<Dependency, String> {
    let purpose = match json["kind"].as_str() {
        None => Purpose::Normal,
        Some("dev") => Purpose::Development,
        Some("build") => Purpose::Build,
        Some(other) => return Err(format!("cargo metadata: unknown kind of dependency `{other}`")),
    };
    Ok(Dependency { name: text(json, "name")?.to_owned(), purpose })
}

fn text<'a>(json: &'a Value, key: &str) -> Result<&'a str, String> {
    json[key].as_str().ok_or_else(|| format!("cargo metadata: no text `{key}`"))
}

fn array<'a>(json: &'a Value, key: &str) -> Result<&'a Vec<Value>, String> {
    json[key].as_array().ok_or_else(|| format!("cargo metadata: no list `{key}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metadata_is_read() {
        let json = r#"{"workspace_root":"/w","target_directory":"/w/target","packages":[{"name":"a",
            "manifest_path":"/w/crates/a/Cargo.toml",
            "dependencies":[{"name":"b","kind":null},{"name":"c","kind":"dev"},{"name":"d","kind":"build"}],
            "targets":[{"name":"a","kind":["lib"]},{"name":"speed","kind":["bench"]},{"name":"e","kind":["example"]}]}]}"#;
        let workspace = Workspace::parse(json).unwrap();
        let a = workspace.package("a").unwrap();
        assert_eq!(a.folder, Path::new("crates/a"));
        assert_eq!(a.benches, ["speed"]);
        assert_eq!(a.examples, ["e"]);
        assert!(a.library && a.publish && !a.docs_rs && a.features.is_empty());
        let purposes: Vec<_> = a.dependencies.iter().map(|d| d.purpose).collect();
        assert_eq!(purposes, [Purpose::Normal, Purpose::Development, Purpose::Build]);
        assert!(workspace.package("b").is_err());
    }

    #[test]
    fn malformed_metadata_is_an_error() {
        assert!(Workspace::parse("{").is_err());
        assert!(Workspace::parse("{}").unwrap_err().contains("workspace_root"));
    }
}
