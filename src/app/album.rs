//! Kept pictures as files, for the next window.
//!
//! Each is an OpenEXR file with the settings that made it in its header, and it in small. They are read and
//! written one after another on a thread of its own.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::time::{SystemTime, UNIX_EPOCH};

use super::document::Document;
use super::kept_picture::{KeptPicture, MAX_PICTURES, Pixels, SMALL_WIDTH};
use super::settings_file;
use super::threads::Joined;
use crate::error::{At as _, Error, Result};
use crate::image::{ExrPicture, Rgb8, read_exr_metadata, read_exr_preview, write_exr};
use crate::output::record::to_json;
use crate::scene::SceneOptions;

/// Names of the header's attributes.
const NAME: &str = "lightgrid.kept.name";
const SUMMARY: &str = "lightgrid.kept.summary";
const DOCUMENT: &str = "lightgrid.kept.document";
const OF_SCENE: &str = "lightgrid.kept.scene-options";

/// Most files that are looked at for those that can be read.
const MAX_TRIED: usize = 64;

/// The folder of kept pictures. Dropped, it waits until everything is written.
pub(super) struct Album {
    folder: PathBuf,
    /// It goes before the thread, which then ends.
    jobs: Sender<Job>,
    _thread: Joined,
    written: u32,
}

/// What is done to a file.
type Job = Box<dyn FnOnce() -> Result<()> + Send>;

impl Album {
    /// Begins to read a folder, which need not be there. `report` is told the newest that are in it, and
    /// later what fails.
    pub(super) fn open(
        folder: PathBuf,
        report: impl Fn(Result<Vec<KeptPicture>>) + Send + 'static,
    ) -> Result<Self> {
        let (jobs, orders) = channel::<Job>();
        let place = folder.clone();
        let thread = std::thread::Builder::new()
            .name("kept pictures".to_owned())
            .spawn(move || {
                let (found, failure) = read_all(&place);
                report(Ok(found));
                let later = orders.into_iter().filter_map(|job| job().err());
                failure.into_iter().chain(later).for_each(|error| report(Err(error)));
            })
            .map_err(|error| Error::new(format!("no thread for kept pictures: {error}")))?;
        Ok(Self { folder, jobs, _thread: Joined(Some(thread)), written: 0 })
    }

    /// Writes a picture, one day soon; where. From then on its pixels are there and no more in memory.
    pub(super) fn write(&mut self, kept: &KeptPicture) -> Result<PathBuf> {
        // In the order of time, and never that of another window.
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let (time, process) = (since.as_millis(), std::process::id());
        let file = self.folder.join(format!("{time:015}-{process}-{:04}.exr", self.written));
        self.written += 1;
        self.write_to(file.clone(), kept)?;
        Ok(file)
    }

    /// Writes a picture's file again, if it has one: its name is another.
    pub(super) fn write_again(&self, kept: &KeptPicture) -> Result<()> {
        kept.file.clone().map_or(Ok(()), |file| self.write_to(file, kept))
    }

    fn write_to(&self, file: PathBuf, kept: &KeptPicture) -> Result<()> {
        let document = &kept.document;
        let lasting = Document {
            scene: settings_file::lasting_scene(&document.scene),
            map: settings_file::lasting_map(&document.map),
            ..document.clone()
        };
        let texts = [
            (NAME, kept.name.clone()),
            (SUMMARY, kept.summary.clone()),
            (DOCUMENT, to_json(&lasting)?),
            (OF_SCENE, to_json(&kept.of_scene)?),
        ];
        let texts = texts.map(|(key, text)| (key.to_owned(), text));
        let (pixels, small) = (Arc::clone(&kept.pixels), kept.small.clone());
        self.send(move || {
            if let Some(folder) = file.parent() {
                std::fs::create_dir_all(folder).at(folder)?;
            }
            let image = pixels.get().map_err(Error::new)?;
            let (layers, preview) = (Vec::new(), Some(&small));
            write_exr(&file, ExrPicture { image: &image, layers, metadata: &texts, preview })?;
            pixels.leave_to(file);
            Ok(())
        });
        Ok(())
    }

    /// Removes a picture's file.
    pub(super) fn remove(&self, file: PathBuf) {
        self.send(move || match std::fs::remove_file(&file) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::at(&file, e)),
            _ => Ok(()),
        });
    }

    fn send(&self, job: impl FnOnce() -> Result<()> + Send + 'static) {
        // The thread ends after this does.
        let _ = self.jobs.send(Box::new(job));
    }
}

