//! The lights of a batch: read and encoded once, and kept while fits that use them are near.

use crate::{
    inputs::{LoadedEnvironment, load_environment},
    settings::EnvironmentSettings,
};
use lookalike::{graph::Blob, plan::encode_light};
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// The most bytes that unused lights may take (256 MiB). The last one is kept whatever its size.
const MOST_BYTES: usize = 256 << 20;

/// A light, and its encoding for nodes.
#[derive(Debug, Clone)]
pub(super) struct Light {
    pub(super) loaded: LoadedEnvironment,
    pub(super) encoded: Blob,
}

/// The most recently used lights.
#[derive(Debug, Default)]
pub(super) struct Lights {
    /// In order of use, latest last.
    kept: Mutex<VecDeque<(EnvironmentSettings, Arc<Light>)>>,
}

impl Lights {
    /// The light of these settings, from memory or from its file.
    pub(super) fn get(&self, settings: &EnvironmentSettings) -> anyhow::Result<Arc<Light>> {
        if let Some(light) = self.find(settings) {
            return Ok(light);
        }
        // Two threads that need one light at the same time may both read it, so that neither waits for another file.
        let loaded = load_environment(settings)?;
        let encoded = encode_light(&loaded.environment)?;
        let light = Arc::new(Light { loaded, encoded });
        let mut kept = self.lock();
        kept.push_back((settings.clone(), Arc::clone(&light)));
        let bytes =
            |kept: &VecDeque<(_, Arc<Light>)>| kept.iter().map(|(_, light)| 2 * light.encoded.len()).sum::<usize>();
        while kept.len() > 1 && bytes(&kept) > MOST_BYTES {
            kept.pop_front();
        }
        Ok(light)
    }

    fn find(&self, settings: &EnvironmentSettings) -> Option<Arc<Light>> {
        let mut kept = self.lock();
        let place = kept.iter().position(|(known, _)| known == settings)?;
        let found = kept.remove(place)?;
        let light = Arc::clone(&found.1);
        kept.push_back(found);
        Some(light)
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<(EnvironmentSettings, Arc<Light>)>> {
        // A panic leaves at worst one light missing.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
