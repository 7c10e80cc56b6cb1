// Adds samples to pixels: one invocation a pixel, which starts its next sample as soon as the last
// path has ended, so that no lane waits for the longest path of each sample.

fn start_sample(x: u32, y: u32, index: u32) -> Path {
    var sampler =
        sampler_new(globals.seed, y * globals.width + x, index - globals.first_of_sequence);
    let offset = filter_sample(next_pair(&sampler));
    let lens = lens_point(&sampler);
    let centre = vec2f(f32(x) + 0.5, f32(y) + 0.5);
    var path = path_new(camera_ray(centre + offset, lens), sampler);
//#if counting
    let stride = globals.work.stride;
    path.is_counted = stride != 0u && (y * globals.width + x + index) % max(stride, 1u) == 0u;
//#end
    return path;
}

@compute @workgroup_size(64)
fn render(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let tiles_across = (globals.width + 7u) / 8u;
    let tile = globals.work.first + group.x;
    let x = (tile % tiles_across) * 8u + (lane & 7u);
    let y = (tile / tiles_across) * 8u + (lane >> 3u);
    if x >= globals.width || y >= globals.height {
        return;
    }
    let pixel = y * globals.width + x;
    var index = film_counts[pixel].x;
    let end = min(index + globals.work.samples, globals.work.end_sample);
    if index >= end {
        return;
    }
    var path = start_sample(x, y, index);
    loop {
        if path_step(&path) {
            continue;
        }
        add_to_film(pixel, &path);
        index += 1u;
        if index == end {
            break;
        }
        path = start_sample(x, y, index);
    }
}
