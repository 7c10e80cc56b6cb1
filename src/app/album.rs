//! Kept pictures as files, for the next window.
//!
//! Each is an OpenEXR file with the settings that made it in its header, and it in small. They are read and
//! written one after another on a thread of its own.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::{SystemTime, UNIX_EPOCH};

use super::document::Document;
use super::kept::{Kept, Pixels};
use super::screen::color_image;
use super::settings_file;
use crate::error::{Error, Result};
use crate::image::{ExrPicture, Image, Rgb8, read_exr_metadata, read_exr_preview, write_exr};
use crate::scene::builtin;

/// Names of the header's attributes.
const NAME: &str = "lightgrid.kept.name";
const SUMMARY: &str = "lightgrid.kept.summary";
const DOCUMENT: &str = "lightgrid.kept.document";

/// Most pictures that are read: no window keeps as many.
const MOST_READ: usize = 64;

/// The folder of kept pictures.
pub(super) struct Album {
    folder: PathBuf,
    jobs: Option<Sender<Job>>,
    thread: Option<JoinHandle<()>>,
    written: u32,
}

enum Job {
    Write { file: PathBuf, picture: Arc<Image>, texts: Vec<(String, String)>, small: Rgb8 },
    Remove(PathBuf),
}

impl Album {
    /// Begins to read a folder, which need not be there. `report` is told all that is in it, and later what
    /// fails.
    pub(super) fn open(
        folder: PathBuf,
        report: impl Fn(Result<Vec<Kept>>) + Send + 'static,
    ) -> Result<Self> {
        let (jobs, orders) = channel();
        let place = folder.clone();
        let thread = std::thread::Builder::new()
            .name("kept pictures".to_owned())
            .spawn(move || {
                let (found, failures): (Vec<_>, Vec<_>) =
                    files(&place).iter().map(|file| read(file)).partition(Result::is_ok);
                report(Ok(found.into_iter().filter_map(Result::ok).collect()));
                failures.into_iter().filter_map(Result::err).for_each(|error| report(Err(error)));
                for job in orders {
                    if let Err(error) = carry_out(job) {
                        report(Err(error));
                    }
                }
            })
            .map_err(|error| Error::new(format!("no thread for kept pictures: {error}")))?;
        Ok(Self { folder, jobs: Some(jobs), thread: Some(thread), written: 0 })
    }

    /// Writes a picture, one day soon; where.
    pub(super) fn write(
        &mut self,
        [name, summary]: [&str; 2],
        picture: &Arc<Image>,
        document: &Document,
        small: &Rgb8,
    ) -> Result<PathBuf> {
        // In the order of time, and never that of another window.
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let (time, process) = (since.as_millis(), std::process::id());
        let file = self.folder.join(format!("{time:015}-{process}-{}.exr", self.written));
        self.written += 1;
        let lasting = Document {
            scene: lasting(&document.scene, builtin::names().contains(&document.scene.as_str())),
            map: lasting(&document.map, document.map.starts_with("sky:")),
            ..document.clone()
        };
        let document = crate::output::record::to_json(&lasting)?;
        let texts = [(NAME, name), (SUMMARY, summary), (DOCUMENT, &document)]
            .map(|(key, text)| (key.to_owned(), text.to_owned()));
        let (picture, small) = (Arc::clone(picture), small.clone());
        self.send(Job::Write { file: file.clone(), picture, texts: texts.into(), small });
        Ok(file)
    }

    /// Removes a picture's file.
    pub(super) fn remove(&self, file: PathBuf) {
        self.send(Job::Remove(file));
    }

    fn send(&self, job: Job) {
        if let Some(jobs) = &self.jobs {
            // The thread ends after this does.
            let _ = jobs.send(job);
        }
    }
}

impl Drop for Album {
    /// Waits until everything is written.
    fn drop(&mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // A panic there was reported there.
            let _ = thread.join();
        }
    }
}

/// A name that means the same in another folder.
fn lasting(name: &str, is_builtin: bool) -> String {
    let absolute = || std::path::absolute(name).ok()?.to_str().map(str::to_owned);
    if is_builtin { name.to_owned() } else { absolute().unwrap_or_else(|| name.to_owned()) }
}

fn carry_out(job: Job) -> Result<()> {
    match job {
        Job::Write { file, picture, texts, small } => {
            if let Some(folder) = file.parent() {
                std::fs::create_dir_all(folder).map_err(|e| Error::at(folder, e))?;
            }
            let picture = ExrPicture {
                image: &picture,
                layers: Vec::new(),
                metadata: &texts,
                preview: Some(&small),
            };
            write_exr(&file, picture)
        }
        Job::Remove(file) => match std::fs::remove_file(&file) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::at(&file, e)),
            _ => Ok(()),
        },
    }
}

/// The newest files of a folder, oldest first.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "exr"))
        .collect();
    files.sort();
    files.split_off(files.len().saturating_sub(MOST_READ))
}

