//! Makes a report: goes through a plan, reuses runs on disk, measures the missing ones, and keeps the pages up to
//! date.

use std::time::{Duration, Instant};

use super::context::{Context, Options, RowState, denoised};
use super::machine::{Machine, OpenDevice};
use super::measure::Run;
use super::pages::row_sentence;
use super::plan::{Device, MIN_PICTURES, Plan, Row, SHARE_RUNS};
use super::prepared_row::PreparedRow;
use super::reference::{Reference, read_reference};
use super::store::Store;
use super::summary::{DeviceReport, Pictures, Report, RowReport, summarise};
use crate::digest::Digest;
use crate::error::{Error, Result};

/// Measures the missing runs and writes `report.html`, `report.csv`, `report.json` and `plots/`; returns an
/// unfinished report if it is cancelled.
///
/// # Errors
/// If a scene or map cannot be used, a device fails, or a file cannot be written. Finished runs are on disk and
/// are reused when the same plan is made again.
pub fn make(plan: &Plan, options: &Options<'_>) -> Result<Report> {
    let size = plan.effort.frame.size;
    let file_reference =
        plan.reference.as_deref().map(|path| read_reference(path, size)).transpose()?;
    let file_reference = file_reference.map(|image| {
        let digest = Digest::new().bytes(bytemuck::cast_slice(image.pixels.as_flattened()));
        (image, digest)
    });
    let store = Store::open(options.folder, options.references)?;
    let machine = Machine::here();
    let open = |device: &Device| OpenDevice::open(*device, options.adapter, &machine);
    let devices = plan.effort.devices.iter().map(open).collect::<Result<Vec<_>>>()?;
    let machine_digest = machine.digest();
    let mut runner = Runner {
        context: Context { plan, options, store, devices, machine_digest, file_reference },
        report: Report { plan: plan.clone(), machine, rows: Vec::new(), is_finished: false },
        pages_written: None,
    };
    for row in &plan.rows {
        runner.row(row)?;
        if let Some(row) = runner.report.rows.last() {
            (options.tell)(row_sentence(&runner.report, row));
        }
        runner.write_pages()?;
        if runner.context.is_cancelled() {
            return Ok(runner.report);
        }
    }
    runner.report.is_finished = true;
    runner.write_pages()?;
    Ok(runner.report)
}

struct Runner<'a> {
    context: Context<'a>,
    report: Report,
    pages_written: Option<Instant>,
}

/// Pages are written anew at most this often while runs go on.
const PAGES_EVERY: Duration = Duration::from_secs(30);

