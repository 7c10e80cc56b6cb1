//! Keys and buttons take turns: a key may change what the next press of a button means, and where
//! software draws both can come in one frame, of which egui does not keep the order. A button that is pressed
//! and let go in one frame, as a touchpad's tap is, would move no slider.

use std::mem::discriminant;

use egui::{Event, Key};

use super::commands::{Command, requested};

/// Leaves in `events` what may be taken in one frame: presses of keys or of buttons, not both, no button let go
/// that was pressed in it, and nothing typed after Enter, which ends what is typed, or after a shortcut that asks for a
/// path, which begins it. The rest is returned; it is meant for the next frame.
pub(super) fn first_turn(events: &mut Vec<Event>) -> Vec<Event> {
    let is_key = |event: &Event| matches!(event, Event::Key { pressed: true, .. });
    let is_button = |event: &Event, is_down: bool| match event {
        Event::PointerButton { pressed, .. } => *pressed == is_down,
        _ => false,
    };
    let is_press = |event: &&Event| is_key(event) || is_button(event, true);
    let first = events.iter().find(is_press).map(discriminant);
    let is_other = |event: &Event| is_press(&event) && first != Some(discriminant(event));
    let (mut is_down, mut is_over) = (false, false);
    let ends = |event: &Event| {
        is_down |= is_button(event, true);
        let is_text = matches!(event, Event::Text(_) | Event::Paste(_) | Event::Ime(_));
        let is_of_another = is_over && (is_text || is_key(event));
        let is_enter = matches!(event, Event::Key { key: Key::Enter, pressed: true, .. });
        is_over |= is_enter || matches!(requested(event), Some(Command::Ask(_)));
        is_other(event) || (is_down && is_button(event, false)) || is_of_another
    };
    events.split_off(events.iter().position(ends).unwrap_or(events.len()))
}

#[cfg(test)]
mod tests {
    use egui::{Modifiers, PointerButton, Pos2};

    use super::*;

    fn key_event(key: Key, pressed: bool) -> Event {
        let modifiers = Modifiers::NONE;
        Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }
    }

    /// Asserts that all of them together are taken in these turns.
    fn check(turns: &[Vec<Event>]) {
        let mut events = turns.concat();
        for turn in turns {
            let rest = first_turn(&mut events);
            assert_eq!(events, *turn);
            events = rest;
        }
        assert!(events.is_empty() && first_turn(&mut events).is_empty());
    }

    #[test]
    fn enter_ends_what_is_typed() {
        let key = |key| key_event(key, true);
        let text = |letter: &str| Event::Text(letter.to_owned());
        let turns = [
            vec![key(Key::C), text("c"), key(Key::Enter)],
            vec![key(Key::D), text("d"), key(Key::Enter)],
        ];
        check(&turns);
    }

    #[test]
    fn what_is_typed_after_a_question_is_no_shortcut() {
        let modifiers = Modifiers::COMMAND;
        let asks =
            |key| Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers };
        let typed = vec![key_event(Key::N, true), Event::Text("n".to_owned())];
        for key in [Key::O, Key::M, Key::S] {
            check(&[vec![key_event(Key::Space, true), asks(key)], typed.clone()]);
        }
        check(&[[vec![asks(Key::Z)], typed].concat()]);
    }

    #[test]
    fn what_a_key_means_for_a_drag_is_known_before_it_begins_and_a_tap_lasts_a_frame() {
        let (pos, modifiers) = (Pos2::ZERO, Modifiers::NONE);
        let key = |pressed| key_event(Key::X, pressed);
        let button = |pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers,
        };
        let moves = Event::PointerMoved(pos);
        let drag = [button(true), moves.clone()];
        let turns = [
            vec![moves.clone(), key(true), key(false), key(true), moves.clone()],
            drag.to_vec(),
            [&[button(false)], &drag[..]].concat(),
            vec![button(false), moves, key(true), key(false)],
        ];
        check(&turns);
    }
}
