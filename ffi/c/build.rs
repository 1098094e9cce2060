//! Gives the shared library the name under which it is installed, with the version of the interface.

fn main() {
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libturbid.so.0");
    println!("cargo::rerun-if-changed=build.rs");
}
