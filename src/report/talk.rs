//! The plan of the talk's table of speed-ups, with two more rows.

use super::plan::{Effort, Method, Plan, Row, Settings};
use crate::render::{Gi, Sampling, Sharing};

/// Title, scene, map, the talk's speed-up on CPU and GPU, and the target for `adaptive`.
type Entry = (&'static str, &'static str, &'static str, Option<[f64; 2]>, Option<f64>);

const ROWS: [Entry; 9] = [
    ("Office", "office", "sky:sunset", Some([6.6, 3.8]), Some(3.0)),
    ("Living room", "living-room", "sky:overcast", Some([2.7, 2.4]), None),
    ("Living room, day", "living-room", "sky:day", Some([2.2, 1.6]), Some(1.9)),
    ("Living room, sunset", "living-room", "sky:sunset", Some([1.9, 1.6]), Some(1.9)),
    ("Living room, night", "living-room", "sky:night", Some([3.8, 3.0]), Some(3.0)),
    ("Exterior", "exterior", "sky:sunset", Some([2.3, 1.8]), Some(2.0)),
    ("Exterior with fog", "fog", "sky:sunset", Some([3.4, 2.6]), Some(1.5)),
    ("Open", "open", "sky:day", None, Some(1.0)),
    ("Crack", "crack", "sky:day", None, None),
];

/// The plan.
pub fn plan(effort: Effort, command: String) -> Plan {
    let rows = ROWS
        .into_iter()
        .map(|(title, scene, map, published, target)| Row {
            title: title.to_owned(),
            published,
            target,
            ..Row::new(scene, map)
        })
        .collect();
    let modes = || [Sampling::Plain, Sampling::Talk, Sampling::Adaptive].map(Method::of);
    let mut methods = modes().to_vec();
    let mut baselines = vec![0];
    // With a single bounce there are no second vertices to share or to cache.
    if effort.frame.bounces > 1 {
        let settings = Settings { sharing: Sharing::Off, ..Settings::of(Sampling::Adaptive) };
        methods.push(Method { name: "own paths".to_owned(), group: None, settings });
        baselines.push(methods.len());
        methods.extend(modes().map(|mode| mode.with_gi(Gi::Cached)));
    }
    Plan {
        title: "The talk's table, measured here",
        introduction: &[
            "Atanasov et al., Adaptive Environment Sampling on CPU and GPU (ACM SIGGRAPH 2018 Talks), \
             learn which tiles of an environment map each part of the picture can see, and publish how \
             many times faster equal noise is reached. Here the same comparison is made with this \
             project's scenes: plain samples the whole map, talk is the talk's method to the letter, \
             adaptive is lightgrid's own; own paths is adaptive whose pixels share nothing, as for a \
             denoiser.",
            "The talk was measured in a renderer whose paths end in a light cache after their first \
             bounce. The methods called cached do the like: their paths end at the second vertex, in a \
             cache that other paths have trained, which costs a bias. With --bounces 1 the first vertex \
             alone is measured.",
        ],
        differences: &DIFFERENCES,
        rows,
        methods,
        baselines,
        effort,
        reference: None,
        command,
    }
}

const DIFFERENCES: [&str; 7] = [
    "Other scenes and maps: the talk's are not public. Ours are built by code after its words (a closed \
     office with two small windows, a living room, a street partly occluded, the street in fog), under \
     built-in skies. Where the talk names no map (office, first living room, exterior) the choice is \
     ours. Open and crack are ours altogether: nothing occluded, and nearly everything.",
    "Another renderer: the talk's is V-Ray, where most indirect light comes from a light cache and the \
     noise is that of direct light at a few vertices. Here full paths of at most so many bounces are \
     traced and the indirect light's own noise counts, which no choice of map samples removes: see \
     the sources of the remaining error, row by row. Nearest to the talk's setting is talk cached over plain \
     cached.",
    "Another measure: the talk says equal noise without a formula. Here it is trimmed relMSE against a \
     reference.",
    "The talk's learning is about 1 % of a production render. Here runs are short and pictures small, \
     and all of the learning counts, so ratios are smaller than in a long render; the column \"without \
     learning\" says what a long one would come to.",
    "The talk does not give the numbers of tiles and cells it was measured with (its figures show 8x4 \
     tiles). Here both talk and adaptive have 16x8 tiles and 64x32 cells.",
    "Low-discrepancy samples, balance heuristic, bilinear look-up of the map and exact integer tables are \
     the same for all three methods here; how the talk's plain method samples is not known.",
    "The published figures are one number a scene, without uncertainty.",
];
