// What all shaders read. The host writes both structs; see src/render/gpu/layout.rs.

// An array that the scene does not have.
const NO_ARRAY = 0xffffffffu;

// What one dispatch does; the host writes it alone.
struct Work {
    // First 8x8 tile of pixels, or first learning path (low and high word).
    first: u32,
    first_high: u32,
    // Tiles or paths.
    count: u32,
    // Each pixel is brought so many samples further, but not beyond `end_sample` of them.
    samples: u32,
    end_sample: u32,
    // Of so many samples one is counted; 0 if none is.
    stride: u32,
    // The sample that pixels which share take; then `first` and `count` are workgroups.
    sample: u32,
    // Groups whose paths one workgroup of `find_seconds` and of `light_seconds` follows.
    rounds: u32,
}

struct Globals {
    work: Work,
    camera_position: vec3f,
    lens_radius: f32,
    camera_right: vec3f,
    focus_distance: f32,
    camera_up: vec3f,
    half_width: f32,
    camera_forward: vec3f,
    half_height: f32,
    grid_center: vec3f,
    grid_columns: u32,
    // Words of `distributions` at which each array begins.
    distribution_starts_at: u32,
    distribution_masks_at: u32,
    distribution_ranks_at: u32,
    distribution_tiles_at: u32,
    distribution_last_at: u32,
    distribution_of_cell_at: u32,
    words_per_distribution: u32,
    grid_rows: u32,
    map_width: u32,
    map_height: u32,
    tile_columns: u32,
    tile_rows: u32,
    rotation_turns: f32,
    intensity: f32,
    // Word of `sums` at which the rows' sums begin.
    tile_sums_at: u32,
    distant_light_count: u32,
    light_triangle_count: u32,
    width: u32,
    height: u32,
    seed: u32,
    bounces: u32,
    russian_roulette: u32,
    orthographic: u32,
    scene_extent: f32,
    // What a learned contribution is divided by.
    mean_contribution: f32,
    // What no compiler can know; see `rounded`.
    zero: u32,
    // Whether points in a medium have a face of their own.
    grid_medium: u32,
    // Of 256 samples of the map so many follow the whole map's distribution.
    whole_map_share: u32,
    // Corners and coefficients of the fog; without fog the lower corner is above the upper one.
    fog_low: vec3f,
    fog_mean_cosine: f32,
    fog_high: vec3f,
    // Samples of the map that each vertex of a learning path tries.
    tries_per_vertex: u32,
    fog_scattering: vec3f,
    // Factor on the map's importance that brings its brightest pixel near 1.
    importance_scale: f32,
    fog_extinction: vec3f,
    // First sample of a pixel that is a point of the sequence `seed` scrambles.
    first_of_sequence: u32,
    // What the camera sees in place of the map: a colour, or how little the map is blurred.
    background: vec3f,
    background_concentration: f32,
    // Factor on what is added to the film, a power of two: squares of the brightest do not overflow.
    film_scale: f32,
    // Triangles in the driver's tree that end every ray; those after them are asked.
    opaque_triangles: u32,
    // Of the radiance cache: whether there is one yet, units a radiance of 1 counts, where its cells lie,
    // mean radiance over albedo.
    cache_is_known: u32,
    cache_scale: f32,
    cache_center: vec3f,
    cache_edge: f32,
    cache_mean: vec3f,
    cache_least_distance: f32,
    // Number of the first triangle of instances, and of how many numbers a slot has the logarithm.
    first_of_instances: u32,
    slot_log2: u32,
    // What paths aim at: word of `lights` at which its triangles begin, their number, their tree's root in
    // `light_nodes`, and the probability of aiming at them.
    targets_at: u32,
    target_count: u32,
    targets_root: u32,
    aim_probability: f32,
    padding_0: u32,
    padding_1: u32,
}
