"""Writes a scene as binary glTF, with area lights as surfaces that emit light."""

import math

import bpy
from mathutils import Color

# Corners of a round area light.
CORNERS = 32


def write(scene, path):
    """Writes what a render of the scene would show, at its frame; the scene is left as it was."""
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        raise RuntimeError("Blender's add-on glTF 2.0 is switched off")
    undo = []
    try:
        prepare(scene, undo)
        export(path)
    finally:
        for step in reversed(undo):
            step()


def export(path):
    """Calls the exporter with the options that this Blender knows."""
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
    bpy.ops.export_scene.gltf(filepath=path, **{name: value for name, value in wanted.items() if name in known})


def prepare(scene, undo):
    """Changes the scene for the export; `undo` gets a function for each change."""
    active = bpy.context.view_layer.objects.active
    if active and active.mode != "OBJECT":
        # The export leaves edit mode, sculpting and the like.
        mode = active.mode
        undo.append(lambda: bpy.ops.object.mode_set(mode=mode))
    shown = rendered(bpy.context.view_layer.layer_collection, set())
    for thing in [thing for thing in scene.objects if not thing.hide_render]:
        if thing not in shown:
            set_for_export(thing, "hide_render", True, undo)
        elif thing.type == "CAMERA":
            prepare_camera(scene, thing, undo)
        elif thing.type == "LIGHT" and thing.data.type == "AREA":
            # Portals only guide the samples of Cycles.
            if not getattr(getattr(thing.data, "cycles", None), "is_portal", False):
                make_surface(scene, thing, undo)
        elif thing.type == "LIGHT" and getattr(thing.data, "use_temperature", False) and thing.data.is_editable:
            # Blender's exporter fails at it.
            colour = [own * warm for own, warm in zip(thing.data.color, thing.data.temperature_color)]
            set_for_export(thing.data, "color", colour, undo)
            set_for_export(thing.data, "use_temperature", False, undo)


def rendered(layer, found):
    """Objects of the collections that a render shows."""
    if not layer.collection.hide_render:
        if not layer.exclude:
            found.update(layer.collection.objects)
        for child in layer.children:
            rendered(child, found)
    return found


def set_for_export(owner, name, value, undo):
    """Gives a property another value until the export has ended."""
    before = getattr(owner, name)
    before = tuple(before) if isinstance(before, Color) else before
    undo.append(lambda: setattr(owner, name, before))
    setattr(owner, name, value)


def prepare_camera(scene, thing, undo):
    """Puts the lens of a camera into its extras, where lightgrid finds it: glTF has no lens."""
    if thing == scene.camera and thing.data.users > 1 and thing.data.is_editable:
        # Its name is to be the name of one camera.
        shared, name = thing.data, thing.data.name
        set_for_export(shared, "name", "lightgrid others", undo)
        own = shared.copy()
        undo.append(lambda: bpy.data.cameras.remove(own))
        own.name = name
        set_for_export(thing, "data", own, undo)
    camera = thing.data
    if camera.dof.use_dof and camera.is_editable and "lens" not in camera:
        camera["lens"] = lens_of(thing)
        undo.append(lambda: camera.__delitem__("lens"))


def lens_of(thing):
    """Radius of a camera's lens and distance of what is sharp, in metres."""
    focus = thing.data.dof
    distance = focus.focus_distance
    if focus.focus_object:
        place = thing.matrix_world.normalized().inverted() @ focus.focus_object.matrix_world.translation
        distance = -place.z
    # As Cycles has it: a parallel projection has no focal length.
    length = 1.0 if thing.data.type == "ORTHO" else thing.data.lens / 1000.0
    return {"radius": length / (2.0 * max(focus.aperture_fstop, 1e-5)), "focus": max(distance, 1e-3)}


def make_surface(scene, lamp, undo):
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
    undo.append(lambda: bpy.data.meshes.remove(mesh))
    # An area light shines along -Z.
    mesh.from_pydata(corners, [], [range(len(corners))[::-1]])
    material = bpy.data.materials.new(lamp.name)
    undo.append(lambda: bpy.data.materials.remove(material))
    make_emissive(material, radiance(lamp, width, height, is_round))
    mesh.materials.append(material)
    surface = bpy.data.objects.new(lamp.name, mesh)
    undo.append(lambda: bpy.data.objects.remove(surface))
    surface.matrix_world = lamp.matrix_world
    scene.collection.objects.link(surface)


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


def make_emissive(material, colour):
    """Makes a material black that emits light from its front."""
    if not material.node_tree:
        material.use_nodes = True
    material.use_backface_culling = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    strength = max(colour)
    shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    shader.inputs["Emission Color"].default_value = (*(c / strength if strength else 0.0 for c in colour), 1.0)
    shader.inputs["Emission Strength"].default_value = strength
