//! Writing pictures, on a thread of its own.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::json;

use super::document::Document;
use super::loader::{LoadedMap, LoadedScene};
use super::tasks::{TaskResult, Tasks};
use super::worker::Snapshot;
use crate::error::Result;
use crate::image::check_writable;
use crate::output::record::{Phases, Record, settings_of};
use crate::output::{self, Exposure, Films, LayerName, PictureOptions, write_picture};
use crate::tone::Tone;

/// What a picture is written from.
pub(super) struct Picture {
    /// The film and what was done for it.
    pub(super) snapshot: Arc<Snapshot>,
    /// Stops, automatic ones included.
    pub(super) exposure_ev: f32,
    /// The settings.
    pub(super) document: Document,
    /// The scene.
    pub(super) scene: LoadedScene,
    /// The map.
    pub(super) map: LoadedMap,
    /// Tone curve and look.
    pub(super) tone: Tone,
}

/// Where the picture is to be written once it has its full size.
#[derive(Default)]
pub(super) struct Saves {
    /// Paths that wait for it.
    pub(super) waiting: Vec<PathBuf>,
}

impl Saves {
    /// Writes a picture to all paths that wait.
    pub(super) fn write(&mut self, picture: Picture, tasks: &mut Tasks) {
        let picture = Arc::new(picture);
        for path in self.waiting.drain(..) {
            let picture = Arc::clone(&picture);
            tasks.write("save", move || {
                write(&path, &picture)?;
                let snapshot = &picture.snapshot;
                let (film, map) = (&snapshot.main.film, &snapshot.request.environment);
                let (path, width, height) = (path.display(), film.width, film.height);
                let saved = format!("Saved {path}, {width} x {height} pixels");
                let remarks = output::remarks(film, map).into_iter();
                Ok(TaskResult::Done(remarks.fold(saved, |all, remark| format!("{all}; {remark}"))))
            });
        }
    }

    /// Gives up what waits: a sentence each, with the cause.
    pub(super) fn give_up(&mut self, why: &str) -> Vec<String> {
        let sentence = |path: PathBuf| format!("{}: not saved: {why}", path.display());
        self.waiting.drain(..).map(sentence).collect()
    }
}

/// Writes what is shown as `.png`; as `.exr` the film with all layers, and what is shown without noise as one more.
fn write(path: &Path, picture: &Picture) -> Result<()> {
    check_writable(path)?;
    let snapshot = &picture.snapshot;
    let document = &picture.document;
    let mut notices = picture.scene.world.scene.notices.clone();
    notices.extend(&picture.map.notices);
    let record = Record {
        scene: &document.scene,
        map: &document.map,
        world: &snapshot.request.world,
        environment: &snapshot.request.environment,
        film: &snapshot.main.film,
        figures: &snapshot.main.figures,
        cached_seconds: snapshot.cached_seconds,
        gpu: snapshot.main.gpu.as_deref().cloned(),
        phases: &Phases {
            load_scene_seconds: picture.scene.seconds[0],
            build_bvh_seconds: picture.scene.seconds[1],
            load_map_seconds: picture.map.seconds[0],
            build_table_seconds: picture.map.seconds[1],
        },
        notices: &notices,
        with_times: true,
        options: settings(picture),
    };
    let options = PictureOptions {
        exposure: Exposure::Stops(picture.exposure_ev),
        tone: picture.tone.clone(),
        denoiser: document.look.denoise.then_some(document.look.denoiser),
        white_balance: document.look.white_balance,
        layers: vec![LayerName::All, LayerName::Denoised],
        ..PictureOptions::default()
    };
    // As it is shown. RGB of linear pictures is exact.
    let cached = snapshot.backdrop.as_ref().map(|cached| (&*cached.film, cached.worth));
    let films = Films { film: record.film, cached, denoised: None, groups: &snapshot.groups };
    write_picture(path, &options, films, record.metadata())
}

fn settings(picture: &Picture) -> Vec<(&'static str, serde_json::Value)> {
    let document = &picture.document;
    let request = &picture.snapshot.request;
    let mut settings = settings_of(&request.view, &request.world);
    let lamp_edits = document.lamp_edits.iter().map(|(name, edit)| edit.to_text(name));
    // As `--material` reads them.
    let LoadedScene { changes, materials, .. } = &picture.scene;
    let name = |number: &u32| Some(&materials.get(*number as usize)?.name);
    let edits = changes.materials.iter();
    let edits = edits.filter_map(|(number, edit)| Some(edit.to_text(name(number)?)));
    settings.extend([
        ("env_rotation_degrees", json!(document.rotation_degrees)),
        ("env_intensity", json!(document.intensity)),
        ("env_sun", json!(document.sun)),
        ("lamps_factor", json!(document.lamps)),
        ("lamp_edits", json!(lamp_edits.collect::<Vec<String>>())),
        ("materials", json!(edits.collect::<Vec<String>>())),
    ]);
    settings
}
