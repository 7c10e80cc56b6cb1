// Adds samples to pixels: one invocation a pixel, which starts its next sample as soon as the last
// path has ended, so that no lane waits for the longest path of each sample.

@compute @workgroup_size(64)
fn render(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let place = pixel_in_tile(globals.work.first + group.x, lane);
    if place.x >= globals.width || place.y >= globals.height {
        return;
    }
    let pixel = place.y * globals.width + place.x;
    var index = film_counts[pixel].x;
    let end = min(index + globals.work.samples, globals.work.end_sample);
    if index >= end {
        return;
    }
    var path: Path;
    var is_over = true;
    loop {
        // At one place: what a second one has in common with the first would stay in registers.
        if is_over {
            path = start_sample(place.x, place.y, index);
        }
        is_over = !path_step(&path);
        if !is_over {
            continue;
        }
        add_to_film(pixel, &path);
        index += 1u;
        if index == end {
            break;
        }
    }
}
