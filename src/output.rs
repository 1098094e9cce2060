//! What came out: tables, VTK files, pictures, the summary.

/// The result of a run; its JSON keys are stable.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Summary {}
