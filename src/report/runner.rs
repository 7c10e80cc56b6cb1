//! Going through a plan: what is on disk is taken, what is missing is measured, pages are kept up to
//! date.

mod evaluate;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::machine::{Machine, OpenDevice};
use super::measure::{Run, measure};
use super::pages::{duration, row_sentence};
use super::plan::{MIN_PICTURES, Method, Plan, Row};
use super::prepared_row::PreparedRow;
use super::reference::{Reference, read_reference};
use super::store::Store;
use super::summary::{DeviceReport, Pictures, Report, RowReport, summarise};
use crate::digest::Digest;
use crate::error::{Error, Result};
use crate::image::Image;

/// How a report is made, beside what it is about.
pub struct Options<'a> {
    /// The report's folder.
    pub folder: &'a Path,
    /// Folder of references, if it is another one.
    pub references: Option<&'a Path>,
    /// The GPU whose name contains this.
    pub adapter: Option<&'a str>,
    /// Becomes true when it is to stop.
    pub cancel: &'a AtomicBool,
    /// Is told what is being done.
    pub progress: &'a dyn Fn(String),
    /// Is told what is done.
    pub tell: &'a dyn Fn(String),
}

/// Measures what is missing and writes `report.html`, `report.csv`, `report.json` and `plots/`, as far
/// as it comes before it is told to stop.
///
/// # Errors
/// If a scene or map cannot be used, a device fails, or something cannot be written; what was measured
/// is on disk and will be taken when the same plan is made again.
pub fn make(plan: &Plan, options: &Options<'_>) -> Result<Report> {
    let size = plan.effort.frame.size;
    let file_reference =
        plan.reference.as_deref().map(|path| read_reference(path, size)).transpose()?;
    let store = Store::open(options.folder, options.references)?;
    let machine = Machine::here();
    let devices = plan
        .effort
        .devices
        .iter()
        .map(|device| OpenDevice::open(*device, options.adapter, &machine))
        .collect::<Result<Vec<_>>>()?;
    let mut runner = Runner {
        machine_digest: machine.digest(),
        report: Report { plan: plan.clone(), machine, rows: Vec::new(), is_finished: false },
        plan,
        store,
        devices,
        file_digest: file_reference.as_ref().map(digest_of),
        file_reference,
        options,
        pages_written: None,
    };
    for row in &plan.rows {
        runner.row(row)?;
        if let Some(row) = runner.report.rows.last() {
            (options.tell)(row_sentence(&runner.report, row));
        }
        runner.write_pages()?;
        if runner.is_cancelled() {
            return Ok(runner.report);
        }
    }
    runner.report.is_finished = true;
    runner.write_pages()?;
    Ok(runner.report)
}

struct Runner<'a> {
    plan: &'a Plan,
    options: &'a Options<'a>,
    store: Store,
    devices: Vec<OpenDevice>,
    machine_digest: Digest,
    file_reference: Option<Image>,
    file_digest: Option<Digest>,
    report: Report,
    pages_written: Option<Instant>,
}

/// Pages are written anew at most this often while runs go on.
const PAGES_EVERY: Duration = Duration::from_secs(30);

/// What is known of a row while it is measured.
struct Work {
    prepared: PreparedRow,
    reference: Option<Reference>,
    /// Runs by device and method, with the names they are kept under.
    runs: Vec<Vec<Vec<(String, Run)>>>,
    /// Why a device cannot do this row.
    refusals: Vec<Option<String>>,
}

