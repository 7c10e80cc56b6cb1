//! Drags of the picture, the wipe over it and the map, followed event by event: what a drag does depends
//! on where the pointer went, not on how many frames were drawn meanwhile. egui's own drags begin in the
//! frame after the press and lose what came before; where software draws, that can be all of it.

use egui::{Event, Modifiers, PointerButton, Pos2, Ui, Vec2};

/// A press over the picture that went no further than this is a click, in points; as egui has it.
pub(super) const CLICK_DISTANCE: f32 = 6.0;
/// Longest step that is told, in points: long ones are cut, so that a fast pointer does the same.
const MAX_STEP: f32 = 4.0;

/// A button held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drag {
    button: PointerButton,
    /// Where it was pressed.
    from: Pos2,
    /// Where the last step ended.
    at: Pos2,
    is_click: bool,
    /// As long as it went no further than this, in points, it is a click.
    slack: f32,
    /// Whether Ctrl was held at the press: that decides what it does to its end.
    pub(super) has_command: bool,
}

/// What happened to a drag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Step {
    /// The pointer moved by so much.
    Move {
        /// With this button held.
        button: PointerButton,
        /// Points, right and down.
        by: Vec2,
        /// With these keys held.
        modifiers: Modifiers,
    },
    /// The button was let go.
    End {
        /// Where it was pressed.
        from: Pos2,
        /// Where it was let go.
        to: Pos2,
    },
}

impl Step {
    /// Points it went to the right.
    pub(super) fn right(&self) -> f32 {
        if let Self::Move { by, .. } = self { by.x } else { 0.0 }
    }

    /// Where the button was let go, if it was.
    pub(super) fn end(&self) -> Option<Pos2> {
        if let Self::End { to, .. } = self { Some(*to) } else { None }
    }
}

impl Drag {
    /// From where to where it went so far; `None` while it may be a click.
    pub(super) fn span(&self) -> Option<[Pos2; 2]> {
        (!self.is_click).then_some([self.from, self.at])
    }

    /// Follows what happens to a part of what is drawn in `ui`: a drag begins where `accepts` says so, unless something
    /// else lies over it there, and once it went further than `slack` points.
    pub(super) fn follow_in(
        drag: &mut Option<Self>,
        ui: &Ui,
        slack: f32,
        accepts: impl Fn(Pos2) -> bool,
    ) -> Vec<Step> {
        let (layer, context) = (ui.layer_id(), ui.ctx());
        let (events, modifiers, is_held) =
            ui.input(|input| (input.events.clone(), input.modifiers, input.pointer.any_down()));
        let is_free = |at| context.layer_id_at(at).is_none_or(|there| there == layer);
        let steps =
            Self::follow(drag, &events, (modifiers, slack), |at| accepts(at) && is_free(at));
        // It may have been let go while nobody followed.
        drag.take_if(|_| !is_held);
        steps
    }

    /// Follows a frame's events; a drag begins where `accepts` says so.
    fn follow(
        drag: &mut Option<Self>,
        events: &[Event],
        (mut modifiers, slack): (Modifiers, f32),
        accepts: impl Fn(Pos2) -> bool,
    ) -> Vec<Step> {
        let mut steps = Vec::new();
        for event in events {
            match *event {
                Event::PointerButton { pos, button, pressed: true, modifiers: held }
                    if drag.is_none() && accepts(pos) =>
                {
                    modifiers = held;
                    let has_command = held.command;
                    let (from, at, is_click) = (pos, pos, true);
                    *drag = Some(Self { button, from, at, is_click, slack, has_command });
                }
                Event::PointerMoved(to) => {
                    drag.iter_mut().for_each(|drag| drag.move_to(to, modifiers, &mut steps));
                }
                Event::PointerButton { pos, button, pressed: false, modifiers: held } => {
                    modifiers = held;
                    if let Some(mut ended) = drag.take_if(|drag| drag.button == button) {
                        ended.move_to(pos, modifiers, &mut steps);
                        if !ended.is_click {
                            steps.push(Step::End { from: ended.from, to: pos });
                        }
                    }
                }
                Event::WindowFocused(false) => *drag = None,
                _ => {}
            }
        }
        steps
    }

    fn move_to(&mut self, to: Pos2, modifiers: Modifiers, steps: &mut Vec<Step>) {
        self.is_click &= self.from.distance(to) < self.slack;
        if self.is_click {
            return;
        }
        // What was held back while it might have been a click comes with the first step.
        let way = to - self.at;
        let count = (way.length() / MAX_STEP).ceil();
        let modifiers = Modifiers { command: self.has_command, ..modifiers };
        let step = Step::Move { button: self.button, by: way / count.max(1.0), modifiers };
        steps.extend(std::iter::repeat_n(step, count as usize));
        self.at = to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn press(pos: Pos2, pressed: bool) -> Event {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        Event::PointerButton { pos, button, pressed, modifiers }
    }

    fn way() -> Vec<Event> {
        let moves = (0..40).map(|i| Event::PointerMoved(Pos2::new(10.0 + i as f32, 20.0)));
        let ends = [press(Pos2::new(10.0, 20.0), true), press(Pos2::new(60.0, 31.0), false)];
        [vec![ends[0].clone()], moves.collect(), vec![ends[1].clone()]].concat()
    }

    /// The steps of a drag whose events come in frames of so many.
    fn steps(events_per_frame: usize) -> Vec<Step> {
        let mut drag = None;
        let follow = |events: &[Event]| {
            Drag::follow(&mut drag, events, (Modifiers::NONE, CLICK_DISTANCE), |at| at.x < 11.0)
        };
        way().chunks(events_per_frame).flat_map(follow).collect()
    }

    #[test]
    fn frames_make_no_difference() {
        let at_once = steps(1000);
        for count in [1, 2, 7, 41] {
            assert_eq!(steps(count), at_once, "{count} events a frame");
        }
        let whole: Vec2 = at_once
            .iter()
            .map(|step| match step {
                Step::Move { by, .. } => *by,
                Step::End { .. } => Vec2::ZERO,
            })
            .fold(Vec2::ZERO, |a, b| a + b);
        assert!((whole - Vec2::new(50.0, 11.0)).length() < 1e-3, "{whole}");
        let end = Step::End { from: Pos2::new(10.0, 20.0), to: Pos2::new(60.0, 31.0) };
        assert_eq!(at_once.last(), Some(&end));
    }

    #[test]
    fn a_click_and_a_press_elsewhere_move_nothing() {
        let (near, far) = (Pos2::new(10.0, 20.0), Pos2::new(100.0, 20.0));
        let click = [press(near, true), press(Pos2::new(13.0, 20.0), false)];
        let elsewhere = [press(far, true), Event::PointerMoved(near), press(near, false)];
        for events in [&click[..], &elsewhere[..]] {
            let mut drag = None;
            let steps = Drag::follow(&mut drag, events, (Modifiers::NONE, CLICK_DISTANCE), |at| {
                at.x < 50.0
            });
            assert_eq!((steps, drag), (Vec::new(), None));
        }
    }
}
