//! The native engine.

/// Parameters of the native engine.
pub struct NativeParams;
/// The native engine.
pub struct Native;
