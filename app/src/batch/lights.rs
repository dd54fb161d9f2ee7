//! The lights of a batch: read once and kept as long as the fits that use them are near, encoded once for all of them.

use crate::{
    inputs::{LoadedEnvironment, load_environment},
    settings::EnvironmentSettings,
};
use lookalike::{graph::Blob, plan::encode_light};
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// What lights that nobody uses at the moment may take, in bytes (256 MiB); the last one is kept whatever it takes.
const MOST_BYTES: usize = 256 << 20;

/// A light, and the same as the nodes read it.
#[derive(Debug, Clone)]
pub(super) struct Light {
    pub(super) loaded: LoadedEnvironment,
    pub(super) encoded: Blob,
}

/// The lights that were used last.
#[derive(Debug, Default)]
pub(super) struct Lights {
    /// The latest last.
    kept: Mutex<VecDeque<(EnvironmentSettings, Arc<Light>)>>,
}

impl Lights {
    /// The light of these settings: the one that is here, else from its file.
    pub(super) fn get(&self, settings: &EnvironmentSettings) -> anyhow::Result<Arc<Light>> {
        if let Some(light) = self.find(settings) {
            return Ok(light);
        }
        // Two that want it at the same time may both read it; nobody waits for the other's file.
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
        // A panic cannot leave it half changed in a way that matters: at worst one is missing.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
