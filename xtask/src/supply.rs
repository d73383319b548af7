//! Dependencies of others: their licences and sources by `deny.toml`, and a bill of materials.
//!
//! Both need `cargo metadata` and `Cargo.lock` alone, no network and no further tool. What `cargo deny` checks besides (versions that stand
//! twice, advisories) is left to it where it is there: see `demand`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde_json::{Value, json};

use crate::command::{cargo, output};
use crate::workspace::Workspace;

/// Package whose dependencies are in the bill of materials.
const PROGRAM: &str = "apsides-cli";
/// The registry in the words of `cargo metadata`.
const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

/// Checks licences and sources of all packages that any feature of any member needs, and that no dependency has a wildcard for its version.
pub(crate) fn check(workspace: &Workspace) -> Result<(), String> {
    let metadata = metadata(workspace)?;
    let rules = read(&workspace.root.join("deny.toml"))?.parse().map_err(|e| format!("deny.toml: {e}"))?;
    let findings = findings(&metadata, &rules)?;
    if findings.is_empty() {
        println!(
            "licences and sources of {} packages are those that deny.toml allows",
            packages(&metadata)?.len()
        );
        return Ok(());
    }
    Err(format!("{} packages that deny.toml does not allow:\n{}", findings.len(), findings.join("\n")))
}

/// Writes the bill of materials of the program, CycloneDX 1.5 as JSON, into a file; by default `apsides.cdx.json` in the target folder.
pub(crate) fn bill(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    let file = match arguments {
        [] => workspace.target.join("apsides.cdx.json"),
        [file] => file.into(),
        _ => return Err(format!("`sbom` takes a file or nothing, not `{}`", arguments.join(" "))),
    };
    let lock = read(&workspace.root.join("Cargo.lock"))?.parse().map_err(|e| format!("Cargo.lock: {e}"))?;
    let bill = materials(&metadata(workspace)?, &lock, PROGRAM)?;
    let text = serde_json::to_string_pretty(&bill).map_err(|e| e.to_string())?;
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    std::fs::write(&file, text + "\n").map_err(|e| format!("{}: {e}", file.display()))?;
    let count = bill["components"].as_array().map_or(0, Vec::len);
    println!("{count} components of {PROGRAM}: {}", file.display());
    Ok(())
}

fn read(file: &Path) -> Result<String, String> {
    std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))
}

fn metadata(workspace: &Workspace) -> Result<Value, String> {
    let all = ["metadata", "--format-version", "1", "--locked", "--all-features"];
    let text = output(&mut cargo(&workspace.root, all))?;
    serde_json::from_str(&text).map_err(|e| format!("cargo metadata: {e}"))
}

fn packages(metadata: &Value) -> Result<&Vec<Value>, String> {
    metadata["packages"].as_array().ok_or_else(|| "cargo metadata: no list `packages`".into())
}

fn named(package: &Value) -> String {
    format!("{} {}", package["name"].as_str().unwrap_or("?"), package["version"].as_str().unwrap_or("?"))
}

/// A sentence for each package that the rules do not allow.
fn findings(metadata: &Value, rules: &toml::Table) -> Result<Vec<String>, String> {
    let list = |table: &str, key: &str| -> Result<BTreeSet<&str>, String> {
        let list = rules.get(table).and_then(|t| t.get(key)).and_then(toml::Value::as_array);
        let list = list.ok_or_else(|| format!("deny.toml: no list `{table}.{key}`"))?;
        Ok(list.iter().filter_map(toml::Value::as_str).collect())
    };
    let (licences, registries) = (list("licenses", "allow")?, list("sources", "allow-registry")?);
    let mut found = Vec::new();
    for package in packages(metadata)? {
        let name = named(package);
        match package["source"].as_str() {
            None => {}
            Some(source) => {
                let url = source.strip_prefix("registry+").unwrap_or(source);
                if !registries.contains(url) {
                    found.push(format!("{name}: comes from {source}"));
                }
            }
        }
        match package["license"].as_str() {
            None => found.push(format!("{name}: states no licence")),
            Some(expression) => match allows(expression, &licences) {
                Ok(true) => {}
                Ok(false) => found.push(format!("{name}: licence {expression}")),
                Err(why) => found.push(format!("{name}: licence {expression}: {why}")),
            },
        }
        for dependency in package["dependencies"].as_array().into_iter().flatten() {
            let ours = package["source"].is_null() && dependency["path"].is_null();
            if ours && dependency["req"] == "*" {
                found.push(format!("{name}: any version of {}", dependency["name"].as_str().unwrap_or("?")));
            }
        }
    }
    Ok(found)
}

/// Says if a licence expression of SPDX, or of the former form with `/` for "or", can be met with the licences that are allowed.
fn allows(expression: &str, allowed: &BTreeSet<&str>) -> Result<bool, String> {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    let met = either(&words, &mut at, allowed)?;
    if at == words.len() { Ok(met) } else { Err(format!("`{}` is one word too many", words[at])) }
}

