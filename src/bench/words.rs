//! The figures as a table to read.

use std::fmt;

use super::{Bench, DeviceFigures, Parity, PathFigures, RayKind, SceneFigures};

impl fmt::Display for Bench {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let m = &self.machine;
        writeln!(f, "{}, {} threads, {}, {}", m.processor, m.threads, m.system, m.build)?;
        writeln!(f, "pictures of {} x {} pixels", self.size.0, self.size.1)?;
        for device in &self.devices {
            write!(f, "\n{device}")?;
        }
        if !self.parity.is_empty() {
            writeln!(f, "\nThe same picture on both (96 x 54 pixels, 16 samples, one seed)")?;
            for parity in &self.parity {
                writeln!(f, "{parity}")?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for DeviceFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.name)?;
        if let Some(adapter) = &self.adapter {
            writeln!(
                f,
                "  {}, rays by {}, {} storage buffers of {} MiB, buffers of {} MiB",
                adapter.kind,
                if self.has_hardware_rays { "its own ray queries" } else { "our kernels" },
                adapter.storage_buffers,
                adapter.storage_binding_bytes >> 20,
                adapter.buffer_bytes >> 20
            )?;
        }
        writeln!(
            f,
            "{:<14} {:>10} | {:>8} {:>8} {:>8} {:>8} | {:>11} {:>8} {:>8} {:>8} | {:>8} {:>8} {:>9} {:>9}",
            "scene",
            "triangles",
            "primary",
            "shadow",
            "diffuse",
            "paths",
            "samples/s",
            "pass",
            "device",
            "read",
            "compile",
            "laws",
            "picture",
            "on device"
        )?;
        writeln!(
            f,
            "{:<14} {:>10} | {:>35} | {:>11} {:>8} {:>8} {:>8} | {:>8} {:>8} {:>9} {:>9}",
            "", "", "millions of rays a second", "millions", "ms", "ms", "kB", "s", "s", "s", "MB"
        )?;
        self.scenes.iter().try_for_each(|scene| writeln!(f, "{scene}"))
    }
}

impl fmt::Display for SceneFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<14} {:>10} |", self.scene, self.triangles)?;
        for kind in RayKind::ALL {
            let found = self.rays.iter().find(|rays| rays.kind == kind);
            write!(f, " {:>8}", found.map_or("-".to_owned(), |rays| millions(rays.per_second)))?;
        }
        if let Some(paths) = &self.paths {
            write!(f, " {paths}")?;
        }
        self.failure.as_ref().map_or(Ok(()), |failure| write!(f, "  {failure}"))
    }
}

impl fmt::Display for PathFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let device = self.device_milliseconds.map_or("-".to_owned(), |ms| format!("{ms:.2}"));
        write!(
            f,
            "{:>8} | {:>11} {:>8.2} {device:>8} {:>8.1} | {:>8.2} {:>8.2} {:>9.2} {:>9.1}",
            millions(self.rays_per_second),
            millions(self.samples_per_second),
            self.pass_milliseconds,
            self.bytes_read_per_pass * 1e-3,
            self.compile_seconds,
            self.first_laws_seconds,
            self.first_picture_seconds,
            self.device_bytes as f64 * 1e-6
        )
    }
}

impl fmt::Display for Parity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(failure) = &self.failure {
            return write!(f, "{:<14} not compared: {failure}", self.scene);
        }
        write!(
            f,
            "{:<14} mean ratio {:.5}, {:.2} % of pixels 1 % apart, {:.4} % of rays hit another triangle",
            self.scene,
            self.mean_ratio,
            100.0 * self.share_apart,
            100.0 * self.other_triangles
        )
    }
}

fn millions(per_second: f64) -> String {
    let millions = per_second * 1e-6;
    if millions < 99.95 { format!("{millions:.2}") } else { format!("{millions:.0}") }
}
