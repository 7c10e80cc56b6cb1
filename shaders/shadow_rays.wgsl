// Shadow rays, for measurements of the walk alone: the largest share of light that arrives along each.

@compute @workgroup_size(64)
fn shadow_rays(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let index = globals.work.first + id.x;
    if index >= globals.work.count {
        return;
    }
    var share = max_element(transmittance_along(cast_ray(index)));
//#if CLEAR_SOLIDS
    share = select(share, 0.0, meets_glass);
//#end
    cast_results[index] = vec2u(bitcast<u32>(share), 0u);
}
