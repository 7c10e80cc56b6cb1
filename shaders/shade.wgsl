// What becomes of paths where their rays have ended, and their rays towards lights.

@compute @workgroup_size(64)
fn shade(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let slot = slot_of(group.x, lane);
    let state = slot_state(slot);
    if state.what != GOES_ON {
        return;
    }
    var path = read_path(slot);
    let texel = slot_read(slot, HIT);
    let found = float3(texel);
    if follow(&path, Hit(found.x, texel.w, found.yz, 0u)) {
        write_path(slot, state.pixel, &path);
    } else {
        slots[slot + 64u * STATE] = vec4u(state.pixel, HAS_ENDED, 0u, 0u);
        write_radiance(slot, &path);
//#if LAYERS
        write_first_hit(slot, &path);
//#end
    }
//#if MAP_SAMPLING
    write_shadow(slot, MAP_SHADOW_TEXEL, path.map_shadow);
//#end
//#if LOCAL_LIGHTS
    write_shadow(slot, LAMP_SHADOW_TEXEL, path.lamp_shadow);
//#end
}
