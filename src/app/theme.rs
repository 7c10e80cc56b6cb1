//! Colours, spacing and small pieces of layout that all panels share.

use std::ops::RangeInclusive;

use egui::emath::Numeric;
use egui::style::Widgets;
use egui::{
    Align2, Color32, CornerRadius, DragValue, FontId, Margin, Pos2, Rect, Response, RichText,
    Shape, Slider, SliderClamping, Stroke, SurrenderFocusOn, TextEdit, TextStyle, Ui, Vec2,
    Visuals, Widget,
};
use glam::Vec3;

use crate::scene::{color_of_hex, hex_of_color};

/// Around the picture.
pub(super) const BACKGROUND: Color32 = Color32::from_rgb(24, 25, 28);
/// Panels. A frame begins with it, and they do not draw it: software is slow to fill what lies under all else.
pub(super) const PANEL: Color32 = Color32::from_rgb(33, 34, 38);
/// Fields and buttons.
pub(super) const FIELD: Color32 = Color32::from_rgb(48, 50, 56);
/// Text that matters.
pub(super) const TEXT: Color32 = Color32::from_rgb(224, 226, 230);
/// A name with a capital first letter.
pub(super) fn capitalised(name: &str) -> String {
    let first = name.chars().take(1).flat_map(char::to_uppercase);
    first.chain(name.chars().skip(1)).collect()
}

/// Text that explains.
pub(super) const QUIET: Color32 = Color32::from_rgb(152, 156, 164);
/// What is chosen or in progress.
pub(super) const ACCENT: Color32 = Color32::from_rgb(240, 176, 84);
/// What went wrong.
pub(super) const ALERT: Color32 = Color32::from_rgb(238, 120, 104);
/// The other of two compared things.
pub(super) const SECOND: Color32 = Color32::from_rgb(110, 168, 240);
/// What is good as it is.
pub(super) const DONE: Color32 = Color32::from_rgb(120, 200, 130);

/// Sets fonts, colours and spacing of a context.
pub(super) fn apply(context: &egui::Context) {
    context.set_theme(egui::Theme::Dark);
    context.all_styles_mut(|style| {
        style.text_styles = [
            (TextStyle::Heading, FontId::proportional(16.0)),
            (TextStyle::Body, FontId::proportional(13.5)),
            (TextStyle::Button, FontId::proportional(13.5)),
            (TextStyle::Small, FontId::proportional(11.5)),
            (TextStyle::Monospace, FontId::monospace(12.5)),
        ]
        .into();
        style.spacing.item_spacing = Vec2::new(8.0, 7.0);
        style.spacing.button_padding = Vec2::new(9.0, 4.0);
        style.spacing.interact_size = Vec2::new(44.0, 24.0);
        style.spacing.slider_width = 96.0;
        style.spacing.combo_width = 120.0;
        style.spacing.window_margin = Margin::same(16);
        style.spacing.menu_margin = Margin::same(8);
        style.spacing.indent = 14.0;
        style.interaction.tooltip_delay = 0.4;
        style.visuals = visuals();
    });
    // Where frames take long, a press and its release are far apart and are a click all the same.
    context.options_mut(|options| {
        options.input_options.max_click_duration = f64::INFINITY;
        // The picture is as large as the room it has; panels are as large as the screen's scale says.
        options.zoom_with_keyboard = false;
        // Who drags in the picture has done with the field.
        options.input_options.surrender_focus_on = SurrenderFocusOn::Presses;
    });
}

fn visuals() -> Visuals {
    let mut visuals = Visuals::dark();
    visuals.panel_fill = PANEL;
    visuals.window_fill = Color32::from_rgb(38, 40, 45);
    visuals.window_stroke = Stroke::new(1.0, Color32::from_rgb(62, 65, 72));
    visuals.extreme_bg_color = Color32::from_rgb(22, 23, 26);
    visuals.faint_bg_color = Color32::from_rgb(38, 40, 44);
    visuals.hyperlink_color = SECOND;
    visuals.warn_fg_color = ACCENT;
    visuals.error_fg_color = ALERT;
    visuals.weak_text_color = Some(QUIET);
    visuals.slider_trailing_fill = true;
    visuals.selection.bg_fill = Color32::from_rgb(122, 86, 34);
    visuals.selection.stroke = Stroke::new(1.0, Color32::from_rgb(255, 232, 196));
    let Widgets { noninteractive, inactive, hovered, active, open } = &mut visuals.widgets;
    for widget in [&mut *noninteractive, &mut *inactive, &mut *hovered, &mut *active, open] {
        widget.corner_radius = CornerRadius::same(5);
        widget.fg_stroke = Stroke::new(1.0, TEXT);
    }
    noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(50, 52, 58));
    inactive.bg_fill = FIELD;
    inactive.weak_bg_fill = FIELD;
    hovered.bg_fill = Color32::from_rgb(66, 69, 77);
    hovered.weak_bg_fill = Color32::from_rgb(66, 69, 77);
    hovered.bg_stroke = Stroke::new(1.0, Color32::from_rgb(96, 100, 110));
    active.bg_fill = Color32::from_rgb(122, 86, 34);
    active.weak_bg_fill = Color32::from_rgb(122, 86, 34);
    visuals
}

