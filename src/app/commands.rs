//! What a person can ask for, and the keys that ask for it.

use std::path::PathBuf;

use egui::{Key, KeyboardShortcut, Modifiers};

use super::document::Viewpoint;
use super::interface::Purpose;

/// Something asked for by a panel, a key or a dropped file; the application carries it out.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Show another scene: a file or a built-in.
    OpenScene(String),
    /// Light with another map: a file or a built-in sky.
    OpenMap(String),
    /// Read the files of scene and map again: another program may have written them.
    ReadAgain,
    /// Ask for a scene file.
    ChooseScene,
    /// Ask for a map file.
    ChooseMap,
    /// Ask where to write the picture.
    ChooseSave,
    /// Open the system's file dialogue.
    Browse(Purpose),
    /// Show where the method was published.
    ShowMethod,
    /// Write the picture.
    Save(PathBuf),
    /// Put the picture on the clipboard.
    Copy,
    /// Look from here.
    LookFrom(Viewpoint),
    /// Keep the present viewpoint.
    Bookmark,
    /// Drop a kept viewpoint.
    ForgetBookmark(usize),
    /// Show the whole scene.
    FrameAll,
    /// Show the surface that was clicked last.
    FrameSelected,
    /// Halt or go on.
    TogglePause,
    /// Start the picture again.
    Restart,
    /// Render a part that is marked next, or the whole again.
    ToggleRegion,
    /// Take a change back.
    Undo,
    /// Bring it again.
    Redo,
    /// Show or hide the plain half.
    ToggleSplit,
    /// Render on the other device.
    ToggleDevice,
    /// Filter noise out or not.
    ToggleDenoise,
    /// Show or hide the panels.
    TogglePanels,
    /// Show pixels at their size or larger, or what fits.
    ToggleZoom,
    /// Let the window fill the screen, or no longer.
    ToggleFullScreen,
    /// Show or hide the developer's panel.
    ToggleDeveloper,
    /// Show or hide the list of keys.
    ToggleShortcuts,
    /// Close what lies over the picture, and mark no region.
    CloseSheets,
    /// Keep the present picture for comparison.
    KeepPicture,
    /// Set everything as it was for a kept picture.
    SetAsKept(usize),
    /// Compute the true visible energy at the inspected point.
    MeasureTruth,
    /// Ask where to write the inspected cell's distribution.
    ChooseExport,
    /// Write all distributions.
    Export(PathBuf),
    /// Ask for a picture without noise.
    ChooseReference,
    /// Measure errors against this picture.
    OpenReference(String),
    /// Measure no errors any more.
    ForgetReference,
    /// Close the window.
    Quit,
}

/// Keys, what they do, and the command.
pub(crate) const SHORTCUTS: [(KeyboardShortcut, &str, Command); 21] = [
    (plain(Key::Space), "Pause, resume", Command::TogglePause),
    (plain(Key::R), "Restart the picture", Command::Restart),
    (plain(Key::F), "Frame the whole scene", Command::FrameAll),
    (shift(Key::F), "Frame the surface clicked last", Command::FrameSelected),
    (plain(Key::B), "Keep this viewpoint", Command::Bookmark),
    (plain(Key::K), "Keep this picture for comparison", Command::KeepPicture),
    (plain(Key::X), "Render a region: drag it; again for the whole", Command::ToggleRegion),
    (plain(Key::Z), "Zoom to the pixels, or fit", Command::ToggleZoom),
    (plain(Key::V), "Split view: plain | adaptive", Command::ToggleSplit),
    (plain(Key::G), "CPU or GPU", Command::ToggleDevice),
    (plain(Key::N), "Denoise, before and after", Command::ToggleDenoise),
    (plain(Key::H), "Hide or show the panels", Command::TogglePanels),
    (plain(Key::F11), "Fill the screen, or no longer", Command::ToggleFullScreen),
    (plain(Key::F12), "Hide or show the developer's panel", Command::ToggleDeveloper),
    (control(Key::S), "Save the picture", Command::ChooseSave),
    (control(Key::O), "Open a scene", Command::ChooseScene),
    (control(Key::M), "Open a map", Command::ChooseMap),
    (plain(Key::F5), "Read scene and map again", Command::ReadAgain),
    (control(Key::Z), "Undo", Command::Undo),
    (control(Key::Y), "Redo", Command::Redo),
    (control(Key::Q), "Quit", Command::Quit),
];

