//! Error against run time: measures methods of rendering, and reports their speed-ups at equal error as tables,
//! plots and pictures.
//!
//! A [`Plan`] says what is compared. [`make`] goes through it row by row: it reuses runs on disk, measures the
//! missing ones (`measure`) against a [reference](ReferenceReport) of sufficiently low noise, and writes the
//! pages. [`talk`] and [`ablations`] are plans; [`sat`] measures importance
//! tables alone.

pub mod ablations;
mod bias;
mod context;
mod evaluate;
mod machine;
mod measure;
mod pages;
mod plan;
mod prepared_row;
mod reference;
mod runner;
pub mod sat;
mod shares;
pub mod statistics;
mod store;
mod summary;
pub mod talk;

pub use bias::Bias;
pub use context::Options;
pub use machine::Machine;
pub(crate) use machine::OpenDevice;
pub use measure::{Memory, Point, Run};
pub use pages::{duration, markdown_table, row_sentence};
pub use plan::{Device, Effort, Frame, Method, Plan, Row, Settings};
pub use reference::{Noise, ReferenceFacts};
pub use runner::{check, make};
pub use shares::Shares;
pub use summary::{
    Costs, DeviceReport, Measure, MethodReport, Pictures, ReferenceReport, Report, RowReport,
};
