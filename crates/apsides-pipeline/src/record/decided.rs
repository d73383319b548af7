//! Decisions of missions on disk: sites on maps take longer than the solves that follow them.

use std::any::Any;
use std::borrow::Cow;
use std::sync::{Arc, LazyLock, PoisonError};

use serde::{Deserialize, Serialize};

use super::Directory;
use crate::Error;
use crate::outcome::Decisions;
use crate::pipeline::Pipeline;
use crate::regular_file;
use crate::sealed::unseal;
use crate::site::{ChosenSite, SiteSummary};

/// The file of the decisions of a mission, as TOML, which has numbers that are not finite.
#[derive(Serialize, Deserialize)]
struct KeptDecisions {
    /// Path of a key, with the bits of its number as digits: TOML has no integers of 64 bits without sign.
    values: Vec<(String, String)>,
    #[serde(default)]
    sites: Vec<SiteSummary>,
}

/// Paths of keys with their numbers.
type DecidedValues = Vec<(Cow<'static, str>, f64)>;

impl Pipeline {
    /// The decisions of the mission from the open record; else those of a search, which are kept there.
    pub(crate) fn kept_decisions(&self) -> Result<Decisions, Error> {
        let Some(record) = super::current() else { return self.decide_anew() };
        let Some(key) = record.key(self, None, false) else { return self.decide_anew() };
        let mission = self.clone();
        record.decisions(&key, move || mission.decide_anew())
    }
}

impl Directory {
    /// Decisions under a digest of all that decides them. Their maps are searched again only where somebody asks for the choice of a site that
    /// another process found.
    fn decisions(
        &self,
        key: &str,
        search: impl Fn() -> Result<Decisions, Error> + Send + 'static,
    ) -> Result<Decisions, Error> {
        let last = || self.decided.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = last().as_ref().filter(|(of, _)| of == key) {
            return Ok(known.clone());
        }
        let found = match self.read_decisions(key) {
            Some((values, sites)) => Decisions { values, sites: searched_again(sites, search) },
            None => {
                let found = search()?;
                if !found.values.is_empty()
                    && let Ok(text) = toml::to_string(&KeptDecisions::of(&found))
                {
                    self.write(&self.decisions_file(key), &text);
                }
                found
            }
        };
        *last() = Some((key.into(), found.clone()));
        Ok(found)
    }

    fn decisions_file(&self, key: &str) -> std::path::PathBuf {
        self.path.join(format!("{key}.decided.toml"))
    }

    fn read_decisions(&self, key: &str) -> Option<(DecidedValues, Vec<SiteSummary>)> {
        let content = regular_file::read(&self.decisions_file(key)).ok()?;
        let KeptDecisions { values, sites } = toml::from_str(unseal(&content)?).ok()?;
        let value = |(path, bits): (String, String)| {
            bits.parse().ok().map(|bits| (Cow::Owned(path), f64::from_bits(bits)))
        };
        Some((values.into_iter().map(value).collect::<Option<_>>()?, sites))
    }
}

impl KeptDecisions {
    fn of(decisions: &Decisions) -> Self {
        let value = |(path, number): &(Cow<'static, str>, f64)| {
            (path.clone().into_owned(), number.to_bits().to_string())
        };
        Self {
            values: decisions.values.iter().map(value).collect(),
            sites: decisions.sites.iter().map(|site| site.summary.clone()).collect(),
        }
    }
}

/// Sites that another process found, whose choices a search makes again where one is asked for: one search for all.
fn searched_again(
    sites: Vec<SiteSummary>,
    search: impl Fn() -> Result<Decisions, Error> + Send + 'static,
) -> Vec<ChosenSite> {
    let search: Box<dyn FnOnce() -> Option<Decisions> + Send> = Box::new(move || search().ok());
    let again = Arc::new(LazyLock::new(search));
    let site = |(place, summary): (usize, SiteSummary)| {
        let again = Arc::clone(&again);
        let choice = move || -> Option<Arc<dyn Any + Send + Sync>> {
            (**again).as_ref()?.sites.get(place).and_then(ChosenSite::choice)
        };
        ChosenSite::kept(summary, choice)
    };
    sites.into_iter().enumerate().map(site).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fs;
    use std::path::Path;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn summary(name: &str) -> SiteSummary {
        SiteSummary {
            map: name.into(),
            safe_fraction: 0.1,
            below: "safe".into(),
            candidates: [5, 2],
            offset_m: [1.0 / 3.0, -0.0, 5e-324],
            clearance_m: None,
            propellant_kg: [f64::NAN, 1.5],
            tilt_deg: Some(2.0),
            warning: None,
        }
    }

    fn directory(path: &Path) -> Directory {
        fs::create_dir_all(path).unwrap();
        Directory::at(path)
    }

    /// Decisions of another process are read, to the last bit; maps are searched only for a choice itself, and once for all.
    #[test]
    fn decisions_are_made_once() {
        let dir = tempfile::tempdir().unwrap();
        let searches = Arc::new(AtomicUsize::new(0));
        let count = Arc::clone(&searches);
        let search = move || {
            count.fetch_add(1, Ordering::Relaxed);
            Ok(Decisions {
                values: vec![("decided.speed_m_s".into(), 0.1 + 0.2), ("decided.mass_kg".into(), f64::NAN)],
                sites: vec![ChosenSite::new(summary("coarse"), 7_u8), ChosenSite::new(summary("fine"), 8_u8)],
            })
        };
        let searched = || searches.load(Ordering::Relaxed);
        let first = directory(dir.path());
        let found = first.decisions("a", search.clone()).unwrap();
        first.decisions("a", search.clone()).unwrap();
        assert_eq!((searched(), found.sites[1].choice_as::<u8>()), (1, Some(&8)));
        let later = directory(dir.path());
        let read = later.decisions("a", search.clone()).unwrap();
        assert_eq!(searched(), 1);
        let bits =
            |d: &Decisions| d.values.iter().map(|(p, v)| (p.to_string(), v.to_bits())).collect::<Vec<_>>();
        assert_eq!(bits(&read), bits(&found));
        for (a, b) in read.sites.iter().zip(&found.sites) {
            assert_eq!(format!("{:?}", a.summary), format!("{:?}", b.summary));
        }
        assert_eq!((read.sites[0].choice_as::<u8>(), read.sites[1].choice_as::<u8>()), (Some(&7), Some(&8)));
        assert_eq!(searched(), 2);
        // Another mission, and a file that was altered.
        later.decisions("b", search.clone()).unwrap();
        let file = later.decisions_file("a");
        let text = fs::read_to_string(&file).unwrap();
        fs::write(&file, text.replace("safe", "SAFE")).unwrap();
        directory(dir.path()).decisions("a", search).unwrap();
        assert_eq!(searched(), 4);
    }
}
