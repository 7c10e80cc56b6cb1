//! What the light of the inspected pixel is made of, where its noise comes from, and what would help.

use egui::{Grid, RichText, Ui};

use crate::app::inspect::Truth;
use crate::app::theme;
use crate::render::light_parts::{LightPart, LightParts};

/// Noise of a pixel that nobody sees.
const LITTLE_NOISE: f64 = 0.05;
/// Learned probability that may lie where nothing is visible.
const LEARNED_WELL: f32 = 0.3;

/// What to call the parts, in the order of [`LightPart::ALL`].
const NAMES: [&str; 5] =
    ["Seen directly", "Map, direct", "Lamps, direct", "Map, reflected", "Lamps, reflected"];

/// Columns of the table, and what they say.
const COLUMNS: [(&str, &str); 3] = [
    ("Light", "How it comes to this pixel"),
    ("Share", "Of the pixel's luminance"),
    ("Noise", "Its share of the variance of exact samples; negative where it balances others"),
];

/// Draws the table of parts, and the advice. `misplaced` is the share of the learned probability that lies where the
/// truth has none; `None` where nothing was learned.
pub(super) fn show(ui: &mut Ui, truth: &Truth, misplaced: Option<f32>) {
    let parts = &truth.parts;
    let light: f64 = parts.luminance.iter().sum();
    if light > 0.0 {
        Grid::new("light").num_columns(3).spacing([14.0, 3.0]).striped(true).show(ui, |ui| {
            for (name, hint) in COLUMNS {
                ui.label(theme::quiet(name)).on_hover_text(hint);
            }
            ui.end_row();
            let lines = NAMES.into_iter().zip(parts.luminance).zip(parts.noise);
            for ((name, luminance), noise) in lines.filter(|((_, luminance), _)| *luminance > 0.0) {
                let percent = |share: f64| format!("{:.0} %", 100.0 * share);
                for text in [name.to_owned(), percent(luminance / light), percent(noise)] {
                    ui.label(RichText::new(text).size(12.5));
                }
                ui.end_row();
            }
        });
    }
    for sentence in sentences(parts, truth.unblocked, misplaced) {
        theme::note(ui, sentence);
    }
}

/// Why it is dark, how noisy it is, and what would help most.
fn sentences(parts: &LightParts, unblocked: f32, misplaced: Option<f32>) -> Vec<String> {
    let arriving = format!(
        "{} of the map's light arrives that a surface facing this way would receive in the open.",
        theme::percent(unblocked)
    );
    if parts.luminance.iter().sum::<f64>() <= 0.0 {
        return vec![arriving, "No path found any light for this pixel.".to_owned()];
    }
    let samples = (parts.spread / LITTLE_NOISE).powi(2).ceil().max(1.0) as u64;
    let (count, percent) = (theme::count(samples), 100.0 * LITTLE_NOISE);
    let noise = format!("This pixel takes {count} samples until its noise is {percent:.0} %.");
    let noisiest = LightPart::ALL.into_iter().zip(parts.noise).max_by(|a, b| a.1.total_cmp(&b.1));
    let (noisiest, _) = noisiest.unwrap_or((LightPart::Seen, 0.0));
    let help = match (noisiest, misplaced) {
        _ if samples <= 4 => return vec![arriving, noise],
        (LightPart::Seen, _) => "what the camera sees directly: samples alone help",
        (LightPart::MapDirect, None) => {
            "the map's direct light: choose adaptive sampling, which learns what is visible"
        }
        (LightPart::MapDirect, Some(share)) if share > LEARNED_WELL => {
            "the map's direct light, and what was learned here is far from the truth: more samples teach it"
        }
        (LightPart::MapDirect, _) => {
            "the map's direct light, which was learned well: an edge of a shadow needs samples"
        }
        (LightPart::LampsDirect, _) => "the lamps' direct light: fewer or larger lamps help",
        (LightPart::MapReflected | LightPart::LampsReflected, _) => {
            "light that several surfaces reflect: denoising with cached light removes it"
        }
    };
    vec![arriving, noise, format!("Most noise is in {help}.")]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(noise: [f64; 5], spread: f64, misplaced: Option<f32>) -> String {
        let parts = LightParts { luminance: [0.2; 5], noise, spread };
        sentences(&parts, 0.013, misplaced).join("\n")
    }

    #[test]
    fn the_noisiest_part_decides_what_is_advised() {
        let by_map = [0.1, 0.6, 0.0, 0.2, 0.1];
        let text = said(by_map, 2.0, Some(0.1));
        assert!(text.starts_with("1.30 % of the map's light arrives"), "{text}");
        assert!(text.contains("takes 1600 samples until its noise is 5 %"), "{text}");
        assert!(text.contains("which was learned well"), "{text}");
        assert!(said(by_map, 2.0, Some(0.5)).contains("far from the truth"));
        assert!(said(by_map, 2.0, None).contains("choose adaptive sampling"));
        assert!(said([0.1, 0.1, 0.0, 0.1, 0.7], 2.0, None).contains("several surfaces reflect"));
        assert_eq!(said(by_map, 0.1, None).lines().count(), 2, "little noise needs no advice");
        let black = LightParts { luminance: [0.0; 5], noise: [0.0; 5], spread: 0.0 };
        let text = sentences(&black, 0.0, None).join("\n");
        assert!(
            text.contains("0 % of the map's light") && text.contains("No path found"),
            "{text}"
        );
    }
}
