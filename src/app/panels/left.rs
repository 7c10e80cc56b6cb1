//! The left panel: scene, cameras, environment, lamps, fog, material. Where there is no room for it, the right one
//! shows the same.

use egui::{
    Button, Checkbox, Margin, Panel, Response, RichText, ScrollArea, SliderClamping, TextureHandle,
    Ui,
};

use glam::Vec3;

use super::button::button;
use super::late::{factor, late_factor};
use super::scope::Scope;
use super::{lamps, map_view, material};
use crate::app::commands::Command;
use crate::app::document::Viewpoint;
use crate::app::drag::{Drag, Step};
use crate::app::settings_file::lasting_map;
use crate::app::theme;
use crate::environment::sky;
use crate::path::Background;
use crate::render::light_groups::MAX_LAMPS;
use crate::scene::{Camera, Frame, Medium, Scene, builtin};
use crate::sources::{is_built_in_map, is_built_in_scene};

/// Draws the panel.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let frame = egui::Frame::new().inner_margin(Margin::symmetric(12, 8));
    let is_narrow = theme::is_narrow(ui);
    let width = if is_narrow { 258.0 } else { 286.0 };
    Panel::left("left").frame(frame).exact_size(width).show(ui, |ui| {
        if is_narrow {
            ui.spacing_mut().slider_width = 66.0;
        }
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| sections(ui, scope));
    });
}

/// Draws what is in the panel.
pub(in crate::app) fn sections(ui: &mut Ui, scope: &mut Scope<'_>) {
    theme::heading(ui, "SCENE");
    scene(ui, scope);
    theme::heading(ui, "CAMERA");
    cameras(ui, scope);
    theme::section(ui, "ENVIRONMENT");
    environment(ui, scope);
    if let Some(scene) = scope.scene() {
        if !scene.named_lamps.is_empty() {
            theme::section(ui, "LAMPS");
            lamps::show(ui, scope, scene);
        }
        theme::section(ui, "FOG");
        fog(ui, &mut scope.document.fog, &scene.world.scene);
        theme::section(ui, "MATERIAL");
        material::show(ui, scope, scene);
    }
}

fn scene(ui: &mut Ui, scope: &mut Scope<'_>) {
    let scene = scope.scene();
    let Scope { document, commands, library, .. } = scope;
    let mut chosen = None;
    theme::choice(ui, "scene").selected_text(theme::file_name(&document.scene)).show_ui(ui, |ui| {
        theme::note(ui, "Built in");
        for name in builtin::names() {
            if ui.selectable_label(document.scene == *name, *name).clicked() {
                chosen = Some((*name).to_owned());
            }
        }
        let files = &library.settings.recent_scenes;
        files_named(ui, "Recent", files, &document.scene, |_| None, &mut chosen);
    });
    commands.extend(chosen.map(Command::OpenScene));
    if let Some(scene) = scene {
        let (low, high) = scene.world.bvh.bounds();
        let triangles = theme::count(scene.world.scene.shown_triangles());
        let frame = scene.world.scene.frame;
        let size = (high - low).to_array().map(|length| frame.length_in_file(length));
        let text = format!("{triangles} triangles, {}", theme::extent(size.into()));
        let Scene { materials, textures, .. } = &scene.world.scene;
        let (materials, textures) = (materials.len(), textures.len());
        let bvh = theme::bytes(scene.world.bvh.memory_bytes());
        let hint = format!("{materials} materials, {textures} textures; BVH {bvh}");
        ui.label(theme::quiet(text)).on_hover_text(hint);
    }
    let is_file = !is_built_in_scene(&document.scene) || !is_built_in_map(&document.map);
    let mut reloads = library.settings.reloads;
    let hint = "Reads scene and map again when another program has written them";
    if is_file && ui.checkbox(&mut reloads, "Reload on change").on_hover_text(hint).changed() {
        commands.push(Command::ToggleReloads);
    }
}

fn files_named<'a>(
    ui: &mut Ui,
    title: &str,
    list: &[String],
    current: &str,
    small: impl Fn(&str) -> Option<&'a TextureHandle>,
    chosen: &mut Option<String>,
) {
    if list.is_empty() {
        return;
    }
    ui.separator();
    theme::note(ui, title);
    for name in list {
        let label = named(ui, current == name, small(name), &theme::file_name(name));
        if label.on_hover_text(name).clicked() {
            *chosen = Some(name.clone());
        }
    }
}

