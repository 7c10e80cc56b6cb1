//! Many pictures by one command: a camera that moves, one picture a frame, or a video of them.

use std::fs;
use std::io::{self, Write as _};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use glam::{Affine3A, Vec3};

use super::RenderArguments;
use crate::cli::picture::say_written;
use crate::error::{At as _, Error, Result};
use crate::image::{extension, name_of_process, write_beside_and_rename};
use crate::path::{World, framing};
use crate::scene::Camera;
use crate::scene::camera_path::CameraPath;
use crate::system::set_apart;

/// Which pictures are asked for, and where the camera is in each.
pub(super) struct Frames<'a> {
    /// Numbers of the pictures.
    pub(super) numbers: RangeInclusive<u32>,
    motion: Motion<'a>,
    frames_per_second: f64,
}

enum Motion<'a> {
    Path(&'a CameraPath),
    Turn { about: Vec3, count: u32 },
}

impl<'a> Frames<'a> {
    /// What the arguments ask for; `None` is one picture. The camera is the one at rest.
    ///
    /// # Errors
    /// If that camera does not move, or a frame is beyond the turn.
    pub(super) fn plan(
        arguments: &RenderArguments,
        world: &'a World,
        camera: &Camera,
    ) -> Result<Option<Self>> {
        let (motion, all) = match (&arguments.frames, arguments.turntable) {
            (None, None) => return Ok(None),
            (_, Some(count)) => {
                let about = arguments.about.or(arguments.place.target);
                let about = about.map(|about| world.scene.frame.point(about));
                let about = about.unwrap_or_else(|| centre(world, camera));
                (Motion::Turn { about, count }, 0..=count - 1)
            }
            (Some(frames), None) => {
                let paths = &world.scene.camera_paths;
                let path = paths.get(arguments.camera_number(world)?).and_then(Option::as_ref);
                let path = path.filter(|_| arguments.place.eye.is_none()).ok_or_else(|| {
                    Error::new(format!(
                        "--frames: the camera does not move in {} (--turntable turns any)",
                        arguments.scene
                    ))
                })?;
                (Motion::Path(path), frames.clone())
            }
        };
        let numbers = arguments.frames.clone().unwrap_or_else(|| all.clone());
        let [first, last, end] = [numbers.start(), numbers.end(), all.end()];
        if last > end {
            let count = end + 1;
            let cause = format!("--frames {first}..{last}: the last of a turn's {count} is {end}");
            return Err(Error::new(cause));
        }
        if last > first && (arguments.part.is_some() || arguments.checkpoint.is_some()) {
            return Err(Error::new("--part and --checkpoint are of one frame, such as --frames 3"));
        }
        Ok(Some(Self { numbers, motion, frames_per_second: arguments.fps }))
    }

    /// Where the camera is in a frame: at `frame / fps` seconds, or so much of a turn further.
    pub(super) fn camera(&self, frame: u32, at_rest: &Camera) -> Camera {
        let world_from_camera = match self.motion {
            Motion::Path(path) => {
                let placed = path.at(f64::from(frame) / self.frames_per_second);
                if placed.is_finite() { placed.as_affine3a() } else { at_rest.world_from_camera }
            }
            Motion::Turn { about, count } => {
                let turn = std::f64::consts::TAU * f64::from(frame) / f64::from(count);
                Affine3A::from_translation(about)
                    * Affine3A::from_rotation_y(turn as f32)
                    * Affine3A::from_translation(-about)
                    * at_rest.world_from_camera
            }
        };
        Camera { world_from_camera, ..at_rest.clone() }
    }
}

/// What a camera is turned about: in a room it stays where it is, for the walls are all around it.
fn centre(world: &World, camera: &Camera) -> Vec3 {
    let eye = Vec3::from(camera.world_from_camera.translation);
    if framing::is_in_room(world, eye) { eye } else { framing::middle(world, camera) }
}

/// A name with the frame's number in place of the `#`s, as many digits as there are at least.
pub(super) fn numbered(path: &Path, frame: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let Some(start) = name.find('#') else { return path.to_owned() };
    let width = name[start..].bytes().take_while(|byte| *byte == b'#').count();
    let (before, after) = (&name[..start], &name[start + width..]);
    path.with_file_name(format!("{before}{frame:0width$}{after}"))
}

/// Whether a name is that of a video.
pub(super) fn is_video(path: &Path) -> bool {
    codec(path).is_some()
}

/// What ffmpeg is told for a kind of video. Those of the first two have an even size.
fn codec(path: &Path) -> Option<String> {
    const YUV_EVEN: &str = "-pix_fmt yuv420p -vf crop=trunc(iw/2)*2:trunc(ih/2)*2";
    Some(match extension(path)?.as_str() {
        "mp4" => format!("-c:v libx264 -crf 16 {YUV_EVEN}"),
        "webm" => format!("-c:v libvpx-vp9 -crf 24 -b:v 0 {YUV_EVEN}"),
        "gif" => "-vf split[a][b];[a]palettegen[p];[b][p]paletteuse".to_owned(),
        _ => return None,
    })
}

