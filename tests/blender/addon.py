"""Installs the add-on, makes a room in Blender, sends it to lightgrid and renders it by Cycles, too:

    python addon.py ADDON.zip LIGHTGRID FOLDER

Leaves in FOLDER cycles.exr of each room, and sent.json: how lightgrid is called for each, and what was found.
"""

import json
import math
import os
import sys
import tempfile
import time

import bpy
import numpy

MODULE = "bl_ext.user_default.lightgrid"
SIZE = (64, 36)
FOLDER = ""


def mesh(name, corners, faces, colour):
    data = bpy.data.meshes.new(name)
    data.from_pydata(corners, [], faces)
    material = bpy.data.materials.new(name)
    if not material.node_tree:
        material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 1.0
    shader.inputs["Specular IOR Level"].default_value = 0.0
    data.materials.append(material)
    return add(name, data)


def box(name, low, high, colour, faces=range(6), inward=False):
    corners = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return mesh(name, corners, [sides[face][:: -1 if inward else 1] for face in faces], colour)


def add(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def light(kind, watts, place, turn=(0.0, 0.0, 0.0), **more):
    data = bpy.data.lights.new(kind, kind)
    data.energy = watts
    for name, value in more.items():
        setattr(data, name, value)
    thing = add(kind, data)
    thing.location, thing.rotation_euler = place, turn


def room(has_window):
    """A room with a box in it, and a camera that is not the file's first."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    scene = bpy.context.scene
    sides = range(5) if has_window else range(6)
    box("walls", (-2, -2, 0), (2, 2, 2.5), (0.7, 0.7, 0.7), sides, inward=True)
    box("box", (-0.5, 0.3, 0), (0.2, 1, 0.8), (0.7, 0.2, 0.1))
    hidden = box("hidden", (-1.5, -1.5, 1), (1, 1, 2), (0, 0, 0))
    hidden.hide_render = True
    add("another", bpy.data.cameras.new("a camera")).location = (0, 0, 1)
    eye = add("eye", bpy.data.cameras.new("the camera"))
    eye.data.angle = math.radians(75)
    # Another object with the same camera.
    add("third", eye.data)
    eye.location, eye.rotation_euler = (-1.6, -1.6, 1.4), (math.radians(80), 0, math.radians(-40))
    scene.camera = eye
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    world = bpy.data.worlds.new("world")
    scene.world = world
    if not world.node_tree:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    return world.node_tree, background


def lamps():
    room(has_window=False)
    light("AREA", 60, (0.3, 0, 2.3), (0.3, 0.2, 0), shape="ELLIPSE", size=0.3, size_y=0.2, color=(1.0, 0.8, 0.5))
    warm = {"use_temperature": True, "temperature": 3000.0} if bpy.app.version >= (5, 0, 0) else {}
    light("POINT", 20, (-1, 1, 2), shadow_soft_size=0.0, **warm)
    hidden = bpy.data.collections.new("hidden")
    bpy.context.scene.collection.children.link(hidden)
    hidden.hide_render = True
    light("AREA", 1000, (0, 0, 1))
    for thing in (bpy.data.objects["AREA.001"], box("in the way", (-1, -1, 1), (1, 1, 2), (0, 0, 0))):
        bpy.context.scene.collection.objects.unlink(thing)
        hidden.objects.link(thing)
    light("SPOT", 80, (1, -1, 2), (0.2, 0.3, 0), shadow_soft_size=0.0, spot_blend=0.0)


def lens():
    """The corner of the room is out of focus."""
    sun()
    eye = bpy.context.scene.camera
    eye.data.dof.use_dof = True
    eye.data.dof.aperture_fstop = 0.2
    eye.data.dof.focus_object = bpy.data.objects["box"]


def sun():
    _, background = room(has_window=True)
    background.inputs["Color"].default_value = (0.1, 0.2, 0.4, 1)
    background.inputs["Strength"].default_value = 2.0
    light("SUN", 3, (0, 0, 3), (0, math.radians(60), 0), angle=0.0)


def picture(package):
    """A map with a lamp at one side, which the add-on writes and Blender reads, turned and made stronger."""
    tree, background = room(has_window=True)
    rows = numpy.full((32, 64, 3), (0.2, 0.3, 0.5), numpy.float32)
    rows[16:] = (0.1, 0.08, 0.05)
    rows[9:12, 24:27] = (60.0, 50.0, 30.0)
    path = os.path.join(FOLDER, "map.exr")
    package.world.write_exr(path, rows)
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(path)
    mapping, coordinates = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Mapping", "TexCoord"))
    mapping.inputs["Rotation"].default_value[2] = math.radians(37)
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 1.5


def sky():
    """A sky that has to be rendered."""
    tree, background = room(has_window=True)
    texture = tree.nodes.new("ShaderNodeTexSky")
    texture.sun_elevation, texture.sun_rotation, texture.sun_size = math.radians(35), math.radians(60), math.radians(4)
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.1


def reference(path, samples=512):
    """The room as Cycles renders it."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = samples, False, False
    cycles.max_bounces = cycles.diffuse_bounces = 31
    cycles.sample_clamp_indirect = 0.0
    cycles.pixel_filter_type = "BOX"
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def state():
    """What sending must leave as it was."""
    kinds = ("cameras", "lights", "materials", "meshes", "objects", "scenes", "worlds")
    names = {kind: sorted(thing.name for thing in getattr(bpy.data, kind)) for kind in kinds}
    hidden = {thing.name: thing.hide_render for thing in bpy.data.objects}
    colours = {thing.name: tuple(thing.color) for thing in bpy.data.lights}
    data = {thing.name: thing.data and thing.data.name for thing in bpy.data.objects}
    return names, hidden, colours, data, {camera.name: dict(camera.items()) for camera in bpy.data.cameras}


def check_worlds(package):
    """A world that cameras see black is sent as what lights the scene; a world of nodes is seen to change."""
    tree, background = room(has_window=True)
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    mix, path, black = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "LightPath", "Background"))
    black.inputs["Strength"].default_value = 0.0
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(background.outputs[0], mix.inputs[1])
    tree.links.new(black.outputs[0], mix.inputs[2])
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = 2.0
    tree.links.new(value.outputs[0], background.inputs["Strength"])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    world, path = bpy.context.scene.world, os.path.join(FOLDER, "lit.exr")
    size, package.world.BAKED_SIZE = package.world.BAKED_SIZE, (16, 8)
    package.world.write(world, path)
    package.world.BAKED_SIZE = size
    image = bpy.data.images.load(path)
    assert abs(image.pixels[0] - 2.0) < 1e-3, image.pixels[0]
    before = package.world.digest(world)
    value.outputs[0].default_value = 3.0
    assert package.world.digest(world) != before