/// A row of a list, with what it looks like if that is known.
fn named(ui: &mut Ui, is_current: bool, small: Option<&TextureHandle>, name: &str) -> Response {
    ui.add(match small {
        Some(texture) => Button::selectable(is_current, (map_view::small(texture), name)),
        None => Button::selectable(is_current, name),
    })
}

fn cameras(ui: &mut Ui, scope: &mut Scope<'_>) {
    let scene = scope.scene();
    let Scope { document, rendering, commands, .. } = scope;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = egui::Vec2::splat(4.0);
        let view =
            |ui: &mut Ui, (name, hint): (&str, &str), camera: Camera, commands: &mut Vec<_>| {
                let button = ui.button(name);
                if button.hovered() {
                    commands.push(Command::MakeCameraPicture(camera.clone()));
                }
                button.on_hover_ui(|ui| {
                    if let Some(texture) = rendering.camera_pictures.of(&camera) {
                        ui.image((texture.id(), texture.size_vec2()));
                    }
                    ui.label(hint);
                })
            };
        for (i, camera) in scene.iter().flat_map(|s| s.world.scene.cameras.iter()).enumerate() {
            let own = Some(camera.name.clone()).filter(|name| !name.is_empty());
            let name = own.unwrap_or_else(|| format!("Camera {}", i + 1));
            let distance = document.viewpoint.as_ref().map_or(3.0, |v| v.pivot_distance);
            let hint = "Look through this camera of the scene";
            if view(ui, (&name, hint), camera.clone(), commands).clicked() {
                commands.push(Command::LookFrom(Viewpoint::of(camera, distance)));
            }
        }
        for (i, viewpoint) in document.bookmarks.iter().enumerate() {
            let hint = "Click: go to this view. Right click: delete it";
            let button = view(ui, (&viewpoint.name, hint), viewpoint.camera(), commands);
            if button.clicked() {
                commands.push(Command::LookFrom(viewpoint.clone()));
            }
            if button.secondary_clicked() {
                commands.push(Command::ForgetBookmark(i));
            }
        }
        button(ui, ("+ Keep", "Keep this viewpoint (B)"), commands, Command::Bookmark);
        button(ui, ("Frame all", "Show the whole scene (F)"), commands, Command::FrameAll);
    });
    let Some(viewpoint) = &mut document.viewpoint else { return };
    let frame = scene.map_or_else(Frame::default, |scene| scene.world.scene.frame);
    if let Some(degrees) = &mut viewpoint.fov_y_degrees {
        let slider = theme::slider(degrees, 1.0..=170.0).suffix("°").max_decimals(1);
        theme::set(ui, "Field of view", "Vertical angle", slider);
    }
    let mut millimetres = frame.length_in_file(viewpoint.lens_radius) * 1000.0;
    let slider = theme::slider(&mut millimetres, 0.0..=100.0).logarithmic(true);
    let slider = slider.smallest_positive(0.1).suffix(" mm").max_decimals(1);
    let hint = "More blurs what is out of focus; 0 keeps everything sharp";
    if theme::set(ui, "Lens radius", hint, slider).changed() {
        viewpoint.lens_radius = frame.length(millimetres / 1000.0);
    }
    if viewpoint.lens_radius > 0.0 {
        let mut metres = frame.length_in_file(viewpoint.focus_distance);
        let slider = theme::slider(&mut metres, 0.01..=1000.0).logarithmic(true).suffix(" m");
        let hint = "Distance of what is sharp; Ctrl click in the picture sets it";
        if theme::set(ui, "Focus at", hint, slider).changed() {
            viewpoint.focus_distance = frame.length(metres);
        }
    }
}

