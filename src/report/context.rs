//! What a report is made of: its options, its devices, its files, and the state of the row at state.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::machine::OpenDevice;
use super::measure::Run;
use super::pages::duration;
use super::plan::{MIN_PICTURES, Method, Plan};
use super::prepared_row::PreparedRow;
use super::reference::Reference;
use super::store::Store;
use crate::denoise::Denoiser;
use crate::digest::Digest;
use crate::image::Image;

/// Options of making a report that do not change what it measures.
pub struct Options<'a> {
    /// The report's folder.
    pub folder: &'a Path,
    /// Folder of references; `None` for one in the report's.
    pub references: Option<&'a Path>,
    /// The GPU whose name contains this.
    pub adapter: Option<&'a str>,
    /// Stops the report when it becomes true.
    pub cancel: &'a AtomicBool,
    /// Is called with the step at state.
    pub progress: &'a dyn Fn(String),
    /// Is called with finished steps and failures.
    pub tell: &'a dyn Fn(String),
}

/// All that stays the same while a report is made.
pub(super) struct Context<'a> {
    pub(super) plan: &'a Plan,
    pub(super) options: &'a Options<'a>,
    pub(super) store: Store,
    pub(super) devices: Vec<OpenDevice>,
    pub(super) machine_digest: Digest,
    /// A given reference and its digest.
    pub(super) file_reference: Option<(Image, Digest)>,
}

/// A row that is measured.
pub(super) struct RowState {
    pub(super) prepared: PreparedRow,
    pub(super) reference: Option<Reference>,
    /// Runs by device and method, with the names they are stored under.
    pub(super) runs: Vec<Vec<Vec<(String, Run)>>>,
    /// By device, the reason why it cannot render this row.
    pub(super) refusals: Vec<Option<String>>,
    /// Rows that come after it.
    pub(super) rows_after: usize,
}

impl Context<'_> {
    pub(super) fn is_cancelled(&self) -> bool {
        self.options.cancel.load(Ordering::Relaxed)
    }

    /// All pictures of a run and the denoised ones, one for each point; `None` if some are missing.
    pub(super) fn pictures(&self, key: &str, run: &Run) -> Option<[Vec<Image>; 2]> {
        let read = |key: &str| {
            let pictures = self.store.read_pictures(key, self.plan.effort.frame.size)?;
            (pictures.len() == run.points.len()).then_some(pictures)
        };
        Some([read(key)?, read(&denoised(key))?])
    }

    /// The last of the pictures stored under a name.
    pub(super) fn last_picture(&self, key: &str) -> Option<Image> {
        self.store.read_pictures(key, self.plan.effort.frame.size)?.pop()
    }

    /// The last picture of each of these runs; `None` if one is missing.
    pub(super) fn last_pictures(&self, runs: &[(String, Run)]) -> Option<Vec<Image>> {
        runs.iter().map(|(key, _)| self.last_picture(key)).collect()
    }

    /// Name of a run: its title and a digest of all that it depends on.
    pub(super) fn key(&self, row: &RowState, device: usize, method: &Method, seed: u32) -> String {
        let device = &self.devices[device];
        let digest = self.machine_digest.debug(&row.prepared.digest).debug(&(
            &method.settings,
            Denoiser::Best.name(),
            &device.name,
            self.plan.effort.seconds,
            seed,
            self.file_reference.as_ref().map(|(_, digest)| digest),
        ));
        let readable = format!("{}-{}-{}", row.prepared.title, device.device.title(), method.name);
        let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
        let readable: String = readable.chars().map(plain).collect();
        format!("{}_{seed}_{digest}", &readable[readable.len().saturating_sub(80)..])
    }

    /// Index of the device that renders references: a real GPU that supports the row, or the first that does.
    pub(super) fn fastest(&self, state: &RowState) -> usize {
        let can = |index: &usize| state.refusals[*index].is_none();
        let all = || (0..self.devices.len()).filter(can);
        all().find(|index| self.devices[*index].is_real_gpu()).or_else(|| all().next()).unwrap_or(0)
    }

    /// The reference so far with its number of pictures; `None` with too few pictures.
    pub(super) fn reference(&self, state: &RowState) -> Option<(Image, Option<u32>)> {
        if let Some((image, _)) = &self.file_reference {
            return Some((image.clone(), None));
        }
        let reference = state.reference.as_ref()?;
        let pictures = reference.facts.pictures;
        (pictures >= MIN_PICTURES).then(|| (reference.image(), Some(pictures)))
    }

    /// Reports the step at work with the remaining time: as given for this row, as expected for the `rows_after`.
    pub(super) fn say(&self, step: &str, row_seconds: f64, rows_after: usize) {
        let left = row_seconds + rows_after as f64 * self.plan.expected_row_seconds();
        (self.options.progress)(format!("{step}, {} left", duration(left)));
    }
}

/// The name under which the denoised pictures of a run are stored.
pub(super) fn denoised(key: &str) -> String {
    format!("{key}_denoised")
}
