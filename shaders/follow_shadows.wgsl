// Follows the paths' rays towards lights and adds what comes along them.

@compute @workgroup_size(64)
fn follow_shadows(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let slot = slot_of(group.x, lane);
    if slot_state(slot).what == IS_IDLE {
        return;
    }
    var path: Path;
    var is_lit = false;
//#if MAP_SAMPLING
    path.map_shadow = read_shadow(slot, MAP_SHADOW_TEXEL);
    is_lit = path.map_shadow.ray.t_max > 0.0;
//#end
//#if LOCAL_LIGHTS
    path.lamp_shadow = read_shadow(slot, LAMP_SHADOW_TEXEL);
    is_lit = is_lit || path.lamp_shadow.ray.t_max > 0.0;
//#end
    if !is_lit {
        return;
    }
    read_radiance(slot, &path);
    add_lights(&path);
    write_radiance(slot, &path);
}
