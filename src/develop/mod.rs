//! Developing on the device: a film's sums become a picture for a display without leaving it.
//!
//! A [`LinearPicture`] is the film of a GPU session as it is, or sums that were uploaded. A
//! [`Developer`] takes noise out of it, measures it for the exposure, and develops it: white balance,
//! exposure, tone curve, sRGB, look, dither and overlay, as [`crate::tone`] does on the CPU, within one
//! 8-bit level.

mod a_trous;
mod passes;
mod picture;
#[cfg(test)]
pub(crate) mod tests;
mod upload;

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use glam::Mat3;

use crate::error::Result;
use crate::image::{Image, Rgb8};
use crate::render::gpu::{Gpu, buffer};
use crate::tone::{Lut, Tone, WhiteBalance, auto_exposure_ev};
use passes::{dispatch, entry, pipelines, stored};
pub(crate) use picture::{DisplayTexture, LinearPicture, OverlayTexture};

/// Pixels across of the picture that the exposure is taken from: so coarse that noise averages out.
const EXPOSURE_WIDTH: u32 = 64;

/// How a picture is developed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DevelopSettings {
    /// The light that looks white.
    pub(crate) white_balance: WhiteBalance,
    /// Stops.
    pub(crate) exposure_ev: f32,
    /// Tone curve and look.
    pub(crate) tone: Tone,
    /// How much of the picture an overlay covers, `[0,1]`: where it has a colour, and how far the
    /// picture steps back where it has none.
    pub(crate) opacity: [f32; 2],
}

/// Twin of `Develop` in `develop.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct DeviceSettings {
    matrix: [[f32; 4]; 3],
    size: [u32; 2],
    small_size: [u32; 2],
    gain: f32,
    curve: u32,
    opacity: [f32; 2],
    is_balanced: u32,
    has_overlay: u32,
    unscale: f32,
    look_side: u32,
    look_strength: f32,
    padding: [u32; 3],
}

impl DeviceSettings {
    /// Size, scale and white balance of a picture; all other settings are zero.
    fn balanced(picture: &LinearPicture, white_balance: WhiteBalance) -> Self {
        let matrix = white_balance.matrix();
        Self {
            matrix: matrix.to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0]),
            size: picture.size(),
            is_balanced: (matrix != Mat3::IDENTITY).into(),
            unscale: picture.film.scale.recip(),
            ..Self::zeroed()
        }
    }
}

/// What develops pictures on one device.
pub(crate) struct Developer {
    /// The device.
    pub(crate) gpu: Gpu,
    develop: wgpu::ComputePipeline,
    shrink: wgpu::ComputePipeline,
    a_trous: a_trous::Passes,
    no_overlay: OverlayTexture,
    /// The look that was used last, on the device; one entry if there was none.
    look: Mutex<(Option<Lut>, wgpu::Buffer)>,
}

impl Developer {
    /// Compiles what is needed on a device.
    ///
    /// # Errors
    /// If the driver refuses it.
    pub(crate) fn new(gpu: &Gpu) -> Result<Self> {
        let source = include_str!("../../shaders/develop.wgsl").into();
        let [develop, shrink] = pipelines(gpu, "develop", source, ["develop", "shrink"]);
        let no_overlay = OverlayTexture::new(gpu, [1, 1], &[[0; 4]]);
        let a_trous = a_trous::Passes::new(gpu);
        let look = Mutex::new((None, stored(gpu, &[[0.0; 4]])));
        let developer = Self { gpu: gpu.clone(), develop, shrink, a_trous, no_overlay, look };
        gpu.check()?;
        Ok(developer)
    }

    /// The picture through the à-trous filter; as it is without layers or
    /// where these do not fit into one binding. Of a live picture it is that of this moment.
    pub(crate) fn denoised(&self, picture: &LinearPicture) -> LinearPicture {
        let film = self.a_trous.run(&self.gpu, &picture.film);
        film.map_or_else(|| picture.clone(), LinearPicture::fixed)
    }

    /// Whether [`Self::denoised`] can filter a film of so many pixels without keeping the device from
    /// drawing: software would for seconds.
    pub(crate) fn can_denoise(&self, width: u32, height: u32) -> bool {
        !self.gpu.facts().is_software() && self.a_trous.fits(&self.gpu, width, height)
    }

