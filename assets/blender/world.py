"""Writes a world as a lat-long map whose middle column looks along +X, the layout of maps in lightgrid."""

import hashlib
import math
import os
import struct

import bpy
import numpy

# Size of worlds that are not a picture: the sun of a sky is wider than one pixel.
BAKED_SIZE = (2048, 1024)
BAKED_SAMPLES = 16
# The largest value of a half float.
MAX_HALF = 65504.0


def source_of(socket):
    """The node that feeds a socket; None if none does."""
    return socket.links[0].from_node if socket.is_linked else None


def tree_of(world):
    """The nodes of a world; None of one without. Since Blender 5 all have them."""
    has_nodes = bpy.app.version >= (5, 0, 0) or world.use_nodes
    return world.node_tree if has_nodes else None


def background_of(world):
    """The node linked to the surface of a world; None if there is none."""
    output = tree_of(world).get_output_node("CYCLES")
    return output and source_of(output.inputs["Surface"])


def picture_of(world):
    """Image, angle about Z in radians and strength of a world that is one lat-long picture; None of any other."""
    background = background_of(world)
    if not background or background.type != "BACKGROUND" or background.inputs["Strength"].is_linked:
        return None
    texture = source_of(background.inputs["Color"])
    if not texture or texture.type != "TEX_ENVIRONMENT" or texture.projection != "EQUIRECTANGULAR":
        return None
    image = texture.image
    if not image or image.source != "FILE" or not image.is_float or not all(image.size):
        return None
    angle = turn_of(texture.inputs["Vector"])
    return None if angle is None else (image, angle, background.inputs["Strength"].default_value)


def colour_of(world):
    """Radiance of a world of one colour, RGB; None of any other."""
    if not world:
        return (0.0, 0.0, 0.0)
    if not tree_of(world):
        return tuple(world.color)
    background = background_of(world)
    if not background:
        return (0.0, 0.0, 0.0)
    if background.type != "BACKGROUND":
        return None
    strength = background.inputs["Strength"]
    if not strength.is_linked and strength.default_value == 0.0:
        return (0.0, 0.0, 0.0)
    if strength.is_linked or background.inputs["Color"].is_linked:
        return None
    return tuple(channel * strength.default_value for channel in background.inputs["Color"].default_value[:3])


def turn_of(socket):
    """Angle about Z of a texture's coordinates; None if something else is done to them."""
    angle = 0.0
    node = source_of(socket)
    if node and node.type == "MAPPING":
        names = ("Location", "Rotation", "Scale")
        if node.vector_type != "POINT" or any(node.inputs[name].is_linked for name in names):
            return None
        location, rotation, scale = (tuple(node.inputs[name].default_value) for name in names)
        if any(location) or any(rotation[:2]) or scale != (1.0, 1.0, 1.0):
            return None
        angle, socket = rotation[2], node.inputs["Vector"]
        node = source_of(socket)
        if not node:
            return None
    if node and (node.type != "TEX_COORD" or socket.links[0].from_socket.name != "Generated" or node.object):
        return None
    return angle


def digest(world):
    """A hash that changes when the world looks different."""
    found = hashlib.sha256()
    if world:
        found.update(repr(tuple(world.color)).encode())
        describe(tree_of(world), found, set())
    return found.hexdigest()


