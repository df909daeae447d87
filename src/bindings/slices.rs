//! Models in slices: their creation, and steps, of which one may be under way.

use std::cell::{RefCell, RefMut};
use std::future::Future;
use std::pin::Pin;
use std::rc::Rc;
use std::task::Poll;

use super::convert::now;
use vesicle::math::DVec3;
use vesicle::mesh::TriangleMesh;
use vesicle::methods::{LiveSurface, Method, MethodError, StepReport};
use vesicle::pauses::{advance, finished};

/// A computation that pauses.
pub type Computation<T> = Pin<Box<dyn Future<Output = T>>>;

type Outcome = Result<StepReport, MethodError>;

/// A method whose steps pause.
pub trait StepsInSlices: Method + 'static {
    /// Makes one step, as `step` does.
    fn step_in_slices(&mut self) -> impl Future<Output = Outcome>;
}

/// A model, of which a step may be under way: whatever is asked of it then ends it first, so that a step changes all or
/// nothing for those who look.
pub struct InSlices<M> {
    model: Rc<RefCell<M>>,
    /// The step under way, which borrows the model until it ends or is dropped.
    step: Option<Computation<Outcome>>,
    /// The report of a step that was ended by whoever asked for something, until a run takes it.
    ended: Option<Outcome>,
}

impl<M: StepsInSlices> InSlices<M> {
    /// Returns a model with a clock for its reports, shared between its raw handle and the live meshes of its surfaces.
    pub fn shared(mut model: M) -> Rc<RefCell<Self>> {
        model.set_clock(now);
        let model = Rc::new(RefCell::new(model));
        Rc::new(RefCell::new(Self { model, step: None, ended: None }))
    }

    /// Returns the model, after the step that is under way.
    pub fn ready(&mut self) -> RefMut<'_, M> {
        self.end_step();
        self.model.borrow_mut()
    }

    /// Returns the model as others share it, after the step that is under way.
    pub fn ready_model(&mut self) -> Rc<RefCell<M>> {
        self.end_step();
        Rc::clone(&self.model)
    }

    fn end_step(&mut self) {
        if let Some(step) = self.step.take() {
            self.ended = Some(finished(step));
        }
    }

    /// Does a slice of the step that is under way, or begins one; returns its report at its end, or that of one that has ended
    /// since the last slice.
    pub fn advance(&mut self) -> Option<Outcome> {
        if let Some(report) = self.ended.take() {
            return Some(report);
        }
        let mut step = self.step.take().unwrap_or_else(|| Box::pin(stepped(Rc::clone(&self.model))));
        match advance(&mut step) {
            Poll::Pending => {
                self.step = Some(step);
                None
            }
            Poll::Ready(report) => Some(report),
        }
    }

    /// Drops the step that is under way, or its report; returns the model if there was a step, to be put in order.
    pub fn drop_step(&mut self) -> Option<RefMut<'_, M>> {
        self.ended = None;
        drop(self.step.take()?);
        Some(self.model.borrow_mut())
    }
}

#[allow(
    clippy::await_holding_refcell_ref,
    reason = "whoever else wants the model ends or drops the step first"
)]
async fn stepped<M: StepsInSlices>(model: Rc<RefCell<M>>) -> Outcome {
    model.borrow_mut().step_in_slices().await
}

/// The live surface of a model.
pub struct LiveInSlices<M>(pub Rc<RefCell<InSlices<M>>>);

impl<M: StepsInSlices> LiveSurface for LiveInSlices<M> {
    fn surface(&self) -> TriangleMesh {
        self.0.borrow_mut().ready().surface()
    }

    fn origin(&self) -> DVec3 {
        self.0.borrow_mut().ready().origin()
    }

    fn counts(&self) -> [usize; 2] {
        self.0.borrow_mut().ready().counts()
    }

    fn versions(&self) -> [u32; 2] {
        self.0.borrow_mut().ready().versions()
    }
}