fn environment(ui: &mut Ui, scope: &mut Scope<'_>) {
    let lamps = scope.scene().map_or(0, |scene| scene.named_lamps.len());
    let Scope { document, interface, commands, library, assets, .. } = scope;
    if let Some(map) = &assets.map {
        let turn = document.rotation_degrees / 360.0;
        let response = map_view::preview(ui, map, turn);
        let (is_free, seen) = (!interface.is_modal(), response.rect.intersect(ui.clip_rect()));
        // The panel's scroll bar lies over its edge.
        let seen = seen.with_max_x(seen.right() - ui.spacing().scroll.bar_width);
        let drag = &mut interface.map_drag;
        let steps = Drag::follow_in(drag, ui, 0.0, |at| is_free && seen.contains(at));
        if drag.is_some_and(|drag| drag.span().is_some()) || !steps.is_empty() {
            let way: f32 = steps.iter().map(Step::right).sum();
            let degrees = way / response.rect.width() * 360.0;
            document.rotation_degrees = (document.rotation_degrees + degrees).rem_euclid(360.0);
            interface.keep_turning(ui.ctx());
        }
        let hint = "Drag to turn the map. The middle of the picture is seen along +X, the left quarter \
                    along -Z";
        response.on_hover_text(hint);
    }
    let mut chosen = None;
    theme::choice(ui, "map").selected_text(theme::file_name(&document.map)).show_ui(ui, |ui| {
        theme::note(ui, "Built in");
        for name in sky::names() {
            let name = format!("sky:{name}");
            let small = library.small_maps.textures.get(&name);
            if named(ui, document.map == name, small, &name).clicked() {
                chosen = Some(name);
            }
        }
        let small = |name: &str| library.small_maps.textures.get(name);
        let current = lasting_map(&document.map);
        let beside = library.small_maps.beside(&current);
        let mut recent = library.settings.recent_maps.clone();
        recent.retain(|name| !beside.contains(name));
        files_named(ui, "In its folder", beside, &current, small, &mut chosen);
        files_named(ui, "Recent", &recent, &current, small, &mut chosen);
        commands.push(Command::MakeSmallMap);
    });
    commands.extend(chosen.map(Command::OpenMap));
    if let Some(map) = &assets.map {
        let image = map.environment.map();
        let text = format!("{} x {} pixels", image.width, image.height);
        let table = theme::bytes(map.environment.memory_bytes().table);
        ui.label(theme::quiet(text)).on_hover_text(format!("Importance table: {table}"));
    }
    let degrees = &mut document.rotation_degrees;
    let slider = theme::slider(degrees, 0.0..=360.0).suffix("°").max_decimals(1);
    let slider = slider.clamping(SliderClamping::Never);
    if theme::set(ui, "Rotation", "Rotates the map about the vertical axis", slider).dragged() {
        interface.keep_turning(ui.ctx());
    }
    // Somebody may type -90.
    if !(0.0..=360.0).contains(degrees) {
        *degrees = degrees.rem_euclid(360.0);
    }
    let words = ("Put the sun…", "Then click or drag in the picture where it is to shine (L)");
    button(ui, words, commands, Command::ToggleSun);
    let is_late = document.mix().is_none();
    let slider = factor(&mut document.intensity);
    if theme::set(ui, "Intensity", "Brightness of the map", slider).dragged() && is_late {
        interface.keep_moving(ui.ctx());
    }
    let hint = "Brightness of the map's sun alone; its sky stays as it is";
    late_factor(ui, "Sun", hint, (&mut document.sun, is_late));
    let may_mix = !document.light.split && lamps <= MAX_LAMPS;
    let mix = Checkbox::new(&mut document.light_mix, "Light mix");
    let hint = "Sky, sun and each lamp get a picture of their own. Intensity, sun and lamps then change what is \
                shown at once. All these pictures take their share of time and memory";
    let why_not = format!("Not beside a split view, nor with more than {MAX_LAMPS} lamps");
    ui.add_enabled(may_mix, mix).on_hover_text(hint).on_disabled_hover_text(why_not);
    background(ui, &mut document.background);
    if (document.rotation_degrees, document.intensity, document.sun) != (0.0, 1.0, 1.0)
        && ui.button(RichText::new("Reset rotation, intensity and sun").size(12.0)).clicked()
    {
        (document.rotation_degrees, document.intensity, document.sun) = (0.0, 1.0, 1.0);
    }
}

