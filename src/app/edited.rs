//! The document, and the steps by which its changes are taken back.

use super::document::{Document, PictureSize};
use super::loader::LoadedScene;
use super::undo::Undo;
use crate::error::Decoded;
use crate::memory;
use crate::scene::StartView;

/// Most bytes that a pixel of the picture takes: films of its exact and of its cached light, copies of both that are
/// shown and that will be, and for a moment the denoiser's planes (measured: 1000 with Open Image Denoise, 860 without).
pub(super) const BYTES_PER_PIXEL: u64 = 1000;

/// The document under change.
pub(super) struct Edited {
    /// What is wanted now.
    pub(super) document: Document,
    /// Its earlier states.
    pub(super) undo: Undo<Document>,
    /// What the window was opened with.
    pub(super) start: Document,
    /// Where the first picture is to be taken from, until there is its scene.
    pub(super) place: Option<StartView>,
    /// Pixels of the room that the picture has had last.
    room: Option<[u32; 2]>,
    /// The size of the picture for which there is memory, and the region.
    affordable: (PictureSize, Option<[f32; 4]>),
}

impl Edited {
    /// Begins without steps.
    pub(super) fn new(document: Document, place: Option<StartView>) -> Self {
        let (undo, start) = (Undo::new(document.clone()), document.clone());
        let affordable = (PictureSize::Viewport(1), None);
        Self { document, undo, start, place, room: None, affordable }
    }

    /// Makes a step of what has changed, if anything has.
    pub(super) fn settle(&mut self) {
        self.undo.settle(&self.document);
    }

    /// The document before the last step or, if that `is_redo`, after the one that was taken back last; if there is
    /// one.
    pub(super) fn step(&mut self, is_redo: bool) -> Option<Document> {
        // What has just been changed may not have been noted as yet.
        self.settle();
        if is_redo { self.undo.redo() } else { self.undo.undo() }
    }

    /// Changes the document by the program itself: that is no step.
    pub(super) fn amend(&mut self, change: impl FnOnce(&mut Document)) {
        change(&mut self.document);
        self.undo.amend(&self.document);
    }

    /// Takes back what cannot be had; it was no step.
    pub(super) fn put_back(&mut self, change: impl FnOnce(&mut Document)) {
        let refused = self.document.clone();
        change(&mut self.document);
        self.undo.correct(&refused, &self.document);
    }

    /// Keeps changes with the materials that have their names, where a scene was read again: another program may have
    /// put them in another order. Returns the changed materials that have gone.
    pub(super) fn renumber(&mut self, before: &LoadedScene, now: &LoadedScene) -> Vec<String> {
        let (before, now, name) = (&before.materials, &now.materials, &now.name);
        self.undo.change_all(|document| {
            if document.scene == *name {
                document.renumber(before, now);
            }
        });
        self.document.renumber(before, now)
    }

    /// Keeps the region on the same part of the scene where the room for the picture has got another shape: the field
    /// of view is vertical.
    pub(super) fn follow_room(&mut self, room: Option<[u32; 2]>) {
        let Some(room) = room else { return };
        let Some(before) = self.room.replace(room).filter(|before| *before != room) else { return };
        let aspect = |[width, height]: [u32; 2]| width as f32 / height as f32;
        let factor = aspect(before) / aspect(room);
        self.document.follow_room(factor);
        self.undo.change_all(|document| document.follow_room(factor));
    }

    /// Takes back a size, or the whole in place of a region, for which there is no memory: the system would end
    /// the window.
    ///
    /// # Errors
    /// With what there is no memory for.
    pub(super) fn check_size(&mut self) -> Decoded<()> {
        let asked = (self.document.size, self.document.region);
        if asked == self.affordable {
            return Ok(());
        }
        if let PictureSize::Fixed(width, height) = asked.0 {
            // A region of how many pixels is known once there is a camera.
            let Some(view) = self.document.view(width, height) else { return Ok(()) };
            if let Err(cause) = memory::check(view.pixels() * BYTES_PER_PIXEL) {
                let (size, region) = self.affordable;
                self.put_back(|document| (document.size, document.region) = (size, region));
                return Err(format!("a picture of {width} x {height} pixels {cause}"));
            }
        }
        self.affordable = asked;
        Ok(())
    }
}
