//! Judging runs: a reference that is good enough, errors against it, and where they are left.

use super::super::bias::Bias;
use super::super::measure::Run;
use super::super::plan::MIN_PICTURES;
use super::super::plan::{SHARE_RUNS, Settings};
use super::super::reference::Noise;
use super::super::shares::shares;
use super::super::summary::{Measure, ReferenceReport};
use super::{Runner, Work};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::metrics::compare;
use crate::render::Sampling;

impl Runner<'_> {
    /// The device that references are made on: a real GPU that can do the row, or the first.
    fn fastest(&self, work: &Work) -> usize {
        let can = |index: &usize| work.refusals[*index].is_none();
        let all = || (0..self.devices.len()).filter(can);
        all().find(|index| self.devices[*index].is_real_gpu()).or_else(|| all().next()).unwrap_or(0)
    }

    /// The reference so far, if it is worth anything, and its number of pictures.
    pub(super) fn reference(&self, work: &Work) -> Option<(Image, Option<u32>)> {
        if let Some(image) = &self.file_reference {
            return Some((image.clone(), None));
        }
        let reference = work.reference.as_ref()?;
        let pictures = reference.facts.pictures;
        (pictures >= MIN_PICTURES).then(|| (reference.image(), Some(pictures)))
    }

    /// Adds pictures to the reference until there are so many; `false` if it was cancelled.
    pub(super) fn grow_reference(&self, work: &mut Work, pictures: u32) -> Result<bool> {
        let fastest = self.fastest(work);
        let settings = &Settings::of(Sampling::Adaptive);
        let Some(mut reference) = work.reference.take() else { return Ok(true) };
        let mut is_whole = true;
        while is_whole && reference.facts.pictures < pictures {
            let done = reference.facts.pictures;
            self.say(
                &format!("{}: reference, picture {} of {pictures}", work.prepared.title, done + 1),
                f64::from(pictures - done) * self.plan.effort.seconds,
            );
            let place = work.prepared.place(self.plan, &self.devices[fastest], settings);
            let (seconds, cancel) = (self.plan.effort.seconds, self.options.cancel);
            is_whole =
                reference.add_picture(&place, &self.devices[fastest].name, seconds, cancel)?
                    && !self.is_cancelled();
            if reference.is_black() {
                return Err(Error::new(format!(
                    "{}: the picture is black, and errors relative to it have no meaning",
                    work.prepared.title
                )));
            }
        }
        work.reference = Some(reference);
        Ok(is_whole)
    }

    /// Grows the reference until its noise is small beside the smallest error, and judges all runs
    /// against it; `false` if it was cancelled.
    pub(super) fn judge_well(&mut self, work: &mut Work) -> Result<bool> {
        loop {
            self.judge_again(work)?;
            let Some(reference) = &work.reference else { return Ok(true) };
            let missing = reference.pictures_missing(
                self.plan.effort.reference_noise,
                smallest_error(work).unwrap_or(0.0),
            );
            if missing == 0 {
                return Ok(true);
            }
            let pictures = reference.facts.pictures + missing;
            if !self.grow_reference(work, pictures)? {
                self.judge_again(work)?;
                return Ok(false);
            }
        }
    }

    /// Takes the errors of all runs whose pictures are still there, if the reference has changed.
    fn judge_again(&self, work: &mut Work) -> Result<()> {
        let Some((reference, pictures)) = self.reference(work) else { return Ok(()) };
        for (key, run) in work.runs.iter_mut().flatten().flatten() {
            let is_new = run.points.iter().all(|p| p.errors.is_some())
                && pictures.is_some()
                && run.reference_pictures == pictures;
            if is_new {
                continue;
            }
            if let Some((films, denoised)) = self.pictures(key, run) {
                run.judge(&films, &denoised, &reference)?;
                run.reference_pictures = pictures;
                self.store.write(key, run)?;
            }
        }
        Ok(())
    }

    /// Takes the error of the methods that matter apart; `false` if it was cancelled.
    pub(super) fn take_apart(&mut self, work: &Work) -> Result<bool> {
        let fastest = self.fastest(work);
        let Some((reference, _)) = self.reference(work) else { return Ok(true) };
        for method in self.plan.compared() {
            let runs = self.plan.methods.iter().position(|m| m.name == method.name);
            let run = runs.and_then(|index| work.runs[fastest][index].first());
            let Some(samples) = run.and_then(|(_, run)| Some(run.points.last()?.samples)) else {
                continue;
            };
            let key = format!("{}_shares", self.key(work, fastest, method, 0));
            let found = match self.store.read(&key) {
                Some(found) => found,
                None => {
                    self.say(
                        &format!("{}: where {}'s error is left", work.prepared.title, method.name),
                        SHARE_RUNS * self.plan.effort.seconds,
                    );
                    let place =
                        work.prepared.place(self.plan, &self.devices[fastest], &method.settings);
                    let method = (method.name.as_str(), &method.settings);
                    let samples = (samples / 8).max(4);
                    let found = shares(&place, method, samples, &reference, self.options.cancel)?;
                    let Some(found) = found else { return Ok(false) };
                    self.store.write(&key, &found)?;
                    found
                }
            };
            if let Some(row) = self.report.rows.last_mut() {
                row.shares.push(found);
            }
        }
        Ok(true)
    }

    /// How far what each method converges to is from the reference, with two runs or more.
    pub(super) fn find_biases(&mut self, work: &Work) -> Result<()> {
        let Some((reference, pictures)) = self.reference(work) else { return Ok(()) };
        let pictures = pictures.unwrap_or_default();
        for (device, methods) in work.runs.iter().enumerate() {
            for (method, runs) in self.plan.methods.iter().zip(methods) {
                let Some((key, _)) = runs.first() else { continue };
                let key = format!("{key}_bias_of_{}_by_{pictures}", runs.len());
                let found = match self.store.read(&key) {
                    Some(found) => Some(found),
                    None => {
                        let device = self.devices[device].device.title();
                        let bias = self
                            .last_pictures(runs)
                            .and_then(|p| Bias::new(device, &method.name, &p, &reference));
                        bias.iter().try_for_each(|bias| self.store.write(&key, bias))?;
                        bias
                    }
                };
                if let Some(row) = self.report.rows.last_mut() {
                    row.biases.extend(found);
                }
            }
        }
        Ok(())
    }

    /// The last picture of each of these runs, if they are all there.
    fn last_pictures(&self, runs: &[(String, Run)]) -> Option<Vec<Image>> {
        runs.iter().map(|(key, _)| self.last_picture(key)).collect()
    }

    pub(super) fn reference_report(&self, work: &Work) -> Result<Option<ReferenceReport>> {
        let error = smallest_error(work);
        let noise = match &work.reference {
            Some(reference) => {
                if reference.facts.pictures < MIN_PICTURES {
                    return Ok(None);
                }
                Some(reference.noise())
            }
            None => self.noise_of_file(work)?,
        };
        let share = noise.zip(error).map(|(noise, error)| noise.trimmed_rel_mse / error);
        Ok(Some(ReferenceReport {
            file: self.plan.reference.as_ref().map(|path| path.display().to_string()),
            facts: work.reference.as_ref().map(|reference| reference.facts.clone()),
            noise,
            share,
            // A given file is judged by noisy pictures: its share is only known to some digits.
            is_good: share.is_some_and(|share| share <= 1.0001 * self.plan.effort.reference_noise),
        }))
    }

    /// What a given reference errs by: how much farther the mean of all runs of the best method is
    /// from it than that mean's own spread explains. `None` with a single run.
    fn noise_of_file(&self, work: &Work) -> Result<Option<Noise>> {
        let Some(reference) = &self.file_reference else { return Ok(None) };
        let all = work.runs.iter().flatten().filter(|runs| runs.len() > 1);
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
fn smallest_error(work: &Work) -> Option<f64> {
    let errors = work.runs.iter().flatten().filter(|runs| !runs.is_empty());
    errors.map(|runs| mean_error(runs)).filter(|e| e.is_finite()).min_by(f64::total_cmp)
}

/// Mean error at the end; not a number before runs are judged.
fn mean_error(runs: &[(String, Run)]) -> f64 {
    let error = |(_, run): &(String, Run)| {
        let last = run.points.last().and_then(|p| p.errors);
        last.map_or(f64::NAN, |errors| Measure::TrimmedRelMse.of(&errors))
    };
    runs.iter().map(error).sum::<f64>() / runs.len() as f64
}