/// The heading of a group of settings.
pub(super) fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(6.0);
    ui.label(RichText::new(text).color(QUIET).size(12.0).strong());
    ui.add_space(-2.0);
}

/// A line below what is above, and the heading of the next group.
pub(super) fn section(ui: &mut Ui, text: &str) {
    ui.add_space(4.0);
    ui.separator();
    heading(ui, text);
}

/// One setting: its name on the left, what sets it on the right.
pub(super) fn row<R>(ui: &mut Ui, name: &str, hint: &str, add: impl FnOnce(&mut Ui) -> R) -> R {
    ui.horizontal(|ui| {
        let height = ui.spacing().interact_size.y;
        let (rect, response) =
            ui.allocate_exact_size(Vec2::new(LABEL_WIDTH, height), egui::Sense::hover());
        let font = TextStyle::Body.resolve(ui.style());
        ui.painter().text(rect.left_center(), Align2::LEFT_CENTER, name, font, TEXT);
        if !hint.is_empty() {
            response.on_hover_text(keys(hint));
        }
        add(ui)
    })
    .inner
}

/// One setting that a single widget sets.
pub(super) fn set(ui: &mut Ui, name: &str, hint: &str, widget: impl Widget) -> Response {
    row(ui, name, hint, |ui| ui.add(widget))
}

/// A slider from end to end of a range. What lies beyond or between its decimals stays until it is moved: a
/// panel that is only looked at changes nothing.
pub(super) fn slider<N: Numeric>(value: &mut N, range: RangeInclusive<N>) -> Slider<'_> {
    let now = value.to_f64();
    let slider = Slider::new(value, range).clamping(SliderClamping::Edits);
    slider.custom_parser(move |text| typed(text, now))
}

/// A number to be dragged or typed, as [`slider`] is.
pub(super) fn number<N: Numeric>(value: &mut N, range: RangeInclusive<N>) -> DragValue<'_> {
    let now = value.to_f64();
    let number = DragValue::new(value).range(range).clamp_existing_to_range(false);
    number.custom_parser(move |text| typed(text, now))
}

/// The number that a field holds; `None` if it is what there is to the decimals written, for whoever only clicks into
/// a field or goes through it changes nothing.
fn typed(text: &str, now: f64) -> Option<f64> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let text = text.replace('\u{2212}', "-");
    let number: f64 = text.parse().ok()?;
    let decimals = text.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let is_what_there_is = format!("{now:.decimals$}").parse() == Ok(number);
    (!is_what_there_is).then_some(number)
}

/// What is said of keys, by this system's name of the one that commands.
pub(super) fn keys(text: &str) -> String {
    if cfg!(target_os = "macos") { text.replace("Ctrl", "⌘") } else { text.to_owned() }
}

/// Width of the names of settings, in points.
const LABEL_WIDTH: f32 = 84.0;

/// A button that opens a picker of linear colours, and the colour as `#rrggbb` to be read, copied and typed; whether
/// another one was chosen. A picker that is only opened gives back what differs by rounding.
pub(super) fn color(ui: &mut Ui, color: &mut [f32; 3]) -> bool {
    let mut chosen = *color;
    let id = ui.color_edit_button_rgb(&mut chosen).id.with("hex");
    let own = hex_of_color(Vec3::from(*color));
    let font = FontId::proportional(12.0);
    let (_, text) = text_field(ui, id, &own, |field| field.desired_width(65.0).font(font));
    let hex = text.map(|text| format!("#{}", text.trim().trim_start_matches('#')));
    if let Some(Ok(typed)) = hex.as_deref().map(color_of_hex) {
        chosen = typed.to_array();
    }
    let is_another = hex_of_color(Vec3::from(chosen)) != own;
    if is_another {
        *color = chosen;
    }
    is_another
}