impl Runner<'_> {
    /// Measures a row and adds it to the report.
    fn row(&mut self, row: &Row) -> Result<()> {
        let Context { plan, store, devices, file_reference, .. } = &self.context;
        let rows_after = plan.rows.len() - self.report.rows.len() - 1;
        self.context.say(&format!("{}: loading", row.title), 0.0, rows_after);
        let prepared = PreparedRow::load(row, plan)?;
        let report = RowReport {
            row: row.clone(),
            notices: prepared.notices.iter().map(str::to_owned).collect(),
            triangles: prepared.world.scene.shown_triangles() as usize,
            map_size: prepared.map_size,
            ..RowReport::default()
        };
        self.report.rows.push(report);
        let (digest, size) = (prepared.digest, plan.effort.frame.size);
        let open = || Reference::open(&store.references, digest, size);
        let reference = file_reference.is_none().then(open);
        let mut state = RowState {
            runs: vec![vec![Vec::new(); plan.methods.len()]; devices.len()],
            refusals: vec![None; devices.len()],
            prepared,
            reference,
            rows_after,
        };
        for (index, device) in devices.iter().enumerate() {
            let uploaded = state.prepared.upload(device);
            self.accept(&mut state, index, &uploaded);
        }
        if state.refusals.iter().all(Option::is_some) {
            return self.update(&mut state);
        }
        let mut is_whole = self.context.grow_reference(&mut state, MIN_PICTURES)?;
        while is_whole {
            is_whole = self.all_runs(&mut state)? && self.context.refine_reference(&mut state)?;
            if !is_whole || !self.remove_outdated(&mut state) {
                break;
            }
        }
        self.update(&mut state)?;
        let Some(report) = self.report.rows.last_mut().filter(|_| is_whole) else { return Ok(()) };
        if self.context.find_shares(&state, report)? {
            self.context.find_biases(&state, report)?;
            self.remove_pictures(&state);
        }
        Ok(())
    }

    /// Measures the missing runs, seed by seed, so that a disturbance of the machine affects all methods alike;
    /// `false` if it was cancelled.
    fn all_runs(&mut self, state: &mut RowState) -> Result<bool> {
        for seed in 0..self.context.plan.effort.seeds {
            for device in 0..self.context.devices.len() {
                for method in 0..self.context.plan.methods.len() {
                    if state.refusals[device].is_none() && !self.run(state, device, method, seed)? {
                        return Ok(false);
                    }
                }
            }
        }
        Ok(true)
    }

    /// One run, from disk or measured; `false` if it was cancelled.
    fn run(&mut self, row: &mut RowState, device: usize, method: usize, seed: u32) -> Result<bool> {
        let plan = self.context.plan;
        let key = self.context.key(row, device, &plan.methods[method], seed);
        if let Some(run) = self.context.store.read::<Run>(&key) {
            let has_errors = run.points.iter().all(|p| p.errors.is_some());
            if has_errors || self.context.pictures(&key, &run).is_some() {
                row.runs[device][method].push((key, run));
                return Ok(true);
            }
        }
        self.say_run(row, device, method, seed);
        let settings = &plan.methods[method].settings;
        let (on, cancel) = (&self.context.devices[device], self.context.options.cancel);
        if on.gpu.is_some() {
            // Kernels are compiled, unless they are cached; a GPU may not support them.
            let ready = row.prepared.place(settings, (on, cancel)).warm_up(settings);
            if !self.accept(row, device, &ready) {
                return Ok(true);
            }
        }
        let (place, seconds) = (row.prepared.place(settings, (on, cancel)), plan.effort.seconds);
        let measured = place.measure(&plan.methods[method], seed, seconds)?;
        let Some(mut done) = measured else { return Ok(false) };
        if seed == 0 && on.gpu.is_none() {
            let (grid, seconds) = (done.grid.take(), seconds.min(1.0));
            done.run.nanoseconds_per_ray = row.prepared.time_rays(on, settings, grid, seconds)?;
        }
        if let Some(reference) = self.context.reference(row) {
            done.run.evaluate(&done.pictures, &reference)?;
        }
        // Pictures first: a run without them is measured again.
        self.context.store.write_pictures(&key, &done.pictures[0])?;
        self.context.store.write_pictures(&denoised(&key), &done.pictures[1])?;
        self.context.store.write(&key, &done.run)?;
        row.runs[device][method].push((key, done.run));
        if self.pages_written.is_none_or(|at| at.elapsed() > PAGES_EVERY) {
            self.update(row)?;
            self.write_pages()?;
        }
        Ok(!self.context.is_cancelled())
    }

    /// Whether `outcome` is a success; else stores the reason why the device cannot render the row.
    fn accept(&self, state: &mut RowState, device: usize, outcome: &Result<()>) -> bool {
        if let Err(reason) = outcome {
            (self.context.options.tell)(format!("{}: {reason}", state.prepared.title));
            state.refusals[device] = Some(format!("not measured: {reason}"));
        }
        outcome.is_ok()
    }

    /// Removes runs with errors against an older reference whose pictures are gone, and then clears all runs to be
    /// read again; whether there was such a run.
    fn remove_outdated(&self, state: &mut RowState) -> bool {
        let pictures = self.context.reference(state).and_then(|(_, pictures)| pictures);
        let is_outdated = |(_, run): &&(String, Run)| run.reference_pictures != pictures;
        let outdated: Vec<_> = state.runs.iter().flatten().flatten().filter(is_outdated).collect();
        outdated.iter().for_each(|(key, _)| self.context.store.remove(key, "json"));
        let is_one = !outdated.is_empty();
        if is_one {
            state.runs.iter_mut().flatten().for_each(Vec::clear);
        }
        is_one
    }

    /// Removes all pictures but the last of each run.
    fn remove_pictures(&self, state: &RowState) {
        let Context { plan, store, .. } = &self.context;
        for (key, _) in state.runs.iter().flatten().flatten() {
            store.remove(&denoised(key), "f32");
            let films = store.read_pictures(key, plan.effort.frame.size).unwrap_or_default();
            if let [_, .., last] = films.as_slice() {
                // A failure only leaves more pictures on the disk.
                let _ = store.write_pictures(key, std::slice::from_ref(last));
            }
        }
    }

    /// Updates the row's report.
    fn update(&mut self, state: &mut RowState) -> Result<()> {
        let plan = self.context.plan;
        let reference = self.context.reference(state);
        let threads = self.report.machine.threads;
        let reference_report = self.context.reference_report(state)?;
        let mut pictures =
            Pictures { reference: reference.map(|(image, _)| image), runs: Vec::new() };
        let mut devices = Vec::new();
        for (index, device) in self.context.devices.iter().enumerate() {
            for (method, runs) in plan.methods.iter().zip(&state.runs[index]) {
                let picture = runs.first().and_then(|(key, _)| self.context.last_picture(key));
                let named = picture.map(|picture| (device.device, method.name.clone(), picture));
                pictures.runs.extend(named);
            }
            let of_method =
                |runs: &Vec<(String, Run)>| runs.iter().map(|(_, run)| run.clone()).collect();
            let runs = state.runs[index].iter().map(of_method).collect();
            devices.push(DeviceReport {
                device: device.device,
                name: device.name.clone(),
                not_measured: state.refusals[index].clone(),
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
        super::pages::write(&self.report, &self.context.store.root)?;
        self.pages_written = Some(Instant::now());
        Ok(())
    }

    fn say_run(&self, state: &RowState, device: usize, method: usize, seed: u32) {
        let plan = self.context.plan;
        let done: usize = state.runs.iter().flatten().map(Vec::len).sum();
        let all = plan.methods.len() * plan.effort.devices.len() * plan.effort.seeds as usize;
        let missing = |of: &Reference| of.pictures_missing(plan.effort.reference_noise, 0.0);
        let reference = state.reference.as_ref().map_or(0, missing);
        let left = (all - done) as f64 + f64::from(reference) + SHARE_RUNS;
        let (title, method) = (&state.prepared.title, &plan.methods[method].name);
        let device = self.context.devices[device].device.title();
        let run = format!("run {} of {}", seed + 1, plan.effort.seeds);
        let step = format!("{title}: {method} on {device}, {run}");
        self.context.say(&step, left * plan.effort.seconds, state.rows_after);
    }
}

/// Refuses a plan whose errors are known before anything is measured.
///
/// # Errors
/// If a scene or map is neither built in nor a file, or a reference is given for several rows.
pub fn check(plan: &Plan) -> Result<()> {
    for row in &plan.rows {
        crate::sources::check_scene(&row.scene)?;
        crate::sources::check_map(&row.map)?;
    }
    if plan.reference.is_some() && plan.rows.len() != 1 {
        let cause = "--reference is a picture of one scene under one map: give one of each";
        return Err(Error::new(cause));
    }
    Ok(())
}
