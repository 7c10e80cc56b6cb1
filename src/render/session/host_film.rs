//! A session's film on the host.

use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use crate::error::Result;
use crate::render::View;
use crate::render::film::Film;

/// The film as it is, or as it was read last where a GPU has gone on since.
pub(super) struct HostFilm {
    /// As it is; read when somebody asks.
    current: OnceLock<Film>,
    /// Its noise, once somebody has asked.
    noise: OnceLock<f64>,
    /// As it was when somebody asked last, to be brought up to date: it survives a GPU.
    before: Mutex<Film>,
    /// When it was read last.
    read: Instant,
}

impl HostFilm {
    /// Without pixels.
    pub(super) fn new() -> Self {
        Self {
            current: OnceLock::new(),
            noise: OnceLock::new(),
            before: Mutex::default(),
            read: Instant::now(),
        }
    }

    /// The film as it is, if somebody has asked for it.
    pub(super) fn known(&self) -> Option<&Film> {
        self.current.get()
    }

    /// The film as it is: the last one of this view, which `read` brings up to date.
    pub(super) fn get(&self, view: &View, read: impl FnOnce(&mut Film)) -> &Film {
        self.current.get_or_init(|| {
            let mut before = self.before.lock().unwrap_or_else(PoisonError::into_inner);
            let mut film = with_pixels(std::mem::take(&mut *before), view);
            read(&mut film);
            film
        })
    }

    /// The noise of the film as it is.
    pub(super) fn noise(&self, find: impl FnOnce() -> f64) -> f64 {
        *self.noise.get_or_init(find)
    }

    /// Reads the film, unless it is known.
    ///
    /// # Errors
    /// Those of `read`; the film is as far as that came.
    pub(super) fn update(
        &mut self,
        view: &View,
        read: impl FnOnce(&mut Film) -> Result<()>,
    ) -> Result<()> {
        if self.current.get().is_some() {
            return Ok(());
        }
        let mut done = Ok(());
        self.get(view, |film| done = read(film));
        self.read = Instant::now();
        done
    }

    /// Whether it has not been read for so long.
    pub(super) fn is_older_than(&self, age: Duration) -> bool {
        self.read.elapsed() > age
    }

    /// What is known is no more as it is.
    pub(super) fn outdate(&mut self) {
        if let Some(film) = self.current.take() {
            *self.before_mut() = film;
        }
        self.noise = OnceLock::new();
    }

    /// The film, to be gone on with and put back.
    pub(super) fn take(&mut self, view: &View) -> Film {
        self.outdate();
        with_pixels(std::mem::take(self.before_mut()), view)
    }

    /// The film as it is.
    pub(super) fn put(&mut self, film: Film) {
        (self.current, self.noise) = (OnceLock::from(film), OnceLock::new());
    }

    fn before_mut(&mut self) -> &mut Film {
        self.before.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The film; a black one of the view in place of one that has no pixels yet.
fn with_pixels(film: Film, view: &View) -> Film {
    let is_empty = film.pixels().is_empty();
    if is_empty { Film::new(view.width, view.height, view.layers) } else { film }
}
