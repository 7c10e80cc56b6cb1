//! How long the presenter rests after a picture.

use std::time::Duration;

use crate::system::thread_cpu_time;

/// Rest after a picture of unfinished work, over the time that the picture took: the first until [`SLOWING`] begins, the
/// second from its end on. Of the machine half of whose cores it has, it takes 9 and 3 %.
const REST: [f64; 2] = [4.5, 16.0];
/// Rest after a moving camera's picture, over the time that picture took: short, since eyes follow it.
pub(super) const MOVING_REST: f64 = 0.5;
/// Seconds of work on a view while pictures change less and less.
const SLOWING: [f64; 2] = [60.0, 240.0];

/// For how long it rests after a picture that took so long, of so many seconds of work.
pub(super) fn rest_after(took: Duration, seconds: f64) -> Duration {
    let ([least, most], [start, end]) = (REST, SLOWING);
    let slowed = ((seconds - start) / (end - start)).clamp(0.0, 1.0);
    took.mul_f64(least + (most - least) * slowed)
}

/// What a picture took, for its rest, of so much by the clock; `start` is this thread's time at work when it was begun.
/// By the clock that would be far too long where other programs take the
/// cores (a picture stood still for half a minute), by this thread's time at work far too short for the
/// renderer, which gets as little: it is the geometric mean of both.
pub(super) fn took(start: Option<Duration>, elapsed: Duration) -> Duration {
    let worked = thread_cpu_time().zip(start).map(|(now, start)| now.saturating_sub(start));
    worked.map_or(elapsed, |worked| between(worked.min(elapsed), elapsed))
}

fn between(worked: Duration, elapsed: Duration) -> Duration {
    Duration::from_secs_f64((worked.as_secs_f64() * elapsed.as_secs_f64()).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rest_is_shorter_at_first_and_where_others_take_the_cores() {
        let seconds = Duration::from_secs_f64;
        assert_eq!(between(seconds(0.5), seconds(0.5)), seconds(0.5));
        assert_eq!(between(seconds(0.25), seconds(4.0)), seconds(1.0));
        assert_eq!(rest_after(seconds(0.5), 60.0), seconds(2.25));
        assert_eq!(rest_after(seconds(0.5), 1e9), seconds(8.0));
    }
}
