//! Developing on the device: a film's sums become a picture for a display without leaving it.
//!
//! A [`LinearPicture`] is the film of a GPU session as it is, or sums that were uploaded. A
//! [`Developer`] takes noise out of it, measures it for the exposure, and develops it: white balance,
//! exposure, tone curve, sRGB, dither and overlay, as [`crate::tone`] does on the CPU, within one
//! 8-bit level.

mod a_trous;
#[cfg(test)]
pub(crate) mod tests;
mod upload;

use bytemuck::{Pod, Zeroable};
use glam::Mat3;

use crate::error::Result;
use crate::image::{Image, Rgb8};
use crate::render::gpu::{DeviceFilm, Gpu, buffer, texture};
use crate::tone::{ToneCurve, WhiteBalance, auto_exposure_ev};

/// Pixels across of the picture that the exposure is taken from: so coarse that noise averages out.
const EXPOSURE_WIDTH: u32 = 64;
/// Texels of overlays and of developed pictures.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Pixels along a side of a workgroup's tile, as in the shaders.
const TILE: u32 = 8;

/// Linear radiance on a device; clones share it, and only those are equal.
#[derive(Clone, PartialEq)]
pub(crate) struct LinearPicture {
    film: DeviceFilm,
    /// Whether it may change by itself.
    pub(crate) is_live: bool,
}

impl LinearPicture {
    /// The film of a renderer on the same device, which may still be adding to it.
    pub(crate) fn live(film: DeviceFilm) -> Self {
        Self { is_live: true, ..Self::fixed(film) }
    }

    /// Sums that nobody will change.
    fn fixed(film: DeviceFilm) -> Self {
        Self { film, is_live: false }
    }

    /// Its sums.
    #[cfg(test)]
    pub(crate) fn film(&self) -> &DeviceFilm {
        &self.film
    }

    /// Pixels across and down.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.film.width, self.film.height]
    }
}

/// Colours to be blended over a picture of the same size; clones share them, and only those are equal.
#[derive(Clone, PartialEq)]
pub(crate) struct OverlayTexture(wgpu::TextureView);

/// A developed picture; clones share it.
#[derive(Clone)]
pub(crate) struct DisplayTexture {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl DisplayTexture {
    /// For whoever draws it: 8-bit sRGB levels that are not to be decoded again, opaque.
    pub(crate) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Pixels across and down.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.texture.width(), self.texture.height()]
    }
}

/// How a picture is developed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DevelopSettings {
    /// The light that looks white.
    pub(crate) white_balance: WhiteBalance,
    /// Stops.
    pub(crate) exposure_ev: f32,
    /// Tone curve.
    pub(crate) curve: ToneCurve,
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
    padding: u32,
}

impl DeviceSettings {
    fn new(picture: &LinearPicture, settings: &DevelopSettings) -> Self {
        let matrix = settings.white_balance.matrix();
        Self {
            matrix: matrix.to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0]),
            size: picture.size(),
            small_size: [0; 2],
            gain: settings.exposure_ev.exp2(),
            curve: settings.curve as u32,
            opacity: settings.opacity,
            is_balanced: (matrix != Mat3::IDENTITY).into(),
            has_overlay: 0,
            unscale: picture.film.scale.recip(),
            padding: 0,
        }
    }
}

/// What develops pictures on one device.
pub(crate) struct Developer {
    gpu: Gpu,
    develop: wgpu::ComputePipeline,
    shrink: wgpu::ComputePipeline,
    a_trous: a_trous::Passes,
    no_overlay: OverlayTexture,
}

impl Developer {
    /// Compiles what is needed on a device.
    ///
    /// # Errors
    /// If the driver refuses it.
    pub(crate) fn new(gpu: &Gpu) -> Result<Self> {
        let shader = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("develop"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/develop.wgsl").into()),
        });
        let no_overlay = upload::overlay(gpu, [1, 1], &[[0; 4]]);
        let developer = Self {
            develop: pipeline(gpu, &shader, "develop"),
            shrink: pipeline(gpu, &shader, "shrink"),
            a_trous: a_trous::Passes::new(gpu),
            gpu: gpu.clone(),
            no_overlay,
        };
        gpu.check()?;
        Ok(developer)
    }

    /// The device.
    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
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
        let settings = DevelopSettings {
            white_balance,
            exposure_ev: 0.0,
            curve: ToneCurve::None,
            opacity: [0.0; 2],
        };
        let settings = DeviceSettings {
            small_size: [width, height],
            ..DeviceSettings::new(picture, &settings)
        };
        let settings = self.buffer(bytemuck::bytes_of(&settings));
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

    /// A texture to develop pictures of this size into.
    pub(crate) fn display_texture(&self, size: [u32; 2]) -> DisplayTexture {
        let usage = wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let texture = texture(&self.gpu.device, Some("developed picture"), size, FORMAT, usage);
        let view = texture.create_view(&Default::default());
        DisplayTexture { texture, view }
    }

    /// Develops a picture into a texture of its size; does not wait for the device.
    pub(crate) fn develop(
        &self,
        picture: &LinearPicture,
        overlay: Option<&OverlayTexture>,
        settings: &DevelopSettings,
        display: &DisplayTexture,
    ) {
        let has_overlay = overlay.is_some().into();
        let settings = DeviceSettings { has_overlay, ..DeviceSettings::new(picture, settings) };
        let settings = self.buffer(bytemuck::bytes_of(&settings));
        let OverlayTexture(overlay) = overlay.unwrap_or(&self.no_overlay);
        let textures = [(4, overlay), (5, &display.view)].map(|(binding, view)| {
            wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) }
        });
        let entries = [self.inputs(picture, &settings).as_slice(), &textures].concat();
        let mut commands = self.gpu.device.create_command_encoder(&Default::default());
        dispatch(&self.gpu, &mut commands, &self.develop, &entries, picture.size());
        self.gpu.submit([commands.finish()]);
    }

    /// The levels of a developed picture; waits for the device.
    ///
    /// # Errors
    /// If the device fails.
    pub(crate) fn read(&self, display: &DisplayTexture) -> Result<Rgb8> {
        self.gpu.read_texture(&display.texture)
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

/// A buffer of these bytes. It is written by the queue, for mapping panics where the device is lost.
fn filled(gpu: &Gpu, usage: wgpu::BufferUsages, bytes: &[u8]) -> wgpu::Buffer {
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    let buffer = buffer(&gpu.device, None, bytes.len() as u64, usage);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

fn entry(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }
}

fn pipeline(gpu: &Gpu, shader: &wgpu::ShaderModule, name: &str) -> wgpu::ComputePipeline {
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: None,
        module: shader,
        entry_point: Some(name),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// One invocation for each pixel.
fn dispatch(
    gpu: &Gpu,
    commands: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::ComputePipeline,
    entries: &[wgpu::BindGroupEntry<'_>],
    [width, height]: [u32; 2],
) {
    let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries,
    });
    let mut pass = commands.begin_compute_pass(&Default::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(width.div_ceil(TILE), height.div_ceil(TILE), 1);
}
