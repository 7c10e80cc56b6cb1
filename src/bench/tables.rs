//! The figures as tables for a terminal.

use std::fmt;

use super::figures::{Bench, DeviceFigures, Parity, SceneFigures};
use super::rays::RayKind;

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
        row(f, "", ["triangles", "primary", "shadow", "diffuse", "paths", "samples"])?;
        row(f, "", ["", "M rays/s", "M rays/s", "M rays/s", "M rays/s", "M/s"])?;
        self.scenes.iter().try_for_each(|scene| scene.write_rates(f))?;
        row(
            f,
            "",
            [
                "pass",
                "of device",
                "read",
                "to stop",
                "to turn",
                "compiling",
                "to distributions",
                "picture",
                "on device",
            ],
        )?;
        row(f, "", ["ms", "ms", "kB/pass", "ms", "ms", "s", "s", "s", "MB"])?;
        self.scenes.iter().try_for_each(|scene| scene.write_waits(f))
    }
}

/// A line of a table: a name and its cells.
fn row<T: fmt::Display>(
    f: &mut fmt::Formatter<'_>,
    name: &str,
    cells: impl IntoIterator<Item = T>,
) -> fmt::Result {
    write!(f, "  {name:<14}")?;
    cells.into_iter().try_for_each(|cell| write!(f, " {cell:>9}"))?;
    writeln!(f)
}

impl SceneFigures {
    fn write_rates(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut cells = vec![self.triangles.to_string()];
        cells.extend(RayKind::ALL.map(|kind| {
            let found = self.rays.iter().find(|rays| rays.kind == kind);
            found.map_or("-".to_owned(), |rays| millions(rays.per_second))
        }));
        if let Some(paths) = &self.paths {
            cells.extend([paths.rays_per_second, paths.samples_per_second].map(millions));
        }
        cells.extend(self.failure.clone());
        row(f, &self.scene, cells)
    }

    fn write_waits(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(paths) = &self.paths else { return Ok(()) };
        let cells = [
            format!("{:.2}", paths.pass_milliseconds),
            paths.device_milliseconds.map_or("-".to_owned(), |ms| format!("{ms:.2}")),
            format!("{:.1}", paths.bytes_read_per_pass * 1e-3),
            format!("{:.0}", paths.stop_milliseconds),
            format!("{:.1}", paths.turn_milliseconds),
            format!("{:.2}", paths.compile_seconds),
            format!("{:.2}", paths.first_distributions_seconds),
            format!("{:.2}", paths.first_picture_seconds),
            format!("{:.1}", paths.device_bytes as f64 * 1e-6),
        ];
        row(f, &self.scene, cells)
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