/// The newest pictures of a folder, oldest first, and what to say of files that are none.
fn read_all(folder: &Path) -> (Vec<KeptPicture>, Option<Error>) {
    let (files, mut failures) = (files(folder), Vec::new());
    let kept = files.iter().rev().filter_map(|file| read(file).map_err(|e| failures.push(e)).ok());
    let mut found: Vec<KeptPicture> = kept.take(MAX_PICTURES).collect();
    found.reverse();
    let count = failures.len();
    let of_all = |first: Error| {
        Error::at(folder, format!("{count} kept pictures cannot be read; the newest: {first}"))
    };
    let first = failures.into_iter().next();
    (found, first.map(|first| if count > 1 { of_all(first) } else { first }))
}

/// The newest files of a folder, oldest first.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_picture = |path: &PathBuf| path.extension().is_some_and(|it| it == "exr");
    let mut files: Vec<_> = entries.map(|entry| entry.path()).filter(is_picture).collect();
    files.sort();
    files.split_off(files.len().saturating_sub(MAX_TRIED))
}

/// A kept picture but its pixels, which are read when they are needed.
fn read(file: &Path) -> Result<KeptPicture> {
    let texts = read_exr_metadata(file)?;
    let text = |key: &str| {
        let found = texts.iter().find(|(name, _)| name == key).map(|(_, text)| text.as_str());
        found.ok_or_else(|| Error::at(file, "is no kept picture"))
    };
    let not_understood =
        |error: serde_json::Error| Error::at(file, format!("settings not understood: {error}"));
    let document: Document = serde_json::from_str(text(DOCUMENT)?).map_err(not_understood)?;
    if !(document.is_sound() && settings_file::is_within_bounds(&document)) {
        return Err(Error::at(file, "its settings are out of bounds"));
    }
    let of_scene = text(OF_SCENE).map_or(Ok(SceneOptions::default()), serde_json::from_str);
    let of_scene = of_scene.map_err(not_understood)?;
    // A program that has had the file in its hands may have left none, or a large one.
    let is_small = |small: &Rgb8| small.width.max(small.height) <= 8 * SMALL_WIDTH;
    let small = read_exr_preview(file)?.filter(is_small);
    let grey = || Rgb8 { width: 1, height: 1, pixels: vec![[160; 3]] };
    Ok(KeptPicture {
        name: text(NAME)?.to_owned(),
        summary: text(SUMMARY)?.to_owned(),
        pixels: Arc::new(Pixels::of_file(file.to_owned())),
        document,
        of_scene,
        small: small.unwrap_or_else(grey),
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
    use crate::image::Image;
    use crate::scene::{Camera, MaterialEdit, Medium};

    type Report = Receiver<Result<Vec<KeptPicture>>>;

    fn open(folder: &Path) -> (Album, Report) {
        let (sender, report) = channel();
        let album = Album::open(folder.to_owned(), move |found| {
            let _ = sender.send(found);
        });
        (album.expect("a thread"), report)
    }

    fn next(report: &Report) -> Result<Vec<KeptPicture>> {
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

    /// A picture with these settings that is in no file.
    fn kept(name: &str, document: Document) -> KeptPicture {
        let (image, small) = picture();
        KeptPicture {
            name: name.to_owned(),
            summary: "plain, 3 samples".to_owned(),
            pixels: Arc::new(Pixels::new(image)),
            document,
            of_scene: SceneOptions { hide: vec!["glass".to_owned()], ..SceneOptions::default() },
            small,
            texture: None,
            file: None,
        }
    }

    /// Gives a picture with these settings to an album.
    fn write(album: &mut Album, name: &str, document: Document) -> PathBuf {
        album.write(&kept(name, document)).expect("told")
    }

    #[test]
    fn the_next_window_finds_what_was_kept() {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = temporary.path().join("deep/pictures");
        let (mut album, report) = open(&folder);
        assert_eq!(next(&report).expect("nothing yet").len(), 0);
        let (image, small) = picture();
        for name in ["Picture 1", "Picture 2"] {
            write(&mut album, name, document());
        }
        let third = kept("Picture 3", document());
        let last = album.write(&third).expect("told");
        // The last picture before the window is closed is not lost.
        drop(album);
        fs::remove_file(&last).expect("it is there");
        assert!(third.pixels.get().is_err(), "it was there alone");
        let (album, report) = open(&folder);
        let kept = next(&report).expect("read");
        let names: Vec<_> = kept.iter().map(|kept| kept.name.as_str()).collect();
        assert_eq!(names, ["Picture 1", "Picture 2"]);
        let scene = std::path::absolute("some/scene.glb").expect("a path");
        let expected = Document { scene: scene.display().to_string(), ..document() };
        assert_eq!(kept[1].document, expected);
        assert_eq!(kept[1].summary, "plain, 3 samples");
        assert_eq!(kept[1].of_scene.hide, ["glass"]);
        assert_eq!(kept[1].small, small);
        assert_eq!(kept[1].pixels.get(), Ok(image));
        let first = kept[0].file.clone().expect("a file");
        let renamed = KeptPicture { name: "Before noon".to_owned(), ..read(&first).expect("read") };
        album.write_again(&renamed).expect("told");
        drop(album);
        let again = read(&first).expect("written again");
        assert_eq!((&*again.name, &again.small), ("Before noon", &kept[0].small));
        assert_eq!((again.pixels.get(), &again.document), (kept[1].pixels.get(), &expected));
        let (album, _report) = open(&folder);
        let taken_away = folder.join("away");
        fs::rename(&first, &taken_away).expect("renamed");
        let sentence = kept[0].pixels.get().expect_err("it is not there");
        assert!(sentence.contains(&first.display().to_string()), "{sentence}");
        fs::rename(&taken_away, &first).expect("renamed");
        assert!(kept[0].pixels.get().is_ok(), "what failed once is tried again");
        album.remove(first);
        drop(album);
        assert_eq!(files(&folder), [kept[1].file.clone().expect("a file")]);
    }

    #[test]
    fn what_cannot_be_read_is_told_and_left_alone() {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = temporary.path();
        let (image, _) = picture();
        let (mut album, _report) = open(folder);
        let sound = write(&mut album, "Picture 1", document());
        let unsound = write(&mut album, "Picture 2", Document { intensity: -1.0, ..document() });
        drop(album);
        fs::write(folder.join("0-noise.exr"), b"noise").expect("written");
        let plain = folder.join("1-plain.exr");
        let other = ExrPicture { image: &image, layers: vec![], metadata: &[], preview: None };
        write_exr(&plain, other).expect("written");
        let (album, report) = open(folder);
        let found: Vec<_> = next(&report).expect("read").iter().map(|k| k.file.clone()).collect();
        assert_eq!(found, [Some(sound)]);
        let sentence = next(&report).err().expect("a sentence").to_string();
        assert!(sentence.contains(": 3 kept pictures cannot be read; the newest: "), "{sentence}");
        assert!(sentence.ends_with("1-plain.exr: is no kept picture"), "{sentence}");
        let refused = |file: &Path| read(file).err().expect("refused").to_string();
        assert!(refused(&unsound).ends_with("its settings are out of bounds"));
        assert!(refused(&folder.join("0-noise.exr")).contains("0-noise.exr: "));
        drop(album);
        assert!(unsound.exists() && plain.exists());
        // Where nothing can be written, that is said.
        let (mut album, report) = open(&plain);
        assert_eq!(next(&report).expect("nothing").len(), 0);
        write(&mut album, "Picture 1", document());
        let sentence = next(&report).err().expect("a sentence").to_string();
        assert!(sentence.contains("1-plain.exr"), "{sentence}");
    }
    #[test]
    fn the_newest_dozen_is_listed_and_a_file_without_a_small_picture_has_a_grey_one() {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = temporary.path();
        let (mut album, _report) = open(folder);
        let files: Vec<_> = (0..MAX_PICTURES + 2)
            .map(|number| write(&mut album, &format!("Picture {number}"), document()))
            .collect();
        drop(album);
        let last = files.last().expect("some");
        let texts = read_exr_metadata(last).expect("read");
        let (image, _) = picture();
        let bare = ExrPicture { image: &image, layers: vec![], metadata: &texts, preview: None };
        write_exr(last, bare).expect("written");
        let (_album, report) = open(folder);
        let kept = next(&report).expect("read");
        let names: Vec<_> = kept.iter().map(|kept| kept.name.clone()).collect();
        let newest: Vec<_> =
            (2..MAX_PICTURES + 2).map(|number| format!("Picture {number}")).collect();
        assert_eq!(names, newest);
        assert_eq!(kept[MAX_PICTURES - 1].small.pixels.len(), 1);
        assert!(files.iter().all(|file| file.exists()), "nothing of others is removed");
    }
}
