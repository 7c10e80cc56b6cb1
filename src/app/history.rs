//! Pictures kept for comparison.

use std::sync::Arc;

use super::album::Album;
use super::document::Document;
use super::kept_picture::{KeptPicture, MAX_PICTURES, Pixels};
use crate::error::Result;
use crate::image::{Image, Rgb8};
use crate::scene::SceneOptions;

/// Kept pictures, oldest first.
#[derive(Default)]
pub(crate) struct History {
    /// All of them.
    pub(crate) list: Vec<KeptPicture>,
    /// The number in the latest name.
    pub(super) count: u32,
    /// The folder that keeps them for the next window; its end waits until everything is written.
    pub(super) album: Option<Album>,
    /// What is asked of the files of scenes.
    pub(super) of_scene: SceneOptions,
}

impl History {
    /// Takes over what earlier windows left; how many those are.
    pub(crate) fn take_over(&mut self, earlier: Vec<KeptPicture>) -> usize {
        let number = |kept: &KeptPicture| kept.name.rsplit(' ').next()?.parse().ok();
        self.count = earlier.iter().filter_map(number).fold(self.count, u32::max);
        let count = earlier.len();
        for kept in &mut self.list {
            self.count = self.count.saturating_add(1);
            kept.name = format!("Picture {}", self.count);
        }
        self.list.splice(0..0, earlier);
        count
    }

    /// Keeps a picture under a new name; its place in the list. `small` is it in small, for the list.
    ///
    /// # Errors
    /// If it cannot be kept for the next window.
    pub(crate) fn keep(
        &mut self,
        summary: String,
        image: &Arc<Image>,
        document: Document,
        small: Rgb8,
    ) -> (usize, Result<()>) {
        self.count = self.count.saturating_add(1);
        let kept = KeptPicture {
            name: format!("Picture {}", self.count),
            summary,
            pixels: Arc::new(Pixels::new(Arc::clone(image))),
            document,
            of_scene: self.of_scene.clone(),
            small,
            texture: None,
            file: None,
        };
        let written = self.album.as_mut().map(|album| album.write(&kept)).transpose();
        let (file, failure) = written.map_or_else(|e| (None, Err(e)), |file| (file, Ok(())));
        self.list.push(KeptPicture { file, ..kept });
        while self.list.len() > MAX_PICTURES {
            self.remove(0);
        }
        (self.list.len() - 1, failure)
    }

    /// Gives a picture another name, here and in its file.
    ///
    /// # Errors
    /// If it cannot be kept.
    pub(crate) fn rename(&mut self, index: usize, name: &str) -> Result<()> {
        let Some(kept) = self.list.get_mut(index) else { return Ok(()) };
        kept.name = name.trim().to_owned();
        self.album.as_ref().map_or(Ok(()), |album| album.write_again(kept))
    }

    /// Drops one, and its file.
    pub(crate) fn remove(&mut self, index: usize) {
        if let (Some(album), Some(file)) = (&self.album, self.list.remove(index).file) {
            album.remove(file);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_picture_goes_and_names_are_not_given_again() {
        let mut history = History::default();
        for _ in 0..=MAX_PICTURES {
            let image = Arc::new(Image::filled(1, 1, [0.0; 3]));
            let small = Rgb8 { width: 1, height: 1, pixels: vec![[0; 3]] };
            history.keep(String::new(), &image, Document::default(), small).1.expect("kept");
        }
        assert_eq!(history.list.len(), MAX_PICTURES);
        assert_eq!(history.list[0].name, "Picture 2");
        history.remove(0);
        assert_eq!(history.list[0].name, "Picture 3");
    }
    #[test]
    fn what_earlier_windows_kept_comes_first_and_the_oldest_file_goes() {
        let temporary = tempfile::tempdir().expect("a folder");
        let open = || {
            let (sender, found) = std::sync::mpsc::channel();
            let report = move |kept| {
                let _ = sender.send(kept);
            };
            let album = Album::open(temporary.path().to_owned(), report).expect("a thread");
            let history = History { album: Some(album), ..History::default() };
            let minute = std::time::Duration::from_secs(60);
            let earlier = found.recv_timeout(minute).expect("an answer").expect("read");
            (history, earlier)
        };
        let keep = |history: &mut History| {
            let image = Arc::new(Image::filled(1, 1, [0.5; 3]));
            let small = Rgb8 { width: 1, height: 1, pixels: vec![[0; 3]] };
            history.keep(String::new(), &image, Document::default(), small).1.expect("kept");
        };
        let (mut history, earlier) = open();
        assert!(earlier.is_empty());
        (0..MAX_PICTURES).for_each(|_| keep(&mut history));
        history.album = None;
        let (mut history, earlier) = open();
        // Before the earlier ones are taken over.
        keep(&mut history);
        assert_eq!(history.take_over(earlier), MAX_PICTURES);
        assert_eq!(history.list.len(), MAX_PICTURES + 1);
        keep(&mut history);
        let names: Vec<_> = history.list.iter().map(|kept| kept.name.clone()).collect();
        assert_eq!(names[0], "Picture 3");
        assert_eq!(names[MAX_PICTURES - 1], format!("Picture {}", MAX_PICTURES + 2));
        history.album = None;
        assert_eq!(open().1.len(), MAX_PICTURES);
        assert_eq!(std::fs::read_dir(temporary.path()).expect("a folder").count(), MAX_PICTURES);
    }
}