impl Runner<'_> {
    fn is_cancelled(&self) -> bool {
        self.options.cancel.load(Ordering::Relaxed)
    }

    fn row(&mut self, row: &Row) -> Result<()> {
        self.say(&format!("{}: loading", row.title), 0.0);
        let prepared = PreparedRow::load(row, self.plan)?;
        let report = RowReport {
            row: row.clone(),
            notices: prepared.notices.iter().map(str::to_owned).collect(),
            triangles: prepared.world.scene.shown_triangles() as usize,
            map_size: prepared.map_size,
            reference: None,
            devices: Vec::new(),
            shares: Vec::new(),
            biases: Vec::new(),
            pictures: Pictures::default(),
        };
        self.report.rows.push(report);
        let reference = self.file_reference.is_none().then(|| {
            Reference::open(self.store.references(), prepared.digest, self.plan.effort.frame.size)
        });
        let mut work = Work {
            runs: vec![vec![Vec::new(); self.plan.methods.len()]; self.devices.len()],
            refusals: vec![None; self.devices.len()],
            prepared,
            reference,
        };
        for device in 0..self.devices.len() {
            let uploaded = work.prepared.upload(&self.devices[device]);
            self.can(&mut work, device, &uploaded);
        }
        if work.refusals.iter().all(Option::is_some) {
            return self.update(&mut work);
        }
        let mut is_whole = self.grow_reference(&mut work, MIN_PICTURES)?;
        while is_whole {
            is_whole = self.all_runs(&mut work)? && self.judge_well(&mut work)?;
            if !is_whole || !self.forget_outdated(&mut work) {
                break;
            }
        }
        self.update(&mut work)?;
        if is_whole && self.take_apart(&work)? {
            self.find_biases(&work)?;
            self.forget_pictures(&work);
        }
        Ok(())
    }

    /// Every run that is missing, seed by seed, so that what disturbs the machine for a while disturbs
    /// all methods alike.
    fn all_runs(&mut self, work: &mut Work) -> Result<bool> {
        for seed in 0..self.plan.effort.seeds {
            for device in 0..self.devices.len() {
                for method in 0..self.plan.methods.len() {
                    if work.refusals[device].is_some() {
                        continue;
                    }
                    if !self.run(work, device, method, seed)? {
                        return Ok(false);
                    }
                }
            }
        }
        Ok(true)
    }

    /// One run, from disk or measured; `false` if it was cancelled.
    fn run(&mut self, work: &mut Work, device: usize, method: usize, seed: u32) -> Result<bool> {
        let plan = self.plan;
        let key = self.key(work, device, &plan.methods[method], seed);
        if let Some(run) = self.store.read::<Run>(&key) {
            let has_errors = run.points.iter().all(|p| p.errors.is_some());
            if has_errors || self.pictures(&key, &run).is_some() {
                work.runs[device][method].push((key, run));
                return Ok(true);
            }
        }
        self.say_run(work, device, method, seed);
        let name = &plan.methods[method].name;
        let settings = &plan.methods[method].settings;
        if !self.make_ready(work, device, method) {
            return Ok(true);
        }
        let place = work.prepared.place(plan, &self.devices[device], settings);
        let seconds = plan.effort.seconds;
        let cancel = self.options.cancel;
        let Some(mut done) = measure(&place, (name, settings), seed, seconds, cancel)? else {
            return Ok(false);
        };
        if seed == 0 && self.devices[device].gpu.is_none() {
            let grid = done.grid.take();
            done.run.nanoseconds_per_ray = work.prepared.time_rays(
                plan,
                &self.devices[device],
                settings,
                grid,
                seconds.min(1.0),
            )?;
        }
        if let Some((reference, pictures)) = self.reference(work) {
            done.run.judge(&done.films, &done.denoised, &reference)?;
            done.run.reference_pictures = pictures;
        }
        // Pictures first: a run without them is measured again.
        self.store.write_pictures(&key, &done.films)?;
        self.store.write_pictures(&denoised(&key), &[done.denoised])?;
        self.store.write(&key, &done.run)?;
        work.runs[device][method].push((key, done.run));
        if self.pages_written.is_none_or(|at| at.elapsed() > PAGES_EVERY) {
            self.update(work)?;
            self.write_pages()?;
        }
        Ok(!self.is_cancelled())
    }

    /// Builds what a GPU needs for a method, if it did not keep it from the last run; `false` if it cannot do it.
    fn make_ready(&self, work: &mut Work, device: usize, method: usize) -> bool {
        if self.devices[device].gpu.is_none() {
            return true;
        }
        let settings = &self.plan.methods[method].settings;
        let place = work.prepared.place(self.plan, &self.devices[device], settings);
        let ready = place.warm_up(settings);
        self.can(work, device, &ready)
    }

    /// Notes why a device cannot do a row, if it cannot; whether it can.
    fn can(&self, work: &mut Work, device: usize, outcome: &Result<()>) -> bool {
        if let Err(reason) = outcome {
            (self.options.tell)(format!("{}: {reason}", work.prepared.title));
            work.refusals[device] = Some(format!("not measured: {reason}"));
        }
        outcome.is_ok()
    }

    /// All pictures of a run, one a point, and the last one without noise, if they are still there.
    fn pictures(&self, key: &str, run: &Run) -> Option<(Vec<Image>, Image)> {
        let size = self.plan.effort.frame.size;
        let films = self.store.read_pictures(key, size)?;
        let denoised = self.last_picture(&denoised(key))?;
        (films.len() == run.points.len()).then_some((films, denoised))
    }

    /// The last of the pictures kept under a name.
    fn last_picture(&self, key: &str) -> Option<Image> {
        self.store.read_pictures(key, self.plan.effort.frame.size)?.pop()
    }

    /// Forgets all runs, and for ever those that were judged by an older reference and have no pictures to be
    /// judged by again; whether there was one.
    fn forget_outdated(&self, work: &mut Work) -> bool {
        let pictures = self.reference(work).and_then(|(_, pictures)| pictures);
        let is_outdated = |(_, run): &&(String, Run)| run.reference_pictures != pictures;
        let outdated: Vec<_> = work.runs.iter().flatten().flatten().filter(is_outdated).collect();
        outdated.iter().for_each(|(key, _)| self.store.remove(key));
        let is_one = !outdated.is_empty();
        if is_one {
            work.runs.iter_mut().flatten().for_each(Vec::clear);
        }
        is_one
    }

    /// Keeps the last picture of each run, and what it is without noise of the first ones (of all for a given
    /// reference, whose noise is judged by them).
    fn forget_pictures(&self, work: &Work) {
        for (key, run) in work.runs.iter().flatten().flatten() {
            if run.seed > 0 && self.file_reference.is_none() {
                self.store.remove_pictures(&denoised(key));
            }
            let films =
                self.store.read_pictures(key, self.plan.effort.frame.size).unwrap_or_default();
            if let [_, .., last] = films.as_slice() {
                // A run with all its pictures is as good as one with the last of them.
                let _ = self.store.write_pictures(key, std::slice::from_ref(last));
            }
        }
    }

    /// Brings the row's report up to date.
    fn update(&mut self, work: &mut Work) -> Result<()> {
        let plan = self.plan;
        let reference = self.reference(work);
        let threads = self.report.machine.threads;
        let reference_report = self.reference_report(work)?;
        let mut pictures =
            Pictures { reference: reference.map(|(image, _)| image), runs: Vec::new() };
        let mut devices = Vec::new();
        for (index, device) in self.devices.iter().enumerate() {
            for (method, runs) in plan.methods.iter().zip(&work.runs[index]) {
                if let Some(picture) = runs.first().and_then(|(key, _)| self.last_picture(key)) {
                    pictures.runs.push((device.device, method.name.clone(), picture));
                }
            }
            let runs = work.runs[index]
                .iter()
                .map(|runs| runs.iter().map(|(_, run)| run.clone()).collect())
                .collect();
            devices.push(DeviceReport {
                device: device.device,
                name: device.name.clone(),
                not_measured: work.refusals[index].clone(),
                methods: summarise(plan, threads, runs),
            });
        }
        if let Some(row) = self.report.rows.last_mut() {
            row.reference = reference_report;
            row.devices = devices;
            row.pictures = pictures;
        }
        Ok(())
    }

    fn write_pages(&mut self) -> Result<()> {
        super::pages::write(&self.report, self.store.root())?;
        self.pages_written = Some(Instant::now());
        Ok(())
    }

    /// Name of a run: readable, and a digest of all that it depends on.
    fn key(&self, work: &Work, device: usize, method: &Method, seed: u32) -> String {
        let device = &self.devices[device];
        let digest = self.machine_digest.debug(&work.prepared.digest).debug(&(
            &method.settings,
            &device.name,
            self.plan.effort.seconds,
            seed,
            self.file_digest,
        ));
        let readable = format!("{}-{}-{}", work.prepared.title, device.device.title(), method.name);
        let readable: String = readable
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' })
            .collect();
        let tail = readable.len().saturating_sub(80);
        format!("{}_{seed}_{digest}", &readable[tail..])
    }

    fn say_run(&self, work: &Work, device: usize, method: usize, seed: u32) {
        let plan = self.plan;
        let done: usize = work.runs.iter().flatten().map(Vec::len).sum();
        let all = plan.methods.len() * plan.effort.devices.len() * plan.effort.seeds as usize;
        let reference = work
            .reference
            .as_ref()
            .map_or(0, |reference| reference.pictures_missing(plan.effort.reference_noise, 0.0));
        let left = (all - done) as f64 + f64::from(reference) + super::plan::SHARE_RUNS;
        self.say(
            &format!(
                "{}: {} on {}, run {} of {}",
                work.prepared.title,
                plan.methods[method].name,
                self.devices[device].device.title(),
                seed + 1,
                plan.effort.seeds
            ),
            left * plan.effort.seconds,
        );
    }

    /// Says what is done, with the time left: for this row as given, for later ones as expected.
    fn say(&self, what: &str, row_seconds: f64) {
        let later = self.plan.rows.len().saturating_sub(self.report.rows.len().max(1));
        let left = row_seconds + later as f64 * self.plan.expected_row_seconds();
        (self.options.progress)(format!("{what}, {} left", duration(left)));
    }
}

/// Refuses what can be seen to be wrong before hours of work.
///
/// # Errors
/// If a scene or map is neither built in nor a file, or a reference is given for several rows.
pub fn check(plan: &Plan) -> Result<()> {
    for row in &plan.rows {
        crate::sources::check_scene(&row.scene)?;
        crate::sources::check_map(&row.map)?;
    }
    if plan.reference.is_some() && plan.rows.len() != 1 {
        return Err(Error::new(
            "--reference is a picture of one scene under one map: give one of each",
        ));
    }
    Ok(())
}

/// What runs that are judged by a given picture depend on.
fn digest_of(picture: &Image) -> Digest {
    Digest::new().bytes(bytemuck::cast_slice(picture.pixels.as_flattened()))
}

/// Under which name a run's last picture without noise is kept.
fn denoised(key: &str) -> String {
    format!("{key}_denoised")
}
