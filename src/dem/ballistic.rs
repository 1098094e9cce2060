//! The shortest engine: particles keep their velocity (or stay fixed), whatever the loads.
pub struct Ballistic;