/// Alternatives; AND binds closer than OR.
fn either(words: &[&str], at: &mut usize, allowed: &BTreeSet<&str>) -> Result<bool, String> {
    let mut met = both(words, at, allowed)?;
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        met |= both(words, at, allowed)?;
    }
    Ok(met)
}

fn both(words: &[&str], at: &mut usize, allowed: &BTreeSet<&str>) -> Result<bool, String> {
    let mut met = licence(words, at, allowed)?;
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        met &= licence(words, at, allowed)?;
    }
    Ok(met)
}

fn licence(words: &[&str], at: &mut usize, allowed: &BTreeSet<&str>) -> Result<bool, String> {
    let word = *words.get(*at).ok_or("it ends early")?;
    *at += 1;
    match word {
        "(" => {
            let met = either(words, at, allowed)?;
            if words.get(*at) != Some(&")") {
                return Err("a parenthesis is not closed".into());
            }
            *at += 1;
            Ok(met)
        }
        "AND" | "OR" | "WITH" | ")" => Err(format!("`{word}` where a licence is expected")),
        licence if words.get(*at) == Some(&"WITH") => {
            let exception = *words.get(*at + 1).ok_or("it ends early")?;
            *at += 2;
            Ok(allowed.contains(format!("{licence} WITH {exception}").as_str()))
        }
        licence => Ok(allowed.contains(licence)),
    }
}

/// The bill of materials: the package and all that it is built from, without what only tests need.
fn materials(metadata: &Value, lock: &toml::Table, program: &str) -> Result<Value, String> {
    let packages: BTreeMap<&str, &Value> =
        packages(metadata)?.iter().filter_map(|p| Some((p["id"].as_str()?, p))).collect();
    let nodes = metadata["resolve"]["nodes"].as_array().ok_or("cargo metadata: no list `resolve.nodes`")?;
    let needed: BTreeMap<&str, Vec<&str>> =
        nodes.iter().filter_map(|n| Some((n["id"].as_str()?, built_from(n)))).collect();
    let root = packages.iter().find(|(_, p)| p["name"] == program);
    let (&root, _) = root.ok_or_else(|| format!("cargo metadata: no package `{program}`"))?;
    let (mut reached, mut open) = (BTreeSet::from([root]), vec![root]);
    while let Some(id) = open.pop() {
        let next = needed.get(id).into_iter().flatten().copied();
        open.extend(next.filter(|id| reached.insert(id)));
    }
    let sums = checksums(lock);
    let mut components = Vec::new();
    for id in reached.iter().filter(|id| **id != root) {
        let package = packages.get(id).ok_or_else(|| format!("cargo metadata: no package `{id}`"))?;
        components.push(component(package, "library", &sums));
    }
    let reference = |id: &&str| packages.get(*id).map(|p| purl(p));
    let dependencies: Vec<Value> = reached
        .iter()
        .map(|id| {
            let on: BTreeSet<String> = needed.get(id).into_iter().flatten().filter_map(reference).collect();
            json!({ "ref": reference(id), "dependsOn": on })
        })
        .collect();
    Ok(json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": { "component": component(packages[root], "application", &sums) },
        "components": components,
        "dependencies": dependencies,
    }))
}

/// Packages that a node of the resolved graph is built from; those of tests alone are left out.
fn built_from(node: &Value) -> Vec<&str> {
    let of_tests_alone =
        |d: &Value| d["dep_kinds"].as_array().is_some_and(|k| k.iter().all(|k| k["kind"] == "dev"));
    let dependencies = node["deps"].as_array().into_iter().flatten();
    dependencies.filter(|d| !of_tests_alone(d)).filter_map(|d| d["pkg"].as_str()).collect()
}

/// SHA-256 of packages by name and version.
fn checksums(lock: &toml::Table) -> BTreeMap<String, &str> {
    let packages = lock.get("package").and_then(toml::Value::as_array).into_iter().flatten();
    let of =
        |p: &'_ toml::Value| Some(format!("{} {}", p.get("name")?.as_str()?, p.get("version")?.as_str()?));
    packages.filter_map(|p| Some((of(p)?, p.get("checksum")?.as_str()?))).collect()
}

fn purl(package: &Value) -> String {
    format!("pkg:cargo/{}", named(package).replace(' ', "@"))
}

fn component(package: &Value, kind: &str, sums: &BTreeMap<String, &str>) -> Value {
    let mut component = json!({
        "type": kind,
        "bom-ref": purl(package),
        "name": package["name"],
        "version": package["version"],
        "purl": purl(package),
    });
    if let Some(expression) = package["license"].as_str() {
        // The former form has `/` for "or".
        let spaced = expression.replace(" / ", "/").replace('/', " OR ");
        component["licenses"] = json!([{ "expression": spaced }]);
    }
    if let Some(sum) = sums.get(&named(package)).filter(|_| package["source"] == REGISTRY) {
        component["hashes"] = json!([{ "alg": "SHA-256", "content": sum }]);
    }
    if let Some(url) = package["repository"].as_str() {
        component["externalReferences"] = json!([{ "type": "vcs", "url": url }]);
    }
    component
}

