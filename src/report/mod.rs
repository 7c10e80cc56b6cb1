//! Error against run time, measured: tables, plots and pictures of how much sooner one way of
//! rendering is as good as another.
//!
//! A [`Plan`] says what is compared; [`make`] goes through it row by row, takes what is on disk already,
//! measures what is missing (`measure`) against a [reference](ReferenceReport) that is good enough
//! for it, and writes the pages. [`talk`] and [`ablations`] are plans; [`sat`] measures importance
//! tables alone.

pub mod ablations;
mod bias;
mod digest;
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
pub use machine::Machine;
pub(crate) use machine::OpenDevice;
pub use measure::{Memory, Point, Run};
pub use pages::{duration, markdown_table, row_sentence};
pub use plan::{Device, Effort, Frame, Method, Plan, Row, Settings};
pub use reference::{Noise, ReferenceFacts};
pub use runner::{Options, check, make};
pub use shares::Shares;
pub use summary::{
    Costs, DeviceReport, Measure, MethodReport, Pictures, ReferenceReport, Report, RowReport,
};
