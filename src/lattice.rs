//! The D3Q19 velocity set.
