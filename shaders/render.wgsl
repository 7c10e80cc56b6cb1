// Adds samples to pixels: one invocation a pixel, which starts its next sample as soon as the last
// path has ended, so that no lane waits for the longest path of each sample.

struct PixelSums {
    sum: vec3f,
    luminance_squared: f32,
    rays: u32,
    invalid: u32,
    padding_0: u32,
    padding_1: u32,
}

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
    own_lane = lane;
    let tiles_across = (globals.width + 7u) / 8u;
    let tile = globals.work.first + group.x;
    let x = (tile % tiles_across) * 8u + (lane & 7u);
    let y = (tile / tiles_across) * 8u + (lane >> 3u);
    if x >= globals.width || y >= globals.height {
        return;
    }
    let pixel = y * globals.width + x;
    var sums: PixelSums;
//#if layers
    var surface = FirstHit(vec3f(0.0), 0.0, vec3f(0.0), 0.0);
//#end
    if globals.work.resumes != 0u {
        sums = film[pixel];
//#if layers
        surface = surfaces[pixel];
//#end
    }
    var index = globals.work.first_sample;
    let end = globals.work.first_sample + globals.work.samples;
    var path: Path;
    var is_over = true;
    loop {
        // At one place: what a second one has in common with the first would stay in registers.
        if is_over {
            path = start_sample(x, y, index);
        }
        is_over = !path_step(&path);
        if !is_over {
            continue;
        }
        if is_finite3(path.radiance) {
            sums.sum += path.radiance;
            let light = luminance(path.radiance);
            sums.luminance_squared = min(sums.luminance_squared + light * light, F32_MAX);
        } else {
            sums.invalid += 1u;
        }
        sums.rays += path.rays;
//#if layers
        surface.albedo += path.first_hit.albedo;
        surface.depth += path.first_hit.depth;
        surface.normal += path.first_hit.normal;
        surface.hits += path.first_hit.hits;
//#end
        index += 1u;
        if index == end {
            break;
        }
    }
    film[pixel] = sums;
//#if layers
    surfaces[pixel] = surface;
//#end
}