def install(zip_file):
    """The add-on's package, once it is installed and switched on."""
    bpy.ops.extensions.package_install_files(filepath=zip_file, repo="user_default", enable_on_install=True)
    return sys.modules[MODULE]


def main(zip_file, program):
    package = install(zip_file)
    found = {"rooms": {}}
    try:
        bpy.ops.lightgrid.send()
    except RuntimeError as error:
        found["without a program"] = str(error)
    rooms = {"lamps": lamps, "sun": sun, "lens": lens, "picture": lambda: picture(package), "sky": sky}
    for name, make in rooms.items():
        make()
        before = state()
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, name + ".blend"))
        assert bpy.ops.lightgrid.send(opens=False) == {"FINISHED"}
        after = state()
        assert after == before, f"the scene is left as it was: {after} is not {before}"
        sent = package.Sent.folder
        assert sorted(os.listdir(sent)) == ["scene.glb", "world.exr"], os.listdir(sent)
        found["rooms"][name] = package.arguments(bpy.context.scene, sent)
        reference(os.path.join(FOLDER, name + ".exr"))

    check_worlds(package)
    sky()

    # The world is written again where it has changed, and only there.
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "changing.blend"))

    def world_time():
        bpy.ops.lightgrid.send(opens=False)
        return os.stat(os.path.join(package.Sent.folder, "world.exr")).st_mtime_ns

    first = world_time()
    assert world_time() == first, "an unchanged world is not written"
    sky_node = next(node for node in bpy.context.scene.world.node_tree.nodes if node.type == "TEX_SKY")
    sky_node.sun_elevation += 0.1
    assert world_time() > first, "a changed world is written"

    # Whoever edits a mesh goes on with that.
    bpy.context.view_layer.objects.active = bpy.data.objects["box"]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.lightgrid.send(opens=False)
    assert bpy.context.mode == "EDIT_MESH", bpy.context.mode
    bpy.ops.object.mode_set(mode="OBJECT")

    # Opened, and sent again whenever the file is saved.
    bpy.context.preferences.addons[MODULE].preferences.program = program
    assert bpy.ops.lightgrid.send() == {"FINISHED"}
    folder = package.Sent.folder
    process = package.Sent.processes[folder]
    scene_file = os.path.join(package.Sent.folder, "scene.glb")
    sent = os.stat(scene_file).st_mtime_ns
    bpy.ops.wm.save_mainfile()
    assert os.stat(scene_file).st_mtime_ns > sent, "saving sends"
    assert bpy.ops.lightgrid.send() == {"FINISHED"}
    assert package.Sent.processes == {folder: process}, "one lightgrid shows a scene"
    # Saved under another name it is another scene, which nobody looks at yet.
    sent = os.stat(scene_file).st_mtime_ns
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "another.blend"))
    assert package.Sent.folder == folder and os.stat(scene_file).st_mtime_ns == sent
    picture_file = os.path.join(tempfile.gettempdir(), "lightgrid.png")
    time.sleep(3.0)
    process.terminate()
    found["status"] = process.wait(60)
    found["picture"] = os.path.isfile(picture_file)
    with open(os.path.join(folder, "lightgrid.log"), encoding="utf-8") as log:
        found["log"] = log.read()
    bpy.ops.preferences.addon_disable(module=MODULE)
    with open(os.path.join(FOLDER, "sent.json"), "w", encoding="utf-8") as file:
        json.dump(found, file)


if __name__ == "__main__":
    FOLDER = sys.argv[3]
    main(*sys.argv[1:3])
