//! What a person can ask for, and the keys that ask for it.

use std::path::PathBuf;

use egui::{Event, Key, KeyboardShortcut, Modifiers};
use glam::Vec2;

use super::document::Viewpoint;
use super::interface::Purpose;
use crate::scene::Camera;

/// Something asked for by a panel, a key or a dropped file; the application carries it out.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Show another scene: a file or a built-in.
    OpenScene(String),
    /// Light with another map: a file or a built-in sky.
    OpenMap(String),
    /// Lay the look of a `.cube` file over the picture.
    OpenLook(String),
    /// Read the files of scene and map again: another program may have written them.
    ReadAgain,
    /// Give up what is being loaded.
    StopLoading,
    /// Read scene and map again when another program has written them, or no longer.
    ToggleReloads,
    /// Ask for a path.
    Ask(Purpose),
    /// Show where the method was published.
    ShowMethod,
    /// Write the picture.
    Save(PathBuf),
    /// Put the picture on the clipboard.
    Copy,
    /// Render the picture, or frames, into a file beside the window.
    Render(PathBuf),
    /// End the final render of this number in the list early, or take it from the list.
    EndRender(usize),
    /// Put the command that renders the same on the clipboard.
    CopyCommandLine,
    /// Look from here.
    LookFrom(Viewpoint),
    /// Make a small picture of what a camera sees, if there is none.
    MakeCameraPicture(Camera),
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
    /// Put the sun where is clicked next, or no longer.
    ToggleSun,
    /// Turn the map so that its sun shines on a place of the picture, both coordinates in `[0,1]`.
    PutSun {
        /// Where.
        place: Vec2,
        /// Whether the pointer was let go there.
        is_last: bool,
    },
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
    /// Show the overlay after the present one (+1) or before it (-1).
    StepOverlay(isize),
    /// Show or hide the developer's panel.
    ToggleDeveloper,
    /// Make a small picture of the next listed map that has none.
    MakeSmallMap,
    /// Show or hide the list of keys.
    ToggleShortcuts,
    /// Close what lies over the picture, and mark no region.
    CloseSheets,
    /// Keep the present picture for comparison.
    KeepPicture,
    /// Set everything as it was for a kept picture.
    SetAsKept(usize),
    /// Give a kept picture another name.
    RenameKept(usize, String),
    /// Compute the true visible energy at the inspected point.
    MeasureTruth,
    /// Learn once more, step by step, or forget the steps.
    ToggleLearningSteps,
    /// Keep the inspected cell to compare others with it, or no longer.
    ToggleKeptCell,
    /// Write all distributions.
    Export(PathBuf),
    /// Measure errors against this picture.
    OpenReference(String),
    /// Measure no errors any more.
    ForgetReference,
    /// Render a picture that errors are measured against.
    RenderReference,
    /// Close the window.
    Quit,
}

/// Keys, what they do, and the command.
pub(crate) const SHORTCUTS: [(KeyboardShortcut, &str, Command); 25] = [
    (plain(Key::Space), "Pause, resume", Command::TogglePause),
    (plain(Key::R), "Restart the picture", Command::Restart),
    (plain(Key::F), "Frame the whole scene", Command::FrameAll),
    (shift(Key::F), "Frame the surface clicked last", Command::FrameSelected),
    (plain(Key::B), "Keep this viewpoint", Command::Bookmark),
    (plain(Key::K), "Keep this picture for comparison", Command::KeepPicture),
    (plain(Key::X), "Render a region (drag it), or all again", Command::ToggleRegion),
    (plain(Key::L), "Put the sun where you click", Command::ToggleSun),
    (plain(Key::Z), "Zoom to 100 %, or fit", Command::ToggleZoom),
    (plain(Key::V), "Split view: plain | adaptive", Command::ToggleSplit),
    (plain(Key::G), "CPU or GPU", Command::ToggleDevice),
    (plain(Key::N), "Denoise on or off", Command::ToggleDenoise),
    (plain(Key::CloseBracket), "Next overlay", Command::StepOverlay(1)),
    (plain(Key::OpenBracket), "Previous overlay", Command::StepOverlay(-1)),
    (plain(Key::H), "Hide or show the panels", Command::TogglePanels),
    (plain(Key::F11), "Full screen on or off", Command::ToggleFullScreen),
    (plain(Key::F12), "Hide or show the developer's panel", Command::ToggleDeveloper),
    (control(Key::S), "Save the picture", Command::Ask(Purpose::Picture)),
    (control(Key::R), "Render into a file", Command::Ask(Purpose::Render)),
    (control(Key::O), "Open a scene", Command::Ask(Purpose::Scene)),
    (control(Key::M), "Open a map", Command::Ask(Purpose::Map)),
    (plain(Key::F5), "Reload scene and map", Command::ReadAgain),
    (control(Key::Z), "Undo", Command::Undo),
    (control(Key::Y), "Redo", Command::Redo),
    (control(Key::Q), "Quit", Command::Quit),
];

