//! The program `turbid`: its command line, and pages of results.
//!
//! | module | what it has |
//! |---|---|
//! | [`cli`] | the verbs, errors and exit codes |
//! | [`report`] | pages of results |

pub mod cli;
pub mod report;