def describe(owner, found, seen):
    """Adds all values of a node tree, and of what it refers to, to a hash."""
    if owner is None or owner.as_pointer() in seen:
        return
    seen.add(owner.as_pointer())
    if isinstance(owner, bpy.types.NodeTree):
        for link in owner.links:
            ends = (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
            found.update(repr(ends).encode())
        for node in owner.nodes:
            describe(node, found, seen)
            for socket in (*node.inputs, *node.outputs):
                found.update(repr(plain(getattr(socket, "default_value", None))).encode())
        return
    if isinstance(owner, bpy.types.Image):
        path = bpy.path.abspath(owner.filepath)
        changed = os.path.getmtime(path) if os.path.isfile(path) else 0.0
        found.update(repr((owner.name, path, changed, owner.colorspace_settings.name)).encode())
        return
    of_editor = {"location", "location_absolute", "width", "height", "select", "parent", "dimensions"}
    is_node = isinstance(owner, bpy.types.Node)
    for name, kind in owner.bl_rna.properties.items():
        if name == "rna_type" or is_node and (name in of_editor or name.startswith("show_")):
            continue
        if kind.type == "COLLECTION":
            if is_node:
                continue
            for item in getattr(owner, name):
                describe(item, found, seen)
        elif kind.type == "POINTER":
            value = getattr(owner, name)
            if isinstance(value, (bpy.types.NodeTree, bpy.types.Image, bpy.types.ColorRamp, bpy.types.CurveMapping)):
                describe(value, found, seen)
        else:
            found.update(repr((name, plain(getattr(owner, name)))).encode())


def plain(value):
    """A value, or those of a vector."""
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def write(world, path):
    """Writes the map of a world, which may be None, as OpenEXR."""
    colour = colour_of(world)
    if colour:
        write_exr(path, numpy.full((2, 4, 3), colour, numpy.float32))
    elif picture := picture_of(world):
        write_exr(path, turned(*picture))
    else:
        bake(world, path)


def turned(image, angle, strength):
    """Rows of RGB from the top, of the picture turned about Z."""
    width, height = image.size
    pixels = numpy.empty(width * height * image.channels, numpy.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)[::-1, :, :3]
    if image.channels < 3:
        pixels = numpy.repeat(pixels[:, :, :1], 3, axis=2)
    shift = width * angle / math.tau
    whole = math.floor(shift)
    share = shift - whole
    pixels = numpy.roll(pixels, whole, axis=1)
    if min(share, 1.0 - share) > 1e-4:
        pixels = (1.0 - share) * pixels + share * numpy.roll(pixels, 1, axis=1)
    return numpy.maximum(pixels * strength, 0.0).astype(numpy.float32)


def bake(world, path):
    """Renders the map of a world by Cycles, in a scene of its own."""
    if not hasattr(bpy.types.Scene, "cycles"):
        raise RuntimeError("the world is rendered by Cycles, whose add-on is switched off")
    scene = bpy.data.scenes.new("lightgrid world")
    camera = bpy.data.cameras.new("lightgrid world")
    eye = bpy.data.objects.new("lightgrid world", camera)
    world = world.copy()
    try:
        show_to_cameras(world)
        scene.world = world
        scene.collection.objects.link(eye)
        scene.camera = eye
        eye.rotation_euler = (math.pi / 2, 0.0, -math.pi / 2)
        camera.type = "PANO"
        panorama = camera if hasattr(camera, "panorama_type") else camera.cycles
        panorama.panorama_type = "EQUIRECTANGULAR"
        scene.render.engine = "CYCLES"
        cycles = scene.cycles
        cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = BAKED_SAMPLES, False, False
        cycles.pixel_filter_type = "BOX"
        cycles.sample_clamp_direct = 0.0
        render = scene.render
        render.resolution_x, render.resolution_y = BAKED_SIZE
        render.resolution_percentage = 100
        settings = render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
        render.filepath, render.use_file_extension = path, False
        bpy.ops.render.render(write_still=True, scene=scene.name)
    finally:
        bpy.data.objects.remove(eye)
        bpy.data.cameras.remove(camera)
        bpy.data.scenes.remove(scene)
        bpy.data.worlds.remove(world)


def show_to_cameras(world):
    """Has cameras see what lights the scene, where worlds show them something else."""
    if hasattr(world, "cycles_visibility"):
        world.cycles_visibility.camera = True
    tree = tree_of(world)
    for link in list(tree.links):
        if link.from_node.type == "LIGHT_PATH" and link.from_socket.name == "Is Camera Ray":
            socket = link.to_socket
            tree.links.remove(link)
            if socket.type == "VALUE":
                socket.default_value = 0.0


def write_exr(path, pixels):
    """Writes rows of RGB as scan lines without compression, in half floats where all values fit.

    Blender's own `Image.save` changes colours before version 5: 1e5 becomes 128.
    """
    height, width, _ = pixels.shape
    is_half = pixels.max() <= MAX_HALF
    kind, channel_type = ("<f2", 1) if is_half else ("<f4", 2)
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", channel_type, 0, 1, 1) for name in (b"B", b"G", b"R"))
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = (
        (b"channels", b"chlist", channels + b"\0"),
        (b"compression", b"compression", b"\0"),
        (b"dataWindow", b"box2i", box),
        (b"displayWindow", b"box2i", box),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1.0)),
        (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0.0, 0.0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1.0)),
    )
    header = struct.pack("<2i", 20000630, 2)
    for name, form, value in attributes:
        header += name + b"\0" + form + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    # Rows of all blue, all green, all red, each after its number and its length.
    rows = numpy.ascontiguousarray(pixels[:, :, ::-1].transpose(0, 2, 1)).astype(kind).reshape(height, -1)
    row_bytes = rows.dtype.itemsize * rows.shape[1]
    first = len(header) + 8 * height
    offsets = first + numpy.arange(height, dtype="<u8") * (8 + row_bytes)
    with open(path, "wb") as file:
        file.write(header)
        file.write(offsets.astype("<u8").tobytes())
        for number, row in enumerate(rows):
            file.write(struct.pack("<2i", number, row_bytes))
            file.write(row.tobytes())
