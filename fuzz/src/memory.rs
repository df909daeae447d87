//! Measurement of the memory that a run allocates; requests count whether they succeed or not.
#![allow(
    unsafe_code,
    reason = "an allocator cannot be written without; this one hands all on to the system's"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static NOW: Cell<usize> = const { Cell::new(0) };
    static PEAK: Cell<usize> = const { Cell::new(0) };
}

struct CountingAllocator;

#[global_allocator]
static METER: CountingAllocator = CountingAllocator;

unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        allocated(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        allocated(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        freed(layout.size());
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        allocated(size);
        freed(layout.size());
        unsafe { System.realloc(memory, layout, size) }
    }
}

/// Adds `bytes` to the count of memory in use by this thread, and updates the peak.
fn allocated(bytes: usize) {
    NOW.set(NOW.get().saturating_add(bytes));
    PEAK.set(PEAK.get().max(NOW.get()));
}

/// Subtracts freed bytes from the count. Some may have been allocated before counting began, or by another thread, so
/// the count stops at 0.
fn freed(bytes: usize) {
    NOW.set(NOW.get().saturating_sub(bytes));
}

/// Returns the largest number of bytes that this thread had in use at any time during `work`, from 0 at its start.
pub fn peak_of(work: impl FnOnce()) -> usize {
    NOW.set(0);
    PEAK.set(0);
    work();
    PEAK.get()
}
