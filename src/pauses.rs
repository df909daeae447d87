//! Long computations in slices: they are futures that pause now and then, so that a caller can do other things meanwhile,
//! or stop. What they compute does not depend on where they pause.

use std::cell::Cell;
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

/// A computation that may pause, kept between its slices.
pub type Computation<T> = Pin<Box<dyn Future<Output = T>>>;

/// Units of work of a slice; a unit takes some microseconds.
const SLICE: u32 = 500;

/// The pauses of a computation, which counts its work.
#[derive(Clone, Default)]
pub struct Pauses(Rc<Counts>);

/// Units of work: of the current slice, and of those before.
#[derive(Default)]
struct Counts {
    slice: Cell<u32>,
    before: Cell<u64>,
}

impl Pauses {
    /// Counts work that was done, and pauses if a slice is complete.
    pub async fn after(&self, work: usize) {
        let done = self.0.slice.get().saturating_add(u32::try_from(work).unwrap_or(u32::MAX));
        self.0.slice.set(done);
        if done >= SLICE {
            self.now().await;
        }
    }

    /// Pauses at once, between two parts of a computation.
    pub async fn now(&self) {
        self.0.before.set(self.work());
        self.0.slice.set(0);
        pause().await;
    }

    /// Returns the units of work so far.
    pub fn work(&self) -> u64 {
        self.0.before.get() + u64::from(self.0.slice.get())
    }
}

/// Is pending once.
async fn pause() {
    let mut is_over = false;
    poll_fn(|_| if std::mem::replace(&mut is_over, true) { Poll::Ready(()) } else { Poll::Pending }).await;
}

/// Runs a computation up to its next pause, or its end.
pub fn advance<F: Future + Unpin + ?Sized>(computation: &mut F) -> Poll<F::Output> {
    Pin::new(computation).poll(&mut Context::from_waker(Waker::noop()))
}

/// Runs a computation to its end.
pub fn finished<F: Future>(computation: F) -> F::Output {
    let mut computation = pin!(computation);
    loop {
        if let Poll::Ready(result) = computation.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return result;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn computations_pause_after_a_slice_of_work() {
        let sum = async |pauses: Pauses| {
            let mut sum = 0;
            for i in 0..10 {
                pauses.after(SLICE as usize / 2).await;
                sum += i;
            }
            sum
        };
        assert_eq!(finished(sum(Pauses::default())), 45);
        let mut computation = Box::pin(sum(Pauses::default()));
        let pauses = (0..).take_while(|_| advance(&mut computation).is_pending()).count();
        assert_eq!(pauses, 5);
        let pauses = Pauses::default();
        finished(sum(pauses.clone()));
        finished(pauses.after(3));
        assert_eq!(pauses.work(), 5 * u64::from(SLICE) + 3);
    }
}