/// Another key for [`Command::Redo`].
const REDO_TOO: KeyboardShortcut =
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);

/// What the mouse and held keys do in the picture.
pub(crate) const GESTURES: [(&str, &str); 9] = [
    ("Drag", "Orbit around the pivot"),
    ("Shift drag, middle drag", "Pan"),
    ("Right drag", "Look around"),
    ("Wheel", "Dolly"),
    ("W A S D, E Q", "Fly; Shift is faster"),
    ("Double click", "Orbit around this point"),
    ("Ctrl click", "Focus on this point"),
    ("Ctrl wheel, pinch", "Zoom into the picture"),
    ("Ctrl drag", "Move the zoomed picture"),
];

const fn plain(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, key)
}

const fn shift(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::SHIFT, key)
}

const fn control(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

/// Takes the shortcuts pressed in this frame; while somebody types or answers a question, it is only the
/// one that leaves.
pub(crate) fn pressed(context: &egui::Context, is_modal: bool) -> Vec<Command> {
    if is_modal || context.text_edit_focused() {
        let leaves = context.input_mut(|input| input.consume_shortcut(&control(Key::Q)));
        return if leaves { vec![Command::Quit] } else { Vec::new() };
    }
    context.input_mut(|input| {
        // A key that is held asks once; only steps back and forth are taken one after the other.
        let asks_again = |key: &Key, modifiers: &Modifiers| {
            let steps = [Command::Undo, Command::Redo];
            SHORTCUTS.iter().any(|(shortcut, _, command)| {
                shortcut.logical_key == *key
                    && modifiers.matches_logically(shortcut.modifiers)
                    && !steps.contains(command)
            })
        };
        input.events.retain(
            |event| !matches!(event, egui::Event::Key { key, repeat: true, modifiers, .. } if asks_again(key, modifiers)),
        );
        // As macOS and Blender have it; it comes before Undo, whose key lets Shift pass.
        let redoes = input.consume_shortcut(&REDO_TOO).then_some(Command::Redo);
        let pressed = SHORTCUTS
            .iter()
            .rev()
            .filter(|(shortcut, _, _)| input.consume_shortcut(shortcut))
            .map(|(_, _, command)| command.clone());
        let mut commands: Vec<Command> = redoes.into_iter().chain(pressed).collect();
        let asks = input.events.iter().any(|e| matches!(e, egui::Event::Text(t) if t == "?"));
        if asks || input.consume_key(Modifiers::NONE, Key::F1) {
            commands.push(Command::ToggleShortcuts);
        }
        // After what opens a sheet: both may come in one frame.
        if input.key_pressed(Key::Escape) {
            commands.push(Command::CloseSheets);
        }
        let copies = input.events.iter().any(|e| matches!(e, egui::Event::Copy));
        if copies {
            commands.push(Command::Copy);
        }
        commands
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_that_is_held_asks_once_but_for_steps_back() {
        let context = egui::Context::default();
        let held = |key, modifiers: Modifiers, repeat| {
            let event =
                egui::Event::Key { key, physical_key: None, pressed: true, repeat, modifiers };
            let input = egui::RawInput { events: vec![event], ..Default::default() };
            let mut commands = Vec::new();
            let _ = context.run_ui(input, |ui| commands = pressed(ui.ctx(), false));
            commands
        };
        assert_eq!(held(Key::K, Modifiers::NONE, false), [Command::KeepPicture]);
        assert_eq!(held(Key::K, Modifiers::NONE, true), []);
        assert_eq!(held(Key::Z, Modifiers::COMMAND, true), [Command::Undo]);
        assert_eq!(held(Key::Z, Modifiers::COMMAND | Modifiers::SHIFT, true), [Command::Redo]);
    }
}
