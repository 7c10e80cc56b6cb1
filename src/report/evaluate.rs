//! Evaluates runs: a reference of sufficiently low noise, errors against it, their sources, and biases.

use super::bias::Bias;
use super::context::{Context, RowState};
use super::measure::Run;
use super::plan::{MIN_PICTURES, SHARE_RUNS, Settings};
use super::reference::Noise;
use super::summary::{Measure, ReferenceReport, RowReport};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::metrics::compare;
use crate::render::Sampling;

impl Context<'_> {
    /// Adds pictures to the reference until it has `pictures` of them; `false` if it was cancelled.
    pub(super) fn grow_reference(&self, state: &mut RowState, pictures: u32) -> Result<bool> {
        let on = (&self.devices[self.fastest(state)], self.options.cancel);
        let settings = &Settings::of(Sampling::Adaptive);
        let Some(mut reference) = state.reference.take() else { return Ok(true) };
        let mut is_whole = true;
        while is_whole && reference.facts.pictures < pictures {
            let done = reference.facts.pictures;
            let (title, next) = (&state.prepared.title, done + 1);
            let seconds = f64::from(pictures - done) * self.plan.effort.seconds;
            let step = format!("{title}: reference, picture {next} of {pictures}");
            self.say(&step, seconds, state.rows_after);
            let place = state.prepared.place(settings, on);
            is_whole =
                reference.add_picture(&place, self.plan.effort.seconds)? && !self.is_cancelled();
            if reference.is_black() {
                let cause = "the picture is black, and errors relative to it have no meaning";
                return Err(Error::new(format!("{title}: {cause}")));
            }
        }
        state.reference = Some(reference);
        Ok(is_whole)
    }

    /// Adds pictures to the reference until its noise is small beside the smallest error, and computes all errors
    /// against it; `false` if it was cancelled.
    pub(super) fn refine_reference(&self, state: &mut RowState) -> Result<bool> {
        loop {
            self.evaluate_runs(state)?;
            let Some(reference) = &state.reference else { return Ok(true) };
            let missing = reference.pictures_missing(
                self.plan.effort.reference_noise,
                smallest_error(state).unwrap_or(0.0),
            );
            if missing == 0 {
                return Ok(true);
            }
            if !self.grow_reference(state, reference.facts.pictures + missing)? {
                self.evaluate_runs(state)?;
                return Ok(false);
            }
        }
    }

    /// Computes the errors again of all runs whose pictures are stored, if the reference has changed.
    fn evaluate_runs(&self, state: &mut RowState) -> Result<()> {
        let Some(reference) = self.reference(state) else { return Ok(()) };
        for (key, run) in state.runs.iter_mut().flatten().flatten() {
            let is_new = run.points.iter().all(|p| p.errors.is_some())
                && reference.1.is_some()
                && run.reference_pictures == reference.1;
            if !is_new && let Some(pictures) = self.pictures(key, run) {
                run.evaluate(&pictures, &reference)?;
                self.store.write(key, run)?;
            }
        }
        Ok(())
    }

    /// Splits the error of the compared methods by its sources; `false` if it was cancelled.
    pub(super) fn find_shares(&self, state: &RowState, row: &mut RowReport) -> Result<bool> {
        let fastest = self.fastest(state);
        let Some((reference, _)) = self.reference(state) else { return Ok(true) };
        for method in self.plan.compared() {
            let runs = self.plan.methods.iter().position(|m| m.name == method.name);
            let run = runs.and_then(|index| state.runs[fastest][index].first());
            let Some(samples) = run.and_then(|(_, run)| Some(run.points.last()?.samples)) else {
                continue;
            };
            let key = format!("{}_shares", self.key(state, fastest, method, 0));
            let found = self.store.kept(&key, || {
                let step = format!("{}: sources of {}'s error", state.prepared.title, method.name);
                self.say(&step, SHARE_RUNS * self.plan.effort.seconds, state.rows_after);
                let on = (&self.devices[fastest], self.options.cancel);
                let place = state.prepared.place(&method.settings, on);
                place.shares(method, (samples / 8).max(4), &reference)
            });
            let Some(found) = found? else { return Ok(false) };
            row.shares.push(found);
        }
        Ok(true)
    }

    /// Estimates each method's bias from two or more runs.
    pub(super) fn find_biases(&self, state: &RowState, row: &mut RowReport) -> Result<()> {
        let Some((reference, pictures)) = self.reference(state) else { return Ok(()) };
        let pictures = pictures.unwrap_or_default();
        for (device, methods) in state.runs.iter().enumerate() {
            for (method, runs) in self.plan.methods.iter().zip(methods) {
                let Some((key, _)) = runs.first() else { continue };
                let key = format!("{key}_bias_of_{}_by_{pictures}", runs.len());
                let device = self.devices[device].device.title();
                let of = |p: Vec<_>| Bias::new(device, &method.name, &p, &reference);
                let found = || Ok(self.last_pictures(runs).and_then(of));
                row.biases.extend(self.store.kept(&key, found)?);
            }
        }
        Ok(())
    }

    pub(super) fn reference_report(&self, state: &RowState) -> Result<Option<ReferenceReport>> {
        let error = smallest_error(state);
        let noise = match &state.reference {
            Some(reference) if reference.facts.pictures < MIN_PICTURES => return Ok(None),
            Some(reference) => Some(reference.noise()),
            None => self.noise_of_file(state)?,
        };
        let share = noise.zip(error).map(|(noise, error)| noise.trimmed_rel_mse / error);
        Ok(Some(ReferenceReport {
            file: self.plan.reference.as_ref().map(|path| path.display().to_string()),
            facts: state.reference.as_ref().map(|reference| reference.facts.clone()),
            noise,
            share,
            // The noise of a given file is estimated from noisy pictures, so its share has rounding errors.
            is_good: share.is_some_and(|share| share <= 1.0001 * self.plan.effort.reference_noise),
        }))
    }

    /// Noise of a given reference: how much farther the mean of all runs of the best method is from it than
    /// that mean's own spread explains. `None` with a single run.
    fn noise_of_file(&self, state: &RowState) -> Result<Option<Noise>> {
        let Some((reference, _)) = &self.file_reference else { return Ok(None) };
        let all = state.runs.iter().flatten().filter(|runs| runs.len() > 1);
        let best = all.min_by(|a, b| mean_error(a).total_cmp(&mean_error(b)));
        let Some(runs) = best else { return Ok(None) };
        let Some(films) = self.last_pictures(runs) else { return Ok(None) };
        let count = films.len() as f64;
        let mut mean = Image::filled(reference.width, reference.height, [0.0; 3]);
        let mut variances = vec![[0.0; 3]; reference.pixels.len()];
        for (i, (mean, variance)) in mean.pixels.iter_mut().zip(&mut variances).enumerate() {
            for c in 0..3 {
                let values = films.iter().map(|film| f64::from(film.pixels[i][c]));
                let average = values.clone().sum::<f64>() / count;
                let squares: f64 = values.map(|v| (v - average).powi(2)).sum();
                mean[c] = average as f32;
                variance[c] = squares / (count - 1.0) / count;
            }
        }
        let found = compare(&mean, reference)?;
        let own = Noise::of(&variances, reference);
        Ok(Some(Noise {
            mse: (found.mse - own.mse).max(0.0),
            rel_mse: (found.rel_mse - own.rel_mse).max(0.0),
            trimmed_rel_mse: (found.trimmed_rel_mse - own.trimmed_rel_mse).max(0.0),
        }))
    }
}

/// Smallest mean error at the end of all methods and devices.
fn smallest_error(state: &RowState) -> Option<f64> {
    let errors = state.runs.iter().flatten().filter(|runs| !runs.is_empty());
    errors.map(|runs| mean_error(runs)).filter(|e| e.is_finite()).min_by(f64::total_cmp)
}

/// Mean error at the end; NaN before errors are known.
fn mean_error(runs: &[(String, Run)]) -> f64 {
    let error = |(_, run): &(String, Run)| {
        run.points.last().and_then(|p| Measure::TrimmedRelMse.of(p)).unwrap_or(f64::NAN)
    };
    runs.iter().map(error).sum::<f64>() / runs.len() as f64
}
