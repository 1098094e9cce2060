//! The program `turbid`: its command line, and what it does with many runs.
//!
//! | module | what it has |
//! |---|---|
//! | [`cli`] | the verbs, errors and exit codes |
//! | [`study`], [`report`] | runs over ranges of parameters; pages of results |
//! | [`validate`], [`crosscheck`] | cases of the literature; the native engine beside LIGGGHTS |
//! | [`checks`] | measured values against references |

pub mod checks;
pub mod cli;
pub mod crosscheck;
pub mod report;
pub mod study;
pub mod validate;
