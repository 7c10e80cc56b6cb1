//! `EXT_meshopt_compression` and its successor `KHR_meshopt_compression`: buffer views that are packed.

#[cfg_attr(not(feature = "meshopt"), path = "meshopt/absent.rs")]
mod codec;
mod packed;

use gltf::json;
use serde::Deserialize as _;

use super::limits::Fallible;
use crate::memory;
pub(super) use packed::Packed;
use packed::{Filter, Mode};

/// More bytes than the codec makes of one: a block of 256 bytes can take a quarter of one.
const MAX_BYTE_VALUES: u64 = 1100;

impl Packed {
    /// What is packed in a view; `None` if it is a plain one.
    pub(super) fn of(view: &json::buffer::View) -> Fallible<Option<Self>> {
        let names = ["KHR_meshopt_compression", "EXT_meshopt_compression"];
        let others = view.extensions.as_ref().map(|all| &all.others);
        let extension = names.iter().find_map(|name| others?.get(*name));
        let packed = extension.map(Self::deserialize).transpose();
        packed.map_err(|cause| format!("its meshopt compression makes no sense ({cause})"))
    }

    /// Unpacks the bytes.
    pub(super) fn unpacked(&self, bytes: &[u8]) -> Fallible<Vec<u8>> {
        let (count, stride) = (self.count, self.byte_stride);
        let total = count.saturating_mul(stride as u64);
        let is_sound = match self.mode {
            Mode::Attributes => stride.is_multiple_of(4) && (4..=256).contains(&stride),
            Mode::Triangles => matches!(stride, 2 | 4) && count.is_multiple_of(3),
            Mode::Indices => matches!(stride, 2 | 4),
        } && match self.filter {
            Filter::None => true,
            Filter::Octahedral | Filter::Color => matches!(stride, 4 | 8),
            Filter::Quaternion => stride == 8,
            Filter::Exponential => stride.is_multiple_of(4),
        };
        let is_plausible =
            total <= (1 << 16) + (bytes.len() as u64).saturating_mul(MAX_BYTE_VALUES);
        if !is_sound || !is_plausible || count > u64::from(u32::MAX) {
            return Err("its meshopt compression makes no sense".into());
        }
        let mut unpacked = memory::filled(total, 0_u8)?;
        codec::decode(self, bytes, &mut unpacked)?;
        Ok(unpacked)
    }
}

#[cfg(all(test, feature = "meshopt"))]
mod tests {
    use super::*;

    fn packed(stride: usize, count: u64, mode: Mode, filter: Filter) -> Packed {
        let (buffer, byte_offset, byte_length) = (0, 0, 0);
        Packed { buffer, byte_offset, byte_length, byte_stride: stride, count, mode, filter }
    }

    #[test]
    fn what_was_packed_comes_back() {
        let positions: Vec<[f32; 3]> =
            (0..1000).map(|i| [i as f32, (i as f32).sin(), 1.0 / (1 + i) as f32]).collect();
        let bytes = meshopt::encode_vertex_buffer(&positions).expect("packed");
        let back = packed(12, 1000, Mode::Attributes, Filter::None).unpacked(&bytes);
        assert_eq!(back.as_deref(), Ok(bytemuck::cast_slice(&positions)));

        let indices: Vec<u32> = (0..998).flat_map(|i| [i, i + 1, i + 2]).collect();
        let bytes = meshopt::encode_index_buffer(&indices, 1000).expect("packed");
        let back = packed(4, 2994, Mode::Triangles, Filter::None).unpacked(&bytes).expect("sound");
        let back: Vec<[u32; 3]> = bytemuck::pod_collect_to_vec(&back);
        // Corners may be turned.
        let turned = |t: &[u32; 3]| [[t[0], t[1], t[2]], [t[1], t[2], t[0]], [t[2], t[0], t[1]]];
        assert!((0..998).zip(&back).all(|(i, t)| turned(t).contains(&[i, i + 1, i + 2])));
        let bytes = meshopt::encode_index_sequence(&indices, 1000).expect("packed");
        let back = packed(2, 2994, Mode::Indices, Filter::None).unpacked(&bytes).expect("sound");
        let short: Vec<u16> = indices.iter().map(|&i| i as u16).collect();
        assert_eq!(back, bytemuck::cast_slice::<u16, u8>(&short));
    }

    #[test]
    fn filters_are_undone() {
        let normals: Vec<[f32; 4]> = (0..256)
            .map(|i| {
                let (sin, cos) = (i as f32 * 0.1).sin_cos();
                [0.8 * sin, 0.6, 0.8 * cos, 0.0]
            })
            .collect();
        let oct: Vec<[i16; 4]> = meshopt::encode_filter_oct(&normals, 16);
        let bytes = meshopt::encode_vertex_buffer(&oct).expect("packed");
        let back = packed(8, 256, Mode::Attributes, Filter::Octahedral).unpacked(&bytes);
        let back: Vec<[i16; 4]> = bytemuck::pod_collect_to_vec(&back.expect("sound"));
        for (normal, found) in normals.iter().zip(&back) {
            for (a, b) in normal.iter().zip(found) {
                assert!((a - f32::from(*b) / 32_767.0).abs() < 1e-3, "{normal:?} {found:?}");
            }
        }
    }

    #[test]
    fn damage_and_bombs_are_sentences() {
        let values: Vec<[u32; 4]> = (0..100).map(|i| [i, 3 * i, 7, i * i]).collect();
        let bytes = meshopt::encode_vertex_buffer(&values).expect("packed");
        let unpack = |bytes: &[u8], count, stride| {
            packed(stride, count, Mode::Attributes, Filter::None).unpacked(bytes)
        };
        assert!(unpack(&bytes, 100, 16).is_ok());
        assert!(unpack(&bytes[..bytes.len() / 2], 100, 16).is_err());
        for (count, stride) in [(u64::MAX, 16), (1 << 31, 256), (100, 15), (100, 260), (100, 0)] {
            assert!(unpack(&bytes, count, stride).unwrap_err().contains("no sense"));
        }
        assert!(unpack(&[], 100, 16).is_err());
        // Every byte in turn, and none of them a crash.
        for at in 0..bytes.len() {
            let mut spoilt = bytes.clone();
            spoilt[at] ^= 0x55;
            let _ = unpack(&spoilt, 100, 16);
        }
    }
}
