//! TOML documents: a text and `--set` options, held against the JSON schema of their type before they are typed.
//!
//! ```
//! use schemars::JsonSchema;
//! use serde::Deserialize;
//! use turbid_input::document::{Format, Located, Source};
//!
//! /// A box.
//! #[derive(Deserialize, JsonSchema)]
//! #[serde(deny_unknown_fields)]
//! struct Case {
//!     /// Edge (m).
//!     edge: Located<f64>,
//! }
//! impl Format for Case {}
//!
//! let source = |text: &str, option: &str| Source::new("a.toml".into(), text.into(), &[option.into()]);
//! let case: Case = source("edge = 1", "edge=2.5").parse()?;
//! assert_eq!(case.edge.value, 2.5);
//! let wrong = source("edge = 1\negde = 2", "edge=2.5").parse::<Case>().err().unwrap().to_string();
//! assert!(wrong.contains("a.toml:2:1") && wrong.contains("did you mean `edge`?"));
//! # Ok::<(), turbid_core::Error>(())
//! ```

mod conform;
mod located;
mod overrides;
mod schema;
mod source;

pub use located::Located;
pub use overrides::names;
pub use schema::{Format, Schema, free, non_negative, one_of, positive};
pub use source::{Source, nearest};