/// Another key for [`Command::Redo`], as macOS and Blender have it.
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

/// Takes the shortcuts pressed in this frame: a command for each press, in their order. While somebody types or
/// answers a question, the only one is [`Command::Quit`].
pub(crate) fn pressed(context: &egui::Context, is_modal: bool) -> Vec<Command> {
    let is_typing = is_modal || context.text_edit_focused();
    let mut commands = Vec::new();
    let mut take = |event: &Event| {
        let command = requested(event).filter(|it| !is_typing || *it == Command::Quit);
        let Some(command) = command else { return false };
        // A key that is held asks once; only steps back and forth are repeated.
        let is_repeat = matches!(event, Event::Key { repeat: true, .. });
        if !is_repeat || matches!(command, Command::Undo | Command::Redo) {
            commands.push(command);
        }
        // Escape ends drags, too, and copying is meant for selected text as well.
        matches!(event, Event::Key { key, .. } if *key != Key::Escape)
    };
    context.input_mut(|input| input.events.retain(|event| !take(event)));
    commands
}

/// The command that an event asks for.
pub(super) fn requested(event: &Event) -> Option<Command> {
    match event {
        Event::Copy => Some(Command::Copy),
        Event::Text(text) if text == "?" => Some(Command::ToggleShortcuts),
        Event::Key { key, modifiers, pressed: true, .. } => {
            let is_pressed = |shortcut: &KeyboardShortcut| {
                shortcut.logical_key == *key && modifiers.matches_logically(shortcut.modifiers)
            };
            match key {
                Key::Escape => Some(Command::CloseSheets),
                Key::F1 if modifiers.is_none() => Some(Command::ToggleShortcuts),
                _ if is_pressed(&REDO_TOO) => Some(Command::Redo),
                // A shortcut without Shift lets Shift pass: one with it follows it in the list.
                _ => {
                    let found = SHORTCUTS.iter().rfind(|(shortcut, _, _)| is_pressed(shortcut));
                    found.map(|(_, _, command)| command.clone())
                }
            }
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(key: Key, modifiers: Modifiers, pressed: bool) -> Event {
        // egui finds out itself what is a repeat.
        Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }
    }

    /// A key pressed and let go.
    fn tap(code: Key, modifiers: Modifiers) -> [Event; 2] {
        [true, false].map(|pressed| key(code, modifiers, pressed))
    }

    /// What these events of one frame ask for.
    fn commands_of(events: &[Event]) -> Vec<Command> {
        let context = egui::Context::default();
        let input = egui::RawInput { events: events.to_vec(), ..Default::default() };
        let mut commands = Vec::new();
        let _ = context.run_ui(input, |ui| commands = pressed(ui.ctx(), false));
        commands
    }

    #[test]
    fn a_key_that_is_held_asks_once_but_for_steps_back() {
        let held = |code, modifiers| commands_of(&[(); 2].map(|()| key(code, modifiers, true)));
        assert_eq!(held(Key::K, Modifiers::NONE), [Command::KeepPicture]);
        assert_eq!(held(Key::Z, Modifiers::COMMAND), [Command::Undo, Command::Undo]);
        let redone = held(Key::Z, Modifiers::COMMAND | Modifiers::SHIFT);
        assert_eq!(redone, [Command::Redo, Command::Redo]);
    }

    #[test]
    fn keys_of_one_frame_keep_their_order_and_number() {
        let plain = |code| tap(code, Modifiers::NONE);
        let undo = tap(Key::Z, Modifiers::COMMAND);
        let twice = [undo.clone(), undo.clone()].concat();
        assert_eq!(commands_of(&twice), [Command::Undo, Command::Undo]);
        let redo = tap(Key::Z, Modifiers::COMMAND | Modifiers::SHIFT);
        assert_eq!(commands_of(&[undo, redo].concat()), [Command::Undo, Command::Redo]);
        let paused = [plain(Key::Space), plain(Key::R)].concat();
        assert_eq!(commands_of(&paused), [Command::TogglePause, Command::Restart]);
        let region = [plain(Key::X), plain(Key::X)].concat();
        assert_eq!(commands_of(&region), [Command::ToggleRegion, Command::ToggleRegion]);
        let closed = [plain(Key::Escape), plain(Key::X), tap(Key::F, Modifiers::SHIFT)].concat();
        let expected = [Command::CloseSheets, Command::ToggleRegion, Command::FrameSelected];
        assert_eq!(commands_of(&closed), expected);
    }
}
