// Nearest hits of rays, for measurements of the walk alone: distance and triangle of each.

@compute @workgroup_size(64)
fn closest_hits(@builtin(global_invocation_id) id: vec3u) {
    let index = globals.work.first + id.x;
    if index >= globals.work.count {
        return;
    }
    let hit = closest_hit(cast_ray(index), false);
    cast_results[index] = vec2u(bitcast<u32>(hit.t), hit.triangle);
}
