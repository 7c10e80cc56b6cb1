"""Opens the scene in lightgrid, or sends it again to a lightgrid that is open."""

import functools
import os
import shutil
import subprocess
import sys
import tempfile
import time

import bpy
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, StringProperty

from . import scene as scene_file
from . import world as world_file

# Seconds after which a program that fails to start has ended.
STARTING = 2.0


class Sent:
    """What was sent last, and the lightgrid that shows each folder."""

    folder = None
    world = None
    processes = {}
    message = ""

    @classmethod
    def is_open(cls, folder):
        process = cls.processes.get(folder)
        return process is not None and process.poll() is None


def program_of(preferences):
    """Path of lightgrid: the chosen one, else the first that is found; empty if none is."""
    if preferences.program:
        return bpy.path.abspath(preferences.program)
    places = {
        "win32": [os.path.expandvars(r"%LOCALAPPDATA%\Programs\lightgrid\lightgrid.exe")],
        "darwin": ["/Applications/lightgrid.app/Contents/MacOS/lightgrid"],
    }.get(sys.platform, [])
    places.append(os.path.expanduser("~/.cargo/bin/lightgrid"))
    found = [place for place in places if os.path.isfile(place)]
    return shutil.which("lightgrid") or (found[0] if found else "")


def folder_of(scene):
    """Where the files of a scene are: beside the saved file, else in a folder of this session."""
    name = bpy.path.clean_name(scene.name)
    if bpy.data.filepath:
        return os.path.splitext(bpy.data.filepath)[0] + ".lightgrid" + os.sep + name
    return os.path.join(bpy.app.tempdir or tempfile.gettempdir(), "lightgrid", name)


def replace(source, target):
    """Puts a file in the place of another, which on Windows fails for a moment while somebody reads that."""
    for _ in range(20):
        try:
            return os.replace(source, target)
        except PermissionError:
            time.sleep(0.1)
    return os.replace(source, target)


def send(context, writes_world):
    """Writes scene and world, each in one step. Returns the folder, and seconds that it took."""
    start = time.monotonic()
    context.view_layer.update()
    folder = folder_of(context.scene)
    unfinished = os.path.join(folder, "unfinished")
    os.makedirs(unfinished, exist_ok=True)
    try:
        world = world_file.digest(context.scene.world)
        map_file = os.path.join(folder, "world.exr")
        is_there = (Sent.folder, Sent.world) == (folder, world) and os.path.isfile(map_file)
        if writes_world or not is_there:
            path = os.path.join(unfinished, "world.exr")
            world_file.write(context.scene.world, path)
            replace(path, map_file)
        path = os.path.join(unfinished, "scene.glb")
        scene_file.write(context.scene, path)
        replace(path, os.path.join(folder, "scene.glb"))
        Sent.folder, Sent.world = folder, world
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return folder, time.monotonic() - start


def arguments(scene, folder):
    """What lightgrid is called with."""
    names = [os.path.join(folder, name) for name in ("scene.glb", "world.exr")]
    found = ["view", names[0], "--env", names[1], "--lamps", "watts"]
    camera = scene.camera
    # glTF has no panoramas.
    if camera and camera.type == "CAMERA" and not camera.hide_render and camera.data.type != "PANO":
        found += ["--camera", camera.data.name]
    return found


def start(program, scene, folder):
    """Starts lightgrid; what it prints goes into a file."""
    detached = {"creationflags": 8} if sys.platform == "win32" else {"start_new_session": True}
    with open(os.path.join(folder, "lightgrid.log"), "w", encoding="utf-8") as log:
        command = [program, *arguments(scene, folder)]
        Sent.processes[folder] = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=tempfile.gettempdir(), **detached
        )
    bpy.app.timers.register(functools.partial(check, folder), first_interval=STARTING)


def check(folder):
    """Says why lightgrid has ended at once, if it has."""
    process = Sent.processes[folder]
    if process.poll():
        with open(os.path.join(folder, "lightgrid.log"), encoding="utf-8", errors="replace") as log:
            lines = [line.strip() for line in log if line.strip()]
        Sent.message = lines[-1] if lines else f"lightgrid ended with status {process.returncode}"
        redraw()


def redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


class LIGHTGRID_OT_send(bpy.types.Operator):
    """Write the scene, its cameras and its world, and show them in lightgrid; one that is open reads them again"""

    bl_idname = "lightgrid.send"
    bl_label = "Open in lightgrid"

    writes_world: BoolProperty(
        name="World Too",
        description="Write the world again even if it seems unchanged",
        options={"SKIP_SAVE"},
    )
    opens: BoolProperty(
        name="Open",
        description="Start lightgrid unless it already shows the scene",
        default=True,
        options={"SKIP_SAVE"},
    )

    def execute(self, context):
        if bpy.app.is_job_running("RENDER"):
            self.report({"WARNING"}, "Blender is rendering: send the scene after that")
            return {"CANCELLED"}
        program = program_of(context.preferences.addons[__package__].preferences)
        if self.opens and not os.path.isfile(program):
            missing = f"There is no {program}" if program else "lightgrid is not found"
            self.report({"ERROR"}, f"{missing}: choose the program in the preferences of the add-on")
            return {"CANCELLED"}
        was_open = Sent.is_open(folder_of(context.scene))
        try:
            folder, seconds = send(context, self.writes_world)
            if self.opens and not was_open:
                start(program, context.scene, folder)
        except Exception as error:
            # Blender adds where in its own code that was.
            lines = [line.strip() for line in str(error).splitlines() if line.strip() and "Location:" not in line]
            Sent.message = lines[-1] if lines else type(error).__name__
            self.report({"ERROR"}, f"The scene could not be sent to lightgrid: {Sent.message}")
            return {"CANCELLED"}
        Sent.message = f"Sent in {seconds:.1f} s"
        self.report({"INFO"}, f"{Sent.message}: {folder}")
        return {"FINISHED"}


class LIGHTGRID_PT_panel(bpy.types.Panel):
    bl_idname = "LIGHTGRID_PT_panel"
    bl_label = "lightgrid"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "lightgrid"

    def draw(self, context):
        layout = self.layout
        row = layout.row(align=True)
        is_open = Sent.is_open(folder_of(context.scene))
        label = "Send Again" if is_open else "Open in lightgrid"
        row.operator("lightgrid.send", text=label, icon="LIGHT_SUN")
        row.operator("lightgrid.send", text="", icon="WORLD").writes_world = True
        layout.prop(context.window_manager, "lightgrid_sends_when_saving")
        if Sent.message:
            layout.label(text=Sent.message)


class LightgridPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: StringProperty(
        name="Program",
        description="Path of lightgrid; leave empty to search for it",
        subtype="FILE_PATH",
    )

    def draw(self, _context):
        self.layout.prop(self, "program")
        if not self.program:
            self.layout.label(text=program_of(self) or "lightgrid is not found: choose its program")


def draw_menu(menu, _context):
    menu.layout.separator()
    menu.layout.operator("lightgrid.send", icon="LIGHT_SUN")


@persistent
def send_when_saving(*_):
    context = bpy.context
    if context.window_manager.lightgrid_sends_when_saving and Sent.is_open(folder_of(context.scene)):
        try:
            bpy.ops.lightgrid.send(opens=False)
        except RuntimeError:
            # The panel says why.
            pass
        redraw()


CLASSES = (LightgridPreferences, LIGHTGRID_OT_send, LIGHTGRID_PT_panel)


def register():
    for kind in CLASSES:
        bpy.utils.register_class(kind)
    bpy.types.WindowManager.lightgrid_sends_when_saving = BoolProperty(
        name="Send when saving",
        description="Send the scene to its open window of lightgrid whenever the file is saved",
        default=True,
    )
    bpy.types.TOPBAR_MT_render.append(draw_menu)
    bpy.app.handlers.save_post.append(send_when_saving)


def unregister():
    bpy.app.handlers.save_post.remove(send_when_saving)
    bpy.types.TOPBAR_MT_render.remove(draw_menu)
    del bpy.types.WindowManager.lightgrid_sends_when_saving
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)
