//! Scenarios that a sweep has made.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use crate::scenario::Scenario;

/// Scenarios that are kept.
const CACHED: usize = 32;

pub(super) type Prepared = Result<Arc<Scenario>, String>;

/// The last scenarios that were made, by what was set in them.
#[derive(Debug, Default)]
pub(super) struct ScenarioCache(Mutex<VecDeque<(Vec<String>, Prepared)>>);

impl ScenarioCache {
    pub(super) fn get(&self, settings: &[String], make: impl FnOnce() -> Prepared) -> Prepared {
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = lock().iter().find(|(known, _)| known == settings) {
            return known.clone();
        }
        // Made without the lock: several may be made at once.
        let made = make();
        let mut kept = lock();
        kept.push_front((settings.to_vec(), made.clone()));
        kept.truncate(CACHED);
        made
    }
}
