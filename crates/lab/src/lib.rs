//! The laboratory of Turbid: what measures the program and the physics of its cases, apart from the program itself.
//!
//! | module | what it has |
//! |---|---|
//! | [`mod@bench`] | the speed of a case |
//! | [`study`] | runs over ranges of parameters |
//! | [`validate`], [`crosscheck`] | cases of the literature; the native engine beside other codes |
//! | [`checks`] | measured values against references |
//!
//! It prints nothing: the program `turbid` (the package `turbid-cli`) has the verbs.

#![allow(missing_docs, reason = "a library for the program alone")]

pub mod bench;
pub mod checks;
pub mod crosscheck;
pub mod study;
pub mod validate;
