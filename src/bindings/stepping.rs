//! Models whose steps go in slices, shared between their raw handles and live meshes.

use std::cell::{RefCell, RefMut};
use std::future::Future;
use std::rc::Rc;
use std::task::Poll;

use vesicle::math::DVec3;
use vesicle::mesh::TriangleMesh;
use vesicle::methods::{LiveSurface, Method, MethodError, StepReport};
use vesicle::pauses::{Computation, advance, finished};

use super::convert::now;

/// A method whose steps go in slices.
pub trait Sliced: Method + 'static {
    /// Makes a step as [`Method::step`] does, and pauses meanwhile.
    fn step_in_slices(&mut self) -> impl Future<Output = Result<StepReport, MethodError>>;

    /// Sets the model back to the end of the last step, after the future of a step was dropped.
    fn discard_step(&mut self);
}

/// A model, of which a step may be under way: whatever is asked of it then ends it first, so that a step changes all or
/// nothing for those who look.
pub struct Stepping<M> {
    model: Rc<RefCell<M>>,
    /// The step under way, which borrows the model until it ends or is dropped.
    step: RefCell<Option<Computation<Result<StepReport, MethodError>>>>,
    /// The report of a step that was ended by whoever asked for something, until a run takes it.
    ended: RefCell<Option<Result<StepReport, MethodError>>>,
}

impl<M: Sliced> Stepping<M> {
    pub fn new(mut model: M) -> Rc<Self> {
        model.set_clock(now);
        let model = Rc::new(RefCell::new(model));
        Rc::new(Self { model, step: RefCell::default(), ended: RefCell::default() })
    }

    /// Returns the model, after the step that is under way.
    pub fn ready(&self) -> RefMut<'_, M> {
        let under_way = self.step.borrow_mut().take();
        if let Some(step) = under_way {
            self.ended.replace(Some(finished(step)));
        }
        self.model.borrow_mut()
    }

    /// Does a slice of the step that is under way, or begins one; returns its report at its end, or that of one that has ended
    /// since the last slice.
    pub fn advance(&self) -> Option<Result<StepReport, MethodError>> {
        if let Some(report) = self.ended.take() {
            return Some(report);
        }
        let under_way = self.step.borrow_mut().take();
        let mut step = under_way.unwrap_or_else(|| Box::pin(stepped(Rc::clone(&self.model))));
        match advance(&mut step) {
            Poll::Pending => {
                self.step.replace(Some(step));
                None
            }
            Poll::Ready(report) => Some(report),
        }
    }

    /// Ends the step that is under way; returns the report of a step that has ended since the last slice.
    pub fn settle(&self) -> Option<Result<StepReport, MethodError>> {
        drop(self.ready());
        self.ended.take()
    }

    /// Gives up the step that is under way; returns the report of one that has ended since the last slice.
    pub fn discard(&self) -> Option<StepReport> {
        let under_way = self.step.borrow_mut().take();
        if under_way.is_some() {
            drop(under_way);
            self.model.borrow_mut().discard_step();
        }
        self.ended.take().and_then(Result::ok)
    }
}

#[allow(
    clippy::await_holding_refcell_ref,
    reason = "whoever else wants the model ends or drops the step first"
)]
async fn stepped<M: Sliced>(model: Rc<RefCell<M>>) -> Result<StepReport, MethodError> {
    model.borrow_mut().step_in_slices().await
}

/// The live surface of a model whose steps go in slices.
pub struct LiveStepping<M>(pub Rc<Stepping<M>>);

impl<M: Sliced> LiveSurface for LiveStepping<M> {
    fn surface(&self) -> TriangleMesh {
        self.0.ready().surface()
    }

    fn origin(&self) -> DVec3 {
        LiveSurface::origin(&*self.0.ready())
    }

    fn counts(&self) -> [usize; 2] {
        self.0.ready().counts()
    }

    fn versions(&self) -> [u32; 2] {
        self.0.ready().versions()
    }
}

/// Implements [`Sliced`] for a method that has its functions, and binds the slices of steps of its raw handle, which has a
/// [`Stepping`].
macro_rules! sliced_bindings {
    ($Raw:ident, $Model:ident) => {
        impl $crate::stepping::Sliced for $Model {
            fn step_in_slices(
                &mut self,
            ) -> impl Future<Output = Result<vesicle::methods::StepReport, vesicle::methods::MethodError>>
            {
                self.step_in_slices()
            }

            fn discard_step(&mut self) {
                self.discard_step();
            }
        }

        #[wasm_bindgen]
        impl $Raw {
            /// Does a slice of a step; returns what `step` returns at its end, else undefined.
            pub fn advance(&self) -> Result<JsValue, JsValue> {
                self.0
                    .advance()
                    .map_or(Ok(JsValue::UNDEFINED), |report| Ok($crate::method::reported(report)?))
            }

            /// Ends the step that is under way; returns the report of a step that has ended since the last slice, else undefined.
            pub fn settle(&self) -> Result<JsValue, JsValue> {
                self.0.settle().map_or(Ok(JsValue::UNDEFINED), |report| Ok($crate::method::reported(report)?))
            }

            /// Gives up the step that is under way; returns the report of one that has ended since the last slice, else undefined.
            pub fn discard(&self) -> Result<JsValue, JsValue> {
                self.0
                    .discard()
                    .map_or(Ok(JsValue::UNDEFINED), |report| Ok($crate::method::reported(Ok(report))?))
            }
        }
    };
}

pub(super) use sliced_bindings;
