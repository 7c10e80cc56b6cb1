"""Writes a scene as binary glTF, with area lights as surfaces that shine."""

import math

import bpy

# Corners of a round area light.
CORNERS = 32


def write(scene, path):
    """Writes what a render of the scene would show, at its frame."""
    # The export leaves edit mode, sculpting and the like.
    active = bpy.context.view_layer.objects.active
    mode = active.mode if active else "OBJECT"
    lamps = [make_surface(scene, lamp) for lamp in area_lights(scene)]
    cameras = [thing for thing in scene.objects if thing.type == "CAMERA" and thing.data.dof.use_dof]
    # What another file owns cannot be changed, and what has a lens already keeps it.
    lenses = {thing.data: lens_of(thing) for thing in cameras if not thing.data.library and "lens" not in thing.data}
    for camera, lens in lenses.items():
        camera["lens"] = lens
    wanted = dict(
        export_format="GLB",
        use_active_scene=True,
        use_renderable=True,
        export_cameras=True,
        export_lights=True,
        export_import_convert_lighting_mode="SPEC",
        export_apply=True,
        export_animations=False,
        export_current_frame=True,
        export_skins=False,
        export_morph=False,
        export_gn_mesh=True,
        export_tangents=False,
        export_extras=True,
    )
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    try:
        bpy.ops.export_scene.gltf(filepath=path, **{name: value for name, value in wanted.items() if name in known})
    finally:
        for surface in lamps:
            mesh = surface.data
            material = mesh.materials[0]
            bpy.data.objects.remove(surface)
            bpy.data.meshes.remove(mesh)
            bpy.data.materials.remove(material)
        for camera in lenses:
            del camera["lens"]
        if active and active.mode != mode:
            bpy.ops.object.mode_set(mode=mode)


def lens_of(camera):
    """Radius of the lens and distance of what is sharp, in metres: glTF has no lens, lightgrid finds it in extras."""
    focus = camera.data.dof
    distance = focus.focus_distance
    if focus.focus_object:
        place = camera.matrix_world.normalized().inverted() @ focus.focus_object.matrix_world.translation
        distance = -place.z
    return {"radius": camera.data.lens / 1000.0 / (2.0 * focus.aperture_fstop), "focus": max(distance, 1e-3)}


def area_lights(scene):
    """Area lights that shine in a render; portals only guide the samples of Cycles."""
    return [
        thing
        for thing in scene.objects
        if thing.type == "LIGHT"
        and thing.data.type == "AREA"
        and not thing.hide_render
        and not getattr(getattr(thing.data, "cycles", None), "is_portal", False)
    ]


def make_surface(scene, lamp):
    """A mesh in the place of an area light, of the same radiance. glTF has no area lights."""
    light = lamp.data
    is_round = light.shape in {"DISK", "ELLIPSE"}
    width = light.size
    height = light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else width
    if is_round:
        turns = [math.tau * i / CORNERS for i in range(CORNERS)]
        corners = [(width / 2 * math.cos(t), height / 2 * math.sin(t), 0.0) for t in turns]
    else:
        corners = [(x * width / 2, y * height / 2, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    mesh = bpy.data.meshes.new(lamp.name)
    # An area light shines along -Z.
    mesh.from_pydata(corners, [], [range(len(corners))[::-1]])
    mesh.materials.append(emission(lamp.name, radiance(lamp, width, height, is_round)))
    surface = bpy.data.objects.new(lamp.name, mesh)
    surface.matrix_world = lamp.matrix_world
    scene.collection.objects.link(surface)
    return surface


def radiance(lamp, width, height, is_round):
    """Radiance of an area light in W/sr/m2, RGB."""
    light = lamp.data
    watts = light.energy * 2.0 ** getattr(light, "exposure", 0.0)
    if getattr(light, "normalize", True):
        size = lamp.matrix_world.to_scale()
        area = width * size.x * height * size.y * (math.pi / 4 if is_round else 1.0)
        watts /= max(area, 1e-12)
    colour = list(light.color)
    if getattr(light, "use_temperature", False):
        colour = [own * warm for own, warm in zip(colour, light.temperature_color)]
    return [watts * channel / math.pi for channel in colour]


def emission(name, colour):
    """A black material that shines from its front."""
    material = bpy.data.materials.new(name)
    if not material.node_tree:
        material.use_nodes = True
    material.use_backface_culling = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    strength = max(colour)
    shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    shader.inputs["Emission Color"].default_value = (*(c / strength if strength else 0.0 for c in colour), 1.0)
    shader.inputs["Emission Strength"].default_value = strength
    return material