/// What the camera sees of the map; surfaces are lit by it in any case.
fn background(ui: &mut Ui, background: &mut Background) {
    let kinds = [
        (Background::Map, "The map"),
        (Background::Blurred(0.1), "The map, blurred"),
        (Background::Color([0.18; 3]), "A colour"),
        (Background::None, "Transparent"),
    ];
    let is_same =
        |a: &Background, b: &Background| std::mem::discriminant(a) == std::mem::discriminant(b);
    let name = kinds.iter().find(|(kind, _)| is_same(kind, background)).map_or("", |(_, n)| n);
    let hint = "What the camera sees behind the scene, also through panes";
    theme::row(ui, "Background", hint, |ui| {
        theme::choice(ui, "background").selected_text(name).show_ui(ui, |ui| {
            for (kind, name) in kinds {
                let is_chosen = is_same(&kind, background);
                if ui.selectable_label(is_chosen, name).clicked() && !is_chosen {
                    *background = kind;
                }
            }
        });
    });
    match background {
        Background::Map | Background::None => {}
        Background::Blurred(radians) => {
            let mut degrees = radians.to_degrees();
            let slider = theme::slider(&mut degrees, 0.1..=90.0).logarithmic(true);
            let slider = slider.suffix("°").fixed_decimals(1);
            if theme::set(ui, "Blur", "Blur of the background", slider).changed() {
                *radians = degrees.to_radians();
            }
        }
        Background::Color(rgb) => {
            theme::row(ui, "Colour", "Background colour, linear", |ui| theme::color(ui, rgb));
        }
    }
}

/// Fog: the scene's own until something is changed.
fn fog(ui: &mut Ui, fog: &mut Option<Medium>, scene: &Scene) {
    let (own, frame) = (scene.medium, scene.frame);
    let clear = Medium::default();
    let now = fog.or(own).unwrap_or(clear);
    let mut edited = now;
    let id = ui.scope_id().with("fog");
    // Whoever pulls the last coefficient to nothing wants to pull on.
    let is_held = ui.data(|data| data.get_temp(id)).unwrap_or(false);
    let mut is_on =
        is_held || now.scattering != clear.scattering || now.absorption != clear.absorption;
    let mut holds = false;
    ui.horizontal(|ui| {
        let hint = "Participating medium (scatters and absorbs light)";
        if ui.checkbox(&mut is_on, "Fill the air").on_hover_text(hint).changed() {
            let thick = frame.medium(Medium { scattering: Vec3::splat(FIRST_FOG), ..clear });
            let own = own.filter(|own| *own != clear);
            edited = if is_on { own.unwrap_or(thick) } else { clear };
        }
    });
    if is_on {
        let mut coefficient = |ui: &mut Ui, value: &mut Vec3| {
            // Of the file's metres.
            let mut mean = frame.length(value.element_sum() / 3.0);
            let slider = theme::slider(&mut mean, 0.0..=10.0).logarithmic(true);
            // More digits would be wider than the panel.
            let slider = slider.smallest_positive(1e-4).max_decimals(4);
            let response = ui.add(slider);
            holds |= response.dragged() || response.has_focus();
            if response.changed() {
                // The colour stays, if there is one.
                let (old, mean) = (value.element_sum() / 3.0, frame.length_in_file(mean));
                *value = if old > 0.0 { *value * (mean / old) } else { Vec3::splat(mean) };
            }
        };
        let hint = "Scattering coefficient, 1/m (1 / mean free path)";
        theme::row(ui, "Scattering", hint, |ui| coefficient(ui, &mut edited.scattering));
        let hint = "Absorption coefficient, 1/m";
        theme::row(ui, "Absorption", hint, |ui| coefficient(ui, &mut edited.absorption));
        let hint = "Henyey-Greenstein g: -1 backward, 0 isotropic, 1 forward";
        let slider = theme::slider(&mut edited.anisotropy, -0.95..=0.95).fixed_decimals(2);
        theme::set(ui, "Anisotropy", hint, slider);
    }
    ui.data_mut(|data| data.insert_temp(id, holds));
    if edited != now {
        *fog = Some(edited);
    }
    fog.take_if(|fog| *fog == own.unwrap_or(clear));
}

/// Scattering per metre of fog that is switched on: seen in a room, not hiding it.
const FIRST_FOG: f32 = 0.05;
