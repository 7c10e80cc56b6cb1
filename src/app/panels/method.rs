//! How light is found, and two ways compared: for whoever wants to know, not for making pictures.

use egui::{ComboBox, RichText, Ui};

use super::scope::Scope;
use crate::app::commands::Command;
use crate::app::convergence::name_of;
use crate::app::desktop::METHOD;
use crate::app::theme;
use crate::render::Sampling;

/// Ways of sampling the map, and what they do.
const WAYS: [(Sampling, &str); 4] = [
    (
        Sampling::Adaptive,
        "Learns which tiles of the map each part of the scene sees, and samples those",
    ),
    (Sampling::Talk, "As described in the SIGGRAPH talk of 2018, for comparison"),
    (Sampling::Plain, "Samples the whole map by brightness, visible or not"),
    (Sampling::Bsdf, "BSDF sampling only"),
];

/// What was published of it.
const TITLE: &str =
    "Atanasov et al., Adaptive Environment Sampling on CPU and GPU, ACM SIGGRAPH 2018 Talks";

/// Draws the choice.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let light = &mut scope.document.light;
    theme::row(ui, "Sampling", "How the map is sampled; only noise and speed differ", |ui| {
        let list = ComboBox::from_id_salt("sampling").selected_text(capital(light.sampling));
        list.show_ui(ui, |ui| {
            for (sampling, hint) in WAYS {
                let chosen = &mut light.sampling;
                ui.selectable_value(chosen, sampling, capital(sampling)).on_hover_text(hint);
            }
        });
    });
    let hint = "Plain sampling on the left, the chosen one on the right, for equal time (V)";
    ui.checkbox(&mut light.split, "Split view").on_hover_text(hint);
    let link = ui.link(RichText::new("About the method").size(12.0));
    if link.on_hover_text(format!("{TITLE}\n{METHOD}")).clicked() {
        scope.commands.push(Command::ShowMethod);
    }
}

fn capital(sampling: Sampling) -> String {
    theme::capitalised(&name_of(sampling))
}