/// A kept picture but its pixels, which are read when they are needed.
fn read(file: &Path) -> Result<Kept> {
    let texts = read_exr_metadata(file)?;
    let text = |key: &str| {
        let found = texts.iter().find(|(name, _)| name == key).map(|(_, text)| text.as_str());
        found.ok_or_else(|| Error::at(file, "is no kept picture"))
    };
    let document: Document = serde_json::from_str(text(DOCUMENT)?)
        .map_err(|error| Error::at(file, format!("settings not understood: {error}")))?;
    if !(document.is_sound() && settings_file::is_within_bounds(&document)) {
        return Err(Error::at(file, "its settings are out of bounds"));
    }
    let small = read_exr_preview(file)?;
    Ok(Kept {
        name: text(NAME)?.to_owned(),
        summary: text(SUMMARY)?.to_owned(),
        pixels: Arc::new(Pixels::of_file(file.to_owned())),
        document,
        small: small.as_ref().map(color_image).unwrap_or_default(),
        texture: None,
        file: Some(file.to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::mpsc::Receiver;
    use std::time::Duration;

    use super::*;
    use crate::app::document::Viewpoint;
    use crate::scene::{Camera, MaterialEdit, Medium};

    type Report = Receiver<Result<Vec<Kept>>>;

    fn open(folder: &Path) -> (Album, Report) {
        let (sender, report) = channel();
        let album = Album::open(folder.to_owned(), move |found| {
            let _ = sender.send(found);
        });
        (album.expect("a thread"), report)
    }

    fn next(report: &Report) -> Result<Vec<Kept>> {
        report.recv_timeout(Duration::from_secs(60)).expect("an answer")
    }

    fn picture() -> (Arc<Image>, Rgb8) {
        let mut image = Image::filled(5, 3, [0.25, 1e-3, 700.0]);
        image.pixels[7] = [0.1, 0.2, 0.3];
        (Arc::new(image), Rgb8 { width: 2, height: 1, pixels: vec![[1, 200, 3], [255, 0, 9]] })
    }

    fn document() -> Document {
        let camera = Camera::look_at(glam::Vec3::ONE, glam::Vec3::ZERO, 0.7);
        let mut document = Document {
            scene: "some/scene.glb".to_owned(),
            map: "sky:sunset".to_owned(),
            rotation_degrees: 12.5,
            fog: Some(Medium { scattering: glam::Vec3::splat(0.1), ..Medium::default() }),
            viewpoint: Some(Viewpoint::of(&camera, 1.0)),
            region: Some([0.0, 0.25, 0.5, 1.0]),
            ..Document::default()
        };
        let edit = MaterialEdit { roughness: Some(0.3), hidden: true, ..MaterialEdit::default() };
        document.materials.insert(3, edit);
        document
    }

    #[test]
    fn the_next_window_finds_what_was_kept() {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = temporary.path().join("deep/pictures");
        let (mut album, report) = open(&folder);
        assert_eq!(next(&report).expect("nothing yet").len(), 0);
        let (image, small) = picture();
        for name in ["Picture 1", "Picture 2"] {
            album.write([name, "plain, 3 samples"], &image, &document(), &small).expect("told");
        }
        // The last picture before the window is closed is not lost.
        drop(album);
        let (album, report) = open(&folder);
        let kept = next(&report).expect("read");
        let names: Vec<_> = kept.iter().map(|kept| kept.name.as_str()).collect();
        assert_eq!(names, ["Picture 1", "Picture 2"]);
        let scene = std::path::absolute("some/scene.glb").expect("a path");
        let expected = Document { scene: scene.display().to_string(), ..document() };
        assert_eq!(kept[1].document, expected);
        assert_eq!(kept[1].summary, "plain, 3 samples");
        assert_eq!(kept[1].small, color_image(&small));
        assert_eq!(kept[1].pixels.get(), Ok(image));
        album.remove(kept[0].file.clone().expect("a file"));
        drop(album);
        assert_eq!(files(&folder), [kept[1].file.clone().expect("a file")]);
    }

    #[test]
    fn what_cannot_be_read_is_told_and_left_alone() {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = temporary.path();
        let (image, small) = picture();
        let (mut album, _report) = open(folder);
        let mut file = |document: &Document| {
            album.write(["Picture 1", ""], &image, document, &small).expect("told")
        };
        let sound = file(&document());
        let unsound = file(&Document { intensity: -1.0, ..document() });
        drop(album);
        fs::write(folder.join("0-noise.exr"), b"noise").expect("written");
        let plain = folder.join("1-plain.exr");
        let other = ExrPicture { image: &image, layers: vec![], metadata: &[], preview: None };
        write_exr(&plain, other).expect("written");
        let (album, report) = open(folder);
        let found: Vec<_> = next(&report).expect("read").iter().map(|k| k.file.clone()).collect();
        assert_eq!(found, [Some(sound)]);
        let sentences: Vec<_> = (0..3)
            .map(|_| next(&report).err().map(|error| error.to_string()).expect("a sentence"))
            .collect();
        assert!(sentences[0].contains("0-noise.exr: "), "{sentences:?}");
        assert!(sentences[2].ends_with("1-plain.exr: is no kept picture"), "{sentences:?}");
        assert!(sentences[1].ends_with("its settings are out of bounds"), "{sentences:?}");
        drop(album);
        assert!(unsound.exists() && plain.exists());
        // Where nothing can be written, that is said.
        let (mut album, report) = open(&plain);
        assert_eq!(next(&report).expect("nothing").len(), 0);
        album.write(["Picture 1", ""], &image, &document(), &small).expect("told");
        let sentence = next(&report).err().expect("a sentence").to_string();
        assert!(sentence.contains("1-plain.exr"), "{sentence}");
    }
}
