//! Reading of what users write: [`document`] types a TOML text by its JSON schema and tells errors with file, line, key, value and
//! remedy; [`input`] reads files that may come from untrusted sources.

pub mod document;
pub mod input;
