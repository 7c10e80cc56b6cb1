// Finds what the rays of paths hit, after those that have ended are added to the film and others begun.

// Begins the next sample of a slot's pixel or of another one; `false` if there are none left.
fn begin_next(slot: u32, path: ptr<function, Path>) -> bool {
    let before = slot_state(slot);
    var item = before.pixel;
    var place = pixel_in_tile(item >> 6u, item & 63u);
    var pixel = place.y * globals.width + place.x;
    var is_wanted = false;
    if before.what == HAS_ENDED {
        var ended: Path;
        read_radiance(slot, &ended);
//#if LAYERS
        read_first_hit(slot, &ended);
//#end
        add_to_film(pixel, &ended);
        atomicAdd(&queue.samples, 1u);
        is_wanted = film_counts[pixel].x < globals.work.end_sample;
    }
    while !is_wanted {
        item = atomicAdd(&queue.next, 1u);
        if item >= globals.work.count * 64u {
            atomicSub(&queue.left, 1u);
            slots[slot + 64u * STATE] = vec4u(0u, IS_IDLE, 0u, 0u);
            return false;
        }
        place = pixel_in_tile(item >> 6u, item & 63u);
        pixel = place.y * globals.width + place.x;
        if place.x < globals.width && place.y < globals.height {
            is_wanted = film_counts[pixel].x < globals.work.end_sample;
        }
    }
    *path = start_sample(place.x, place.y, film_counts[pixel].x);
    write_path(slot, item, path);
    return true;
}

@compute @workgroup_size(64)
fn trace(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let slot = slot_of(group.x, lane);
    let state = slot_state(slot);
    if state.what == IS_IDLE {
        return;
    }
    var path: Path;
    if state.what != GOES_ON {
        if !begin_next(slot, &path) {
            return;
        }
    } else {
        path.ray = Ray(
            float3(slot_read(slot, ORIGIN)), float3(slot_read(slot, DIRECTION)), F32_MAX);
        read_vertices(slot_read(slot, SAMPLER).w, &path);
    }
    let hit = closest_hit(path.ray, is_of_camera(&path));
    slot_write(slot, HIT, vec3f(hit.t, hit.barycentric), hit.triangle);
}
