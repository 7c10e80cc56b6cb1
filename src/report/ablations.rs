//! Every default of the code beside the alternatives that it was chosen over.

use super::plan::{Device, Effort, Method, Plan, Row, Settings};
use crate::environment::TableKind;
use crate::light_grid::{DistributionOptions, Recording, RenderedPaths};
use crate::render::{Gi, Sampling, Sharing};
use crate::sampler::Points;

/// Default scenes and maps: one of each kind of occlusion.
const ROWS: [(&str, &str); 5] = [
    ("office", "sky:sunset"),
    ("living-room", "sky:day"),
    ("living-room", "sky:night"),
    ("exterior", "sky:sunset"),
    ("open", "sky:day"),
];

/// The plan, for these scenes and maps, of the methods whose group or name contains one of `only`;
/// `plain` and `adaptive` are always there. What only the CPU can do is left out where a GPU is measured, too.
pub fn plan(rows: Vec<Row>, only: &[String], effort: Effort, command: String) -> Plan {
    let rows =
        if rows.is_empty() { ROWS.map(|(scene, map)| Row::new(scene, map)).to_vec() } else { rows };
    let is_asked = |method: &Method| {
        let group = method.group.unwrap_or_default();
        let is_in =
            |word: &String| group.contains(word.as_str()) || method.name.contains(word.as_str());
        // What is only measured is left to the CPU.
        let is_on_gpus = method.settings.table == TableKind::TileLocal
            && method.settings.points == Points::Sobol
            && method.settings.distributions.recording != Recording::VisibleCosineSquared;
        let can_be_measured = is_on_gpus || !effort.devices.contains(&Device::Gpu);
        can_be_measured && (only.is_empty() || only.iter().any(is_in))
    };
    let mut methods = [Sampling::Plain, Sampling::Adaptive].map(Method::of).to_vec();
    methods.extend(variants().into_iter().filter(is_asked));
    Plan {
        title: "Value of every default",
        introduction: &[
            "Each line changes one setting of adaptive, lightgrid's default, or builds up to it from the \
             talk's form. Above 1 the change would be faster, below 1 the default is. A default is kept \
             where the intervals do not separate it from the change.",
        ],
        differences: &[],
        rows,
        methods,
        baselines: vec![0, 1],
        effort,
        reference: None,
        command,
    }
}

/// Groups of the variants, in order.
pub fn groups() -> Vec<&'static str> {
    let mut groups: Vec<_> = variants().into_iter().filter_map(|m| m.group).collect();
    groups.dedup();
    groups
}

fn variants() -> Vec<Method> {
    const VISIBLE: DistributionOptions =
        DistributionOptions { recording: Recording::Visible, ..DistributionOptions::TALK };
    const COSINE: DistributionOptions =
        DistributionOptions { recording: Recording::VisibleCosine, ..DistributionOptions::TALK };
    const WITH_FACES: DistributionOptions = DistributionOptions { faces: true, ..COSINE };
    let mut found = Vec::new();
    let mut add = |group: &'static str, name: &str, change: &dyn Fn(&mut Settings)| {
        let mut settings = Settings::of(Sampling::Adaptive);
        change(&mut settings);
        found.push(Method { name: name.to_owned(), group: Some(group), settings });
    };
    let group = "sampling modes";
    add(group, "talk", &|s| s.sampling = Sampling::Talk);
    add(group, "bsdf", &|s| s.sampling = Sampling::Bsdf);
    // Step by step from counted visibility to the full method, one addition each.
    let group = "step by step, neither pooling nor powers";
    for (name, distributions) in [
        ("talk + faces", DistributionOptions { faces: true, ..DistributionOptions::TALK }),
        ("visibility", VISIBLE),
        ("visibility + faces", DistributionOptions { faces: true, ..VISIBLE }),
        ("visibility + cosine", COSINE),
        ("visibility + faces + cosine", WITH_FACES),
        (
            "visibility + faces + cosine + compensation",
            DistributionOptions { compensation: 0.5, ..WITH_FACES },
        ),
    ] {
        add(group, name, &|s| s.distributions = distributions);
    }
    let group = "faces and cosine";
    add(group, "no faces (nor compensation)", &|s| s.distributions.faces = false);
    add(group, "no cosine", &|s| s.distributions.recording = Recording::Visible);
    let group = "weights";
    add(group, "mean visibility (power 1)", &|s| s.distributions.ratio_exponent = 1.0);
    add(group, "root of mean visibility (power 1/2)", &|s| s.distributions.ratio_exponent = 0.5);
    add(group, "root of second moment", &|s| {
        s.distributions.recording = Recording::VisibleCosineSquared;
        s.distributions.ratio_exponent = 0.5;
    });
    let group = "pooling, tries";
    for tries in [0.0, 4.0, 64.0] {
        add(group, &format!("pooling {tries}"), &|s| s.distributions.pooling_tries = tries);
    }
    let group = "MIS compensation";
    for share in [0.0, 0.25, 1.0] {
        add(group, &format!("compensation {share}"), &|s| s.distributions.compensation = share);
    }
    let group = "defensive share of the whole map";
    for share in [0, 4, 64, 128] {
        add(group, &format!("whole map {share}/256"), &|s| s.distributions.whole_map_share = share);
    }
    let group = "learning from rendered paths";
    for (name, rendered_paths) in [
        ("traced paths only", RenderedPaths::Nowhere),
        ("rendered paths everywhere", RenderedPaths::Everywhere),
    ] {
        add(group, name, &|s| s.distributions.rendered_paths = rendered_paths);
    }
    for (columns, rows) in [(8, 4), (32, 16), (64, 32)] {
        add("tiles", &format!("{columns}x{rows} tiles"), &|s| s.tiles = (columns, rows));
    }
    for columns in [16, 32, 128] {
        add("cells around the horizon", &format!("{columns} cells"), &|s| s.grid_columns = columns);
    }
    let group = "learning paths";
    for paths in [1 << 13, 1 << 16, 1 << 18] {
        add(group, &format!("{paths} learning paths"), &|s| s.learning_paths = Some(paths));
    }
    let group = "tries per vertex of a learning path";
    for tries in [1, 4, 16] {
        add(group, &format!("tries {tries}"), &|s| s.distributions.tries_per_vertex = tries);
    }
    let group = "samples";
    add(group, "independent points instead of Sobol's", &|s| s.points = Points::Independent);
    add(group, "no Russian roulette", &|s| s.russian_roulette = false);
    let group = "shared second vertices";
    add(group, "paths of their own", &|s| s.sharing = Sharing::Off);
    add(group, "squares of 4x4 pixels, all keep theirs", &|s| s.sharing = Sharing::Small);
    add("radiance cache at the second vertex (biased)", "cached", &|s| s.gi = Gi::Cached);
    for table in [TableKind::U32, TableKind::F32, TableKind::F64] {
        add("importance tables", &format!("table {table}"), &|s| s.table = table);
    }
    found
}