    /// [`auto_exposure_ev`] of the balanced picture; waits for the device.
    ///
    /// # Errors
    /// If the device fails.
    pub(crate) fn auto_exposure_ev(
        &self,
        picture: &LinearPicture,
        white_balance: WhiteBalance,
    ) -> Result<f32> {
        self.shrunk(picture, white_balance).map(|image| auto_exposure_ev(&image))
    }

    /// The balanced picture as [`Image::shrunk`] makes it small.
    fn shrunk(&self, picture: &LinearPicture, white_balance: WhiteBalance) -> Result<Image> {
        let [all_width, all_height] = picture.size();
        let (width, height) = Image::shrunk_size(all_width, all_height, EXPOSURE_WIDTH);
        let settings = DeviceSettings {
            small_size: [width, height],
            ..DeviceSettings::balanced(picture, white_balance)
        };
        let settings = stored(&self.gpu, &[settings]);
        let bytes = u64::from(width) * u64::from(height) * size_of::<[f32; 4]>() as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let small = buffer(&self.gpu.device, Some("small picture"), bytes, usage);
        let entries = [self.inputs(picture, &settings).as_slice(), &[entry(6, &small)]].concat();
        let mut commands = self.gpu.device.create_command_encoder(&Default::default());
        dispatch(&self.gpu, &mut commands, &self.shrink, &entries, [width, height]);
        self.gpu.submit([commands.finish()]);
        let bytes = self.gpu.read_back(&small, bytes)?;
        let pixels = bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&bytes);
        let pixels = pixels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
        Ok(Image { width, height, pixels })
    }

    /// Develops a picture into a texture of its size; does not wait for the device.
    pub(crate) fn develop(
        &self,
        picture: &LinearPicture,
        overlay: Option<&OverlayTexture>,
        settings: &DevelopSettings,
        display: &DisplayTexture,
    ) {
        let grade = settings.tone.grade.as_ref();
        let look = self.look_of(grade.map(|grade| &grade.lut));
        let settings = DeviceSettings {
            gain: settings.exposure_ev.exp2(),
            curve: settings.tone.curve as u32,
            opacity: settings.opacity,
            has_overlay: overlay.is_some().into(),
            look_side: grade.map_or(0, |grade| grade.lut.side()),
            look_strength: grade.map_or(0.0, |grade| grade.strength),
            ..DeviceSettings::balanced(picture, settings.white_balance)
        };
        let settings = stored(&self.gpu, &[settings]);
        let OverlayTexture(overlay) = overlay.unwrap_or(&self.no_overlay);
        let textures = [(4, overlay), (5, &display.view)].map(|(binding, view)| {
            wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) }
        });
        let inputs = self.inputs(picture, &settings);
        let entries = [inputs.as_slice(), &textures, &[entry(7, &look)]].concat();
        let mut commands = self.gpu.device.create_command_encoder(&Default::default());
        dispatch(&self.gpu, &mut commands, &self.develop, &entries, picture.size());
        self.gpu.submit([commands.finish()]);
    }

    /// The levels of a developed picture; waits for the device.
    ///
    /// # Errors
    /// If the device fails.
    pub(crate) fn read(&self, display: &DisplayTexture) -> Result<Rgb8> {
        self.gpu.read_texture(display.view.texture())
    }

    /// A look's colours on the device.
    fn look_of(&self, lut: Option<&Lut>) -> wgpu::Buffer {
        let mut look = self.look.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(lut) = lut.filter(|lut| look.0.as_ref() != Some(lut)) {
            *look = (Some(lut.clone()), stored(&self.gpu, lut.entries()));
        }
        look.1.clone()
    }

    /// What both entry points read.
    fn inputs<'a>(
        &'a self,
        picture: &'a LinearPicture,
        settings: &'a wgpu::Buffer,
    ) -> [wgpu::BindGroupEntry<'a>; 3] {
        let film = &picture.film;
        [entry(0, settings), entry(1, &film.sum), entry(2, &film.counts)]
    }
}