#[cfg(test)]
mod tests {
    use super::*;

    fn met(expression: &str) -> Result<bool, String> {
        allows(expression, &BTreeSet::from(["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"]))
    }

    #[test]
    fn licence_expressions_are_met_or_not() {
        for expression in [
            "MIT",
            "GPL-3.0 OR MIT",
            "Unlicense/MIT",
            "Apache-2.0 / MIT",
            "(GPL-3.0 OR MIT) AND Zlib",
            "Apache-2.0 WITH LLVM-exception OR GPL-2.0",
            "GPL-2.0 AND Zlib OR MIT",
        ] {
            assert_eq!(met(expression), Ok(true), "{expression}");
        }
        for expression in
            ["GPL-3.0", "MIT AND GPL-3.0", "Apache-2.0", "(MIT OR Zlib) AND AGPL-3.0", "Zlib AND (GPL-2.0)"]
        {
            assert_eq!(met(expression), Ok(false), "{expression}");
        }
        for expression in ["", "MIT OR", "(MIT", "MIT)", "AND MIT", "MIT WITH", "MIT Zlib"] {
            assert!(met(expression).is_err(), "{expression}");
        }
    }

    fn rules() -> toml::Table {
        "[licenses]\nallow = [\"MIT\"]\n[sources]\nallow-registry = [\"https://github.com/rust-lang/crates.io-index\"]"
            .parse()
            .unwrap()
    }

    #[test]
    fn packages_that_are_not_allowed_are_named() {
        let metadata = json!({ "packages": [
            { "name": "ours", "version": "1.0.0", "license": "MIT", "source": null, "dependencies": [
                { "name": "any", "req": "*", "path": null }, { "name": "beside", "req": "*", "path": "/w/beside" } ] },
            { "name": "good", "version": "1.0.0", "license": "MIT OR GPL-3.0", "source": REGISTRY, "dependencies": [] },
            { "name": "bad", "version": "2.0.0", "license": "AGPL-3.0", "source": REGISTRY, "dependencies": [] },
            { "name": "none", "version": "3.0.0", "license": null, "source": REGISTRY, "dependencies": [] },
            { "name": "forked", "version": "4.0.0", "license": "MIT", "source": "git+https://example.org/x", "dependencies": [] },
        ]});
        assert_eq!(
            findings(&metadata, &rules()).unwrap(),
            [
                "ours 1.0.0: any version of any",
                "bad 2.0.0: licence AGPL-3.0",
                "none 3.0.0: states no licence",
                "forked 4.0.0: comes from git+https://example.org/x",
            ]
        );
        assert!(findings(&json!({}), &rules()).is_err());
        assert!(findings(&metadata, &toml::Table::new()).unwrap_err().contains("licenses.allow"));
    }

    #[test]
    fn the_bill_has_what_the_program_is_built_from() {
        let package = |name: &str, source: Value| json!({ "id": name, "name": name, "version": "1.0.0", "license": "MIT/Zlib", "source": source });
        let needs = |name: &str, kind: Value| json!({ "pkg": name, "dep_kinds": [{ "kind": kind }] });
        let metadata = json!({
            "packages": [
                package("apsides-cli", Value::Null),
                package("a", REGISTRY.into()),
                package("b", REGISTRY.into()),
                package("of-tests", REGISTRY.into()),
            ],
            "resolve": { "nodes": [
                { "id": "apsides-cli", "deps": [needs("a", Value::Null), needs("of-tests", "dev".into())] },
                { "id": "a", "deps": [needs("b", "build".into()), needs("a", "dev".into())] },
                { "id": "b", "deps": [] },
                { "id": "of-tests", "deps": [] },
            ]},
        });
        let lock = "[[package]]\nname = \"a\"\nversion = \"1.0.0\"\nchecksum = \"ab12\"".parse().unwrap();
        let bill = materials(&metadata, &lock, "apsides-cli").unwrap();
        let names: Vec<_> =
            bill["components"].as_array().unwrap().iter().map(|c| c["purl"].as_str().unwrap()).collect();
        assert_eq!(names, ["pkg:cargo/a@1.0.0", "pkg:cargo/b@1.0.0"]);
        assert_eq!(bill["components"][0]["hashes"][0]["content"], "ab12");
        assert_eq!(bill["components"][0]["licenses"][0]["expression"], "MIT OR Zlib");
        assert_eq!(bill["metadata"]["component"]["type"], "application");
        let all = bill["dependencies"].as_array().unwrap();
        assert_eq!(all.len(), 3);
        assert_eq!(
            all.iter().find(|d| d["ref"] == "pkg:cargo/a@1.0.0").unwrap()["dependsOn"],
            json!(["pkg:cargo/b@1.0.0"])
        );
        assert!(materials(&metadata, &lock, "other").unwrap_err().contains("other"));
    }
}
