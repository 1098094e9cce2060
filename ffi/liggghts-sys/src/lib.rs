//! Guarded C interface of LIGGGHTS.