/// A field of text, styled by `style`, and what was typed into it once it is left, if that is not its `own` text.
pub(super) fn text_field(
    ui: &mut Ui,
    id: egui::Id,
    own: &str,
    style: impl for<'t> FnOnce(TextEdit<'t>) -> TextEdit<'t>,
) -> (Response, Option<String>) {
    let mut text = ui.data(|data| data.get_temp(id)).unwrap_or_else(|| own.to_owned());
    let field = ui.add(style(TextEdit::singleline(&mut text)));
    if field.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
        return (field, None);
    }
    ui.data_mut(|data| data.remove::<String>(id));
    (field, Some(text).filter(|text| text != own))
}

/// A list to choose from, across the panel and as high as the window has room for.
pub(super) fn choice(ui: &Ui, name: &str) -> egui::ComboBox<'static> {
    let height = 0.7 * ui.ctx().content_rect().height();
    egui::ComboBox::from_id_salt(name).width(ui.available_width()).height(height)
}

/// Whether the window is too narrow for everything: what can be had elsewhere gives way.
pub(super) fn is_narrow(ui: &Ui) -> bool {
    ui.ctx().content_rect().width() < 1260.0
}

/// Whether there is no room for two panels and a picture between them.
pub(super) fn is_small(ui: &Ui) -> bool {
    ui.ctx().content_rect().width() < 860.0
}

