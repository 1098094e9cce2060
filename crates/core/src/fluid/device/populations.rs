//! Populations of a block on the host and on a device, of which the older copy is brought up to date when it is used.

use crate::device::{Array, Done, Failed, Queue};
use crate::fluid::buffer::Buffer;
use crate::fluid::population::Population;
use std::cell::{Cell, RefCell, UnsafeCell};
use std::ops::{Deref, DerefMut};
use std::rc::Rc;

/// The newer one of the copies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Newer {
    Neither,
    Host,
    Device,
}

/// Populations on the host, with a copy on a device if there is one.
pub(in crate::fluid) struct Populations<S> {
    host: UnsafeCell<Buffer<S>>,
    newer: Cell<Newer>,
    copy: Option<DeviceCopy>,
}

struct DeviceCopy {
    queue: Rc<Queue>,
    array: Array,
    failed: Rc<Failure>,
}

/// The first failure of a device.
#[derive(Default)]
pub(super) struct Failure(pub(super) RefCell<Option<Failed>>);

impl Failure {
    pub(super) fn note(&self, result: Done) {
        if let Err(failed) = result {
            self.0.borrow_mut().get_or_insert(failed);
        }
    }
}

impl<S: Population> From<Buffer<S>> for Populations<S> {
    fn from(host: Buffer<S>) -> Self {
        Self { host: host.into(), newer: Cell::new(Newer::Neither), copy: None }
    }
}

impl<S: Population> Populations<S> {
    /// The start of the memory on the host.
    pub(in crate::fluid) fn root(&mut self) -> *mut S {
        let _: &mut [S] = self;
        self.host.get_mut().root()
    }

    /// Keeps a copy in an array of a device from now on.
    pub(super) fn copy_to(&mut self, array: Array, queue: &Rc<Queue>, failed: &Rc<Failure>) {
        self.copy = Some(DeviceCopy { queue: queue.clone(), array, failed: failed.clone() });
        self.newer.set(Newer::Host);
    }

    /// Brings the host up to date.
    fn fetch(&self) {
        if self.newer.get() == Newer::Device {
            let copy = self.copy.as_ref().expect("the device has the newer one");
            // SAFETY: the device became the newer one through a unique borrow, since when there was no reference to the buffer: the
            // first one is made after this call, which later ones no longer reach.
            let host: &mut [S] = unsafe { &mut *self.host.get() };
            copy.failed.note(copy.queue.read(&copy.array, host));
            self.newer.set(Newer::Neither);
        }
    }

    /// The array of the device, brought up to date, which is then the newer one.
    pub(super) fn on_device(&mut self) -> &Array {
        let copy = self.copy.as_mut().expect("on a device");
        if self.newer.get() == Newer::Host {
            copy.failed.note(copy.queue.write(&mut copy.array, &self.host.get_mut()[..]));
        }
        self.newer.set(Newer::Device);
        &copy.array
    }
}

impl<S: Population> Deref for Populations<S> {
    type Target = [S];
    fn deref(&self) -> &[S] {
        self.fetch();
        // SAFETY: the buffer changes only through unique borrows, but for `fetch`.
        unsafe { &*self.host.get() }
    }
}

impl<S: Population> DerefMut for Populations<S> {
    fn deref_mut(&mut self) -> &mut [S] {
        self.fetch();
        if self.copy.is_some() {
            self.newer.set(Newer::Host);
        }
        self.host.get_mut()
    }
}
