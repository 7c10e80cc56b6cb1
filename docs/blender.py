"""Makes docs/pictures/blender.jpg: one room in Blender, by Cycles and by lightgrid.

    LIGHTGRID=target/release/lightgrid python docs/blender.py    # with bpy
"""

import math
import os
import subprocess
import sys
import tempfile

root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(root, "tests", "blender"))
folder = tempfile.mkdtemp()
os.environ["BLENDER_USER_RESOURCES"] = folder

import addon
import bpy
import numpy

zip_file = subprocess.check_output([os.path.join(root, ".ci", "blender"), folder], text=True).strip()
package = addon.install(zip_file)
addon.SIZE = (480, 270)
tree, background = addon.room(has_window=True)
sky = tree.nodes.new("ShaderNodeTexSky")
sky.sun_elevation, sky.sun_rotation = math.radians(32), math.radians(62)
tree.links.new(sky.outputs["Color"], background.inputs["Color"])
background.inputs["Strength"].default_value = 0.1
addon.light("AREA", 25, (-1.2, 1.2, 2.2), (0.3, 0.2, 0), shape="ELLIPSE", size=0.3, size_y=0.3, color=(1, 0.7, 0.4))
wood = (0.35, 0.2, 0.1)
addon.box("table", (0.6, -1.2, 0.55), (1.6, -0.2, 0.6), wood)
for x in (0.65, 1.5):
    for y in (-1.15, -0.3):
        addon.box("leg", (x, y, 0), (x + 0.05, y + 0.05, 0.55), wood)
bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.25, location=(1.1, -0.7, 0.85))
ball = bpy.context.object
bpy.ops.object.shade_smooth()
ball.data.materials.append(bpy.data.materials["box"].copy())
shader = next(node for node in ball.data.materials[0].node_tree.nodes if node.type == "BSDF_PRINCIPLED")
shader.inputs["Base Color"].default_value, shader.inputs["Roughness"].default_value = (0.1, 0.3, 0.5, 1), 0.25
shader.inputs["Specular IOR Level"].default_value = 0.5

bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "room.blend"))
bpy.ops.lightgrid.send(opens=False)
theirs, ours = (os.path.join(folder, name + ".exr") for name in ("cycles", "lightgrid"))
addon.reference(theirs, samples=256)
arguments = package.arguments(bpy.context.scene, package.Sent.folder)[1:]
render = [os.environ["LIGHTGRID"], "render", *arguments, "--size", "480x270", "--spp", "256", "-o", ours]
subprocess.run(render, check=True)


def rows_of(path):
    image = bpy.data.images.load(path)
    width, height = image.size
    rows = numpy.empty(width * height * 4, numpy.float32)
    image.pixels.foreach_get(rows)
    return rows.reshape(height, width, 4)


pair = numpy.concatenate([rows_of(theirs), numpy.full((270, 6, 4), 1e9, numpy.float32), rows_of(ours)], axis=1)
exposure = 0.9 / numpy.percentile(pair[:, :480, :3], 90)
pair[:, :, :3] = (1 - numpy.exp(-exposure * pair[:, :, :3])) ** (1 / 2.2)
pair[:, :, 3] = 1
picture = bpy.data.images.new("pair", pair.shape[1], pair.shape[0])
picture.pixels.foreach_set(pair.ravel())
picture.file_format = "JPEG"
picture.save(filepath=os.path.join(root, "docs", "pictures", "blender.jpg"), quality=88)