/// The last part of a path, or the whole name of what is no file.
pub(super) fn file_name(path: &str) -> String {
    let name = std::path::Path::new(path).file_name();
    name.map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Text that explains.
pub(super) fn quiet(text: impl Into<String>) -> RichText {
    RichText::new(text).color(QUIET).size(12.0)
}

/// Shows quiet text.
pub(super) fn note(ui: &mut Ui, text: impl Into<String>) {
    ui.label(quiet(text));
}

/// Samples a pixel, in the mean.
pub(super) fn samples(mean: f64) -> String {
    match mean {
        ..1.0 => format!("{mean:.2}"),
        ..10.0 => format!("{mean:.1}"),
        _ => count(mean as u64),
    }
}

/// A number with as many digits as help: 0.0012, 1.23, 45.6, 789, 12.3 k, 4.5 M.
pub(super) fn figure(value: f64) -> String {
    let (value, suffix) = match value.abs() {
        x if x >= 1e9 => (value / 1e9, " G"),
        x if x >= 1e6 => (value / 1e6, " M"),
        x if x >= 1e4 => (value / 1e3, " k"),
        _ => (value, ""),
    };
    let digits = match value.abs() {
        x if x >= 100.0 || x == 0.0 => 0,
        x if x >= 10.0 => 1,
        x if x >= 0.1 => 2,
        x if x >= 1e-4 => (1 - x.log10().floor() as i32) as usize,
        _ => return format!("{value:.1e}{suffix}"),
    };
    format!("{value:.digits$}{suffix}")
}

/// A whole number: 0, 999, 12.3 k.
pub(super) fn count(value: u64) -> String {
    if value < 10_000 { value.to_string() } else { figure(value as f64) }
}

/// A share in per cent, with as many digits as it needs.
pub(super) fn percent(share: f32) -> String {
    match 100.0 * share {
        p if p >= 9.95 => format!("{p:.1} %"),
        p if p >= 0.01 => format!("{p:.2} %"),
        p if p > 0.0 => format!("{p:.0e} %"),
        _ => "0 %".to_owned(),
    }
}

/// A box's sides in metres, in the unit that suits the longest.
pub(super) fn extent(size: Vec3) -> String {
    let (factor, unit) = match size.max_element() {
        ..1.0 => (100.0, "cm"),
        ..10_000.0 => (1.0, "m"),
        _ => (0.001, "km"),
    };
    let [x, y, z] = (size * factor).to_array();
    format!("{x:.1} x {y:.1} x {z:.1} {unit}")
}

/// Bytes in the unit that suits.
pub(super) fn bytes(count: usize) -> String {
    match count as f64 {
        b if b < 1024.0 => format!("{count} B"),
        b if b < 1024.0 * 1024.0 => format!("{:.0} KB", b / 1024.0),
        b if b < 1024.0 * 1024.0 * 1024.0 => format!("{:.1} MB", b / 1048576.0),
        b => format!("{:.2} GB", b / 1_073_741_824.0),
    }
}

/// Seconds as a person says them: 4.2 s, 3:07, 1:02:03.
pub(super) fn clock(seconds: f64) -> String {
    let whole = seconds as u64;
    match whole {
        0..60 => format!("{seconds:.1} s"),
        60..3600 => format!("{}:{:02}", whole / 60, whole % 60),
        _ => format!("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60),
    }
}

/// Texts on dark plates; one that would cover another is moved below it.
pub(in crate::app) fn badges(ui: &Ui, badges: &[(Pos2, Align2, &str, Color32)]) {
    let mut taken: Vec<Rect> = Vec::new();
    for (at, align, text, color) in badges {
        let font = FontId::proportional(13.0);
        let galley = ui.painter().layout_no_wrap((*text).to_owned(), font, *color);
        let mut rect = align.anchor_size(*at, galley.size());
        let plate = |rect: Rect| rect.expand2(Vec2::new(8.0, 4.0));
        while let Some(other) = taken.iter().find(|other| other.intersects(plate(rect))) {
            rect = rect.translate(Vec2::new(0.0, other.bottom() - plate(rect).top() + 2.0));
        }
        taken.push(plate(rect));
        ui.painter().add(Shape::rect_filled(plate(rect), 5.0, Color32::from_black_alpha(170)));
        ui.painter().galley(rect.min, galley, *color);
    }
}

#[cfg(test)]
mod tests {
    use egui::{Event, Key, Modifiers};

    use super::*;

    #[test]
    fn figures_read_well() {
        let cases =
            [(0.0, "0"), (1.2e-5, "1.2e-5"), (0.5, "0.50"), (12.34, "12.3"), (999.4, "999")];
        for (value, text) in cases {
            assert_eq!(figure(value), text);
        }
        assert_eq!((figure(0.012), figure(1e-3)), ("0.012".into(), "0.0010".into()));
        assert_eq!(figure(1_234_567.0), "1.23 M");
        assert_eq!(extent(Vec3::new(6.5, 3.5, 12.0)), "6.5 x 3.5 x 12.0 m");
        assert_eq!(extent(Vec3::new(0.2, 0.014, 0.0)), "20.0 x 1.4 x 0.0 cm");
        assert_eq!(extent(Vec3::new(2e4, 1e3, 3e4)), "20.0 x 1.0 x 30.0 km");
        assert_eq!((bytes(10), bytes(3 << 20)), ("10 B".into(), "3.0 MB".into()));
        assert_eq!((clock(4.25), clock(187.0)), ("4.2 s".into(), "3:07".into()));
        assert_eq!(clock(3723.0), "1:02:03");
    }

    #[test]
    fn a_field_that_is_only_gone_through_changes_nothing() {
        for (text, now) in [("0.44", 0.4375), ("22.9", 22.945), ("70", 70.0), ("", 1.0), ("x", 1.0)]
        {
            assert_eq!(typed(text, now), None, "{text}");
        }
        assert_eq!(typed("0.45", 0.4375), Some(0.45));
        assert_eq!(typed(" \u{2212}3", 70.0), Some(-3.0));
    }

    #[test]
    fn a_colour_is_typed_into_its_own_field() {
        let context = egui::Context::default();
        let mut colors = [[0.5; 3], [0.25; 3]];
        let key = |key, modifiers| Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers,
        };
        let plain = |it| key(it, Modifiers::NONE);
        let to_field = [vec![plain(Key::Tab)], vec![plain(Key::Tab)]];
        let typed = [vec![key(Key::A, Modifiers::COMMAND)], vec![Event::Text("ff0000".to_owned())]];
        let frames = to_field.into_iter().chain(typed).chain([vec![plain(Key::Enter)], vec![]]);
        for events in frames {
            let input = egui::RawInput { events, ..Default::default() };
            let _ = context.run_ui(input, |ui| {
                for rgb in &mut colors {
                    row(ui, "Colour", "", |ui| color(ui, rgb));
                }
            });
        }
        assert_eq!(colors, [[1.0, 0.0, 0.0], [0.25; 3]]);
    }
}
