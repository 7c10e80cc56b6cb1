//! The page: what was measured, how, what came out.

use std::fmt::Write as _;

use super::super::plan::device_names;
use super::super::summary::Report;
use super::format::percent;
use super::{escape, overview, sections};
use crate::error::Result;

const STYLE: &str = "
:root { color-scheme: light; --ink: #202124; --soft: #5f6368; --rule: #dadce0; --paper: #fff; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.5rem 1.5rem 5rem; max-width: 72rem; background: var(--paper);
  color: var(--ink); font: 16px/1.55 system-ui, 'Segoe UI', Helvetica, Arial, sans-serif; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.4rem; margin: 3.2rem 0 .4rem; padding-top: 1rem; border-top: 2px solid var(--ink); }
h3 { font-size: 1.05rem; margin: 1.8rem 0 .4rem; }
p, ul { max-width: 52rem; margin: .5rem 0; }
.soft { color: var(--soft); }
.warning { border-left: 4px solid #d55e00; background: #fdf1e8; padding: .6rem 1rem; max-width: 52rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: .8rem 0; font-size: .9rem; font-variant-numeric: tabular-nums; }
th { text-align: right; vertical-align: bottom; font-weight: 600; border-bottom: 1.5px solid var(--ink);
  padding: .3rem .7rem; }
td { text-align: right; padding: .25rem .7rem; border-bottom: 1px solid var(--rule); white-space: nowrap; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
td.remark { text-align: left; color: var(--soft); white-space: normal; }
tr.group td { font-weight: 600; padding-top: .8rem; }
.plots { display: flex; flex-wrap: wrap; gap: 1rem; margin: .8rem 0; }
.plots svg { max-width: 100%; height: auto; }
.pictures { font-size: 0; margin: .6rem 0; }
figure { display: inline-block; vertical-align: top; margin: 0 .8rem .8rem 0; font-size: .85rem; }
figure img { display: block; image-rendering: pixelated; }
figcaption { padding-top: .25rem; color: var(--soft); }
figcaption b { color: var(--ink); }
code { font: .88em/1.4 ui-monospace, Menlo, Consolas, monospace; background: #f3f4f6; padding: .1em .35em; }
";

/// The whole page.
pub(super) fn page(report: &Report) -> Result<String> {
    let title = escape(&report.plan.title);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
    );
    introduction(report, &mut html);
    overview::overview(report, &mut html);
    method(report, &mut html);
    if !report.plan.differences.is_empty() {
        html.push_str("<h2>Beside the talk's figures</h2>\n<ul>\n");
        for sentence in &report.plan.differences {
            let _ = writeln!(html, "<li>{}</li>", escape(sentence));
        }
        html.push_str("</ul>\n");
    }
    for row in &report.rows {
        sections::row(report, row, &mut html)?;
    }
    html.push_str("</body>\n</html>\n");
    Ok(html)
}

fn introduction(report: &Report, html: &mut String) {
    let (plan, machine) = (&report.plan, &report.machine);
    for paragraph in &plan.introduction {
        let _ = writeln!(html, "<p>{}</p>", escape(paragraph));
    }
    let mut places = vec![format!(
        "{}, {} threads ({}, {})",
        machine.processor, machine.threads, machine.system, machine.build
    )];
    let gpu = report.rows.iter().flat_map(|row| &row.devices).find(|d| d.device.title() == "GPU");
    places.extend(gpu.map(|gpu| gpu.name.clone()));
    let _ = write!(html, "<p class=\"soft\">Measured on {}.", escape(&places.join(", and on ")));
    if let Some(load) = machine.load {
        let _ =
            write!(html, " Load of the machine in the minute before the last start: {load:.2}.");
    }
    html.push_str("</p>\n");
    if !report.is_finished {
        let _ = writeln!(
            html,
            "<p class=\"warning\"><b>Not finished.</b> {} of {} rows are begun; the same command goes \
             on from here: <code>{}</code></p>",
            report.rows.len(),
            plan.rows.len(),
            escape(&plan.command)
        );
    }
    if machine.build.contains("development") {
        html.push_str(
            "<p class=\"warning\"><b>Development build.</b> Times are longer than a release build's, \
             and not by the same factor everywhere.</p>\n",
        );
    }
    let bad = report
        .rows
        .iter()
        .filter(|row| row.reference.as_ref().is_some_and(|r| !r.is_good))
        .map(|row| row.row.title.as_str())
        .collect::<Vec<_>>();
    if !bad.is_empty() {
        let _ = writeln!(
            html,
            "<p class=\"warning\"><b>The reference is too noisy</b>, or its noise is not known, in: \
             {}. The smallest errors there are too large as measured, and large speed-ups too \
             small.</p>",
            escape(&bad.join("; "))
        );
    }
}

/// How it was measured, in words.
fn method(report: &Report, html: &mut String) {
    let plan = &report.plan;
    let (width, height) = plan.effort.frame.size;
    let runs = match plan.effort.seeds {
        1 => "One run".to_owned(),
        n => format!("{n} independent runs"),
    };
    html.push_str("<h2>How it was measured</h2>\n");
    let paragraphs = [
        format!(
            "{runs} of {} s for every combination of scene, map, device ({}) and method: {width}x{height} \
             pixels, box filter, {} bounces. The methods take turns, seed by seed, so that what \
             disturbs the machine for a while disturbs all alike.",
            plan.effort.seconds,
            device_names(&plan.effort.devices),
            plan.effort.frame.bounces
        ),
        "Time counts from the start of building the map's importance table and includes learning and \
         the making of tile distributions. It does not include reading files, building the scene's tree, and, on \
         a GPU, uploading and building kernels, which are the same for all methods or nearly so and are \
         done once beforehand. Errors are taken while the clock stands still."
            .to_owned(),
        "MSE and relMSE are in units of the reference's mean; relMSE divides each squared difference by \
         the squared reference plus 0.01; trimmed relMSE leaves out the 0.1 % of the pixels where it is \
         worst, and is what speed-ups are told by; FLIP is LDR-FLIP after automatic exposure and the \
         ACES curve. Means are over runs, with the standard error of the mean."
            .to_owned(),
        "A speed-up is the ratio of the times at which the mean errors of two methods are equal, at the \
         larger of the two errors at the end. In brackets: 95 % confidence, by bootstrap over runs \
         (expanded percentiles, 2000 resamples). A sign ≥ or ≤ says that the faster method was there \
         before its first measured point. The slope is that of a power law fitted to each run's error \
         against rendering time, over the last 15/16 of it: -1 for independent samples, steeper for \
         even ones, flatter where rare bright paths are still to come."
            .to_owned(),
        format!(
            "{} Its own noise, from the spread of these pictures, was to be at most {} of the smallest \
             error it is used for; what was reached stands beside each row.",
            if plan.reference.is_some() {
                "The reference was given. What it errs by is judged by how much farther the mean of \
                 the best method's runs is from it than their spread explains."
            } else {
                "The reference is the mean of independent pictures with seeds of their own, rendered \
                 by the default sampling."
            },
            percent(plan.effort.reference_noise)
        ),
        "Where the error is left: the same samples are rendered with all bounces, with one and with \
         none. As paths draw their random numbers in order, the differences of these pictures are the \
         light of later vertices and of the first one; eight seeds give each part's variance. What is \
         seen at zero bounces errs by the pixel filter alone."
            .to_owned(),
    ];
    for paragraph in paragraphs {
        let _ = writeln!(html, "<p>{}</p>", escape(&paragraph));
    }
    let _ = writeln!(
        html,
        "<p>Once more: <code>{}</code>. All points are in <code>report.csv</code>, everything is in \
         <code>report.json</code>, the plots are in <code>plots/</code>.</p>",
        escape(&plan.command)
    );
}
