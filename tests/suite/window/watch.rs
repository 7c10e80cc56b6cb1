//! What is on the screen from second to second: it only gets better, and does not stand still while work goes on.

use std::time::Duration;

use super::Desk;

/// Share of the work that may pass without another picture.
const MAX_SHARE_OF_WORK: f64 = 0.4;
/// Share of the work that showing may take where others want the cores, too: it goes by the clock.
const MAX_SHARE_FOR_SHOWING: f64 = 0.3;
/// The same on a quiet machine of two cores, in the first minute, when one picture follows another within seconds.
const MAX_SHARE_OF_A_MINUTE: f64 = 0.15;

#[test]
fn the_picture_on_the_screen_never_gets_worse() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start(
        "view office --env sky:day@256x128 --size 240x160 --samples 32 --device cpu --settings window.json",
    );
    let shown = until_it_is_done(&desk);
    check_all("at the start", &shown).unwrap_or_else(|why| panic!("{why}"));
    // Where frames take a second it may have seemed to end under way; not twice.
    let moved = |way| {
        desk.drag((560, 400), way, Duration::from_millis(50));
        check_all("after a move", &until_it_is_done(&desk))
    };
    if let Err(why) = moved((60, 10)) {
        println!("once more: {why}");
        moved((-60, 10)).unwrap_or_else(|why| panic!("{why}"));
    }
    check_showing(&desk, None, MAX_SHARE_FOR_SHOWING);
}

/// As a person meets it: the default scene in a window of usual size, on two cores with software Vulkan.
#[test]
#[ignore = "six minutes of a quiet machine; run it in release"]
fn the_first_minute_and_a_move_lead_to_the_converged_picture() {
    let Some(mut desk) = Desk::of_size(1440, 900) else { return };
    desk.start("view --samples 32 --device cpu --settings window.json");
    let watch = |when: &str| {
        let before = Effort::of(&desk);
        let shown: Vec<Moment> = (0..120).map(|at| Moment::next(&desk, at)).collect();
        println!("{when}:");
        check_showing(&desk, before, MAX_SHARE_OF_A_MINUTE);
        while !is_idle(&desk) {}
        let errors = errors_beside(&shown, &desk.picture());
        let longest = stands(&shown).map(<[_]>::len).max().unwrap_or_default();
        println!("{errors:.2?}; longest without a change: {} s", longest as f64 / 2.0);
        never_worse(&errors).unwrap_or_else(|why| panic!("{when}: {why}"));
    };
    watch("at the start");
    desk.drag((700, 400), (60, 10), Duration::from_millis(50));
    watch("after a move");
}

/// Seconds of all cores.
struct Effort {
    work: f64,
    showing: f64,
}

impl Effort {
    /// `None` where the system does not tell.
    fn of(desk: &Desk) -> Option<Self> {
        Some(Self { work: desk.work()?, showing: desk.work_for_showing()? })
    }
}

/// Asserts that showing takes less than so much of the work since then, or of all.
fn check_showing(desk: &Desk, since: Option<Effort>, most: f64) {
    let Some(now) = Effort::of(desk) else { return };
    let since = since.unwrap_or(Effort { work: 0.0, showing: 0.0 });
    let share = (now.showing - since.showing) / (now.work - since.work);
    println!("showing takes {share:.3} of the work");
    assert!(share < most, "showing takes {share:.3} of the work");
}

/// What is shown, and the seconds of all cores by then.
struct Moment {
    picture: Vec<u8>,
    work: f64,
}

impl Moment {
    /// In half a second, after so many others. Without a clock of work, that of moments will do.
    fn next(desk: &Desk, before: usize) -> Self {
        std::thread::sleep(Duration::from_millis(500));
        Self { picture: desk.picture(), work: desk.work().unwrap_or(before as f64) }
    }
}

/// What is shown until nothing has changed for a while: it is done then.
fn until_it_is_done(desk: &Desk) -> Vec<Moment> {
    let mut shown: Vec<Moment> = Vec::new();
    let mut unchanged = 0;
    while unchanged < 20 || shown.len() < 30 {
        let now = Moment::next(desk, shown.len());
        let is_same = shown.last().is_some_and(|last| last.picture == now.picture);
        unchanged = if is_same { unchanged + 1 } else { 0 };
        shown.push(now);
        assert!(shown.len() < 1200, "it never ends");
    }
    shown.truncate(shown.len() - unchanged);
    shown
}

/// Whether next to no work is done for five seconds. Where the system does not tell, it is idle after a while.
fn is_idle(desk: &Desk) -> bool {
    let before = desk.work();
    std::thread::sleep(Duration::from_secs(if before.is_some() { 5 } else { 1200 }));
    desk.work().zip(before).is_none_or(|(now, before)| now - before < 0.5)
}

/// Root mean square of levels.
fn errors_beside(shown: &[Moment], converged: &[u8]) -> Vec<f64> {
    let error = |moment: &Moment| {
        let pairs = moment.picture.iter().zip(converged);
        let sum: f64 = pairs.map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
        (sum / converged.len() as f64).sqrt()
    };
    shown.iter().map(error).collect()
}

fn never_worse(errors: &[f64]) -> Result<(), String> {
    for (at, pair) in errors.windows(2).enumerate() {
        // Two per cent, and a fifth of a level for rounding.
        if pair[1] > 1.02 * pair[0] + 0.2 {
            return Err(format!("worse at {at}: {errors:.2?}"));
        }
    }
    Ok(())
}

/// Moments at which the same is shown.
fn stands(shown: &[Moment]) -> impl Iterator<Item = &[Moment]> {
    shown.chunk_by(|a, b| a.picture == b.picture)
}

/// Seconds of work from the first to the last.
fn work_in(moments: &[Moment]) -> f64 {
    moments[moments.len() - 1].work - moments[0].work
}

/// Whether what is shown until the picture is done only gets better and never stands still.
fn check_all(when: &str, shown: &[Moment]) -> Result<(), String> {
    let last = shown.last().expect("something is shown");
    let errors = errors_beside(shown, &last.picture);
    println!("{when}: {errors:.2?}");
    let first = errors[0];
    if !errors.iter().any(|error| *error < 0.5 * first) {
        return Err(format!("{when}: it got no better: {errors:.2?}"));
    }
    never_worse(&errors).map_err(|why| format!("{when}: {why}"))?;
    // How long a picture is shown depends on how long it took: what counts is its share of the work, for at
    // least three seconds of clock.
    let all = work_in(shown);
    if all <= 0.0 {
        return Err(format!("{when}: nothing is done"));
    }
    // At the start there is nothing to be seen at first.
    for stand in stands(shown).skip(usize::from(when == "at the start")) {
        let share = work_in(stand) / all;
        if stand.len() > 6 && share > MAX_SHARE_OF_WORK {
            return Err(format!("{when}: the picture stands still, {share:.2}: {errors:.2?}"));
        }
    }
    Ok(())
}