/// Refuses names that cannot hold many pictures, and videos that nothing here can make.
///
/// # Errors
/// One sentence that names the file.
pub(super) fn check(arguments: &RenderArguments) -> Result<()> {
    let RenderArguments { outputs, json, distributions, .. } = arguments;
    for path in outputs.iter().chain(json).chain(distributions) {
        let has_number = numbered(path, 0) != *path;
        if !is_video(path) && !has_number {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            let cause =
                format!("frames need a number in their names, as {name}.####.{extension} has");
            return Err(Error::at(path, cause));
        }
        if let Some(codec) = codec(path) {
            try_ffmpeg(&codec).at(path)?;
        }
        if has_number && path.file_name().is_some_and(|name| name.to_str().is_none()) {
            return Err(Error::at(path, "its name is not Unicode: no number can be put into it"));
        }
    }
    Ok(())
}

/// Makes a video of one black frame and throws it away: hours of rendering are not to find that ffmpeg cannot.
fn try_ffmpeg(codec: &str) -> std::result::Result<(), String> {
    const SIDE: usize = 64;
    let cannot = |cause: &dyn std::fmt::Display| format!("ffmpeg cannot make it: {cause}");
    let input = format!("-v error -f rawvideo -pix_fmt rgb24 -s {SIDE}x{SIDE} -i -");
    let child = Command::new("ffmpeg")
        .args(format!("{input} {codec} -f null -").split_whitespace())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = child.map_err(|_| {
        "ffmpeg, which makes videos, is not found: install it, or ask for .####.png".to_owned()
    })?;
    if let Some(mut input) = child.stdin.take() {
        // One that refuses reads nothing.
        let _ = input.write_all(&[0; 3 * SIDE * SIDE]);
    }
    let output = child.wait_with_output().map_err(|error| cannot(&error))?;
    if output.status.success() { Ok(()) } else { Err(cannot(&said(&output.stderr))) }
}

/// The last line of what a program says.
fn said(text: &[u8]) -> String {
    String::from_utf8_lossy(text).lines().last().unwrap_or("no reason given").to_owned()
}

/// A folder for the frames of a video, gone when this value is.
pub(super) struct Reel {
    /// Where they are.
    pub(super) folder: PathBuf,
    /// Frames asked for so far.
    count: u32,
}

impl Reel {
    /// An empty one in the temporary folder.
    ///
    /// # Errors
    /// If it cannot be made.
    pub(super) fn new() -> Result<Self> {
        let folder = std::env::temp_dir().join(format!("lightgrid-{}-frames", name_of_process()));
        fs::create_dir(&folder).at(&folder)?;
        Ok(Self { folder, count: 0 })
    }

    /// Where the next frame is to be written: in the place of the last if that could not be, for videos are
    /// made of frames without gaps.
    pub(super) fn next(&mut self) -> PathBuf {
        if self.count == 0 || self.frame(self.count - 1).exists() {
            self.count += 1;
        }
        self.frame(self.count - 1)
    }

    fn frame(&self, number: u32) -> PathBuf {
        self.folder.join(format!("{number:08}.png"))
    }

    /// Whether the first frame was written.
    pub(super) fn has_frames(&self) -> bool {
        self.frame(0).exists()
    }

    /// Leaves the frames where they are; there.
    pub(super) fn keep(mut self) -> PathBuf {
        std::mem::take(&mut self.folder)
    }

    /// Makes a video of the frames.
    ///
    /// # Errors
    /// If ffmpeg fails or the file cannot be written.
    pub(super) fn write(&self, path: &Path, frames_per_second: f64) -> Result<()> {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        let made = format!("video.{extension}");
        let mut command = Command::new("ffmpeg");
        command
            .args(["-y", "-v", "error", "-framerate", &frames_per_second.to_string()])
            .args(["-i", "%08d.png"])
            .args(codec(path).unwrap_or_default().split_whitespace())
            .arg(&made)
            // Names of folders may have what it would take for numbers.
            .current_dir(&self.folder)
            .stdin(Stdio::null());
        // Ctrl-C ends the rendering, not the video of what there is.
        set_apart(&mut command);
        let cannot = |e| Error::at(path, format!("ffmpeg cannot be started: {e}"));
        let output = command.output().map_err(cannot)?;
        if !output.status.success() {
            return Err(Error::at(path, format!("ffmpeg failed: {}", said(&output.stderr))));
        }
        write_beside_and_rename(path, |file| {
            io::copy(&mut fs::File::open(self.folder.join(made))?, file).map(|_| ())
        })?;
        say_written(path);
        Ok(())
    }
}

impl Drop for Reel {
    fn drop(&mut self) {
        // Kept, it is no longer this value's.
        if !self.folder.as_os_str().is_empty() {
            let _ = fs::remove_dir_all(&self.folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_take_the_place_of_hashes() {
        for (pattern, frame, name) in [
            ("a.####.png", 7, "a.0007.png"),
            ("a#.exr", 12, "a12.exr"),
            ("x#/b##.png", 123, "x#/b123.png"),
            ("a.png", 1, "a.png"),
        ] {
            assert_eq!(numbered(Path::new(pattern), frame), Path::new(name), "{pattern}");
        }
    }
}
